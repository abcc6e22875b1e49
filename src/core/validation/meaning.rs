//! From a raw value to one of four fates: defined, not available, fault, undefined.
//!
//! The fates stay apart all the way to the report
//! (docs/spec/vehicle-interface.md, "The four fates of a value").
//! A value that the profile does not name is undefined; nothing is guessed from all-ones or from `VAL_`.

use std::fmt;

/// What one raw value means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meaning<T> {
    /// The vehicle says `T`.
    Defined(T),
    /// The vehicle says that it does not know ("signal not available").
    NotAvailable,
    /// The vehicle says that its own sensor or lamp is broken.
    Fault,
    /// The profile gives this value no meaning.
    Undefined,
}

/// Inclusive range of raw values; a single value is a range of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RawRange {
    /// Lowest value.
    pub first: i128,
    /// Highest value, not below `first`.
    pub last: i128,
}

impl RawRange {
    /// The range that holds `value` alone.
    pub const fn single(value: i128) -> Self {
        Self { first: value, last: value }
    }

    const fn contains(self, raw: i128) -> bool {
        self.first <= raw && raw <= self.last
    }
}

/// As a profile spells it: `3`, or `4..=7`.
impl fmt::Display for RawRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { first, last } = self;
        if first == last { write!(f, "{first}") } else { write!(f, "{first}..={last}") }
    }
}

/// Raw values and what they mean; ranges are disjoint, the rest is undefined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueMap<T> {
    entries: Vec<(RawRange, Meaning<T>)>,
}

impl<T: Copy> ValueMap<T> {
    /// Builds the map.
    ///
    /// # Errors
    /// Two entries that share a value, lower one first.
    pub fn new(mut entries: Vec<(RawRange, Meaning<T>)>) -> Result<Self, [RawRange; 2]> {
        entries.sort_by_key(|(range, _)| *range);
        for pair in entries.windows(2) {
            if pair[1].0.first <= pair[0].0.last {
                return Err([pair[0].0, pair[1].0]);
            }
        }
        Ok(Self { entries })
    }

    /// What `raw` means.
    pub fn meaning(&self, raw: i128) -> Meaning<T> {
        // A handful of entries: a linear scan beats a search.
        self.entries
            .iter()
            .find(|(range, _)| range.contains(raw))
            .map_or(Meaning::Undefined, |(_, meaning)| *meaning)
    }

    /// The named ranges with their meanings, ascending.
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
    fn what_the_profile_does_not_name_is_undefined() {
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
    fn a_value_with_two_meanings_is_refused() {
        let entries = vec![(range(4, 9), Meaning::Defined(1)), (range(0, 4), Meaning::NotAvailable)];
        assert_eq!(ValueMap::new(entries), Err([range(0, 4), range(4, 9)]));
    }
}
