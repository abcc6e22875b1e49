//! Entering and leaving roundabouts (turn-signal-decider section 3.2): what is remembered, and which
//! record comes of it.

use std::collections::BTreeMap;

use super::geometry::Pose;
use super::intersection::next_in_queue;
use super::road::LaneId;
use super::scene::Scene;
use super::section::Section;
use super::signal::{Side, Signal};

pub mod backward;
pub mod ways;

use ways::{Entry, Exit, Leaving, Ways};

/// Where signals at roundabouts began.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RoundaboutMemory {
    entries: BTreeMap<LaneId, Pose>,
    exits: BTreeMap<LaneId, Pose>,
}

impl RoundaboutMemory {
    /// The record of the entry or exit that is next, if one is in view.
    pub fn section(&mut self, scene: &Scene<'_>, ways: &Ways) -> Option<Section> {
        if !scene.is_compat() {
            self.entries.retain(|id, _| ways.entries.iter().any(|entry| entry.lane.id == *id));
            self.exits.retain(|id, _| ways.exits.iter().any(|exit| exit.lane.id == *id));
        }
        let entries = ways.entries.iter().filter_map(|entry| self.entry(scene, entry));
        let mut records: Vec<Section> = entries.collect();
        records.extend(ways.exits.iter().filter_map(|exit| self.exit(scene, exit)));
        next_in_queue(&scene.ruler, records)
    }

    /// Forgets all: the route is another one.
    pub fn clear(&mut self) {
        self.entries.clear();
        self.exits.clear();
    }

    /// Where the rear axle was when this entry came into view.
    pub fn entry_start(&self, lane: LaneId) -> Option<Pose> {
        self.entries.get(&lane).copied()
    }

    /// Section 3.2.3. An entry that came into view stays so.
    fn entry(&mut self, scene: &Scene<'_>, entry: &Entry) -> Option<Section> {
        let (lane, parameters) = (&entry.lane, scene.parameters);
        let search_m =
            lane.search_distance_m.unwrap_or_else(|| parameters.roundabout_search_m(scene.speed_mps));
        let in_view = scene.ruler.from_front_m(lane.front) < search_m;
        if !in_view && !self.entries.contains_key(&lane.id) {
            return None;
        }
        let start = *self.entries.entry(lane.id).or_insert(scene.ego());
        let Some(side) = entry.side().or(parameters.roundabout_on_entry) else {
            self.entries.remove(&lane.id);
            return None;
        };
        let mut record = lane.section(side.into(), start);
        if let Some(leaving) = entry.leaving.filter(|_| parameters.roundabout_entry_persists) {
            record.desired_end = leaving.back;
        }
        if scene.ruler.from_base_m(record.desired_end) < 0.0 {
            self.entries.remove(&lane.id);
            return None;
        }
        Some(record)
    }

    /// Section 3.2.4. By default an exit without a signal displaces nothing, and one without tags is
    /// announced as well (W10).
    fn exit(&mut self, scene: &Scene<'_>, exit: &Exit) -> Option<Section> {
        let (lane, ruler) = (&exit.lane, &scene.ruler);
        if ruler.from_base_m(lane.back) < 0.0 {
            self.exits.remove(&lane.id);
            return None;
        }
        let side = scene.parameters.roundabout_on_exit;
        if side.is_none() && !scene.is_compat() {
            return None;
        }
        let start = match exit.after_previous.filter(|_| !exit.is_tagged && !scene.is_compat()) {
            Some(after_previous) => {
                let near = ruler.from_front_m(lane.front)
                    < scene.parameters.roundabout_search_m(scene.speed_mps.max(0.0));
                let begun =
                    self.exits.contains_key(&lane.id) || near && ruler.from_front_m(after_previous) < 0.0;
                begun.then_some(scene.ego())?
            }
            None => Some(exit.start).filter(|start| ruler.from_front_m(*start) < 0.0)?,
        };
        let start = *self.exits.entry(lane.id).or_insert(start);
        Some(lane.section(side.map_or(Signal::Disable, Signal::from), start))
    }
}

impl Entry {
    /// The side the map asks for, by the exit that will be taken.
    fn side(&self) -> Option<Side> {
        let Leaving { lane, .. } = self.leaving?;
        if self.exits_left.contains(&lane) {
            Some(Side::Left)
        } else if self.exits_right.contains(&lane) {
            Some(Side::Right)
        } else {
            None
        }
    }
}
