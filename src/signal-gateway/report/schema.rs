//! JSON Schemas of the gateway's output for programs, generated from its types.

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, Schema};
use serde_json::Value;

/// Returns the schema of a type as it is serialised.
pub fn schema<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut schema = Schema::to_value(settings.into_generator().into_root_schema_for::<T>());
    rewrite_descriptions(&mut schema);
    schema
}

/// Replaces Rust terms in descriptions by JSON terms.
fn rewrite_descriptions(value: &mut Value) {
    match value {
        Value::String(text) => {
            *text = text.replace("`None`", "null").replace('\n', " ").replace("[`", "`").replace("`]", "`");
        }
        Value::Array(items) => items.iter_mut().for_each(rewrite_descriptions),
        Value::Object(fields) => fields.values_mut().for_each(rewrite_descriptions),
        Value::Null | Value::Bool(_) | Value::Number(_) => {}
    }
}
