//! The keys in a configuration file as parameters of the node, named with a dot for each level.

use std::str::FromStr;

use super::reference::sections;
use crate::config::reading::{Kind, Value, description};
use ros_transport::parameters::{ParameterValue, Parameters};

/// Returns the parameters for the keys of a table, with the descriptions of the keys.
pub(super) fn parameters(root: &Value) -> Parameters {
    let mut parameters = Parameters::default();
    add(&mut parameters, "", root);
    let sections = sections();
    parameters.describe(|name| {
        let (path, key) = name.rsplit_once('.').unwrap_or(("", name));
        let rows =
            sections.iter().filter(|section| is_at(path, section.path)).flat_map(|section| &section.keys);
        rows.copied().find(|row| row.name() == key).map(description)
    });
    parameters
}

/// Returns true for the path of this section, in which a star stands for any name.
fn is_at(path: &str, section: &str) -> bool {
    path.split('.').count() == section.split('.').count()
        && path.split('.').zip(section.split('.')).all(|(part, expected)| expected == "*" || part == expected)
}

fn add(parameters: &mut Parameters, name: &str, value: &Value) {
    let below = |key: &str| if name.is_empty() { key.to_owned() } else { format!("{name}.{key}") };
    match &value.kind {
        Kind::Null => {}
        Kind::Scalar { text, is_quoted } => parameters.set(name, scalar(text, *is_quoted)),
        Kind::Map(entries) => {
            for entry in entries {
                add(parameters, &below(&entry.key), &entry.value);
            }
        }
        Kind::List(items) => match items.iter().map(Value::scalar).collect::<Option<Vec<_>>>() {
            Some(scalars) => parameters.set(name, list(&scalars)),
            None => {
                for (number, item) in items.iter().enumerate() {
                    add(parameters, &below(&number.to_string()), item);
                }
            }
        },
    }
}

/// Returns a truth value or a number if the text is one, otherwise a text.
fn scalar(text: &str, is_quoted: bool) -> ParameterValue {
    let as_text = || ParameterValue::Text(text.to_owned());
    let (truth, whole, number) = (parsed(text), parsed(text), parsed(text));
    let value = truth.map(ParameterValue::Bool).or(whole.map(ParameterValue::Integer));
    value.or(number.map(ParameterValue::Double)).filter(|_| !is_quoted).unwrap_or_else(as_text)
}

/// Returns a list of the common type of all items, otherwise of texts.
fn list(scalars: &[(&str, bool)]) -> ParameterValue {
    fn all<T: FromStr>(scalars: &[(&str, bool)]) -> Option<Vec<T>> {
        let is_quoted = scalars.is_empty() || scalars.iter().any(|(_, is_quoted)| *is_quoted);
        let values = (!is_quoted).then(|| scalars.iter().map(|(text, _)| parsed(text)))?;
        values.collect()
    }
    let texts = || ParameterValue::Texts(scalars.iter().map(|(text, _)| (*text).to_owned()).collect());
    let (truths, wholes, numbers) = (all(scalars), all(scalars), all(scalars));
    let list = truths.map(ParameterValue::Bools).or(wholes.map(ParameterValue::Integers));
    list.or(numbers.map(ParameterValue::Doubles)).unwrap_or_else(texts)
}

fn parsed<T: FromStr>(text: &str) -> Option<T> {
    text.replace('_', "").parse().ok()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::reading::{Text, from_toml};

    fn of(toml: &str) -> Parameters {
        let text = Text::new(Path::new("gateway.toml"), toml.as_bytes().to_vec()).unwrap();
        parameters(&from_toml(&text, "").unwrap())
    }

    #[test]
    fn each_key_is_described_whether_it_is_in_effect_or_not() {
        let keys = [
            ("can.a.interface", "SocketCAN"),
            ("turn_signal.planning_hz", "cycles"),
            ("turn_signal.outputs.markers", "RViz"),
            ("traffic_lights.faults.camera.seed", "the same seed"),
        ];
        for (name, part) in keys {
            let parameters = of(&format!("{name} = 1"));
            assert!(
                parameters.description(name).contains(part),
                "{name}: {:?}",
                parameters.description(name)
            );
        }
        assert_eq!(of("can.a.b.interface = 1").description("can.a.b.interface"), "");
    }

    #[test]
    fn each_key_has_its_type() {
        use ParameterValue::{Bool, Bools, Double, Doubles, Integer, Integers, Text, Texts};
        let texts = |texts: &[&str]| Texts(texts.iter().map(|text| (*text).to_owned()).collect());
        for (toml, name, expected) in [
            ("a = true", "a", Bool(true)),
            ("a = \"true\"", "a", Text("true".to_owned())),
            ("[a]\nb.c = 1_000", "a.b.c", Integer(1000)),
            ("a = -2.5", "a", Double(-2.5)),
            ("a = inf", "a", Text("inf".to_owned())),
            ("a = []", "a", texts(&[])),
            ("a = [true, false]", "a", Bools(vec![true, false])),
            ("a = [1, 2]", "a", Integers(vec![1, 2])),
            ("a = [1, 2.5]", "a", Doubles(vec![1.0, 2.5])),
            ("a = [\"1\", \"b\"]", "a", texts(&["1", "b"])),
            ("a = [1, \"b\"]", "a", texts(&["1", "b"])),
            ("a = [1.0, nan]", "a", texts(&["1", "NaN"])),
            ("[[a]]\nb = 1\n[[a]]\nb = 2", "a.1.b", Integer(2)),
        ] {
            assert_eq!(of(toml).get(name), Some(&expected), "{toml}");
        }
    }
}
