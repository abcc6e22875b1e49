//! Entering and leaving roundabouts (docs/spec/turn-signal-decider.md, "Roundabouts"): the state kept, and
//! the resulting record.

use std::collections::{BTreeMap, BTreeSet};

use super::decision_context::DecisionContext;
use super::intersection::next_in_queue;
use super::section::Section;
use super::side::Side;
use super::subject::SignalSubject;
use crate::light_command::TurnCommand;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::LaneId;

pub mod backward;
pub mod legs;

use legs::{Leaving, RoundaboutEntry, RoundaboutExit, RoundaboutLegs};

/// The poses at which signals at roundabouts began.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RoundaboutMemory {
    pub(super) entries: BTreeMap<LaneId, Pose>,
    exits: BTreeMap<LaneId, Pose>,
    /// Improved: the announced entries that are passed. A route that goes around once comes by them again
    /// (W20).
    passed: BTreeSet<LaneId>,
}

impl RoundaboutMemory {
    /// Returns the record of the next entry or exit, if one is in range.
    pub fn section(&mut self, context: &DecisionContext<'_>, legs: &RoundaboutLegs) -> Option<Section> {
        if !context.quirks.memory_survives_route {
            let is_entry = |id: &LaneId| legs.entries.iter().any(|entry| entry.lane.id == *id);
            self.entries.retain(|id, _| is_entry(id));
            self.passed.retain(is_entry);
            self.exits.retain(|id, _| legs.exits.iter().any(|exit| exit.lane.id == *id));
        }
        let mut records = Vec::new();
        let mut persistent = Vec::new();
        for entry in &legs.entries {
            let Some(record) = self.entry(context, entry) else { continue };
            records.push(record);
            persistent.extend(entry.leaving.filter(|_| context.parameters.roundabout_entry_persists));
        }
        let lasts_to = |exit: LaneId| persistent.iter().any(|leaving| leaving.lane == exit);
        let exits = legs.exits.iter().filter_map(|exit| self.exit(context, exit, lasts_to(exit.lane.id)));
        records.extend(exits);
        next_in_queue(&context.path_frame, records)
    }

    /// docs/spec/turn-signal-decider.md, "Roundabout entry". An entry that came within range stays announced.
    fn entry(&mut self, context: &DecisionContext<'_>, entry: &RoundaboutEntry) -> Option<Section> {
        let (lane, parameters) = (&entry.lane, context.parameters);
        if self.passed.contains(&lane.id) {
            return None;
        }
        let search_m =
            lane.search_distance_m.unwrap_or_else(|| parameters.roundabout_search_m(context.speed_mps));
        let in_range = context.path_frame.from_front_m(lane.front) < search_m;
        if !in_range && !self.entries.contains_key(&lane.id) {
            return None;
        }
        let start = *self.entries.entry(lane.id).or_insert(context.ego());
        let Some(side) = entry.side().or(parameters.roundabout_on_entry) else {
            self.entries.remove(&lane.id);
            return None;
        };
        let mut record = lane.section(SignalSubject::RoundaboutEntry(lane.id), side.into(), start);
        if let Some(leaving) = entry.leaving.filter(|_| parameters.roundabout_entry_persists) {
            record.desired_end = leaving.back;
        }
        if context.path_frame.from_base_m(record.desired_end) < 0.0 {
            self.entries.remove(&lane.id);
            if !context.quirks.ignores_height_and_continuity {
                self.passed.insert(lane.id);
            }
            return None;
        }
        Some(record)
    }

    /// docs/spec/turn-signal-decider.md, "Roundabout exit". By default an exit without a signal displaces
    /// nothing, and an exit without tags is announced as well (W10), unless the signal of the entry lasts
    /// until it.
    fn exit(
        &mut self,
        context: &DecisionContext<'_>,
        exit: &RoundaboutExit,
        entry_lasts: bool,
    ) -> Option<Section> {
        let (lane, path_frame) = (&exit.lane, &context.path_frame);
        if path_frame.from_base_m(lane.back) < 0.0 {
            self.exits.remove(&lane.id);
            return None;
        }
        let side = context.parameters.roundabout_on_exit;
        if side.is_none() && !context.quirks.overlooks_roundabout_exits {
            return None;
        }
        let announces_untagged =
            !exit.is_tagged && !entry_lasts && !context.quirks.overlooks_roundabout_exits;
        let start = match exit.after_previous.filter(|_| announces_untagged) {
            Some(after_previous) => {
                let near = path_frame.from_front_m(lane.front)
                    < context.parameters.roundabout_search_m(context.speed_mps.max(0.0));
                let begun = self.exits.contains_key(&lane.id)
                    || near && path_frame.from_front_m(after_previous) < 0.0;
                begun.then_some(context.ego())?
            }
            None => Some(exit.start).filter(|start| path_frame.from_front_m(*start) < 0.0)?,
        };
        let start = *self.exits.entry(lane.id).or_insert(start);
        let turn = side.map_or(TurnCommand::Disable, TurnCommand::from);
        Some(lane.section(SignalSubject::RoundaboutExit(lane.id), turn, start))
    }
}

impl RoundaboutEntry {
    /// Returns the side that the map assigns to the exit that will be taken.
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
