//! How many lights look like what, kept with each change: diagnostics need not look at all of them.

use super::bulb::{BulbSet, Color, Status};

/// Counts of the lights of a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct BulbCounts {
    /// Those ever touched, or detected.
    pub(super) lights: u32,
    /// Those of which no light comes out.
    pub(super) dark: u32,
    /// Those with a colour or status that is not recognised.
    pub(super) unknown: u32,
}

impl BulbCounts {
    /// One light.
    pub(super) fn of(bulbs: Option<BulbSet>) -> Self {
        let Some(bulbs) = bulbs else { return Self::default() };
        let is_lit = bulbs.iter().any(|bulb| bulb.status.is_lit());
        let is_unknown =
            bulbs.iter().any(|bulb| bulb.color == Color::Unknown || bulb.status == Status::Unknown);
        Self { lights: 1, dark: u32::from(!is_lit), unknown: u32::from(is_unknown) }
    }

    /// A light of these looked like the one and looks like the other now.
    pub(super) fn turn(&mut self, from: Option<BulbSet>, to: Option<BulbSet>) {
        if from == to {
            return;
        }
        let (from, to) = (Self::of(from), Self::of(to));
        // It was counted, so nothing falls below zero.
        self.lights = self.lights + to.lights - from.lights;
        self.dark = self.dark + to.dark - from.dark;
        self.unknown = self.unknown + to.unknown - from.unknown;
    }
}
