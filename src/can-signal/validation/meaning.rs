//! Meaning of a raw value: defined, not available, fault or undefined.
//!
//! The four meanings stay distinct all the way to the report (docs/spec/vehicle-interface.md,
//! "The four fates of a value"). A value that the profile does not name is undefined; nothing is inferred
//! from all-ones or `VAL_`.

use std::fmt;

/// Meaning of one raw value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meaning<T> {
    /// The vehicle reports `T`.
    Defined(T),
    /// The vehicle reports "signal not available".
    NotAvailable,
    /// The vehicle reports a defect of its own sensor or lamp.
    Fault,
    /// The profile does not define this value.
    Undefined,
}

impl<T> Meaning<T> {
    /// Converts a defined value by `value`.
    pub fn map<U>(self, value: impl FnOnce(T) -> U) -> Meaning<U> {
        match self {
            Self::Defined(defined) => Meaning::Defined(value(defined)),
            Self::NotAvailable => Meaning::NotAvailable,
            Self::Fault => Meaning::Fault,
            Self::Undefined => Meaning::Undefined,
        }
    }
}

/// Inclusive range of raw values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RawRange {
    /// Lowest value of the range.
    pub first: i128,
    /// Highest value of the range, at least `first`.
    pub last: i128,
}

impl RawRange {
    /// Returns the range that holds only `value`.
    pub const fn single(value: i128) -> Self {
        Self { first: value, last: value }
    }

    /// Returns true if `raw` lies in the range.
    pub const fn contains(self, raw: i128) -> bool {
        self.first <= raw && raw <= self.last
    }
}

/// Formats the range as in profiles: `3` or `4..=7`.
impl fmt::Display for RawRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { first, last } = self;
        if first == last { write!(f, "{first}") } else { write!(f, "{first}..={last}") }
    }
}

/// Meanings of disjoint ranges of raw values; all other values are undefined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueMap<T> {
    entries: Vec<(RawRange, Meaning<T>)>,
}

impl<T: Copy> ValueMap<T> {
    /// Builds the map. Fails if two entries share a value, and returns both ranges, the lower one first.
    pub fn new(mut entries: Vec<(RawRange, Meaning<T>)>) -> Result<Self, [RawRange; 2]> {
        entries.sort_by_key(|(range, _)| *range);
        for pair in entries.windows(2) {
            if pair[1].0.first <= pair[0].0.last {
                return Err([pair[0].0, pair[1].0]);
            }
        }
        Ok(Self { entries })
    }

    /// Returns the same ranges with their defined values converted by `value`.
    pub fn map<U>(&self, value: impl Fn(T) -> U) -> ValueMap<U> {
        let entries = self.entries.iter().map(|(range, meaning)| (*range, meaning.map(&value)));
        ValueMap { entries: entries.collect() }
    }

    /// Returns the meaning of `raw`.
    pub fn meaning(&self, raw: i128) -> Meaning<T> {
        // With a handful of entries, a linear scan beats a binary search.
        self.entries
            .iter()
            .find(|(range, _)| range.contains(raw))
            .map_or(Meaning::Undefined, |(_, meaning)| *meaning)
    }

    /// Returns the named ranges in ascending order with their meanings.
    pub fn entries(&self) -> &[(RawRange, Meaning<T>)] {
        &self.entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(first: i128, last: i128) -> RawRange {
        RawRange { first, last }
    }

    #[test]
    fn unnamed_value_is_undefined() {
        let map = ValueMap::new(vec![
            (range(3, 3), Meaning::Defined("none")),
            (range(1, 1), Meaning::Defined("left")),
            (range(14, 14), Meaning::Fault),
            (range(15, 15), Meaning::NotAvailable),
        ])
        .unwrap();
        assert_eq!(map.meaning(1), Meaning::Defined("left"));
        assert_eq!(map.meaning(3), Meaning::Defined("none"));
        assert_eq!(map.meaning(14), Meaning::Fault);
        assert_eq!(map.meaning(15), Meaning::NotAvailable);
        for raw in [-1, 0, 2, 4, 13, 16] {
            assert_eq!(map.meaning(raw), Meaning::Undefined, "{raw}");
        }
    }

    #[test]
    fn overlapping_ranges_are_refused() {
        let entries = vec![(range(4, 9), Meaning::Defined(1)), (range(0, 4), Meaning::NotAvailable)];
        assert_eq!(ValueMap::new(entries), Err([range(0, 4), range(4, 9)]));
    }
}
