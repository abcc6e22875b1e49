//! Raw values of a signal as a profile writes them: numbers and ranges.

use std::fmt;

use serde::Deserialize;
use serde::de::{Unexpected, Visitor};
use toml::Spanned;

use crate::core::validation::meaning::RawRange;

/// A list of raw values and ranges, e.g. `[0, "4..=7"]`.
pub(super) type RawValues = Spanned<Vec<Spanned<RawValue>>>;

/// One entry of such a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawValue(pub RawRange);

impl<'de> Deserialize<'de> for RawValue {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RawValueVisitor)
    }
}

struct RawValueVisitor;

impl Visitor<'_> for RawValueVisitor {
    type Value = RawValue;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a raw value such as 3, or a range such as \"4..=7\"")
    }

    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<RawValue, E> {
        Ok(RawValue(RawRange::single(value.into())))
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<RawValue, E> {
        Ok(RawValue(RawRange::single(value.into())))
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<RawValue, E> {
        raw_range(text).map(RawValue).ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))
    }
}

/// `"4..=7"`, `"0x96"`, `"-1"`.
fn raw_range(text: &str) -> Option<RawRange> {
    let number = |text: &str| match text.trim().strip_prefix("0x") {
        Some(hex) => i128::from_str_radix(hex, 16).ok(),
        None => text.trim().parse().ok(),
    };
    let (first, last) = match text.split_once("..=") {
        Some((first, last)) => (number(first)?, number(last)?),
        None => (number(text)?, number(text)?),
    };
    (first <= last).then_some(RawRange { first, last })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_numbers_or_ranges() {
        assert_eq!(raw_range("4..=7"), Some(RawRange { first: 4, last: 7 }));
        assert_eq!(raw_range("0x96"), Some(RawRange::single(0x96)));
        assert_eq!(raw_range("-2 ..= -1"), Some(RawRange { first: -2, last: -1 }));
        for wrong in ["", "7..=4", "1..2", "x", "1..=", "0x"] {
            assert_eq!(raw_range(wrong), None, "{wrong}");
        }
    }
}
