//! Faults of the groups of a message: missing, unknown, of another colour or confidence.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::draws::{Draws, Kind, Spell};
use super::{Confusion, FaultSettings, Spells};
use crate::core::traffic_light::bulb::{Bulb, Color, Status};
use crate::core::traffic_light::emission::{Element, GroupState};

#[derive(Debug, Clone)]
pub(super) struct GroupFaults {
    draws: Draws,
    miss: Spells,
    unknown: f64,
    confusions: Vec<Confusion>,
    confidence_mean: Option<f64>,
    confidence_spread: f64,
    /// The spells in which groups are missing, by relation id.
    missing: BTreeMap<i64, Spell>,
}

impl GroupFaults {
    pub(super) fn new(draws: Draws, settings: &FaultSettings) -> Self {
        Self {
            draws,
            miss: settings.miss,
            unknown: settings.unknown,
            confusions: settings.confusions.clone(),
            confidence_mean: settings.confidence_mean,
            confidence_spread: settings.confidence_spread,
            missing: BTreeMap::new(),
        }
    }

    /// Returns whether any fault of groups is on.
    pub(super) fn is_on(&self) -> bool {
        self.miss.probability > 0.0
            || self.unknown > 0.0
            || !self.confusions.is_empty()
            || self.changes_confidence()
    }

    pub(super) fn apply(&mut self, groups: &[Arc<GroupState>], message: u64) -> Vec<Arc<GroupState>> {
        let mut arriving = Vec::with_capacity(groups.len());
        for group in groups {
            let of = group.relation_id.cast_unsigned();
            let spell = self.missing.entry(group.relation_id).or_default();
            if !spell.goes_on(self.draws, self.miss, Kind::Miss, of, message) {
                arriving.push(Arc::new(self.misread(group, of, message)));
            }
        }
        arriving
    }

    fn misread(&self, group: &GroupState, of: u64, message: u64) -> GroupState {
        let is_unknown = self.draws.happens(self.unknown, Kind::Unknown, [of, 0], message);
        let misread = |element: &Element| {
            let draw = [of, u64::from(element.bulb.key())];
            let bulb = if is_unknown {
                Bulb { color: Color::Unknown, status: Status::Unknown, ..element.bulb }
            } else {
                Bulb { color: self.confused(element.bulb.color, draw, message), ..element.bulb }
            };
            Element { bulb, confidence: self.confidence(element.confidence, draw, message) }
        };
        let mut elements: Vec<_> = group.elements.iter().map(misread).collect();
        // Bulbs that have become equal are one.
        elements.sort_by_key(|element| element.bulb);
        elements.dedup_by_key(|element| element.bulb);
        GroupState { elements, ..group.clone() }
    }

    fn confused(&self, color: Color, draw: [u64; 2], message: u64) -> Color {
        let mut left = self.draws.share(Kind::Confusion, draw, message);
        for confusion in self.confusions.iter().filter(|confusion| confusion.from == color) {
            if left < confusion.probability {
                return confusion.to;
            }
            left -= confusion.probability;
        }
        color
    }

    fn confidence(&self, given: f64, draw: [u64; 2], message: u64) -> f64 {
        if !self.changes_confidence() {
            return given;
        }
        let noise = self.draws.normal(Kind::Confidence, draw, message) * self.confidence_spread;
        (self.confidence_mean.unwrap_or(given) + noise).clamp(0.0, 1.0)
    }

    fn changes_confidence(&self) -> bool {
        self.confidence_mean.is_some() || self.confidence_spread > 0.0
    }
}
