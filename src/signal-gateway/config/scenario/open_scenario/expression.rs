//! Arithmetic in `${…}` (OpenSCENARIO 1.1 to 1.3, "Expressions"), and the constant `pi`, which test tracks
//! and simulators use.

use exmex::{BinOp, Express, FlatEx, MakeOperators, MatchLiteral, Operator};

/// Maximum length of an expression, bytes, which also limits its nesting.
const MAX_LENGTH: usize = 500;

/// The operators and functions of OpenSCENARIO on numbers; truth values are 0 and 1.
#[derive(Debug, Clone)]
struct Operators;

/// The numbers of OpenSCENARIO, such as `3`, `.5` and `2.1E-7`.
#[derive(Debug, Clone)]
struct Numbers;

impl MatchLiteral for Numbers {
    fn is_literal(text: &str) -> Option<&str> {
        let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
        let mut end = digits(text);
        let mut count = end;
        if let Some(fraction) = text[end..].strip_prefix('.') {
            count += digits(fraction);
            end += 1 + digits(fraction);
        }
        if let Some(exponent) = text[end..].strip_prefix(['e', 'E']) {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            let length = digits(&exponent[sign..]);
            end += if length > 0 { 1 + sign + length } else { 0 };
        }
        (count > 0).then_some(&text[..end])
    }
}

/// Returns the value, or NaN unless all operands are finite, regardless of the operator's own result: the
/// maximum of 1 and the root of -1 is not 1.
fn of<const N: usize>(operands: [f64; N], value: f64) -> f64 {
    if operands.iter().all(|operand| operand.is_finite()) { value } else { f64::NAN }
}

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        fn truth(value: bool) -> f64 {
            f64::from(u8::from(value))
        }
        let binary = |apply, prio| BinOp { apply, prio, is_commutative: false };
        vec![
            Operator::make_bin("or", binary(|a, b| of([a, b], truth(a != 0.0 || b != 0.0)), 0)),
            Operator::make_bin("and", binary(|a, b| of([a, b], truth(a != 0.0 && b != 0.0)), 1)),
            Operator::make_bin_unary("+", binary(|a, b| a + b, 2), |a| a),
            Operator::make_bin_unary("-", binary(|a, b| a - b, 2), |a| -a),
            Operator::make_bin("*", binary(|a, b| a * b, 3)),
            Operator::make_bin("/", binary(|a, b| of([a, b], a / b), 3)),
            Operator::make_bin("%", binary(|a, b| of([a, b], a % b), 3)),
            Operator::make_bin("pow", binary(|a, b| of([a, b], a.powf(b)), 4)),
            Operator::make_bin("max", binary(|a, b| of([a, b], a.max(b)), 4)),
            Operator::make_bin("min", binary(|a, b| of([a, b], a.min(b)), 4)),
            Operator::make_unary("not", |a| of([a], truth(a == 0.0))),
            Operator::make_unary("round", f64::round),
            Operator::make_unary("floor", f64::floor),
            Operator::make_unary("ceil", f64::ceil),
            Operator::make_unary("sqrt", f64::sqrt),
            Operator::make_unary("abs", f64::abs),
            Operator::make_unary("sign", |a| of([a], truth(a > 0.0) - truth(a < 0.0))),
            // Angles are in radians.
            Operator::make_unary("sin", f64::sin),
            Operator::make_unary("cos", f64::cos),
            Operator::make_unary("tan", f64::tan),
            Operator::make_unary("asin", f64::asin),
            Operator::make_unary("acos", f64::acos),
            Operator::make_unary("atan", |a| of([a], a.atan())),
            Operator::make_constant(PI, std::f64::consts::PI),
            Operator::make_constant(TRUE, truth(true)),
            Operator::make_constant(FALSE, truth(false)),
        ]
    }
}

const PI: &str = "pi";
const TRUE: &str = "true";
const FALSE: &str = "false";

pub(super) fn is_constant(name: &str) -> bool {
    [PI, TRUE, FALSE].contains(&name)
}

