//! The shipped JSON Schemas, and the table of fields in docs/status.md, are made of the types themselves.

use std::fs;
use std::path::{Path, PathBuf};

use gateway_core::gateway::history::HistoryEntry;
use serde_json::{Map, Value};
use signal_gateway::check::JsonReport;
use signal_gateway::process_status::snapshot::Snapshot;
use signal_gateway::report::gateway_view::GatewayView;
use signal_gateway::report::schema::schema;

const DOCUMENT: &str = "docs/status.md";
const MARKS: [&str; 2] = ["<!-- begin fields -->\n", "<!-- end fields -->\n"];
const AGAIN: &str = "UPDATE_DOCS=1 cargo test --test pure snapshot";

fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Compares a file with what it should hold, or writes it with `UPDATE_DOCS` set.
fn compare(path: &str, text: &str) {
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(project(path), text).unwrap();
    } else {
        assert!(fs::read_to_string(project(path)).unwrap() == text, "{path}: {AGAIN}");
    }
}

#[test]
fn shipped_schemas_are_those_of_the_types() {
    for (name, schema) in [
        ("status", schema::<Snapshot>()),
        ("feed", schema::<GatewayView>()),
        ("history", schema::<HistoryEntry>()),
        ("check", schema::<JsonReport<'_>>()),
    ] {
        compare(&format!("docs/schema/{name}.schema.json"), &(format!("{schema:#}") + "\n"));
    }
}

/// How deep the table goes; the schema has all fields.
const MAX_DEPTH: usize = 2;

/// Table of the fields of a schema.
struct Fields {
    definitions: Map<String, Value>,
    table: String,
    /// Objects of three fields or more that are in the table, with their paths.
    objects: Vec<(String, Value)>,
}

impl Fields {
    /// Adds a row for each field of an object, or for those that differ from a `known` object with the same
    /// names of fields.
    fn rows(&mut self, path: &str, object: &Value, known: Option<&Value>) {
        for (name, field) in object["properties"].as_object().unwrap() {
            if known.is_some_and(|known| self.cells(&known["properties"][name]) == self.cells(field)) {
                continue;
            }
            let (list, target) = self.inside(field);
            let [kind, mut text] = self.cells(field);
            let inner = format!("{path}{name}{list}");
            let known = self.known(&target).filter(|_| kind.starts_with("object")).cloned();
            if let Some((path, known)) = &known {
                let fields = target["properties"].as_object().unwrap().iter();
                let others = fields
                    .filter(|(name, field)| self.cells(&known["properties"][name]) != self.cells(field));
                let others: Vec<_> = others.map(|(name, _)| format!("`{name}`")).collect();
                let but = if others.is_empty() {
                    String::new()
                } else {
                    format!(", but for {}", others.join(", "))
                };
                text += &format!(" As `{path}`{but}.");
            }
            self.table += &format!("| `{inner}` | {kind} | {text} |\n");
            let is_shown = inner.matches('.').count() + 1 < MAX_DEPTH;
            if is_shown && kind.starts_with("object") && target.get("properties").is_some() {
                if known.is_none() && target["properties"].as_object().unwrap().len() > 2 {
                    self.objects.push((inner.clone(), target.clone()));
                }
                self.rows(&format!("{inner}."), &target, known.as_ref().map(|(_, known)| known));
            }
        }
    }

    /// Returns an object of the table whose fields have the same names.
    fn known(&self, object: &Value) -> Option<&(String, Value)> {
        let names =
            |object: &Value| Some(object["properties"].as_object()?.keys().cloned().collect::<Vec<_>>());
        self.objects.iter().find(|(_, known)| names(object).is_some_and(|found| Some(found) == names(known)))
    }

    /// Returns the mark of a list, and its items, or the field itself.
    fn inside(&self, field: &Value) -> (&'static str, Value) {
        let is_list = field["type"] == "array" && field.get("maxItems").is_none();
        let (list, inside) = if is_list { ("[]", &field["items"]) } else { ("", field) };
        (list, self.target(inside))
    }

    /// Returns the values and the description of a field.
    fn cells(&self, field: &Value) -> [String; 2] {
        let is_list = field["type"] == "array" && field.get("maxItems").is_none();
        let inside = if is_list { &field["items"] } else { field };
        let null = if may_be_null(inside) { ", null" } else { "" };
        let text = field["description"].as_str().unwrap_or_default();
        [format!("{}{null}", kind(&self.target(inside))), text.to_owned()]
    }

    /// What a field refers to, or itself.
    fn target(&self, field: &Value) -> Value {
        let of =
            |value: &Value| value["$ref"].as_str().map(|path| path.rsplit('/').next().unwrap().to_owned());
        let mut alternatives = field["anyOf"].as_array().into_iter().flatten();
        let name = of(field).or_else(|| alternatives.find_map(of));
        name.map_or_else(|| field.clone(), |name| self.definitions[&name].clone())
    }
}

fn may_be_null(field: &Value) -> bool {
    let is_null = |kind: &Value| kind == "null" || kind["type"] == "null";
    ["type", "anyOf"].iter().any(|key| field[key].as_array().is_some_and(|kinds| kinds.iter().any(is_null)))
}

const LEVELS: [&str; 4] = ["`OK`", "`WARN`", "`ERROR`", "`STALE`"];

/// The values of a field in words.
fn kind(field: &Value) -> String {
    let names = names(field);
    let types: Vec<_> =
        field["type"].as_array().map_or_else(|| vec![&field["type"]], |types| types.iter().collect());
    let has = |name: &str| types.iter().any(|kind| *kind == name);
    match () {
        () if names == LEVELS => "level".to_owned(),
        () if !names.is_empty() => names.join(", "),
        () if has("object") && field.get("properties").is_some() => "object".to_owned(),
        () if has("object") => "object of texts".to_owned(),
        () if has("boolean") => "boolean".to_owned(),
        () if has("string") => "text".to_owned(),
        () if has("integer") => "integer".to_owned(),
        () if has("number") => "number".to_owned(),
        () if has("array") => format!("{} numbers", field["maxItems"]),
        () => panic!("{field}"),
    }
}

/// Names of the variants of an enum; a variant with content is an object with one key.
fn names(field: &Value) -> Vec<String> {
    let variants = field["oneOf"].as_array().into_iter().flatten();
    let nested = variants.flat_map(names);
    let listed = field["enum"].as_array().into_iter().flatten().chain(field.get("const"));
    let listed = listed.map(|name| format!("`{}`", name.as_str().unwrap()));
    let keyed = field["properties"]
        .as_object()
        .filter(|fields| fields.len() == 1 && field["additionalProperties"] == false);
    let keyed = keyed.into_iter().flat_map(|fields| fields.keys()).map(|key| format!("`{{\"{key}\": …}}`"));
    nested.chain(listed).chain(keyed).collect()
}

#[test]
fn document_has_the_upper_fields_of_the_types() {
    let schema = schema::<Snapshot>();
    let definitions = schema["$defs"].as_object().unwrap().clone();
    let table = "| field | value | |\n|---|---|---|\n".to_owned();
    let mut fields = Fields { definitions, table, objects: Vec::new() };
    fields.rows("", &schema, None);
    let table = fields.table;
    assert!(table.lines().count() > 50, "{table}");
    let text = fs::read_to_string(project(DOCUMENT)).unwrap();
    let (before, rest) = text.split_once(MARKS[0]).unwrap();
    let (_, after) = rest.split_once(MARKS[1]).unwrap();
    compare(DOCUMENT, &format!("{before}{}{table}{}{after}", MARKS[0], MARKS[1]));
}
