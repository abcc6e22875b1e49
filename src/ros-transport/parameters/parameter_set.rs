//! The parameters of the node.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::value::ParameterValue;
use ros_messages::builtin_interfaces::Time;
use ros_messages::rcl_interfaces::{Parameter, ParameterEvent, ParameterValue as NoValue};

/// Parameters by their names, with a dot for each level.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Parameters {
    values: BTreeMap<String, ParameterValue>,
    descriptions: BTreeMap<String, String>,
}

impl Parameters {
    /// Adds a parameter, or replaces its value. Numbers that are not finite become texts, because the
    /// settings' JSON cannot represent them.
    pub fn set(&mut self, name: &str, value: impl Into<ParameterValue>) {
        let mut value = value.into();
        if let ParameterValue::Double(number) = value
            && !number.is_finite()
        {
            value = ParameterValue::Text(number.to_string());
        }
        if let ParameterValue::Doubles(numbers) = &value
            && !numbers.iter().all(|number| number.is_finite())
        {
            value = ParameterValue::Texts(numbers.iter().map(f64::to_string).collect());
        }
        self.values.insert(name.to_owned(), value);
    }

    /// Sets the descriptions of the parameters for which `description` returns one.
    pub fn describe(&mut self, description: impl Fn(&str) -> Option<String>) {
        let described = self.values.keys().filter_map(|name| Some((name.clone(), description(name)?)));
        self.descriptions = described.collect();
    }

    /// Returns the description of a parameter; empty without one.
    pub fn description(&self, name: &str) -> &str {
        self.descriptions.get(name).map_or("", String::as_str)
    }

    /// Returns the value of a parameter.
    pub fn get(&self, name: &str) -> Option<&ParameterValue> {
        self.values.get(name)
    }

    /// Returns the event for the change from `before` to these parameters of a node; `None` if nothing
    /// differs.
    pub fn event_after(&self, before: &Self, node: &str, stamp: Time) -> Option<ParameterEvent> {
        let named = |name: &str, value| Parameter { name: name.to_owned(), value };
        let (mut new_parameters, mut changed_parameters) = (Vec::new(), Vec::new());
        for (name, value) in &self.values {
            match before.get(name) {
                None => new_parameters.push(named(name, value.message())),
                Some(old) if old != value => changed_parameters.push(named(name, value.message())),
                Some(_) => {}
            }
        }
        let deleted = before.names().filter(|name| self.get(name).is_none());
        let deleted_parameters: Vec<_> = deleted.map(|name| named(name, NoValue::default())).collect();
        let is_different =
            [&new_parameters, &changed_parameters, &deleted_parameters].iter().any(|list| !list.is_empty());
        let node = node.to_owned();
        is_different.then_some(ParameterEvent {
            stamp,
            node,
            new_parameters,
            changed_parameters,
            deleted_parameters,
        })
    }

    /// Returns all names, in alphabetical order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.values.keys().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_has_what_is_new_what_changed_and_what_is_gone() {
        let parameters = |entries: &[(&str, i64)]| {
            let mut parameters = Parameters::default();
            for (name, value) in entries {
                parameters.set(name, *value);
            }
            parameters
        };
        let before = parameters(&[("changed", 1), ("gone", 2), ("same", 3)]);
        let after = parameters(&[("changed", 4), ("new", 5), ("same", 3)]);
        let stamp = Time { sec: 6, nanosec: 7 };
        let event = after.event_after(&before, "/car/lights", stamp).unwrap();
        let shown = |list: &[Parameter]| {
            list.iter()
                .map(|one| (one.name.clone(), one.value.r#type, one.value.integer_value))
                .collect::<Vec<_>>()
        };
        assert_eq!((event.node.as_str(), event.stamp), ("/car/lights", stamp));
        assert_eq!(shown(&event.new_parameters), [("new".to_owned(), 2, 5)]);
        assert_eq!(shown(&event.changed_parameters), [("changed".to_owned(), 2, 4)]);
        assert_eq!(shown(&event.deleted_parameters), [("gone".to_owned(), 0, 0)]);
        assert_eq!(after.event_after(&after, "/car/lights", stamp), None);
    }
}
