//! Selects the frames of a message: frames with one identifier, or frames of a J1939 parameter group from
//! some senders.

use std::fmt;

use super::frame::CanId;

/// Bits of a 29-bit identifier that hold the sender's address.
const SOURCE: u32 = 0xFF;
/// Bits that hold the destination of a PDU1 message, and the group extension of a PDU2 message.
const PDU_SPECIFIC: u32 = 0xFF00;
/// Extended data page, data page, PDU format and PDU specific: all bits except priority and sender.
const GROUP: u32 = 0x03FF_FF00;
/// Lowest PDU format of a broadcast message (PDU2); lower formats have one destination (PDU1).
const LOWEST_PDU2: u32 = 240;
/// Largest number of listed senders that get one kernel filter each; a longer list gets one filter for all
/// senders.
const MAX_SOURCE_FILTERS: u32 = 8;

/// Selects the frames of a message by their identifiers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct IdMatch {
    described: CanId,
    /// Accepted senders of an SAE J1939 message, whose frames may have any priority and, for PDU1, any
    /// destination. `None` = only the described identifier.
    sources: Option<SourceAddresses>,
}

/// A parameter group number: 18 bits, of which the lowest eight are zero for PDU1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pgn(u32);

/// A set of source addresses.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SourceAddresses([u64; 4]);

/// Bits of an identifier that a kernel filter compares: a frame passes if its identifier equals `id` in the
/// bits of `mask`. Both identifiers have the same length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IdMask {
    /// Identifier to compare with.
    pub id: CanId,
    /// Bits that are compared; bits outside are ignored.
    pub mask: u32,
}

impl Pgn {
    /// Returns the parameter group of a 29-bit identifier; `None` for an 11-bit identifier.
    pub fn of(id: CanId) -> Option<Self> {
        let CanId::Extended(id) = id else { return None };
        let group = if is_pdu2(id) { id & GROUP } else { id & GROUP & !PDU_SPECIFIC };
        Some(Self(group >> 8))
    }

    /// Returns the bits of an identifier that hold the group, without priority, destination and sender.
    fn mask(self) -> u32 {
        if is_pdu2(self.0 << 8) { GROUP } else { GROUP & !PDU_SPECIFIC }
    }
}

fn is_pdu2(id: u32) -> bool {
    (id >> 16) & 0xFF >= LOWEST_PDU2
}

/// Returns the source address of a 29-bit identifier of J1939; `None` for an 11-bit identifier.
pub fn source_address(id: CanId) -> Option<u8> {
    match id {
        CanId::Standard(_) => None,
        CanId::Extended(id) => u8::try_from(id & SOURCE).ok(),
    }
}

/// Formats the group in hexadecimal, like identifiers: `FDCC`.
impl fmt::Display for Pgn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}", self.0)
    }
}

impl SourceAddresses {
    /// Every address.
    pub const ANY: Self = Self([u64::MAX; 4]);

    /// Returns true if frames from this sender are accepted.
    pub fn contains(self, address: u8) -> bool {
        self.0[usize::from(address / 64)] >> (address % 64) & 1 == 1
    }

    /// Returns the number of addresses.
    pub fn count(self) -> u32 {
        self.0.iter().map(|part| part.count_ones()).sum()
    }

    /// Returns the addresses, ascending.
    pub fn iter(self) -> impl Iterator<Item = u8> {
        (0..=u8::MAX).filter(move |address| self.contains(*address))
    }
}

impl FromIterator<u8> for SourceAddresses {
    fn from_iter<T: IntoIterator<Item = u8>>(addresses: T) -> Self {
        let mut set = [0; 4];
        for address in addresses {
            set[usize::from(address / 64)] |= 1 << (address % 64);
        }
        Self(set)
    }
}

/// Formats `any source address`, or the addresses in hexadecimal: `source address 27, 28`.
impl fmt::Display for SourceAddresses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Self::ANY {
            return f.write_str("any source address");
        }
        f.write_str("source address ")?;
        self.iter().enumerate().try_for_each(|(at, address)| {
            let separator = if at == 0 { "" } else { ", " };
            write!(f, "{separator}{address:02X}")
        })
    }
}

