//! Parameter files as in `--params-file`: nodes, and below `ros__parameters` their parameters. Also values of
//! `--param`, which are YAML too.

use std::path::Path;

use super::files::Files;
use super::reading::yaml_text::from_rcl_yaml;
use super::reading::{Checker, Entry, Kind, Refused, Text, Value};
use super::ros_names::NodeNames;

/// The key below which a node's parameters are.
const PARAMETERS: &str = "ros__parameters";
const SEE: &str = "";

/// A value that is neither a list nor a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterValue {
    /// The text as written.
    pub text: String,
    /// True if it is quoted, or tagged as a text.
    pub is_quoted: bool,
}

impl ParameterValue {
    /// Returns the truth value, in the words of `rcl_yaml_param_parser`.
    pub fn as_bool(&self) -> Option<bool> {
        const ON: [&str; 11] = ["y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"];
        const OFF: [&str; 11] = ["n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"];
        let is_one_of = |words: [&str; 11]| !self.is_quoted && words.contains(&self.text.as_str());
        (is_one_of(ON) || is_one_of(OFF)).then(|| is_one_of(ON))
    }
}

/// A parameter of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileParameter {
    /// Name, with a dot for each level.
    pub name: String,
    /// Its value; `None` for a list or nothing.
    pub value: Option<ParameterValue>,
    /// True if the file names the node itself rather than a pattern.
    pub is_for_this_node: bool,
}

/// Reads the parameters in a file for a node, in file order.
///
/// # Errors
/// Fails if the file cannot be read, or is not a parameter file.
pub fn read_parameters(
    files: &dyn Files,
    path: &Path,
    names: NodeNames<'_>,
) -> Result<Vec<FileParameter>, Refused> {
    let text = Text::read(path, files.read(path), "give the path of a YAML file with parameters")?;
    // Launch files write an empty file for a node without parameters.
    let Some(root) = from_rcl_yaml(&text)?.filter(|root| !matches!(root.kind, Kind::Null)) else {
        return Ok(Vec::new());
    };
    let mut reader =
        NodeReader { checker: Checker::new(&text.file, SEE), node: names.full_name(), found: Vec::new() };
    for entry in reader.entries(&root) {
        reader.nodes("", entry);
    }
    let NodeReader { checker, found, .. } = reader;
    checker.finish(Some(found)).map_err(Refused)
}

/// Reads the value of a parameter on the command line; `None` for a list, a table or nothing.
///
/// # Errors
/// Fails if the value is not YAML.
pub fn read_value(given: &str) -> Result<Option<ParameterValue>, Refused> {
    let text = Text::new(Path::new("--param"), given.into())?;
    Ok(from_rcl_yaml(&text)?.and_then(|value| single(&value)))
}

fn single(value: &Value) -> Option<ParameterValue> {
    value.scalar().map(|(text, is_quoted)| ParameterValue { text: text.to_owned(), is_quoted })
}

struct NodeReader {
    checker: Checker,
    /// Name of the node with its namespace.
    node: String,
    found: Vec<FileParameter>,
}

impl NodeReader {
    fn entries<'v>(&self, value: &'v Value) -> &'v [Entry] {
        self.checker.entries(value, "/**: { ros__parameters: { use_sim_time: true } }")
    }

    /// Reads the nodes of one key below a pattern.
    fn nodes(&mut self, above: &str, entry: &Entry) {
        if entry.key == PARAMETERS {
            if above.is_empty() {
                let remedy = "write the node's name above, or /**";
                self.checker.refuse(&entry.location, "parameters without a node", remedy);
            } else if matches(above, &self.node) {
                self.parameters("", &entry.value, !above.contains('*'));
            }
            return;
        }
        let pattern = format!("{above}/{}", entry.key.trim_matches('/'));
        for below in self.entries(&entry.value) {
            self.nodes(&pattern, below);
        }
    }

    fn parameters(&mut self, above: &str, value: &Value, is_for_this_node: bool) {
        for entry in self.entries(value) {
            let name = format!("{above}{}", entry.key);
            if matches!(entry.value.kind, Kind::Map(_)) {
                self.parameters(&format!("{name}."), &entry.value, is_for_this_node);
            } else {
                let value = single(&entry.value);
                self.found.push(FileParameter { name, value, is_for_this_node });
            }
        }
    }
}

