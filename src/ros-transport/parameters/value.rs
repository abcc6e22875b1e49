//! The value of a parameter.

use derive_more::From;
use serde::{Deserialize, Serialize};

use ros_messages::rcl_interfaces::ParameterValue as Message;

/// A value of one of the parameter types.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, From)]
pub enum ParameterValue {
    /// The parameter is true or false.
    #[from]
    Bool(bool),
    /// The parameter is a whole number.
    #[from]
    Integer(i64),
    /// The parameter is a floating-point number.
    Double(f64),
    /// The parameter is a text.
    #[from(String, &str)]
    Text(String),
    /// The parameter is a list of truth values.
    Bools(Vec<bool>),
    /// The parameter is a list of whole numbers.
    Integers(Vec<i64>),
    /// The parameter is a list of floating-point numbers.
    Doubles(Vec<f64>),
    /// The parameter is a list of texts.
    #[from]
    Texts(Vec<String>),
}

impl ParameterValue {
    /// Returns the number of its type in messages.
    pub fn type_number(&self) -> u8 {
        match self {
            Self::Bool(_) => 1,
            Self::Integer(_) => 2,
            Self::Double(_) => 3,
            Self::Text(_) => 4,
            Self::Bools(_) => 6,
            Self::Integers(_) => 7,
            Self::Doubles(_) => 8,
            Self::Texts(_) => 9,
        }
    }

    /// Returns the message with this value.
    pub fn message(&self) -> Message {
        let mut message = Message { r#type: self.type_number(), ..Message::default() };
        match self.clone() {
            Self::Bool(value) => message.bool_value = value,
            Self::Integer(value) => message.integer_value = value,
            Self::Double(value) => message.double_value = value,
            Self::Text(value) => message.string_value = value,
            Self::Bools(values) => message.bool_array_value = values,
            Self::Integers(values) => message.integer_array_value = values,
            Self::Doubles(values) => message.double_array_value = values,
            Self::Texts(values) => message.string_array_value = values,
        }
        message
    }
}
