//! Values changed by actions and compared by conditions: the parameters and variables of OpenSCENARIO
//! (docs/spec/traffic-lights.md, "Conditions and triggers").

use derive_more::Display;

/// A variable, by position in [`Scenario::variables`](super::scenario::Scenario::variables).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VariableIndex(pub usize);

/// A declared parameter or variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name. It need not be unique, since parameters of inner elements hide parameters of outer ones.
    pub name: String,
    /// Value at the start of the scenario.
    pub value: VariableValue,
}

/// The value of a variable. Two values of one kind are ordered: `false` before `true`, texts by their
/// characters.
#[derive(Debug, Clone, PartialEq, PartialOrd, Display)]
pub enum VariableValue {
    /// A truth value, `true` or `false`.
    Boolean(bool),
    /// A number of any of the numeric types; never NaN.
    Number(f64),
    /// A text, or a date.
    Text(String),
}

/// A change of a variable that is a number.
#[derive(Debug, Clone, Copy, PartialEq, Display)]
#[allow(missing_docs)] // the texts say it
pub enum Modification {
    #[display("plus {_0}")]
    Add(f64),
    #[display("times {_0}")]
    Multiply(f64),
}

impl VariableValue {
    /// Parses another value of the same kind; `None` if the text is not one.
    pub fn parse_as(&self, text: &str) -> Option<Self> {
        match self {
            Self::Boolean(_) => match text.trim() {
                "true" | "1" => Some(Self::Boolean(true)),
                "false" | "0" => Some(Self::Boolean(false)),
                _ => None,
            },
            Self::Number(_) => {
                text.trim().parse().ok().filter(|number: &f64| !number.is_nan()).map(Self::Number)
            }
            Self::Text(_) => Some(Self::Text(text.to_owned())),
        }
    }

    /// Changes a number; leaves other values, and changes with a result that is not a number, without effect.
    pub(super) fn modify(&mut self, modification: Modification) {
        let Self::Number(number) = self else { return };
        let modified = match modification {
            Modification::Add(by) => *number + by,
            Modification::Multiply(by) => *number * by,
        };
        if !modified.is_nan() {
            *number = modified;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_read_as_the_kind_that_the_variable_has() {
        let number = VariableValue::Number(0.0);
        assert_eq!(number.parse_as(" 2.50 "), Some(VariableValue::Number(2.5)));
        assert_eq!((number.parse_as("red"), number.parse_as("NaN")), (None, None));
        let truth = VariableValue::Boolean(false);
        assert_eq!(truth.parse_as("true"), Some(VariableValue::Boolean(true)));
        assert_eq!(truth.parse_as("yes"), None);
        assert_eq!(VariableValue::Text(String::new()).parse_as("1"), Some(VariableValue::Text("1".into())));
    }

    #[test]
    fn a_number_is_changed_and_never_becomes_nan() {
        let mut value = VariableValue::Number(3.0);
        value.modify(Modification::Add(1.5));
        value.modify(Modification::Multiply(2.0));
        assert_eq!(value, VariableValue::Number(9.0));
        value = VariableValue::Number(f64::INFINITY);
        value.modify(Modification::Multiply(0.0));
        assert_eq!(value, VariableValue::Number(f64::INFINITY));
    }
}
