//! Recognises the platform of a bus by its identifiers: the share of them found in a public list of the
//! platform's messages.
//!
//! One identifier with its usual length means little, since different makes use the same ones; the share of
//! the whole bus that is in a list means much. The limits were chosen from public recordings;
//! `docs/identify.md` documents their margins.

use std::collections::{BTreeMap, BTreeSet};

use can_signal::can::{CanId, Frame};

/// Smallest number of different identifiers from which a bus has a fingerprint.
pub const MIN_IDENTIFIERS: u32 = 12;
/// Minimum share of the identifiers found in a list of the bus's own platform, percent.
const MIN_PERCENT: u32 = 15;
/// Minimum ratio of that share to the share expected by chance.
const MIN_RATIO_TO_CHANCE: u32 = 2;
/// A bus is not of another platform if it has at least one in this many of a list's identifiers, even if the
/// list is short.
const RECEIVED_FRACTION: u32 = 5;
/// Minimum difference between the explained identifiers and their number by chance, standard deviations, for
/// naming a platform.
const MIN_DEVIATIONS: f64 = 10.0;
/// Minimum assumed probability that a list has an identifier, so that three or four matches with a short list
/// name no platform.
const MIN_CHANCE: f64 = 0.01;
/// Number of identifiers of 11 bits.
const STANDARD_IDENTIFIERS: u32 = 2048;
/// Maximum number of different identifiers of a bus; more are ignored.
const MAX_IDENTIFIERS: usize = 8192;

/// Public list of the messages on a bus of a platform.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlatformList {
    /// Name of the DBC from which the list was made, without its extension, e.g. `hyundai_can_generated`.
    pub name: String,
    /// Make, e.g. `Hyundai`. Lists of one make do not exclude each other.
    pub make: String,
    /// Platform or models, and the bus, e.g. `Hyundai and Kia, classic CAN`.
    pub title: String,
    /// Identifiers with the length of their data, bytes.
    pub messages: BTreeSet<(CanId, usize)>,
}

impl PlatformList {
    /// Returns the number of listed identifiers of 11 bits.
    fn standard(&self) -> u32 {
        count(self.messages.iter().filter(|(id, _)| matches!(id, CanId::Standard(_))))
    }

    /// Returns the probability that the list contains a random identifier of 11 bits.
    fn chance(&self) -> f64 {
        f64::from(self.standard()) / f64::from(STANDARD_IDENTIFIERS)
    }
}

fn count(items: impl Iterator) -> u32 {
    items.map(|_| 1).sum()
}

/// The identifiers that were received on a bus, each with its usual length.
#[derive(Debug, Clone, Default)]
pub struct Fingerprint {
    /// Identifiers of 11 bits, indexed by number up to the largest.
    standard: Vec<Option<UsualLength>>,
    extended: BTreeMap<u32, UsualLength>,
    /// Number of all identifiers.
    count: usize,
}

/// Length of most frames; each frame with another length reduces its count by one.
#[derive(Debug, Clone, Copy)]
struct UsualLength {
    bytes: usize,
    votes: u64,
}

impl Fingerprint {
    /// Adds the next frame of the bus. Returns true if its identifier is new.
    pub fn frame(&mut self, frame: &Frame) -> bool {
        let bytes = frame.data().len();
        let known = match frame.id() {
            CanId::Standard(id) => self.standard.get_mut(usize::from(id)).and_then(Option::as_mut),
            CanId::Extended(id) => self.extended.get_mut(&id),
        };
        let Some(usual) = known else {
            self.add(frame.id(), bytes);
            return true;
        };
        match (usual.bytes == bytes, usual.votes) {
            (true, _) => usual.votes += 1,
            (false, 0) => *usual = UsualLength { bytes, votes: 1 },
            (false, _) => usual.votes -= 1,
        }
        false
    }

    /// Adds a new identifier, unless there are too many.
    fn add(&mut self, id: CanId, bytes: usize) {
        if self.count >= MAX_IDENTIFIERS {
            return;
        }
        self.count += 1;
        let usual = UsualLength { bytes, votes: 1 };
        match id {
            CanId::Standard(id) => {
                let index = usize::from(id);
                self.standard.resize(self.standard.len().max(index + 1), None);
                self.standard[index] = Some(usual);
            }
            CanId::Extended(id) => {
                self.extended.insert(id, usual);
            }
        }
    }