impl fmt::Debug for SourceAddresses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl From<CanId> for IdMatch {
    fn from(id: CanId) -> Self {
        Self { described: id, sources: None }
    }
}

/// Formats the identifier, or the group with its senders: `PGN FDCC from any source address`.
impl fmt::Display for IdMatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.group() {
            None => self.described.fmt(f),
            Some((pgn, sources)) => write!(f, "PGN {pgn} from {sources}"),
        }
    }
}

impl IdMatch {
    /// Creates the match of a J1939 message that a DBC describes with the identifier `id`; `None` for an
    /// 11-bit identifier.
    pub fn j1939(id: CanId, sources: SourceAddresses) -> Option<Self> {
        Pgn::of(id).map(|_| Self { described: id, sources: Some(sources) })
    }

    /// Returns the identifier of the message in the DBC.
    pub fn described(self) -> CanId {
        self.described
    }

    /// Returns the parameter group and the senders; `None` for a message with one identifier.
    fn group(self) -> Option<(Pgn, SourceAddresses)> {
        Some((Pgn::of(self.described)?, self.sources?))
    }

    /// Returns true if frames with this identifier belong to the message.
    #[inline]
    pub fn contains(&self, id: CanId) -> bool {
        self.described == id && self.sources.is_none() || self.sources.is_some() && self.group_contains(id)
    }

    /// Returns true if the message has a group to which frames with this identifier belong.
    fn group_contains(&self, id: CanId) -> bool {
        self.group().is_some_and(|(pgn, sources)| {
            Pgn::of(id) == Some(pgn) && source_address(id).is_some_and(|address| sources.contains(address))
        })
    }

    /// Returns true if frames with this identifier belong to the message, or would with an identifier of the
    /// other length, or with another J1939 priority, destination or sender.
    #[inline]
    pub fn resembles(&self, id: CanId) -> bool {
        self.contains(id)
            || self.described.number() == id.number()
            || Pgn::of(self.described).is_some_and(|pgn| Pgn::of(id) == Some(pgn))
    }

    /// Returns true if a frame can belong to both messages.
    pub fn overlaps(self, other: Self) -> bool {
        match (self.group(), other.group()) {
            (None, _) => other.contains(self.described),
            (_, None) => self.contains(other.described),
            (Some((pgn, sources)), Some((other, others))) => {
                pgn == other && sources.iter().any(|address| others.contains(address))
            }
        }
    }

    /// Returns true if the message may come from several senders.
    pub fn has_several_senders(self) -> bool {
        self.sources.is_some_and(|sources| sources.count() > 1)
    }

    /// Returns kernel filters that together pass every frame of the message, and as few others as possible.
    pub fn masks(self) -> Vec<IdMask> {
        let Some((pgn, sources)) = self.group() else {
            let mask = match self.described {
                CanId::Standard(_) => 0x7FF,
                CanId::Extended(_) => 0x1FFF_FFFF,
            };
            return vec![IdMask { id: self.described, mask }];
        };
        let (group, mask) = (pgn.0 << 8, pgn.mask());
        if sources.count() > MAX_SOURCE_FILTERS {
            return vec![IdMask { id: CanId::Extended(group), mask }];
        }
        let of_source =
            |address: u8| IdMask { id: CanId::Extended(group | u32::from(address)), mask: mask | SOURCE };
        sources.iter().map(of_source).collect()
    }
}

/// Values looked up by the identifier of a frame.
#[derive(Debug, Clone)]
pub struct IdTable<T> {
    /// Values for one identifier, ascending by its [`key`].
    exact: Vec<(u32, T)>,
    groups: Vec<(IdMatch, T)>,
}

/// Returns the identifier as one number, which is quick to compare; 29-bit identifiers sort after 11-bit
/// identifiers.
#[inline]
fn key(id: CanId) -> u32 {
    match id {
        CanId::Standard(id) => u32::from(id),
        CanId::Extended(id) => 1 << 31 | id,
    }
}

