//! One lamp of a traffic light with its appearance, and sets of lamps
//! (docs/spec/traffic-lights.md, "Bulbs and their numbers").
//!
//! The numbers here are the model's own; the ROS numbers are defined with the messages.

use std::fmt;

use derive_more::Display;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The colour of a lamp. Its number counts from 0, and is the highest byte of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Color {
    /// Green, as for "go".
    Green,
    /// Yellow, also called amber.
    Yellow,
    /// Red, as for "stop".
    Red,
    /// White, as for trams.
    White,
    /// A colour that was not recognised.
    Unknown,
}

/// The status of a lamp. Its number counts from 0, and is the second byte of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "camelCase")]
pub enum BulbStatus {
    /// The lamp is on all the time.
    SolidOn,
    /// The lamp is off.
    SolidOff,
    /// The lamp is on at intervals.
    Flashing,
    /// A status that was not recognised.
    Unknown,
}

/// The shape of a lamp, with its number in the sort key: the directions of an arrow (left 8, down 4, up 2,
/// right 1) in the high byte, the kind of shape (circle 0, cross 1, arrow 2, unknown 3) in the low one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "camelCase")]
pub enum BulbShape {
    /// A disc, the usual shape.
    Circle = 0x0000,
    /// A cross, as for a closed lane.
    Cross = 0x0001,
    /// A shape that was not recognised.
    Unknown = 0x0003,
    /// Arrow to the right.
    Right = 0x0102,
    /// An arrow straight ahead.
    Up = 0x0202,
    /// Arrow ahead to the right.
    UpperRight = 0x0302,
    /// An arrow that points downwards.
    Down = 0x0402,
    /// Arrow down to the right.
    LowerRight = 0x0502,
    /// Arrow to the left.
    Left = 0x0802,
    /// Arrow ahead to the left.
    UpperLeft = 0x0A02,
    /// Arrow down to the left.
    LowerLeft = 0x0C02,
}

impl Color {
    /// All colours, in the order of their numbers.
    pub const ALL: [Self; 5] = [Self::Green, Self::Yellow, Self::Red, Self::White, Self::Unknown];
}

impl BulbStatus {
    /// All statuses, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::SolidOn, Self::SolidOff, Self::Flashing, Self::Unknown];

    /// Returns whether the lamp is on, at least intermittently.
    pub const fn is_lit(self) -> bool {
        matches!(self, Self::SolidOn | Self::Flashing)
    }
}

impl BulbShape {
    /// All shapes, in the order of their numbers.
    pub const ALL: [Self; 11] = [
        Self::Circle,
        Self::Cross,
        Self::Unknown,
        Self::Right,
        Self::Up,
        Self::UpperRight,
        Self::Down,
        Self::LowerRight,
        Self::Left,
        Self::UpperLeft,
        Self::LowerLeft,
    ];

    /// Returns whether the shape has a direction.
    pub const fn is_arrow(self) -> bool {
        self as u32 & 0xFF == 2
    }
}

/// One lamp of a head. Lamps are ordered by their sort key.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema, Display,
)]
// Written as it is read: always all three.
#[display("{} {} {}", self.color.name(), self.status.name(), self.shape.name())]
pub struct Bulb {
    /// Colour of the light.
    pub color: Color,
    /// On, off or flashing.
    pub status: BulbStatus,
    /// Outline of the lamp.
    pub shape: BulbShape,
}

impl Bulb {
    /// Returns the sort key: colour << 24 | status << 16 | shape number.
    pub const fn key(self) -> u32 {
        (self.color as u32) << 24 | (self.status as u32) << 16 | self.shape as u32
    }

    /// Returns its bit in a [`BulbSet`]: bulbs are numbered in the order of their keys.
    fn position(self) -> usize {
        let shape = BulbShape::ALL.iter().position(|shape| *shape == self.shape).unwrap_or_default();
        (self.color as usize * BulbStatus::ALL.len() + self.status as usize) * BulbShape::ALL.len() + shape
    }

    const fn at(position: usize) -> Self {
        let (rest, shape) = (position / BulbShape::ALL.len(), position % BulbShape::ALL.len());
        let (color, status) = (rest / BulbStatus::ALL.len(), rest % BulbStatus::ALL.len());
        Self { color: Color::ALL[color], status: BulbStatus::ALL[status], shape: BulbShape::ALL[shape] }
    }
}

