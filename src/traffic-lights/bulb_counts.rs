//! Counts of lights for diagnostics, updated with each change.

use derive_more::{Add, Sub};

use super::bulb::{BulbSet, BulbStatus, Color};

/// Counts of the lights of a store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Add, Sub)]
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

    pub(super) fn change(&mut self, from: Option<BulbSet>, to: Option<BulbSet>) {
        if from != to {
            // `from` was counted before, so the difference does not fall below zero.
            *self = *self + Self::of(to) - Self::of(from);
        }
    }
}
