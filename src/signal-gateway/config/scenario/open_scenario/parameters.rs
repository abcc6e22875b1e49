//! Parameters and variables, and references to them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::super::naming::listed;
use super::expression::{compute, is_constant};
use crate::config::reading::Refusal;
use traffic_lights::variable::VariableIndex;

/// The substitutions of a launch system that name the folder of a package.
const PACKAGE_SUBSTITUTIONS: [&str; 2] = ["find-pkg-share ", "ros2 pkg prefix --share "];

/// A declared parameter, or the reason why its value is unknown.
pub(super) type Declared = Result<DeclaredParameter, Refusal>;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct DeclaredParameter {
    /// The value that replaces references to it.
    pub(super) value: String,
    /// True if a launch system computed the value, so that paths in it are not relative to the file.
    pub(super) is_of_launch_system: bool,
    /// The variable with its name, which actions change and conditions compare.
    pub(super) variable: VariableIndex,
}

/// The declared parameters, by scope; the innermost scope is the last.
#[derive(Debug, Default)]
pub(super) struct ParameterScopes {
    scopes: Vec<BTreeMap<String, Declared>>,
    /// The parameters of the whole document, each with the names of its enclosing elements and its own name.
    declared: Vec<(Vec<String>, String, Declared)>,
    variables: BTreeMap<String, VariableIndex>,
    /// The folders of packages by name, for `$(find-pkg-share NAME)`.
    packages: BTreeMap<String, PathBuf>,
}

impl ParameterScopes {
    pub(super) fn new(packages: BTreeMap<String, PathBuf>) -> Self {
        Self { packages, ..Self::default() }
    }

    /// Opens a scope with its parameters; [`Self::leave`] closes it.
    pub(super) fn enter(&mut self, scope: BTreeMap<String, Declared>) {
        self.scopes.push(scope);
    }

    pub(super) fn leave(&mut self) {
        self.scopes.pop();
    }

    /// Adds a parameter to the innermost scope. `path` are the names of the elements around it.
    pub(super) fn declare(&mut self, path: &[String], name: String, parameter: Declared) {
        self.declared.push((path.to_vec(), name.clone(), parameter.clone()));
        if let Some(scope) = self.scopes.last_mut() {
            scope.insert(name, parameter);
        }
    }

    pub(super) fn innermost(&self) -> BTreeMap<String, Declared> {
        self.scopes.last().cloned().unwrap_or_default()
    }

    /// Adds a variable, which no reference in a text can name.
    pub(super) fn declare_variable(&mut self, name: String, variable: VariableIndex) {
        self.variables.insert(name, variable);
    }

    pub(super) fn variable(&self, name: &str) -> Result<VariableIndex, Refusal> {
        self.variables.get(name).copied().ok_or_else(|| {
            let known = listed(self.variables.keys().map(String::as_str));
            Refusal::new(format!("no variable is called {name}"), known)
        })
    }

    /// Returns the text with its references replaced: `$name`, `${name}` and `${$name}` are the value of a
    /// parameter, `${$name * 2}` is computed, and `$(find-pkg-share NAME)` is the folder of a package.
    pub(super) fn value(&self, text: &str) -> Result<String, Refusal> {
        if text.contains("$(") {
            return self.with_packages(text);
        }
        let Some(reference) = text.strip_prefix('$') else { return Ok(text.to_owned()) };
        let inner = reference.strip_prefix('{').and_then(|inner| inner.strip_suffix('}')).map(str::trim);
        let name = inner.unwrap_or(reference);
        let name = name.strip_prefix('$').unwrap_or(name);
        match inner {
            // `A-1` may be a name or a difference, and `pi` may be the name of a parameter.
            Some(expression)
                if !is_name(name)
                    || (name.contains('-') || is_constant(expression)) && self.declared(name).is_none() =>
            {
                self.computed(expression)
            }
            Some(_) | None => self.parameter(name).map(|parameter| parameter.value.clone()),
        }
    }

