//! Raw values of a signal in a profile: numbers and ranges.

use crate::config::reading::{Checker, Fields, Kind, Location, Value};
use can_signal::validation::meaning::RawRange;

/// A list of raw values and ranges, e.g. `[0, "4..=7"]`, each with its location.
#[derive(Debug, Clone)]
pub(super) struct RawValues(pub(super) Vec<(RawRange, Location)>);

impl RawValues {
    /// Creates a list of one range with its location.
    pub(super) fn one(range: RawRange, at: &Location) -> Self {
        Self(vec![(range, at.clone())])
    }

    /// Returns the raw values of a key; `None` if it is absent.
    pub(super) fn given(fields: &Fields<'_>, key: &'static str) -> Option<Self> {
        fields.value(key).map(|value| Self::of(fields.checker, value))
    }

    /// Returns the raw values of a key, at least one; `None` if it is absent.
    pub(super) fn some_given(fields: &Fields<'_>, key: &'static str) -> Option<Self> {
        fields.value(key).map(|value| Self::some_of(fields.checker, value))
    }

    /// Returns the raw values of a list, at least one.
    pub(super) fn some_of(checker: &Checker, value: &Value) -> Self {
        if matches!(&value.kind, Kind::List(items) if items.is_empty()) {
            checker.refuse(&value.location, "no value is given", "give at least one raw value");
        }
        Self::of(checker, value)
    }

    fn of(checker: &Checker, value: &Value) -> Self {
        let items = checker.list(value, "give a list of raw values, e.g. [0, \"4..=7\"]");
        Self(items.iter().filter_map(|item| Some((range(checker, item)?, item.location.clone()))).collect())
    }
}

fn range(checker: &Checker, value: &Value) -> Option<RawRange> {
    let range = value.scalar().and_then(|(text, is_quoted)| {
        if is_quoted { raw_range(text) } else { text.parse().ok().map(RawRange::single) }
    });
    if range.is_none() {
        checker.refuse_kind(value, "a raw value such as 3, or a range such as \"4..=7\"");
    }
    range
}

/// Reads a text such as `"4..=7"`, `"0x96"` or `"-1"`.
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