impl<T> FromIterator<(IdMatch, T)> for IdTable<T> {
    fn from_iter<I: IntoIterator<Item = (IdMatch, T)>>(values: I) -> Self {
        let mut table = Self { exact: Vec::new(), groups: Vec::new() };
        for (ids, value) in values {
            match ids.sources {
                None => table.exact.push((key(ids.described), value)),
                Some(_) => table.groups.push((ids, value)),
            }
        }
        table.exact.sort_by_key(|(key, _)| *key);
        table
    }
}

impl<T> IdTable<T> {
    /// Returns the values for frames with this identifier, values of groups last.
    pub fn get(&self, id: CanId) -> impl Iterator<Item = &T> {
        self.exact(id).map(|(_, value)| value).chain(self.groups(id))
    }

    /// Creates a table for [`Self::get_merged`], in which the value of each identifier is already `merge`d
    /// with the values of the groups that contain the identifier.
    pub fn merged(values: impl IntoIterator<Item = (IdMatch, T)>, merge: impl Fn(T, T) -> T) -> Self
    where
        T: Copy,
    {
        let values: Vec<_> = values.into_iter().collect();
        let (groups, exact): (Vec<_>, Vec<_>) =
            values.into_iter().partition(|(ids, _)| ids.sources.is_some());
        let of_groups = |ids: IdMatch| groups.iter().filter(move |(group, _)| group.contains(ids.described));
        let exact = exact.into_iter().map(|(ids, value)| {
            (ids, of_groups(ids).fold(value, |merged, (_, of_group)| merge(merged, *of_group)))
        });
        exact.chain(groups.iter().copied()).collect()
    }

    /// Returns the merged value for frames with this identifier, from a table made by [`Self::merged`].
    pub fn get_merged(&self, id: CanId, merge: impl Fn(T, T) -> T) -> Option<T>
    where
        T: Copy,
    {
        let exact = self.exact(id).next().map(|(_, value)| *value);
        exact.or_else(|| self.groups(id).copied().reduce(merge))
    }

    fn exact(&self, id: CanId) -> impl Iterator<Item = &(u32, T)> {
        let key = key(id);
        let first = self.exact.partition_point(|(known, _)| *known < key);
        self.exact[first..].iter().take_while(move |(known, _)| *known == key)
    }