    /// Returns true if a text has a substitution of a launch system, or is a parameter with one.
    pub(super) fn is_of_launch_system(&self, text: &str) -> bool {
        let name = text.strip_prefix('$').map(|name| name.trim_matches(['{', '}', ' ', '$']));
        let parameter = name.and_then(|name| self.declared(name));
        let has_one = |declared: &Declared| declared.as_ref().map_or(true, |known| known.is_of_launch_system);
        text.contains("$(") || parameter.is_some_and(has_one)
    }

    /// Returns the parameter of a name in the innermost scope that has one. `::name` is one of the whole
    /// document, and `element::name` one below an element of the storyboard, as TIER IV writes them.
    pub(super) fn parameter(&self, name: &str) -> Result<&DeclaredParameter, Refusal> {
        let found = self.declared(name).ok_or_else(|| {
            let known = self.scopes.iter().flat_map(BTreeMap::keys);
            Refusal::new(format!("no parameter is called {name}"), listed(known.map(String::as_str)))
        })?;
        found.as_ref().map_err(|Refusal { reason, remedy }| {
            let reason = format!("the value of the parameter {name} is not known: {reason}");
            Refusal::new(reason, remedy.as_str())
        })
    }

    fn declared(&self, name: &str) -> Option<&Declared> {
        match name.rsplit_once("::") {
            None => self.scopes.iter().rev().find_map(|scope| scope.get(name)),
            Some(("", own)) => self.scopes.first().and_then(|scope| scope.get(own)),
            Some((path, own)) => {
                let leads_to = |above: &[String]| {
                    let mut above = above.iter();
                    path.trim_start_matches("::").split("::").all(|step| above.any(|name| name == step))
                };
                let mut declared = self.declared.iter();
                let found = declared.find(|(above, name, _)| name == own && leads_to(above));
                found.map(|(.., parameter)| parameter)
            }
        }
    }

    fn computed(&self, expression: &str) -> Result<String, Refusal> {
        let mut parts = expression.split('$');
        let mut numbers = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let end = part.find(|char| !is_in_name(char)).unwrap_or(part.len());
            let mut name = part.get(..end).unwrap_or_default();
            // OpenSCENARIO allows no hyphens in names, but users write them: takes the longest existing name,
            // otherwise the shortest.
            while self.declared(name).is_none()
                && let Some((shorter, _)) = name.rsplit_once('-')
            {
                name = shorter;
            }
            let after = part.get(name.len()..).unwrap_or_default();
            // In parentheses, since it may be negative.
            numbers.extend(["(", &self.parameter(name)?.value, ")", after]);
        }
        let remedy = "correct the expression, or write its value";
        compute(&numbers).map_err(|error| Refusal::new(error.to_string(), remedy))
    }

    fn with_packages(&self, text: &str) -> Result<String, Refusal> {
        let mut parts = text.split("$(");
        let mut replaced = parts.next().unwrap_or_default().to_owned();
        for part in parts {
            let (substitution, after) = part.split_once(')').unwrap_or((part, ""));
            // The simulator replaces this one itself.
            if let Some(name) = substitution.strip_prefix("var ") {
                replaced.push_str(&self.parameter(name.trim())?.value);
                replaced.push_str(after);
                continue;
            }
            let name = PACKAGE_SUBSTITUTIONS.iter().find_map(|prefix| substitution.strip_prefix(prefix));
            let Some(name) = name.map(str::trim) else {
                let reason = format!("`$({substitution})` is replaced by the launch system");
                return Err(Refusal::new(reason, "write its value"));
            };
            let Some(folder) = self.packages.get(name) else {
                let remedy = format!("give it with --package {name}=FOLDER, or write the path");
                return Err(Refusal::new(format!("the folder of the package {name} is not known"), remedy));
            };
            replaced.push_str(&folder.display().to_string());
            replaced.push_str(after);
        }
        Ok(replaced)
    }
}

fn is_in_name(char: char) -> bool {
    char.is_alphanumeric() || char == '_' || char == '-'
}

