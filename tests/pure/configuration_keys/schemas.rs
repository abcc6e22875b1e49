//! The JSON Schemas for editors, `docs/schema`. The gateway's is made of the rows of its keys. The others are
//! kept by hand, except the keys that drives share with the gateway; `agreement` holds them against their
//! readers.

use std::path::PathBuf;

use serde_json::{Map, Value, json};
use signal_gateway::config::gateway::reference::{KeySection, sections};
use signal_gateway::config::{KeyRow, ValueShape, description};
use turn_signal::parameters::table::DeciderParameter;

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
    for key in shared.into_iter().chain(["parameters", "age_limits"]) {
        drive["properties"][key] = gateway["properties"]["turn_signal"]["properties"][key].clone();
    }
    check("docs/schema/drive.schema.json", &text(&drive));
    for kind in ["profile", "scenario"] {
        check(&format!("docs/schema/{kind}.schema.json"), &text(&shipped(kind)));
    }
}

/// The file with each date as a text, which JSON has in its place.
fn with_texts_for_dates(file: Value) -> Value {
    match file {
        Value::Object(mut entries) => match entries.remove("$__toml_private_datetime") {
            Some(date) => date,
            None => entries.into_iter().map(|(key, value)| (key, with_texts_for_dates(value))).collect(),
        },
        Value::Array(items) => items.into_iter().map(with_texts_for_dates).collect(),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => file,
    }
}

/// The TOML files of a folder, as JSON.
pub(super) fn files(folder: &str) -> Vec<(PathBuf, Value)> {
    let entries = std::fs::read_dir(project(folder)).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> =
        entries.filter(|path| path.extension().is_some_and(|end| end == "toml")).collect();
    paths.sort();
    let json = |path: &PathBuf| {
        let table: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
        with_texts_for_dates(serde_json::to_value(table).unwrap())
    };
    paths.into_iter().map(|path| (path.clone(), json(&path))).collect()
}

/// The judgement of a validator that is not ours.
fn judge(kind: &str, file: &Value) -> Result<(), String> {
    let path = project(&format!("docs/schema/{kind}.schema.json"));
    let mut schemas = boon::Schemas::new();
    let index = boon::Compiler::new().compile(path.to_str().unwrap(), &mut schemas).unwrap();
    schemas.validate(file, index).map_err(|error| error.to_string())
}

#[test]
fn a_validator_accepts_every_shipped_file() {
    let mut count = 0;
    for (kind, folder) in [
        ("gateway", "config"),
        ("gateway", "packaging/debian"),
        ("profile", "config/vehicles"),
        ("drive", "config/drives"),
        ("scenario", "config/scenarios"),
    ] {
        for (path, file) in files(folder) {
            assert_eq!(judge(kind, &file), Ok(()), "{}", path.display());
            count += 1;
        }
    }
    assert!(count > 120, "{count} files");
}

#[test]
fn a_validator_refuses_unknown_keys_and_values_out_of_range() {
    for (kind, toml) in [
        ("gateway", "[black_box]\nbefore_s = 301"),
        ("gateway", "[black_box]\nbefor_s = 30"),
        ("gateway", "[turn_signal.parameters]\nturn_signal_search_time = -1"),
        ("gateway", "[ros]\ntransport = \"tcp\""),
        ("gateway", "[can.body]\ninterfaces = \"can0\""),
        ("gateway", "[traffic_lights.faults.camera]\nconfusion = [{ from = \"green\", into = \"red\" }]"),
        ("profile", "name = \"x\"\nturn.lamp.hold_ms = 0"),
        ("profile", "name = \"x\"\nmessage.A.timing = \"often\""),
        ("scenario", "[[event]]\ndo = [{ sets = \"11\" }]"),
        ("scenario", "[[event]]\ntimes = 0\ndo = []"),
        ("drive", "map = \"x\"\nroute.segments = [1]\ndrive.speed = [{ at_m = 0, mps = 101 }]"),
        ("drive", "map = \"x\"\nroute.segments = [1]\ndrive.speed = [{ at_m = 0, kmh = 10 }]"),
    ] {
        let table: toml::Table = toml.parse().unwrap();
        assert!(judge(kind, &serde_json::to_value(table).unwrap()).is_err(), "{kind}: {toml}");
    }
}
