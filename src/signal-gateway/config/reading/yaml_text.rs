//! Reads YAML as values; aliases and merge keys are expanded, within limits.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use saphyr_parser::{Event, Marker, Parser, ScalarStyle};

use super::location::{KeyPath, Location, MAX_DEPTH, MAX_NODES, Text};
use super::problem::{Position, Problem};
use super::value::{Entry, Kind, Value};

/// The key whose value is a table, or a list of tables, with further entries.
const MERGE_KEY: &str = "<<";
/// Maximum number of values stored for aliases.
const MAX_KEPT: usize = 4 * MAX_NODES;

/// Maximum number of commas and opening brackets, including those in texts.
const MAX_MARKS: usize = 4 * MAX_NODES;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum YamlForm {
    /// Plain data: no tags, and each key of a table once.
    Strict,
    /// As in `rcl_yaml_param_parser`: a tag can only mark a value as a text, and keys may be repeated.
    OfRcl,
}

/// Reads a YAML text with a single document.
///
/// # Errors
/// Fails for the first violation of YAML, anything but plain data, too deep nesting, or too many values.
pub(crate) fn from_yaml(text: &Text) -> Result<Value, Problem> {
    let root = document(text, YamlForm::Strict)?;
    root.ok_or_else(|| text.problem(Position::START, "the file is empty", "write a scenario into it"))
}

/// Reads a YAML text with a single document like the libraries of ROS 2, with tags and repeated keys; returns
/// `None` if it is empty.
///
/// # Errors
/// Fails for the first violation of YAML, too deep nesting, or too many values.
pub(crate) fn from_rcl_yaml(text: &Text) -> Result<Option<Value>, Problem> {
    document(text, YamlForm::OfRcl)
}

fn document(text: &Text, form: YamlForm) -> Result<Option<Value>, Problem> {
    // The parser stores a whole list or table in brackets, since it may turn out to be a key: a few hundred
    // bytes per item.
    let mut marks = text.content.bytes().enumerate().filter(|(_, byte)| b",[{".contains(byte));
    if let Some((offset, _)) = marks.nth(MAX_MARKS) {
        let reason = format!("more than {MAX_MARKS} commas and brackets");
        return Err(text.problem(text.position(offset), &reason, "split the scenario"));
    }
    let anchors = BTreeMap::new();
    let mut builder = YamlBuilder { text, form, root: None, open: Vec::new(), anchors, nodes: 0, kept: 0 };
    for event in Parser::new_from_str(&text.content) {
        let (event, span) = event
            .map_err(|error| text.problem(position(error.marker()), error.info(), "correct the YAML"))?;
        builder.take(event, position(&span.start))?;
    }
    Ok(builder.root)
}

fn position(marker: &Marker) -> Position {
    Position { line: marker.line(), column: marker.col() + 1 }
}

struct YamlBuilder<'a> {
    text: &'a Text,
    form: YamlForm,
    root: Option<Value>,
    /// Collections that have not ended, the outermost first.
    open: Vec<OpenNode>,
    /// Values that aliases can refer to, with the number of their nodes.
    anchors: BTreeMap<usize, (Value, usize)>,
    nodes: usize,
    /// Number of nodes of all anchors; the nodes of an anchor within another anchor count twice, since both
    /// are stored.
    kept: usize,
}

struct OpenNode {
    location: Location,
    content: YamlContent,
    /// Its anchor (0 = none), and the number of nodes before it.
    anchor: (usize, usize),
}

enum YamlContent {
    List(Vec<Value>),
    Map { entries: Vec<Entry>, keys: BTreeSet<String>, pending: Option<(String, Location)> },
}

