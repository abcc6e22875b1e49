//! Faults of the groups of a message: missing, unknown, of another colour or confidence.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::draws::{DrawKind, Draws, Spell};
use super::settings::FaultSettings;
use crate::bulb::{Bulb, BulbStatus, Color};
use crate::emission::{GroupElement, GroupState};

#[derive(Debug, Clone)]
pub(super) struct GroupFaults {
    draws: Draws,
    /// The spells in which groups are missing, by relation id.
    missing: BTreeMap<i64, Spell>,
}

impl GroupFaults {
    pub(super) fn new(draws: Draws) -> Self {
        Self { draws, missing: BTreeMap::new() }
    }

    pub(super) fn apply(
        &mut self,
        settings: &FaultSettings,
        groups: &[Arc<GroupState>],
        message: u64,
    ) -> Vec<Arc<GroupState>> {
        let mut arriving = Vec::with_capacity(groups.len());
        for group in groups {
            let of = group.relation_id.cast_unsigned();
            let spell = self.missing.entry(group.relation_id).or_default();
            if !spell.goes_on(self.draws, settings.miss, DrawKind::Miss, of, message) {
                arriving.push(Arc::new(misread(self.draws, settings, group, message)));
            }
        }
        arriving
    }
}

fn misread(draws: Draws, settings: &FaultSettings, group: &GroupState, message: u64) -> GroupState {
    let of = group.relation_id.cast_unsigned();
    let is_unknown = draws.happens(settings.unknown, DrawKind::Unknown, [of, 0], message);
    let misread = |element: &GroupElement| {
        let draw = [of, u64::from(element.bulb.key())];
        let color =
            || confused(element.bulb.color, draws.share(DrawKind::Confusion, draw, message), settings);
        let bulb = if is_unknown {
            Bulb { color: Color::Unknown, status: BulbStatus::Unknown, ..element.bulb }
        } else {
            Bulb { color: color(), ..element.bulb }
        };
        let noise = || draws.normal(DrawKind::Confidence, draw, message) * settings.confidence_spread;
        let confidence = if settings.change_confidence() {
            (settings.confidence_mean.unwrap_or(element.confidence) + noise()).clamp(0.0, 1.0)
        } else {
            element.confidence
        };
        GroupElement { bulb, confidence }
    };
    let mut elements: Vec<_> = group.elements.iter().map(misread).collect();
    // Bulbs that have become equal are merged.
    elements.sort_by_key(|element| element.bulb);
    elements.dedup_by_key(|element| element.bulb);
    GroupState { elements, ..group.clone() }
}

/// Returns the colour with which a colour is confused. `share` is a draw from 0 to 1.
fn confused(color: Color, mut share: f64, settings: &FaultSettings) -> Color {
    for confusion in settings.confusions.iter().filter(|confusion| confusion.from == color) {
        if share < confusion.probability {
            return confusion.to;
        }
        share -= confusion.probability;
    }
    color
}
