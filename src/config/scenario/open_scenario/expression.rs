//! Arithmetic in `${…}` (OpenSCENARIO 1.1, "Expressions").

use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};

/// The longest expression that is computed, bytes: an expression is nested at most as deeply as it is long.
const MAX_LENGTH: usize = 500;

/// The operators and functions of OpenSCENARIO on numbers; truth values are 0 and 1.
#[derive(Debug, Clone)]
struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        fn truth(value: bool) -> f64 {
            f64::from(u8::from(value))
        }
        let binary = |apply, prio| BinOp { apply, prio, is_commutative: false };
        vec![
            Operator::make_bin("or", binary(|a, b| truth(a != 0.0 || b != 0.0), 0)),
            Operator::make_bin("and", binary(|a, b| truth(a != 0.0 && b != 0.0), 1)),
            Operator::make_bin_unary("+", binary(|a, b| a + b, 2), |a| a),
            Operator::make_bin_unary("-", binary(|a, b| a - b, 2), |a| -a),
            Operator::make_bin("*", binary(|a, b| a * b, 3)),
            Operator::make_bin("/", binary(|a, b| a / b, 3)),
            Operator::make_bin("%", binary(|a, b| a % b, 3)),
            Operator::make_bin("pow", binary(f64::powf, 4)),
            Operator::make_unary("not", |a| truth(a == 0.0)),
            Operator::make_unary("round", f64::round),
            Operator::make_unary("floor", f64::floor),
            Operator::make_unary("ceil", f64::ceil),
            Operator::make_unary("sqrt", f64::sqrt),
            Operator::make_constant("true", truth(true)),
            Operator::make_constant("false", truth(false)),
        ]
    }
}

/// Computes an expression of numbers, and writes the result as a number: whole, or with 15 digits.
///
/// # Errors
/// The reason as text.
pub(super) fn compute(expression: &str) -> Result<String, String> {
    if expression.len() > MAX_LENGTH {
        return Err(format!("the expression is longer than {MAX_LENGTH} bytes"));
    }
    let parsed = FlatEx::<f64, Operators>::parse(expression);
    let value = parsed.and_then(|parsed| parsed.eval(&[])).map_err(|_| {
        format!("{expression:?} is not an expression of numbers, + - * / %, pow, sqrt, round, floor and ceil")
    })?;
    if !value.is_finite() {
        return Err(format!("{expression:?} has no finite value"));
    }
    // 1 + 3 * 2.2 is meant to be 7.6. Ids are whole numbers, which are exact.
    let rounded = format!("{value:.14e}").parse().unwrap_or(value);
    Ok(if value.fract() == 0.0 { value.to_string() } else { rounded.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn numbers_are_computed_as_openscenario_says() {
        for (expression, value) in [
            ("34800 + 2", "34802"),
            ("7 / 2", "3.5"),
            ("2 + 3 * -4", "-10"),
            ("(2 + 3) * 4", "20"),
            ("10 - 4 - 3", "3"),
            ("7 % 4", "3"),
            ("pow(2, 3) + sqrt(16)", "12"),
            ("round(2.5) + floor(-0.5) + ceil(0.1)", "3"),
            ("not(0) and true or false", "1"),
            ("1 + sqrt(9) * 2.2", "7.6"),
            ("9007199254740990 + 1", "9007199254740991"),
            ("(-3) * 2", "-6"),
        ] {
            assert_eq!(compute(expression).as_deref(), Ok(value), "{expression}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_refused() {
        for expression in ["", "1 +", "red", "1 2", "(1", "1)", "x + 1", "1 / 0", "sqrt(-1)"] {
            assert!(compute(expression).is_err(), "{expression}");
        }
        assert!(compute(&"(".repeat(100_000)).unwrap_err().contains("longer than"));
    }

    proptest! {
        #[test]
        fn no_text_brings_it_down(text in "[-+*/%()a-z0-9. $]{0,60}|.{0,60}") {
            let _ = compute(&text);
        }
    }
}
