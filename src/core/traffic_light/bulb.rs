//! One lamp of a traffic light as it may look, and sets of them
//! (docs/spec/traffic-lights.md, "Bulbs and their numbers").
//!
//! The names and numbers here are the model's own; how ROS numbers them stands with the messages.

use std::fmt;

/// The colour of a lamp. The order is that of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Color {
    /// 0
    Green,
    /// 1; also called amber
    Yellow,
    /// 2
    Red,
    /// 3
    White,
    /// 4; not recognised
    Unknown,
}

/// The status of a lamp. The order is that of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Status {
    /// 0
    SolidOn,
    /// 1
    SolidOff,
    /// 2
    Flashing,
    /// 3; not recognised
    Unknown,
}

/// The shape of a lamp. The order is that of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Shape {
    /// 0x0000
    Circle,
    /// 0x0001
    Cross,
    /// 0x0003; not recognised
    Unknown,
    /// 0x0102
    Right,
    /// 0x0202; also called straight
    Up,
    /// 0x0302
    UpperRight,
    /// 0x0402
    Down,
    /// 0x0502
    LowerRight,
    /// 0x0802
    Left,
    /// 0x0A02
    UpperLeft,
    /// 0x0C02
    LowerLeft,
}

/// The kind of a shape: the low byte of its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Category {
    /// 0
    Circle,
    /// 1
    Cross,
    /// 2
    Arrow,
    /// 3
    Unknown,
}

impl Color {
    /// All, in order.
    pub const ALL: [Self; 5] = [Self::Green, Self::Yellow, Self::Red, Self::White, Self::Unknown];

    /// The name in state texts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Green => "green",
            Self::Yellow => "yellow",
            Self::Red => "red",
            Self::White => "white",
            Self::Unknown => "unknown",
        }
    }
}

impl Status {
    /// All, in order.
    pub const ALL: [Self; 4] = [Self::SolidOn, Self::SolidOff, Self::Flashing, Self::Unknown];

    /// The name in state texts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SolidOn => "solidOn",
            Self::SolidOff => "solidOff",
            Self::Flashing => "flashing",
            Self::Unknown => "unknown",
        }
    }

    /// Whether light comes out.
    pub const fn is_lit(self) -> bool {
        match self {
            Self::SolidOn | Self::Flashing => true,
            Self::SolidOff | Self::Unknown => false,
        }
    }
}

impl Shape {
    /// All, in order.
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

    /// The name in state texts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Circle => "circle",
            Self::Cross => "cross",
            Self::Unknown => "unknown",
            Self::Right => "right",
            Self::Up => "up",
            Self::UpperRight => "upperRight",
            Self::Down => "down",
            Self::LowerRight => "lowerRight",
            Self::Left => "left",
            Self::UpperLeft => "upperLeft",
            Self::LowerLeft => "lowerLeft",
        }
    }

    /// Direction bits (left 8, down 4, up 2, right 1) in the high byte, category in the low one.
    pub const fn number(self) -> u16 {
        match self {
            Self::Circle => 0x0000,
            Self::Cross => 0x0001,
            Self::Unknown => 0x0003,
            Self::Right => 0x0102,
            Self::Up => 0x0202,
            Self::UpperRight => 0x0302,
            Self::Down => 0x0402,
            Self::LowerRight => 0x0502,
            Self::Left => 0x0802,
            Self::UpperLeft => 0x0A02,
            Self::LowerLeft => 0x0C02,
        }
    }

    /// The kind of the shape.
    pub const fn category(self) -> Category {
        match self {
            Self::Circle => Category::Circle,
            Self::Cross => Category::Cross,
            Self::Unknown => Category::Unknown,
            Self::Right
            | Self::Up
            | Self::UpperRight
            | Self::Down
            | Self::LowerRight
            | Self::Left
            | Self::UpperLeft
            | Self::LowerLeft => Category::Arrow,
        }
    }
}