    /// Returns the identifiers, each with its usual length in bytes.
    fn identifiers(&self) -> impl Iterator<Item = (CanId, usize)> {
        let standard = (0..).zip(&self.standard);
        let standard = standard.filter_map(|(id, usual)| Some((CanId::Standard(id), usual.as_ref()?.bytes)));
        let extended = self.extended.iter().map(|(id, usual)| (CanId::Extended(*id), usual.bytes));
        standard.chain(extended)
    }

    /// Compares the bus with a list; `None` below [`MIN_IDENTIFIERS`].
    pub fn compare<'a>(&self, list: &'a PlatformList) -> Option<PlatformMatch<'a>> {
        let identifiers = count(self.identifiers());
        let is_listed = |identifier: &(CanId, usize)| list.messages.contains(identifier);
        (identifiers >= MIN_IDENTIFIERS).then(|| PlatformMatch {
            list,
            explained: count(self.identifiers().filter(is_listed)),
            identifiers,
        })
    }

    /// Returns the best match among the lists of one platform; `None` without a list, or below
    /// [`MIN_IDENTIFIERS`].
    pub fn compare_best<'a>(
        &self,
        lists: impl IntoIterator<Item = &'a PlatformList>,
    ) -> Option<PlatformMatch<'a>> {
        let matches = lists.into_iter().filter_map(|list| self.compare(list));
        matches.max_by(|one, other| one.deviations().total_cmp(&other.deviations()))
    }

    /// Returns the platform whose list explains far more identifiers than chance does, with other lists of
    /// the same make that explain as many; empty if there is none.
    pub fn platforms<'a>(&self, lists: &'a [PlatformList]) -> Vec<PlatformMatch<'a>> {
        let Some(best) = self.compare_best(lists).filter(PlatformMatch::names_platform) else {
            return Vec::new();
        };
        let equals = lists.iter().filter(|list| list.make == best.list.make && list.name != best.list.name);
        let equals = equals.filter_map(|list| self.compare(list));
        let equals: Vec<_> = equals.filter(|other| other.explained >= best.explained).collect();
        [vec![best], equals].concat()
    }
}

/// Number of identifiers of a bus that are in the list of a platform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatformMatch<'a> {
    /// The list.
    pub list: &'a PlatformList,
    /// Number of identifiers that are in the list with their usual length.
    pub explained: u32,
    /// Number of all identifiers on the bus.
    pub identifiers: u32,
}