impl YamlBuilder<'_> {
    fn take(&mut self, event: Event<'_>, position: Position) -> Result<(), Problem> {
        match event {
            Event::DocumentStart(_) if self.root.is_some() => {
                self.refuse(position, "a second document", "keep one scenario in a file")
            }
            Event::Nothing
            | Event::StreamStart
            | Event::StreamEnd
            | Event::DocumentStart(_)
            | Event::DocumentEnd => Ok(()),
            Event::Scalar(_, _, _, Some(_))
            | Event::SequenceStart(_, Some(_))
            | Event::MappingStart(_, Some(_))
                if self.form == YamlForm::Strict =>
            {
                self.refuse(position, "a tag (`!…`)", "remove it")
            }
            Event::Scalar(content, style, anchor, tag) => {
                let is_text = tag.is_some_and(|tag| tag.is_yaml_core_schema() && tag.suffix == "str");
                let is_quoted = style != ScalarStyle::Plain || is_text;
                let is_null = !is_quoted && ["", "~", "null", "Null", "NULL"].contains(&&*content);
                let kind = if is_null && !self.awaits_key() {
                    Kind::Null
                } else {
                    Kind::Scalar { text: content.into_owned(), is_quoted }
                };
                self.count(1, position)?;
                let location = Location { position, key: self.key() };
                self.put_anchored(Value { location, kind }, anchor, 1)
            }
            Event::SequenceStart(anchor, _) => self.start(YamlContent::List(Vec::new()), anchor, position),
            Event::MappingStart(anchor, _) => {
                let content = YamlContent::Map { entries: Vec::new(), keys: BTreeSet::new(), pending: None };
                self.start(content, anchor, position)
            }
            Event::SequenceEnd | Event::MappingEnd => self.end(),
            Event::Alias(anchor) => {
                let Some((value, nodes)) = self.anchors.get(&anchor).cloned() else {
                    return self.refuse(position, "an alias within its own anchor", "write it out");
                };
                self.count(nodes, position)?;
                self.put(value)
            }
        }
    }

    fn refuse(&self, position: Position, what: &str, remedy: &str) -> Result<(), Problem> {
        Err(self.text.problem(position, &format!("{what} cannot be read here"), remedy))
    }

    fn count(&mut self, nodes: usize, position: Position) -> Result<(), Problem> {
        self.nodes = self.nodes.saturating_add(nodes);
        if self.nodes > MAX_NODES {
            let reason = format!("more than {MAX_NODES} values, aliases written out");
            return Err(self.text.problem(position, &reason, "split the scenario"));
        }
        Ok(())
    }

    fn awaits_key(&self) -> bool {
        self.open.last().is_some_and(|open| matches!(open.content, YamlContent::Map { pending: None, .. }))
    }

    /// Returns the path of the next value.
    fn key(&self) -> Rc<KeyPath> {
        match self.open.last() {
            None => KeyPath::root(),
            Some(OpenNode { location, content: YamlContent::List(items), .. }) => {
                KeyPath::below(&location.key, "", &format!("[{}]", items.len() + 1))
            }
            Some(OpenNode { location, content: YamlContent::Map { pending, .. }, .. }) => {
                Rc::clone(&pending.as_ref().map_or(location, |(_, location)| location).key)
            }
        }
    }

    fn start(&mut self, content: YamlContent, anchor: usize, position: Position) -> Result<(), Problem> {
        if self.open.len() >= MAX_DEPTH {
            return Err(self.text.problem(position, "nested too deeply", "nest less deeply"));
        }
        if self.awaits_key() {
            return self.refuse(position, "a key that is a list or a table", "use a text");
        }
        let before = self.nodes;
        self.count(1, position)?;
        let location = Location { position, key: self.key() };
        self.open.push(OpenNode { location, content, anchor: (anchor, before) });
        Ok(())
    }

    fn end(&mut self) -> Result<(), Problem> {
        let Some(OpenNode { location, content, anchor: (anchor, before) }) = self.open.pop() else {
            return Ok(());
        };
        let kind = match content {
            YamlContent::List(items) => Kind::List(items),
            YamlContent::Map { entries, keys, .. } => Kind::Map(self.merged(entries, keys)?),
        };
        self.put_anchored(Value { location, kind }, anchor, self.nodes - before)
    }

    /// Returns the entries with each merge key replaced by its entries. The table's own keys have priority,
    /// then the keys of the first merged table.
    fn merged(&self, entries: Vec<Entry>, mut keys: BTreeSet<String>) -> Result<Vec<Entry>, Problem> {
        let mut merged = Vec::new();
        for Entry { key, location, value } in entries {
            if key != MERGE_KEY {
                merged.push(Entry { key, location, value });
                continue;
            }
            let tables = if let Kind::List(tables) = value.kind { tables } else { vec![value] };
            for table in tables {
                let Kind::Map(entries) = table.kind else {
                    let reason = "a merge key (`<<`) takes a table or a list of tables";
                    return Err(self.text.problem(location.position, reason, "give it an alias of a table"));
                };
                merged.extend(entries.into_iter().filter(|entry| keys.insert(entry.key.clone())));
            }
        }
        Ok(merged)
    }

    /// Adds a value with an anchor (0 = none); `nodes` is the number of its nodes.
    fn put_anchored(&mut self, value: Value, anchor: usize, nodes: usize) -> Result<(), Problem> {
        if anchor != 0 {
            self.kept = self.kept.saturating_add(nodes);
            if self.kept > MAX_KEPT {
                let reason = format!(
                    "more than {MAX_KEPT} values in anchors, those of anchors within anchors counted again"
                );
                let remedy = "remove the anchors that no alias names";
                return Err(self.text.problem(value.location.position, &reason, remedy));
            }
            self.anchors.insert(anchor, (value.clone(), nodes));
        }
        self.put(value)
    }

    /// Adds a value to the open collection, as an item, a key, or the value of the latest key.
    fn put(&mut self, value: Value) -> Result<(), Problem> {
        let Some(OpenNode { location, content, .. }) = self.open.last_mut() else {
            self.root = Some(value);
            return Ok(());
        };
        match content {
            YamlContent::List(items) => items.push(value),
            YamlContent::Map { entries, pending, .. } if pending.is_some() => {
                if let Some((key, location)) = pending.take() {
                    entries.push(Entry { key, location, value });
                }
            }
            YamlContent::Map { keys, pending, .. } => {
                let position = value.location.position;
                let Kind::Scalar { text, .. } = value.kind else {
                    return self.refuse(position, "a key that is a list or a table", "use a text");
                };
                if !keys.insert(text.clone()) && self.form == YamlForm::Strict {
                    let reason = format!("the key {text:?} is given twice");
                    return Err(self.text.problem(position, &reason, "keep one"));
                }
                let key = KeyPath::below(&location.key, ".", &text);
                *pending = Some((text, Location { position, key }));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read(text: &str) -> Result<Value, String> {
        from_yaml(&Text::new(Path::new("a"), text.into()).unwrap()).map_err(|problem| problem.to_string())
    }

    #[test]
    fn keys_keep_their_order_and_locations() {
        let Kind::Map(entries) = read("z: 1\nb:\n  - c: ~\n  - c: '1'\n").unwrap().kind else { panic!() };
        assert_eq!(entries[0].key, "z");
        let Kind::List(items) = &entries[1].value.kind else { panic!() };
        let Kind::Map(second) = &items[1].kind else { panic!() };
        assert_eq!(second[0].value.location.key.to_string(), "b[2].c");
        let positions = [second[0].location.position, second[0].value.location.position];
        assert_eq!(positions.map(|position| position.to_string()), ["4:5", "4:8"]);
        assert!(matches!(&second[0].value.kind, Kind::Scalar { text, is_quoted: true } if text == "1"));
        let Kind::Map(first) = &items[0].kind else { panic!() };
        assert!(matches!(first[0].value.kind, Kind::Null));
    }

    #[test]
    fn an_alias_has_the_value_of_its_anchor() {
        let Kind::Map(entries) = read("a: &x [1, 2]\nb: *x\n").unwrap().kind else { panic!() };
        assert!(matches!(&entries[1].value.kind, Kind::List(items) if items.len() == 2));
    }

    #[test]
    fn a_merge_key_adds_the_entries_of_other_tables_in_its_place() {
        let text =
            "a: &a {x: 1, y: 2}\nb: &b {y: 3, z: 4}\nc:\n  w: 5\n  <<: [*a, *b]\n  x: 6\nd:\n  <<: *a\n";
        let Kind::Map(entries) = read(text).unwrap().kind else { panic!() };
        let shown = |value: &Value| {
            let Kind::Map(entries) = &value.kind else { panic!() };
            let entries = entries.iter().map(|entry| format!("{}={}", entry.key, entry.value.described()));
            entries.collect::<Vec<_>>().join(" ")
        };
        assert_eq!(shown(&entries[2].value), "w=5 y=2 z=4 x=6");
        assert_eq!(shown(&entries[3].value), "x=1 y=2");
    }

    #[test]
    fn anything_but_plain_data_is_refused_at_its_location() {
        let laughs: String = (1..30).map(|n| format!("a{n}: &a{n} [*a{0}, *a{0}]\n", n - 1)).collect();
        let laughs = format!("a0: &a0 [x]\n{laughs}");
        let deep = "[".repeat(70) + &"]".repeat(70);
        let anchored = "&a [".repeat(9) + &"1,".repeat(50_000) + &"]".repeat(9);
        let wide = format!("[{}]", "1,".repeat(400_000));
        let rows = [
            (wide.as_str(), "a:1:800001: more than 400000 commas and brackets"),
            (laughs.as_str(), "more than 100000 values"),
            (anchored.as_str(), "more than 400000 values in anchors"),
            (deep.as_str(), "a:1:65: nested too deeply"),
            ("a: &a [*a]", "a:1:8: an alias within"),
            ("a: 1\na: 2", "a:2:1: the key \"a\" is given twice"),
            ("a: !x 1", "a tag"),
            ("? [a]\n: 1", "a key that is a list"),
            ("a: {b: 1}\nc:\n  <<: 1", "a:3:3: a merge key (`<<`) takes a table"),
            ("a: {b: 1}\nc:\n  <<: [1]", "a:3:3: a merge key (`<<`) takes a table"),
            ("a: 1\n---\nb: 1", "a second document"),
            ("a: [1", "correct the YAML"),
            ("a: *none", "correct the YAML"),
        ];
        for (text, part) in rows {
            let refused = read(text).unwrap_err();
            assert!(refused.contains(part), "{text:.40}: {refused}");
        }
    }
}