/// Writes calls of two operands between these, `max(1, 2)` as `((1)max(2))`: the parser does not accept a
/// call as a second operand. A call with a different number of operands remains, and the parser refuses it.
fn infix(expression: &str) -> String {
    // For each open parenthesis: the preceding function, until its comma, and the required end.
    let (mut written, mut open) = (String::new(), Vec::new());
    for char in expression.chars() {
        match char {
            '(' => {
                let name = ["pow", "max", "min"].into_iter().find(|name| written.trim_end().ends_with(name));
                match name {
                    Some(name) => {
                        written.truncate(written.trim_end().len() - name.len());
                        written.push_str("((");
                    }
                    None => written.push('('),
                }
                open.push((name, if name.is_some() { ",)" } else { ")" }));
            }
            ',' => match open.last_mut() {
                Some((name @ Some(_), end)) => {
                    written.extend([")", name.take().unwrap_or_default(), "("]);
                    *end = "))";
                }
                Some((None, _)) | None => written.push(','),
            },
            ')' => written.push_str(open.pop().map_or(")", |(_, end)| end)),
            other => written.push(other),
        }
    }
    written
}

#[derive(Debug, thiserror::Error)]
pub(super) enum ExpressionError {
    #[error("the expression is longer than {MAX_LENGTH} bytes")]
    TooLong,
    #[error(
        "{0:?} is not an expression of numbers, pi, + - * / %, and functions such as min, max, abs, sign, pow, sqrt, round, \
         floor and ceil"
    )]
    Invalid(String),
    #[error("{0:?} has no finite value")]
    NotFinite(String),
}

/// Computes an expression of numbers, and writes the result as a number: whole, or with 15 digits.
pub(super) fn compute(expression: &str) -> Result<String, ExpressionError> {
    if expression.len() > MAX_LENGTH {
        return Err(ExpressionError::TooLong);
    }
    let parsed = FlatEx::<f64, Operators, Numbers>::parse(&infix(expression));
    let value = parsed.and_then(|parsed| parsed.eval(&[]));
    let value = value.map_err(|_| ExpressionError::Invalid(expression.to_owned()))?;
    if !value.is_finite() {
        return Err(ExpressionError::NotFinite(expression.to_owned()));
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
            ("2.1E-1 * 10 + 1e3", "1002.1"),
            ("round(2 * pi * 100)", "628"),
            ("sign(-2.5) + sign(0) * 10 + sign(7) * 100", "99"),
            ("abs(-3) + abs(2.5)", "5.5"),
            ("min(3, -2) * 2", "-4"),
            ("2 * max(1 + 1, 2 * 3)", "12"),
            ("-min(1, 2)", "-1"),
            ("max(min(4, 5), abs(-7))", "7"),
            ("max(1, max(2, min (9, max(3, 4)))) + pow(2, pow(2, 2))", "20"),
            ("10 - max(1, 2) - 3", "5"),
            ("2 * pow(2, 3) - 1", "15"),
            ("sin(pi / 2) + cos(0) + tan(0)", "2"),
            ("round((asin(1) + acos(0) + 4 * atan(1)) * 1000)", "6283"),
        ] {
            assert_eq!(compute(expression).unwrap(), value, "{expression}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_refused() {
        for expression in [
            "",
            "1 +",
            "1e",
            ".",
            "1.2.3",
            "red",
            "1 2",
            "(1",
            "1)",
            "x + 1",
            "1 / 0",
            "sqrt(-1)",
            "asin(2)",
            "5 % 0",
            "1 / (1 / 0)",
            "max(sqrt(-1), 2)",
            "min(1 / 0, 2)",
            "pow(sqrt(-1), 0)",
            "pow(-1, 0.5)",
            "not(sqrt(-1))",
            "true or sqrt(-1)",
            "atan(1 / 0)",
            "sign(sqrt(-1))",
            "min(1)",
            "max(1, 2, 3)",
            "pi()",
            "abs",
        ] {
            assert!(compute(expression).is_err(), "{expression}");
        }
        assert!(matches!(compute(&"(".repeat(100_000)), Err(ExpressionError::TooLong)));
    }

    proptest! {
        #[test]
        fn no_text_brings_it_down(text in "[-+*/%()a-z0-9. $]{0,60}|.{0,60}") {
            let _ = compute(&text);
        }
    }
}
