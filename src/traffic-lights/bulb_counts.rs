//! Counts of lights for diagnostics, updated with each change.

use super::bulb::{BulbSet, BulbStatus, Color};

/// Counts of the lights of a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct BulbCounts {
    /// Lights that were ever touched, or are detected.
    pub(super) lights: u32,
    /// Lights without a lit bulb.
    pub(super) dark: u32,
    /// Lights with an unrecognised colour or status.
    pub(super) unknown: u32,
    /// Lights that show red and green at once.
    pub(super) contradictory: u32,
}

impl BulbCounts {
    pub(super) fn of(bulbs: Option<BulbSet>) -> Self {
        let Some(bulbs) = bulbs else { return Self::default() };
        let is_lit = bulbs.iter().any(|bulb| bulb.status.is_lit());
        let is_unknown =
            bulbs.iter().any(|bulb| bulb.color == Color::Unknown || bulb.status == BulbStatus::Unknown);
        Self {
            lights: 1,
            dark: u32::from(!is_lit),
            unknown: u32::from(is_unknown),
            contradictory: u32::from(bulbs.is_contradictory()),
        }
    }

    /// Returns the sum of both.
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            lights: self.lights + other.lights,
            dark: self.dark + other.dark,
            unknown: self.unknown + other.unknown,
            contradictory: self.contradictory + other.contradictory,
        }
    }

    pub(super) fn change(&mut self, from: Option<BulbSet>, to: Option<BulbSet>) {
        if from == to {
            return;
        }
        let (from, to) = (Self::of(from), Self::of(to));
        // `from` was counted before, so the difference does not fall below zero.
        self.lights = self.lights + to.lights - from.lights;
        self.dark = self.dark + to.dark - from.dark;
        self.unknown = self.unknown + to.unknown - from.unknown;
        self.contradictory = self.contradictory + to.contradictory - from.contradictory;
    }
}
