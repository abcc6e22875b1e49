//! What V2I announces of phases to come (docs/spec/traffic-lights.md, "Predictions").
//!
//! Improved mode announces what will be sent: a head's V2I states, a detection before the truth, or the copied
//! conventional state. Upstream has quirks of its own, kept apart below (Q5, Q10, Q11).

use std::collections::BTreeMap;
use std::time::Duration;

use super::bulb::{Bulb, BulbSet};
use super::change_log::ChangeLog;
use super::controller::{ControllerState, upstream_cycle_s};
use super::quirks::UpstreamQuirks;
use super::refusal::Refusal;
use super::scenario::{Controller, Phase, StateText};
use super::store::heads_of;
use super::sync::SyncedStores;
use super::target::{Channel, Layer};
use crate::core::map::light_map::HeadIndex;
use crate::core::time::WallStamp;

/// How many phases are looked ahead.
const PHASES_AHEAD: usize = 6;
/// Predictions of one head closer than this are one.
pub(super) const SAME_TIME: Duration = Duration::from_millis(10);

/// How heads will look.
#[derive(Debug, Clone)]
pub(super) struct Predictions {
    quirks: UpstreamQuirks,
    by_head: BTreeMap<HeadIndex, Announced>,
    /// Heads each controller announced last.
    by_controller: Vec<Vec<HeadIndex>>,
    change_log: ChangeLog,
}

#[derive(Debug, Clone)]
struct Announced {
    controller: usize,
    list: Vec<Predicted>,
}

/// How one head will look from then on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Predicted {
    pub(super) at: WallStamp,
    /// In order; upstream may have the same one twice.
    pub(super) bulbs: Vec<Bulb>,
}

impl Predictions {
    pub(super) fn new(controllers: usize, heads: usize, quirks: UpstreamQuirks) -> Self {
        let by_controller = vec![Vec::new(); controllers];
        Self { quirks, by_head: BTreeMap::new(), by_controller, change_log: ChangeLog::new(heads) }
    }

    /// The predictions of a head, ascending by time.
    pub(super) fn of(&self, head: HeadIndex) -> &[Predicted] {
        self.by_head.get(&head).map_or(&[], |announced| &announced.list)
    }

    /// The heads whose predictions may have changed.
    pub(super) fn change_log(&self) -> &ChangeLog {
        &self.change_log
    }

    /// Forgets all predictions.
    pub(super) fn clear(&mut self) {
        for head in self.by_head.keys() {
            self.change_log.add(*head);
        }
        self.by_head.clear();
    }

    /// Announces what follows the phase that a controller is in. Forgets what it announced before;
    /// upstream forgets what any controller did.
    pub(super) fn renew(
        &mut self,
        index: usize,
        controller: &Controller,
        state: &ControllerState,
        lights: &SyncedStores,
    ) -> Result<(), Refusal> {
        let Some(phase) = state.phase else { return Ok(()) };
        if self.quirks.renews_predictions_late {
            self.clear();
        }
        for head in self.by_controller.get_mut(index).map(std::mem::take).into_iter().flatten() {
            if self.by_head.get(&head).is_some_and(|announced| announced.controller == index) {
                self.by_head.remove(&head);
                self.change_log.add(head);
            }
        }
        let announce = if self.quirks.predicts_single_bulbs { announce_upstream } else { announce };
        let mut found = BTreeMap::new();
        let outcome = announce(controller, phase, state.start_wall, lights, &mut found);
        // Upstream keeps what it found before a mistake.
        if outcome.is_err() && !self.quirks.predicts_single_bulbs {
            return outcome;
        }
        if let Some(heads) = self.by_controller.get_mut(index) {
            heads.extend(found.keys());
        }
        self.take(index, found);
        outcome
    }

    fn take(&mut self, controller: usize, found: BTreeMap<HeadIndex, Vec<Predicted>>) {
        for head in found.keys() {
            self.change_log.add(*head);
        }
        let announced = found.into_iter().map(|(head, list)| (head, Announced { controller, list }));
        self.by_head.extend(announced);
    }
}