/// A set of bulbs in the order of their keys. It is cheap to copy: one bit for each of the 220 possible
/// bulbs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct BulbSet([u64; 4]);

impl BulbSet {
    /// No bulb: dark, or not reported.
    pub const EMPTY: Self = Self([0; 4]);

    /// Adds a bulb; does nothing if the set already contains it.
    pub fn insert(&mut self, bulb: Bulb) {
        let position = bulb.position();
        self.0[position / 64] |= 1 << (position % 64);
    }

    /// Returns whether the set has this bulb.
    pub fn contains(&self, bulb: Bulb) -> bool {
        let position = bulb.position();
        self.0[position / 64] >> (position % 64) & 1 == 1
    }

    /// Returns whether the set has every bulb of `other`.
    pub fn contains_all(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(own, other)| own & other == *other)
    }

    /// Returns the bulbs of both sets.
    pub fn union(self, other: Self) -> Self {
        let mut union = self;
        union.0.iter_mut().zip(other.0).for_each(|(bits, more)| *bits |= more);
        union
    }

    /// Returns whether the set has no bulb.
    pub fn is_empty(&self) -> bool {
        *self == Self::EMPTY
    }

    /// Returns the number of bulbs.
    pub fn len(&self) -> usize {
        self.0.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// Returns whether a circle of this colour is lit.
    pub fn shows_circle(self, color: Color) -> bool {
        let is_shown =
            |bulb: Bulb| bulb.color == color && bulb.shape == BulbShape::Circle && bulb.status.is_lit();
        self.iter().any(is_shown)
    }

    /// Returns whether a red and a green circle are lit. A red circle with a green arrow is usual.
    pub fn is_contradictory(self) -> bool {
        self.shows_circle(Color::Red) && self.shows_circle(Color::Green)
    }

    /// Returns the bulbs in the order of their keys.
    pub fn iter(&self) -> impl Iterator<Item = Bulb> + use<> {
        let mut words = self.0;
        std::iter::from_fn(move || {
            let word = words.iter().position(|bits| *bits != 0)?;
            let bit = words[word].trailing_zeros() as usize;
            words[word] &= words[word] - 1;
            Some(Bulb::at(word * 64 + bit))
        })
    }
}

impl FromIterator<Bulb> for BulbSet {
    fn from_iter<I: IntoIterator<Item = Bulb>>(bulbs: I) -> Self {
        let mut set = Self::EMPTY;
        bulbs.into_iter().for_each(|bulb| set.insert(bulb));
        set
    }
}

/// Prints the bulbs joined by `, `; nothing for the empty set.
impl fmt::Display for BulbSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        self.iter().try_for_each(|bulb| {
            let written = write!(f, "{separator}{bulb}");
            separator = ", ";
            written
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> impl Iterator<Item = Bulb> {
        Color::ALL.into_iter().flat_map(|color| {
            BulbStatus::ALL.into_iter().flat_map(move |status| {
                BulbShape::ALL.into_iter().map(move |shape| Bulb { color, status, shape })
            })
        })
    }

    #[test]
    fn a_set_lists_every_bulb_once_in_the_order_of_the_keys() {
        let mut reversed: Vec<_> = all().collect();
        reversed.reverse();
        let set: BulbSet = reversed.into_iter().chain(all()).collect();
        let listed: Vec<_> = set.iter().collect();
        assert_eq!((listed.len(), set.len()), (220, 220));
        assert!(listed.windows(2).all(|pair| pair[0].key() < pair[1].key() && pair[0] < pair[1]));
    }

    #[test]
    fn a_set_has_its_bulbs_and_no_others() {
        for bulb in all() {
            let set: BulbSet = [bulb].into_iter().collect();
            assert_eq!(set.iter().collect::<Vec<_>>(), [bulb]);
            assert!(all().all(|other| set.contains(other) == (other == bulb)));
            assert!(set.contains_all(&BulbSet::EMPTY) && !BulbSet::EMPTY.contains_all(&set));
        }
    }

    #[test]
    fn sets_print_in_canonical_order_whatever_the_order_of_insertion() {
        let bulb = |color, shape| Bulb { color, status: BulbStatus::SolidOn, shape };
        let set: BulbSet =
            [bulb(Color::Red, BulbShape::Circle), bulb(Color::Green, BulbShape::Right)].into_iter().collect();
        assert_eq!(set.to_string(), "green solidOn right, red solidOn circle");
        assert_eq!(BulbSet::EMPTY.to_string(), "");
    }
}