    fn groups(&self, id: CanId) -> impl Iterator<Item = &T> {
        // An 11-bit identifier belongs to no group.
        let groups = if matches!(id, CanId::Extended(_)) { self.groups.as_slice() } else { &[] };
        groups.iter().filter(move |(ids, _)| ids.contains(id)).map(|(_, value)| value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn group(id: u32, sources: SourceAddresses) -> IdMatch {
        IdMatch::j1939(CanId::Extended(id), sources).unwrap()
    }

    #[test]
    fn group_of_pdu1_leaves_out_the_destination_and_of_pdu2_has_the_extension() {
        let of = |id| Pgn::of(CanId::Extended(id)).map(|pgn| pgn.to_string());
        assert_eq!(of(0x0CFD_CC27).as_deref(), Some("FDCC"));
        assert_eq!(of(0x18EF_2127).as_deref(), Some("EF00"));
        assert_eq!(of(0x19EF_2127).as_deref(), Some("1EF00"));
        assert_eq!(Pgn::of(CanId::Standard(0x127)), None);
        let pdu1 = group(0x18EF_2127, SourceAddresses::ANY);
        let pdu2 = group(0x0CFD_CC27, [0x27].into_iter().collect());
        for (ids, id, expected) in [
            (pdu1, 0x00EF_FF00, true),
            (pdu1, 0x1CEF_2127, true),
            (pdu1, 0x18EE_2127, false),
            (pdu1, 0x19EF_2127, false),
            (pdu2, 0x18FD_CC27, true),
            (pdu2, 0x18FD_CC28, false),
            (pdu2, 0x18FD_CD27, false),
        ] {
            assert_eq!(ids.contains(CanId::Extended(id)), expected, "{ids} {id:08X}");
        }
        assert!(!pdu1.contains(CanId::Standard(0x127)));
    }

    #[test]
    fn matches_are_shown_with_their_senders() {
        assert_eq!(IdMatch::from(CanId::Standard(0x12)).to_string(), "012");
        assert_eq!(group(0x0CFD_CC27, SourceAddresses::ANY).to_string(), "PGN FDCC from any source address");
        let listed = group(0x0CFD_CC27, [0x28, 0x03].into_iter().collect());
        assert_eq!(listed.to_string(), "PGN FDCC from source address 03, 28");
        assert!(listed.has_several_senders());
        assert!(!group(0x0CFD_CC27, [3].into_iter().collect()).has_several_senders());
        assert_eq!(IdMatch::j1939(CanId::Standard(0x12), SourceAddresses::ANY), None);
    }

    #[test]
    fn merged_table_has_one_value_for_an_identifier_and_the_groups_that_have_it() {
        let values = [
            (group(0x18EF_2127, SourceAddresses::ANY), 1),
            (CanId::Extended(0x18EF_2127).into(), 2),
            (CanId::Standard(0x127).into(), 4),
            (group(0x18EF_2127, [0x28].into_iter().collect()), 8),
        ];
        let table = IdTable::merged(values, |one, other| one + other);
        let of = |id| table.get_merged(id, |one, other| one + other);
        let ids = [0x18EF_2127, 0x1CEF_2128, 0x18EF_2129, 0x18EE_2127].map(CanId::Extended);
        assert_eq!(ids.map(of), [Some(3), Some(9), Some(1), None]);
        assert_eq!([0x127, 0x128].map(|id| of(CanId::Standard(id))), [Some(4), None]);
    }

    fn any_match() -> impl Strategy<Value = IdMatch> {
        let sources = prop_oneof![
            Just(SourceAddresses::ANY),
            prop::collection::vec(any::<u8>(), 1..12).prop_map(|list| list.into_iter().collect()),
        ];
        prop_oneof![
            (0..0x800_u32).prop_map(|id| IdMatch::from(CanId::standard(id).unwrap())),
            (0..0x2000_0000_u32).prop_map(|id| IdMatch::from(CanId::Extended(id))),
            (0..0x2000_0000_u32, sources).prop_map(|(id, sources)| group(id, sources)),
        ]
    }

    proptest! {
        #[test]
        fn kernel_filters_pass_every_identifier_of_the_message(
            ids in any_match(),
            noise in 0..0x2000_0000_u32,
            kept in any::<u32>(),
        ) {
            // An identifier near the match: noise in the bits that J1939 leaves free, and sometimes in
            // others.
            let free = if ids.group().is_some() { noise & 0x1C00_FFFF & kept } else { 0 };
            let near = ids.described().number() ^ free;
            for id in [CanId::extended(near), CanId::standard(near & 0x7FF), CanId::extended(noise)] {
                let id = id.unwrap();
                let passes = |filter: &IdMask| {
                    std::mem::discriminant(&filter.id) == std::mem::discriminant(&id)
                        && filter.id.number() & filter.mask == id.number() & filter.mask
                };
                let passes = ids.masks().iter().any(passes);
                prop_assert!(passes || !ids.contains(id), "{ids} {id}");
                let is_exact = ids.sources.is_none_or(|sources| sources.count() <= MAX_SOURCE_FILTERS);
                prop_assert!(!(is_exact || ids.sources == Some(SourceAddresses::ANY)) || passes == ids.contains(id));
                prop_assert_eq!(ids.contains(id), ids.overlaps(id.into()));
                let table: IdTable<()> = [(ids, ()), (CanId::Standard(0x7FF).into(), ())].into_iter().collect();
                let found = usize::from(ids.contains(id)) + usize::from(id == CanId::Standard(0x7FF));
                prop_assert_eq!(table.get(id).count(), found);
            }
        }
    }
}
