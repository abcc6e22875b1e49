//! Definitions of messages in the notation of `.msg` files, with those of the types they contain.

use std::fmt::Write as _;

use crate::io::ros::topics::TypeName;

/// Definitions of all types, each behind a line `MSG: package/Name`; one empty line between two.
const DEFINITIONS: &str = include_str!("definitions.msg");

/// Between the definitions of two types.
const SEPARATOR: &str = "================================================================================";

/// The definition of a message, then those of all types in it, each once; `None` for a type that is not recorded.
pub fn ros2msg((package, name): TypeName) -> Option<String> {
    let mut types = vec![format!("{package}/{name}")];
    let mut text = definition(&types[0])?.to_owned();
    let mut next = 0;
    while let Some(definition) = types.get(next).and_then(|name| definition(name)) {
        if next > 0 {
            // Writing to a String cannot fail.
            let _ = write!(text, "\n{SEPARATOR}\nMSG: {}\n{definition}", types[next]);
        }
        for used in definition.lines().filter_map(used_type) {
            if !types.iter().any(|known| known == used) {
                types.push(used.to_owned());
            }
        }
        next += 1;
    }
    Some(text)
}

/// The fields and constants of a type, without line end.
fn definition(name: &str) -> Option<&'static str> {
    let mut definitions = DEFINITIONS.split("MSG: ");
    let found = definitions.find_map(|text| text.strip_prefix(name)?.strip_prefix('\n'));
    found.map(str::trim_end)
}

/// The type of a field, unless it is a primitive.
fn used_type(line: &str) -> Option<&str> {
    let name = line.split(['[', ' ']).next()?;
    name.contains('/').then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn definition_carries_constants_and_every_type_it_uses_once() {
        let text = ros2msg(("diagnostic_msgs", "DiagnosticArray")).unwrap();
        let parts: Vec<_> = text.split(SEPARATOR).collect();
        assert_eq!(parts[0], "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n");
        let names: Vec<_> = parts[1..].iter().map(|part| part.lines().nth(1).unwrap()).collect();
        assert_eq!(
            names,
            [
                "MSG: std_msgs/Header",
                "MSG: diagnostic_msgs/DiagnosticStatus",
                "MSG: builtin_interfaces/Time",
                "MSG: diagnostic_msgs/KeyValue"
            ]
        );
        assert!(parts[2].contains("\nbyte ERROR=2\n") && parts[2].contains("\nbyte level\n"), "{text}");
        assert_eq!(ros2msg(("std_msgs", "Nothing")), None);
    }

    #[test]
    fn every_type_that_a_definition_uses_is_defined() {
        for name in DEFINITIONS.lines().filter_map(|line| line.strip_prefix("MSG: ")) {
            let fields = definition(name).unwrap().lines();
            for used in fields.filter_map(used_type) {
                assert!(definition(used).is_some(), "{name}: {used}");
            }
        }
    }
}
