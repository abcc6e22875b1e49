//! The messages of `rcl_interfaces` about parameters, and the requests and responses of its services.

use serde::{Deserialize, Serialize};

use super::stamp::Time;

/// `rcl_interfaces/msg/ParameterValue`: the type says which of the values counts.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ParameterValue {
    /// 0 not set, 1 a truth value, 2 a whole number, 3 a number, 4 a text, 5 bytes; 6 truth values, 7 whole numbers,
    /// 8 numbers, 9 texts.
    pub r#type: u8,
    /// A truth value.
    pub bool_value: bool,
    /// A whole number.
    pub integer_value: i64,
    /// A number.
    pub double_value: f64,
    /// A text.
    pub string_value: String,
    /// Bytes.
    pub byte_array_value: Vec<u8>,
    /// Truth values.
    pub bool_array_value: Vec<bool>,
    /// Whole numbers.
    pub integer_array_value: Vec<i64>,
    /// Numbers.
    pub double_array_value: Vec<f64>,
    /// Texts.
    pub string_array_value: Vec<String>,
}

/// `rcl_interfaces/msg/Parameter`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedParameterValue {
    /// Name, with a dot for each level.
    pub name: String,
    /// Its value.
    pub value: ParameterValue,
}

/// `rcl_interfaces/msg/ParameterEvent`: what has become of the parameters of a node, on `/parameter_events`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterEvent {
    /// When they changed.
    pub stamp: Time,
    /// Name of the node, with its namespace.
    pub node: String,
    /// Those that were not there before.
    pub new_parameters: Vec<NamedParameterValue>,
    /// Those with another value than before.
    pub changed_parameters: Vec<NamedParameterValue>,
    /// Those that are not there any more, without a value.
    pub deleted_parameters: Vec<NamedParameterValue>,
}

/// `rcl_interfaces/msg/ParameterDescriptor`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ParameterDescriptor {
    /// Name of the parameter.
    pub name: String,
    /// As in [`ParameterValue`].
    pub r#type: u8,
    /// One line for a person.
    pub description: String,
    /// Constraints in words.
    pub additional_constraints: String,
    /// True if nobody can set it.
    pub read_only: bool,
    /// True if its type may change.
    pub dynamic_typing: bool,
    /// None, or one.
    pub floating_point_range: Vec<FloatingPointRange>,
    /// None, or one.
    pub integer_range: Vec<IntegerRange>,
}

/// `rcl_interfaces/msg/FloatingPointRange`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FloatingPointRange {
    /// The lowest value.
    pub from_value: f64,
    /// The highest value.
    pub to_value: f64,
    /// Between two values; 0 for any.
    pub step: f64,
}

/// `rcl_interfaces/msg/IntegerRange`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct IntegerRange {
    /// The lowest value.
    pub from_value: i64,
    /// The highest value.
    pub to_value: i64,
    /// Between two values; 0 for any.
    pub step: u64,
}

/// `rcl_interfaces/msg/SetParametersResult`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SetParametersResult {
    /// True if the parameter was set.
    pub successful: bool,
    /// The reason if it was not.
    pub reason: String,
}

/// The request of `ListParameters`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListParametersRequest {
    /// The parameters below these names; all without any.
    pub prefixes: Vec<String>,
    /// Levels below each prefix; 0 for all.
    pub depth: u64,
}

/// The response of `ListParameters`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ListParametersResponse {
    /// Names of the parameters.
    pub names: Vec<String>,
    /// Names of the levels that they stand below.
    pub prefixes: Vec<String>,
}

/// The request of `DescribeParameters`, `GetParameters` and `GetParameterTypes`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ParameterNames {
    /// Names of parameters.
    pub names: Vec<String>,
}

/// The request of `SetParameters` and `SetParametersAtomically`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetParametersRequest {
    /// Parameters with the values that they are to get.
    pub parameters: Vec<NamedParameterValue>,
}