/// One lamp. The order is that of the sort key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Bulb {
    /// Colour of the light.
    pub color: Color,
    /// Whether and how it shines.
    pub status: Status,
    /// Outline of the lamp.
    pub shape: Shape,
}

impl Bulb {
    /// The sort key: colour << 24 | status << 16 | shape number.
    pub const fn key(self) -> u32 {
        (self.color as u32) << 24 | (self.status as u32) << 16 | self.shape.number() as u32
    }

    /// Position among all bulbs that can be, in the order of their keys.
    const fn position(self) -> usize {
        (self.color as usize * Status::ALL.len() + self.status as usize) * Shape::ALL.len()
            + self.shape as usize
    }

    const fn at(position: usize) -> Self {
        let (rest, shape) = (position / Shape::ALL.len(), position % Shape::ALL.len());
        let (color, status) = (rest / Status::ALL.len(), rest % Status::ALL.len());
        Self { color: Color::ALL[color], status: Status::ALL[status], shape: Shape::ALL[shape] }
    }
}

/// `<colour> <status> <shape>`, always all three.
impl fmt::Display for Bulb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.color.name(), self.status.name(), self.shape.name())
    }
}

/// A set of bulbs in the order of their keys. Small enough to be copied: one bit for each of the
/// 220 bulbs that can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct BulbSet([u64; 4]);

impl BulbSet {
    /// No bulb: dark, or not reported.
    pub const EMPTY: Self = Self([0; 4]);

    /// Adds a bulb; one that is there already changes nothing.
    pub const fn insert(&mut self, bulb: Bulb) {
        let position = bulb.position();
        self.0[position / 64] |= 1 << (position % 64);
    }

    /// Whether the bulb is in it.
    pub const fn contains(&self, bulb: Bulb) -> bool {
        let position = bulb.position();
        self.0[position / 64] >> (position % 64) & 1 == 1
    }

    /// Whether every bulb of `other` is in it.
    pub fn contains_all(&self, other: &Self) -> bool {
        self.0.iter().zip(&other.0).all(|(own, wanted)| own & wanted == *wanted)
    }

    /// All bulbs of both.
    pub fn union(self, other: Self) -> Self {
        let mut union = self;
        union.0.iter_mut().zip(other.0).for_each(|(bits, more)| *bits |= more);
        union
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        *self == Self::EMPTY
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// The bulbs, in the order of their keys.
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

/// The bulbs joined by `, `; nothing for the empty set.
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
            Status::ALL.into_iter().flat_map(move |status| {
                Shape::ALL.into_iter().map(move |shape| Bulb { color, status, shape })
            })
        })
    }

    #[test]
    fn a_set_lists_every_bulb_once_in_the_order_of_the_keys() {
        let mut given: Vec<_> = all().collect();
        given.reverse();
        let set: BulbSet = given.iter().copied().chain(all()).collect();
        let listed: Vec<_> = set.iter().collect();
        assert_eq!((listed.len(), set.len()), (220, 220));
        assert!(listed.windows(2).all(|pair| pair[0].key() < pair[1].key() && pair[0] < pair[1]));
    }

    #[test]
    fn a_set_holds_what_was_put_in_and_nothing_else() {
        for bulb in all() {
            let set: BulbSet = [bulb].into_iter().collect();
            assert_eq!(set.iter().collect::<Vec<_>>(), [bulb]);
            assert!(all().all(|other| set.contains(other) == (other == bulb)));
            assert!(set.contains_all(&BulbSet::EMPTY) && !BulbSet::EMPTY.contains_all(&set));
        }
    }

    #[test]
    fn sets_print_in_canonical_order_whatever_the_order_of_insertion() {
        let bulb = |color, shape| Bulb { color, status: Status::SolidOn, shape };
        let set: BulbSet =
            [bulb(Color::Red, Shape::Circle), bulb(Color::Green, Shape::Right)].into_iter().collect();
        assert_eq!(set.to_string(), "green solidOn right, red solidOn circle");
        assert_eq!(BulbSet::EMPTY.to_string(), "");
    }
}