impl PlatformMatch<'_> {
    /// Returns the minimum number of explained identifiers for a bus of the platform.
    pub fn min_explained(&self) -> u32 {
        let by_share = (MIN_PERCENT * self.identifiers).div_ceil(100);
        let by_chance = MIN_RATIO_TO_CHANCE * self.list.standard() * self.identifiers;
        by_share.max(by_chance.div_ceil(STANDARD_IDENTIFIERS))
    }

    /// Returns the number of random identifiers that the list would explain.
    pub fn expected_by_chance(&self) -> f64 {
        self.list.chance() * f64::from(self.identifiers)
    }

    /// Returns true if the bus may well belong to the platform.
    pub fn is_of_platform(&self) -> bool {
        self.explained >= self.min_explained()
    }

    /// Returns true if the bus belongs to another platform: few of its identifiers are in the list, and few
    /// identifiers of the list are on the bus.
    pub fn is_of_other_platform(&self) -> bool {
        let is_unlisted = RECEIVED_FRACTION * self.explained < count(self.list.messages.iter());
        !self.is_of_platform() && is_unlisted
    }

    /// Returns true if chance does not explain the number of identifiers in the list.
    fn names_platform(&self) -> bool {
        self.is_of_platform() && self.deviations() >= MIN_DEVIATIONS
    }

    /// Returns the difference between the explained identifiers and their number by chance, in standard
    /// deviations.
    fn deviations(&self) -> f64 {
        let chance = self.list.chance().max(MIN_CHANCE);
        let expected = chance * f64::from(self.identifiers);
        (f64::from(self.explained) - expected) / (expected * (1.0 - chance)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(name: &str, make: &str, ids: impl IntoIterator<Item = u16>) -> PlatformList {
        let messages = ids.into_iter().map(|id| (CanId::Standard(id), 8)).collect();
        PlatformList { name: name.to_owned(), make: make.to_owned(), title: name.to_owned(), messages }
    }

    fn bus(frames: impl IntoIterator<Item = (u16, usize)>) -> Fingerprint {
        let mut bus = Fingerprint::default();
        for (id, length) in frames {
            bus.frame(&Frame::classic(CanId::Standard(id), &[0; 8][..length]).unwrap());
        }
        bus
    }

    #[test]
    fn a_bus_of_few_identifiers_has_no_fingerprint() {
        let list = list("list", "Make", 0..100);
        assert_eq!(bus((0..11).map(|id| (id, 8))).compare(&list), None);
        let compared = bus((0..12).map(|id| (id, 8))).compare(&list).unwrap();
        assert_eq!((compared.explained, compared.identifiers), (12, 12));
    }

    #[test]
    fn an_identifier_counts_with_the_length_of_most_of_its_frames() {
        let list = list("list", "Make", 0..100);
        let explained = |odd: usize, right: usize| {
            let others = (1..12).map(|id| (id, 7));
            let odd = std::iter::repeat_n((0, 7), odd);
            bus(others.chain(odd).chain(std::iter::repeat_n((0, 8), right))).compare(&list).unwrap().explained
        };
        assert_eq!((explained(2, 3), explained(3, 2)), (1, 0));
    }

    #[test]
    fn the_share_says_whether_a_bus_is_of_the_platform() {
        // 100 identifiers, of which the list of 80 explains 14 or 15; chance is 3.9 %.
        let shares = |explained: u16| {
            let known = (0..explained).map(|id| (id, 8));
            let foreign = (explained..100).map(|id| (1_000 + id, 8));
            let list = list("list", "Make", 0..80);
            let bus = bus(known.chain(foreign));
            let compared = bus.compare(&list).unwrap();
            (compared.is_of_platform(), compared.is_of_other_platform())
        };
        assert_eq!((shares(15), shares(14)), ((true, false), (false, true)));
    }

    #[test]
    fn a_long_list_needs_a_larger_share_than_chance_gives() {
        let long = list("long", "Make", 0..400);
        let bus = bus((0..30).map(|id| (id, 8)).chain((1_000..1_070).map(|id| (id, 8))));
        let compared = bus.compare(&long).unwrap();
        assert!(compared.explained > 15 && !compared.is_of_platform(), "{compared:?}");
    }

    #[test]
    fn a_short_list_of_which_much_was_received_excludes_nothing() {
        let short = list("short", "Make", 0..9);
        let bus = |received: u16| bus((0..received).chain(1_000..1_100).map(|id| (id, 8)));
        assert!(!bus(2).compare(&short).unwrap().is_of_other_platform());
        assert!(bus(1).compare(&short).unwrap().is_of_other_platform());
    }

    #[test]
    fn a_platform_is_named_with_equal_lists_of_its_make() {
        let lists = [
            list("one", "Make", 0..40),
            list("worse", "Make", 0..20),
            list("equal", "Make", 0..45),
            list("other", "Other", 0..200),
            list("short", "Short", 900..910),
        ];
        let names = |bus: &Fingerprint| {
            bus.platforms(&lists).iter().map(|found| found.list.name.as_str()).collect::<Vec<_>>()
        };
        assert_eq!(names(&bus((0..40).chain(1_000..1_030).map(|id| (id, 8)))), ["one", "equal"]);
        assert_eq!(names(&bus((900..906).chain(1_000..1_014).map(|id| (id, 8)))), ["short"]);
        assert_eq!(names(&bus((900..904).chain(1_000..1_016).map(|id| (id, 8)))), Vec::<&str>::new());
        assert_eq!(names(&bus((0..5).chain(1_000..1_030).map(|id| (id, 8)))), Vec::<&str>::new());
    }
}
