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
        self.message().r#type
    }

    /// Returns the message with this value.
    pub fn message(&self) -> Message {
        let none = Message::default();
        match self.clone() {
            Self::Bool(bool_value) => Message { r#type: 1, bool_value, ..none },
            Self::Integer(integer_value) => Message { r#type: 2, integer_value, ..none },
            Self::Double(double_value) => Message { r#type: 3, double_value, ..none },
            Self::Text(string_value) => Message { r#type: 4, string_value, ..none },
            Self::Bools(bool_array_value) => Message { r#type: 6, bool_array_value, ..none },
            Self::Integers(integer_array_value) => Message { r#type: 7, integer_array_value, ..none },
            Self::Doubles(double_array_value) => Message { r#type: 8, double_array_value, ..none },
            Self::Texts(string_array_value) => Message { r#type: 9, string_array_value, ..none },
        }
    }
}