fn announce(
    controller: &Controller,
    phase: usize,
    start: WallStamp,
    lights: &SyncedStores,
    found: &mut BTreeMap<HeadIndex, Vec<Predicted>>,
) -> Result<(), Refusal> {
    let Some(mut offset) = controller.phases.get(phase).and_then(|phase| phase.duration) else {
        return Ok(());
    };
    let mut known = BTreeMap::new();
    for visited in controller.phases.iter().cycle().skip(phase + 1).take(PHASES_AHEAD) {
        known.extend(states(visited, lights)?);
        for (head, bulbs) in &known {
            add(found.entry(*head).or_default(), start.after(offset), bulbs.iter());
        }
        let Some(duration) = visited.duration else { break };
        offset = offset.saturating_add(duration);
    }
    // One bulb twice in what begins at the same time is one bulb.
    for predicted in found.values_mut().flatten() {
        predicted.bulbs = predicted.bulbs.drain(..).collect::<BulbSet>().iter().collect();
    }
    Ok(())
}

/// The future V2I state of each head that a phase names, in one way or the other.
fn states(phase: &Phase, lights: &SyncedStores) -> Result<BTreeMap<HeadIndex, BulbSet>, Refusal> {
    let (mut copied, mut truth, mut detected) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    for entry in &phase.entries {
        for head in heads_of(lights.stores().map(), entry.target.id)? {
            let store = entry.target.store;
            let known = match (store.channel, store.layer) {
                (Channel::V2i, Layer::Detected) => &mut detected,
                (Channel::V2i, Layer::GroundTruth) => &mut truth,
                (Channel::Conventional, Layer::GroundTruth) if lights.is_enabled(head) => &mut copied,
                (Channel::Conventional, Layer::GroundTruth | Layer::Detected) => continue,
            };
            let bulbs: &mut BulbSet = known.entry(head).or_default();
            *bulbs = bulbs.union(entry.state.bulbs);
        }
    }
    copied.extend(truth);
    copied.extend(detected);
    Ok(copied)
}

fn announce_upstream(
    controller: &Controller,
    phase: usize,
    start: WallStamp,
    lights: &SyncedStores,
    found: &mut BTreeMap<HeadIndex, Vec<Predicted>>,
) -> Result<(), Refusal> {
    let Some(mut offset) = controller.phases.get(phase).and_then(|phase| phase.duration) else {
        return Ok(());
    };
    if offset.as_secs_f64() > f64::from(upstream_cycle_s(controller)) {
        return Ok(());
    }
    let mut known = BTreeMap::new();
    for visited in controller.phases.iter().cycle().skip(phase + 1).take(PHASES_AHEAD) {
        let Some(duration) = visited.duration else { break };
        known.extend(upstream_states(visited, lights));
        for (id, states) in &known {
            for state in states {
                let bulb = state.single.ok_or_else(|| Refusal::State {
                    text: state.text.clone(),
                    mistake: "only one bulb can be announced".to_owned(),
                })?;
                for head in heads_of(lights.stores().map(), *id)? {
                    add(found.entry(head).or_default(), start.after(offset), [bulb]);
                }
            }
        }
        offset = offset.saturating_add(duration);
    }
    Ok(())
}

/// The V2I entries of a phase by their ids as written, and the conventional ones of ids that have
/// none and are enabled just so; truth and detections alike.
fn upstream_states<'a>(phase: &'a Phase, lights: &SyncedStores) -> BTreeMap<i64, Vec<&'a StateText>> {
    let of = |channel| phase.entries.iter().filter(move |entry| entry.target.store.channel == channel);
    let mut states: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for entry in of(Channel::V2i) {
        states.entry(entry.target.id).or_default().push(&entry.state);
    }
    let explicit: Vec<_> = states.keys().copied().collect();
    for entry in of(Channel::Conventional) {
        let id = entry.target.id;
        let is_copied = lights.stores().map().head(id).is_some_and(|head| lights.is_enabled(head));
        if is_copied && explicit.binary_search(&id).is_err() {
            states.entry(id).or_default().push(&entry.state);
        }
    }
    states
}

/// Adds bulbs at a time, to those there already or after them.
pub(super) fn add(list: &mut Vec<Predicted>, at: WallStamp, bulbs: impl IntoIterator<Item = Bulb>) {
    let same = |known: &&mut Predicted| {
        Duration::from_nanos(known.at.as_nanos().abs_diff(at.as_nanos())) <= SAME_TIME
    };
    match list.iter_mut().find(same) {
        Some(known) => known.bulbs.extend(bulbs),
        None => list.push(Predicted { at, bulbs: bulbs.into_iter().collect() }),
    }
}

#[cfg(test)]
mod tests;