/// Returns true if the text between the braces is a name. `a-b` is a name, but is computed after `$`.
pub(super) fn is_name(text: &str) -> bool {
    text.starts_with(|char: char| char.is_alphabetic() || char == '_') && text.chars().all(is_in_name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(value: &str) -> DeclaredParameter {
        DeclaredParameter { value: value.to_owned(), is_of_launch_system: false, variable: VariableIndex(0) }
    }

    #[test]
    fn a_reference_is_the_value_of_the_innermost_scope() {
        let scope = |value: &str| BTreeMap::from([("light".to_owned(), Ok(parameter(value)))]);
        let parameters =
            ParameterScopes { scopes: vec![scope("1"), scope("2")], ..ParameterScopes::default() };
        for text in ["$light", "${light}", "${ $light }", "2"] {
            assert_eq!(parameters.value(text), Ok("2".to_owned()), "{text}");
        }
        let refused = |text| parameters.value(text).unwrap_err();
        assert_eq!(refused("$dark"), Refusal::new("no parameter is called dark", "there are light, light"));
        assert_eq!(parameters.value("$(var light)/$(var light)"), Ok("2/2".to_owned()));
        assert!(refused("$(env light)").reason.contains("launch system"));
    }

    #[test]
    fn a_path_leads_to_a_parameter_anywhere_in_the_document() {
        let mut parameters = ParameterScopes::default();
        parameters.enter(BTreeMap::new());
        let path = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        parameters.declare(&[], "light".to_owned(), Ok(parameter("1")));
        parameters.enter(BTreeMap::new());
        parameters.declare(&path(&["story", "act", "", "m"]), "light".to_owned(), Ok(parameter("3")));
        parameters.leave();
        parameters.enter(BTreeMap::new());
        let texts = ["$light", "$::light", "$act::light", "$story::m::light", "$::story::act::light"];
        let values = ["1", "1", "3", "3", "3"];
        assert_eq!(texts.map(|text| parameters.value(text).unwrap()), values);
        let refused = parameters.value("$m::act::light").unwrap_err();
        assert_eq!(refused.reason, "no parameter is called m::act::light");
    }

    #[test]
    fn an_expression_of_parameters_is_computed() {
        let scope = [("way", "34802"), ("step", "-2"), ("color", "red"), ("last-way", "7")];
        let scope = scope.map(|(name, value)| (name.to_owned(), Ok(parameter(value)))).into();
        let parameters = ParameterScopes { scopes: vec![scope], ..ParameterScopes::default() };
        for (text, value) in [
            ("${$way + 1}", "34803"),
            ("${$way - $step}", "34804"),
            ("${$way-$step}", "34804"),
            ("${$way-1}", "34801"),
            ("${$last-way}", "7"),
            ("${$last-way-1+$last-way}", "13"),
            ("${ 2.5 * 2 }", "5"),
            ("${7}", "7"),
            ("${ pi }", "3.14159265358979"),
            ("${true}", "1"),
            ("${min($way, 2 * pi)}", "6.28318530717959"),
            ("${max($step, sign($step))}", "-1"),
        ] {
            assert_eq!(parameters.value(text).as_deref(), Ok(value), "{text}");
        }
        let reason = |text| parameters.value(text).unwrap_err().reason;
        assert!(reason("${$color + 1}").contains("is not an expression"));
        assert_eq!(reason("${$pi}"), "no parameter is called pi");
        assert_eq!(reason("${$wax + 1}"), "no parameter is called wax");
    }

    #[test]
    fn a_package_is_replaced_by_its_folder() {
        let packages = BTreeMap::from([("town".to_owned(), PathBuf::from("/maps/town"))]);
        let parameters = ParameterScopes::new(packages);
        for text in ["$(find-pkg-share town)/map.osm", "$(ros2 pkg prefix --share town)/map.osm"] {
            assert_eq!(parameters.value(text).as_deref(), Ok("/maps/town/map.osm"), "{text}");
        }
        let remedy = "give it with --package city=FOLDER, or write the path";
        let refusal = Refusal::new("the folder of the package city is not known", remedy);
        assert_eq!(parameters.value("$(find-pkg-share city)/map.osm"), Err(refusal));
    }
}