/// Returns true if a pattern such as `/**`, `/*/node` or `/car/node` matches a full name.
fn matches(pattern: &str, name: &str) -> bool {
    let (mut pattern, name): (Vec<_>, Vec<_>) = (pattern.split('/').collect(), name.split('/').collect());
    // A single `**` means the same, and matches faster.
    pattern.dedup_by(|token, before| *token == "**" && *before == "**");
    fits(&pattern, &name)
}

fn fits(pattern: &[&str], name: &[&str]) -> bool {
    match (pattern, name) {
        ([], []) => true,
        (["**", rest @ ..], _) => {
            (0..=name.len()).any(|taken| fits(rest, name.get(taken..).unwrap_or_default()))
        }
        ([token, pattern @ ..], [own, name @ ..]) => (*token == "*" || token == own) && fits(pattern, name),
        ([], _) | (_, []) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::files::TestFiles;

    fn read(text: &'static str) -> Result<Vec<String>, String> {
        let names = NodeNames { node: "lights", namespace: "/car", remappings: &[] };
        let files = TestFiles(&[("p.yaml", text)]);
        let read = read_parameters(&files, Path::new("p.yaml"), names).map_err(|error| error.to_string())?;
        let shown = |parameter: FileParameter| {
            let mark = if parameter.is_for_this_node { "!" } else { "" };
            let value = parameter.value.map_or("[]".into(), |value| value.text);
            format!("{}={value}{mark}", parameter.name)
        };
        Ok(read.into_iter().map(shown).collect())
    }

    #[test]
    fn parameters_of_this_node_and_of_patterns_are_found() {
        let text = "/**:\n  ros__parameters:\n    use_sim_time: true\n    a: {b: 1, c: [1]}\n\
                    /car/lights:\n  ros__parameters: {config: x.toml}\n\
                    /car:\n  lights: {ros__parameters: {d: 1}}\n  other: {ros__parameters: {e: 1}}\n\
                    /*/lights: {ros__parameters: {f: 'text'}}\n\
                    lights: {ros__parameters: {g: 1}}\n/*: {ros__parameters: {h: 1}}\n\
                    /**/lights: {ros__parameters: {i: 1}}";
        let expected = ["use_sim_time=true", "a.b=1", "a.c=[]", "config=x.toml!", "d=1!", "f=text", "i=1"];
        assert_eq!(read(text).unwrap(), expected);
    }

    #[test]
    fn what_rcl_takes_is_taken() {
        for (text, expected) in [
            ("", ""),
            ("# nothing\n---\n", ""),
            ("/**: {ros__parameters: !!map {a: !!str 1, b: !other [1]}}", "a=1 b=[]"),
            ("/**: {ros__parameters: {a: 1}}\n/**: {ros__parameters: {a: 2}}", "a=1 a=2"),
            ("/**: {ros__parameters: {}}", ""),
        ] {
            assert_eq!(read(text).unwrap().join(" "), expected, "{text}");
        }
        let as_bool = |text: &str| read_value(text).unwrap().and_then(|value| value.as_bool());
        let (on, off) = ("true True TRUE on On ON yes Yes YES y Y", "false False off no n");
        assert!(on.split(' ').all(|text| as_bool(text) == Some(true)));
        assert!(off.split(' ').all(|text| as_bool(text) == Some(false)));
        assert!(
            ["1", "'true'", "!!str true", "[true]", "", "tRue"].iter().all(|text| as_bool(text).is_none())
        );
    }

    #[test]
    fn what_is_not_a_file_of_parameters_is_refused_with_its_place() {
        for (text, expected) in [
            ("ros__parameters: {a: 1}", "p.yaml:1:1: ros__parameters: parameters without a node"),
            ("- a", "expected a table"),
            ("/**: 1", "expected a table"),
            ("/**: {ros__parameters: 1}", "expected a table"),
            ("a: [", "p.yaml:"),
        ] {
            let refused = read(text).unwrap_err();
            assert!(refused.contains(expected), "{text}: {refused}");
        }
    }
}
