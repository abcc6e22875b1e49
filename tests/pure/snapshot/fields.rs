//! The table of fields in docs/status.md is made of the types themselves.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use signal_gateway::core::traffic_light::snapshot::MAX_LISTED_LIGHTS;

/// Files with the types of the snapshot.
const FILES: [&str; 11] = [
    "src/core/gateway/snapshot.rs",
    "src/core/provenance.rs",
    "src/core/gateway/network.rs",
    "src/core/gateway/configuration.rs",
    "src/core/gateway/process_status.rs",
    "src/core/can/snapshot.rs",
    "src/core/validation/snapshot.rs",
    "src/core/vehicle_lights/status/snapshot.rs",
    "src/core/command/snapshot.rs",
    "src/core/traffic_light/snapshot.rs",
    "src/core/turn_signal/flow/snapshot.rs",
];
const DOCUMENT: &str = "docs/status.md";
const MARKS: [&str; 2] = ["<!-- begin fields -->\n", "<!-- end fields -->\n"];

struct Field {
    name: String,
    /// Its type, without blanks.
    kind: String,
    text: String,
}

fn project(path: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The public structs of a file, by name.
fn structs(text: &str, found: &mut BTreeMap<String, Vec<Field>>) {
    let tokens: Vec<TokenTree> = text.parse::<TokenStream>().unwrap().into_iter().collect();
    for (index, token) in tokens.iter().enumerate() {
        let is_struct = matches!(token, TokenTree::Ident(word) if word == "struct");
        let body = tokens[index..].iter().find_map(|token| {
            let TokenTree::Group(group) = token else { return None };
            (group.delimiter() == Delimiter::Brace).then(|| group.stream())
        });
        if let (true, Some(body)) = (is_struct, body) {
            found.insert(tokens[index + 1].to_string(), fields(body));
        }
    }
}

fn fields(body: TokenStream) -> Vec<Field> {
    let (mut fields, mut text, mut depth) = (Vec::<Field>::new(), String::new(), 0);
    let mut tokens = body.into_iter().peekable();
    let mut in_type = false;
    while let Some(token) = tokens.next() {
        match &token {
            TokenTree::Punct(mark) if mark.as_char() == '#' => {
                let attribute = tokens.next().unwrap().to_string();
                let doc = attribute.split_once('"').unwrap().1.rsplit_once('"').unwrap().0;
                text = format!("{text} {}", doc.trim());
            }
            TokenTree::Punct(mark) if mark.as_char() == ',' && depth == 0 => in_type = false,
            TokenTree::Ident(word) if word == "pub" && !in_type => {
                let name = tokens.next().unwrap().to_string();
                tokens.next();
                fields.push(Field { name, kind: String::new(), text: std::mem::take(&mut text) });
                in_type = true;
            }
            TokenTree::Punct(_) | TokenTree::Ident(_) | TokenTree::Group(_) | TokenTree::Literal(_) => {
                depth += match token.to_string().as_str() {
                    "<" => 1,
                    ">" => -1,
                    _ => 0,
                };
                fields.last_mut().unwrap().kind += &token.to_string();
            }
        }
    }
    fields
}

/// The inside of `Option<…>` or `Vec<…>`.
fn inside<'a>(kind: &'a str, wrapper: &str) -> Option<&'a str> {
    kind.strip_prefix(wrapper)?.strip_prefix('<')?.strip_suffix('>')
}

fn rows(path: &str, kind: &str, all: &BTreeMap<String, Vec<Field>>, table: &mut String) {
    for field in &all[kind] {
        let (kind, may_be_null) = match inside(&field.kind, "Option") {
            Some(kind) => (kind, true),
            None => (field.kind.as_str(), false),
        };
        let (kind, list) = inside(kind, "Vec").map_or((kind, ""), |kind| (kind, "[]"));
        let name = kind.split('<').next().unwrap();
        let json = match kind {
            "bool" => "true, false",
            "String" => "text",
            "f64" => "number",
            "[f64 ; 4]" => "4 numbers",
            "Level" => "`OK`, `WARN`, `ERROR`",
            "BTreeMap<String , String>" | "BTreeMap<String,String>" => "object of texts",
            "T" => "`DISABLE`, `ENABLE_LEFT`, `ENABLE_RIGHT`; hazard lights: `DISABLE`, `ENABLE`",
            "FaultKind" => "`unknown`, `invalid`, `hardware_fault`",
            "Compliance" => {
                "`not_requested`, `compliant`, `pending`, `overdue`, `mismatch`, `no_feedback`, `driver_override`"
            }
            _ if all.contains_key(name) => "object",
            _ if kind.starts_with(['u', 'i']) => "integer",
            _ => panic!("{path}{}: {kind}", field.name),
        };
        let null = if may_be_null { ", null" } else { "" };
        let text = field.text.trim().replace("`None`", "null").replace("[`SCHEMA`]", "Version of this form");
        let text = text.replace("[`MAX_LISTED_LIGHTS`]", &MAX_LISTED_LIGHTS.to_string());
        *table += &format!("| `{path}{}{list}` | {json}{null} | {text} |\n", field.name);
        let below = format!("{path}{}{list}.", field.name);
        // The same object twice: once is enough.
        if json == "object" && !matches!(field.name.as_str(), "hazard_lights" | "read") {
            rows(&below, name, all, table);
        }
    }
}

#[test]
fn document_has_every_field_of_the_types() {
    let mut all = BTreeMap::new();
    for file in FILES {
        structs(&fs::read_to_string(project(file)).unwrap(), &mut all);
    }
    let mut table = "| field | value | |\n|---|---|---|\n".to_owned();
    rows("", "Snapshot", &all, &mut table);
    assert!(table.lines().count() > 100, "{table}");
    let text = fs::read_to_string(project(DOCUMENT)).unwrap();
    let (before, rest) = text.split_once(MARKS[0]).unwrap();
    let (written, after) = rest.split_once(MARKS[1]).unwrap();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(project(DOCUMENT), format!("{before}{}{table}{}{after}", MARKS[0], MARKS[1])).unwrap();
    } else {
        assert_eq!(written, table, "UPDATE_DOCS=1 cargo test --test pure snapshot");
    }
}
