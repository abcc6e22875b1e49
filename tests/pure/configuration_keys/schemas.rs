//! The JSON Schemas for editors, `docs/schema`. The gateway's is made of the rows of its keys. The others are kept by hand, except the
//! keys that drives share with the gateway; `agreement` holds them against their readers.

use std::path::PathBuf;

use serde_json::{Map, Value, json};
use signal_gateway::config::gateway::reference::{KeySection, description, sections};
use signal_gateway::config::{KeyRow, ValueShape};
use signal_gateway::core::turn_signal::parameters::table::DeciderParameter;

use super::{check, project};

/// The schema of a kind of file, as it is shipped.
pub(super) fn shipped(kind: &str) -> Value {
    let path = project(&format!("docs/schema/{kind}.schema.json"));
    serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap()
}

fn text(schema: &Value) -> String {
    serde_json::to_string_pretty(schema).unwrap() + "\n"
}

fn of_toml(toml: &str) -> Value {
    let table: toml::Table = format!("value = {toml}").parse().unwrap();
    serde_json::to_value(&table["value"]).unwrap()
}

fn of_row(row: &dyn KeyRow) -> Value {
    let mut schema = match row.shape() {
        ValueShape::Whole(min, max, _) => {
            let mut schema = json!({ "type": "integer" });
            if min > i64::MIN {
                schema["minimum"] = min.into();
            }
            if max < i64::MAX {
                schema["maximum"] = max.into();
            }
            schema
        }
        ValueShape::Number(min, max, _) if max < f64::MAX => {
            json!({ "type": "number", "minimum": min, "maximum": max })
        }
        ValueShape::Number(min, ..) => json!({ "type": "number", "minimum": min }),
        ValueShape::Flag => json!({ "type": "boolean" }),
        ValueShape::Keyword(words) => json!({ "enum": words }),
        ValueShape::Text | ValueShape::Path => json!({ "type": "string" }),
        ValueShape::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        ValueShape::Names => {
            let scalar = json!({ "type": ["string", "number", "boolean"] });
            json!({ "type": "object", "additionalProperties": scalar })
        }
        ValueShape::Tables(keys) => json!({ "type": "array", "items": of_table("", &keys) }),
    };
    schema["description"] = description(row).into();
    if let Some(default) = row.default_toml() {
        schema["default"] = of_toml(&default);
    } else if !row.example().is_empty() {
        schema["examples"] = json!([of_toml(row.example())]);
    }
    schema
}

fn of_table(doc: &str, keys: &[&'static dyn KeyRow]) -> Value {
    let mut properties = Map::new();
    for row in keys {
        properties.insert(row.name().to_owned(), of_row(*row));
        for alias in DeciderParameter::named(row.name()).map_or(&[][..], |parameter| parameter.aliases) {
            properties.insert((*alias).to_owned(), of_row(*row));
        }
    }
    let mut schema = json!({ "type": "object", "properties": properties, "additionalProperties": false });
    if !doc.is_empty() {
        schema["description"] = doc.into();
    }
    schema
}

fn put(schema: &mut Value, path: &[&str], table: Value) {
    let (first, rest) = path.split_first().unwrap();
    if *first == "*" {
        schema["additionalProperties"] = table;
        return;
    }
    let below = &mut schema["properties"][*first];
    if rest.is_empty() {
        *below = table;
    } else {
        if below.is_null() {
            *below = json!({ "type": "object", "properties": {}, "additionalProperties": false });
        }
        put(below, rest, table);
    }
}

fn gateway() -> Value {
    let mut schema = of_table("", &sections()[0].keys);
    for KeySection { path, doc, keys, .. } in sections().into_iter().skip(1) {
        put(&mut schema, &path.split('.').collect::<Vec<_>>(), of_table(doc, &keys));
    }
    let vehicle = "The vehicle profile, in the place of a path; its keys are those of profile.schema.json";
    schema["properties"]["vehicle"] = json!({ "type": "object", "description": vehicle });
    schema["$schema"] = "http://json-schema.org/draft-07/schema#".into();
    schema["title"] = "Configuration of signal-gateway".into();
    schema
}

#[test]
fn the_schema_of_the_gateway_is_made_of_the_rows() {
    check("docs/schema/gateway.schema.json", &text(&gateway()));
}

#[test]
fn the_schema_of_drives_has_the_rows_that_drives_share_with_the_gateway() {
    let (mut drive, gateway) = (shipped("drive"), gateway());
    let shared = ["country", "minimum_on_ms", "minimum_gap_ms", "standing_limit_ms", "waits_for_junctions"];
    for key in shared.into_iter().chain(["parameters", "age_limits", "vehicle"]) {
        drive["properties"][key] = gateway["properties"]["turn_signal"]["properties"][key].clone();
    }
    check("docs/schema/drive.schema.json", &text(&drive));
    for kind in ["profile", "scenario"] {
        check(&format!("docs/schema/{kind}.schema.json"), &text(&shipped(kind)));
    }
}

/// The files of a folder with an extension, with their texts as JSON.
pub(super) fn files(folder: &str) -> Vec<(PathBuf, Value)> {
    let entries = std::fs::read_dir(project(folder)).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    paths.sort();
    let json = |path: &PathBuf| {
        let table: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
        serde_json::to_value(table).unwrap()
    };
    paths.into_iter().map(|path| (path.clone(), json(&path))).collect()
}
