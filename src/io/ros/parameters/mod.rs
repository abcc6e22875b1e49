//! The parameters of the node, which can be read and not set, and the services for them.
//!
//! [`ParameterService::answer`] makes the response to a request; [`Call`] finds request and client in a sample, as the
//! middleware of the client has put them there. Requests come from anybody: nothing in them is trusted.

mod call;
mod service;
mod value;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

pub use call::{Call, Middleware};
pub use service::{MAX_REQUEST, MAX_RESPONSE, ParameterService};
pub use value::ParameterValue;

/// Parameters by their names, with a dot for each level.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Parameters(BTreeMap<String, ParameterValue>);

impl Parameters {
    /// Adds a parameter, or replaces its value. Numbers that are not finite become texts: they have no place in the
    /// settings of the network side.
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
        self.0.insert(name.to_owned(), value);
    }

    /// The value of a parameter.
    pub fn get(&self, name: &str) -> Option<&ParameterValue> {
        self.0.get(name)
    }

    /// The names of all, in alphabetical order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }
}
