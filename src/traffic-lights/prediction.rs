//! Predictions of future phases for V2I (docs/spec/traffic-lights.md, "Predictions").
//!
//! Improved mode predicts the states that will be sent: a head's V2I states, a detection in preference to
//! truth, or the copied conventional state. Upstream has its own quirks, separated below (Q5, Q10, Q11).

use std::collections::BTreeMap;
use std::time::Duration;

use super::bulb::{Bulb, BulbSet};
use super::change_log::ChangeLog;
use super::controller::ControllerProgress;
use super::quirks::LightQuirks;
use super::refusal::ActionRefusal;
use super::scenario::{Phase, StateText, TrafficSignalController, upstream_cycle_s};
use super::store::heads_of;
use super::sync::SyncedStores;
use super::target::{LightChannel, StoreLayer};
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::HeadIndex;

const PHASES_AHEAD: usize = 6;
/// Predictions of one head within this time of each other are merged.
const SAME_TIME: Duration = Duration::from_millis(10);

#[derive(Debug, Clone)]
pub(super) struct Predictions {
    quirks: LightQuirks,
    /// The predictions of each head, with the position of the controller from which they result.
    by_head: BTreeMap<HeadIndex, (usize, Vec<Predicted>)>,
    /// The heads of the last predictions of each controller.
    by_controller: Vec<Vec<HeadIndex>>,
    pub(super) change_log: ChangeLog,
}

/// A predicted state of one head.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Predicted {
    pub(super) at: WallStamp,
    /// Bulbs in the order of their keys; upstream may repeat one.
    pub(super) bulbs: Vec<Bulb>,
}

type ByHead = BTreeMap<HeadIndex, Vec<Predicted>>;

impl Predictions {
    pub(super) fn new(controllers: usize, heads: usize, quirks: LightQuirks) -> Self {
        let by_controller = vec![Vec::new(); controllers];
        Self { quirks, by_head: BTreeMap::new(), by_controller, change_log: ChangeLog::new(heads) }
    }

    /// Returns the predictions of a head, ascending by time.
    pub(super) fn of(&self, head: HeadIndex) -> &[Predicted] {
        self.by_head.get(&head).map_or(&[], |(_, list)| list)
    }

    pub(super) fn clear(&mut self) {
        for head in self.by_head.keys() {
            self.change_log.add(*head);
        }
        self.by_head.clear();
    }

    /// Replaces the predictions of a controller, based on the phases after its present one. Upstream also
    /// discards the predictions of the other controllers.
    pub(super) fn renew(
        &mut self,
        index: usize,
        controller: &TrafficSignalController,
        state: &ControllerProgress,
        lights: &SyncedStores,
    ) -> Result<(), ActionRefusal> {
        let Some(phase) = state.phase else { return Ok(()) };
        if self.quirks.renews_predictions_late {
            self.clear();
        }
        for head in std::mem::take(&mut self.by_controller[index]) {
            if self.by_head.get(&head).is_some_and(|(controller, _)| *controller == index) {
                self.by_head.remove(&head);
                self.change_log.add(head);
            }
        }
        let Some(duration) = controller.phases[phase].duration else { return Ok(()) };
        let predict = if self.quirks.predicts_single_bulbs { predict_upstream } else { predict };
        let mut found = ByHead::new();
        let outcome = predict(controller, phase, (state.start_wall, duration), lights, &mut found);
        // Upstream keeps the predictions computed before a mistake.
        if outcome.is_err() && !self.quirks.predicts_single_bulbs {
            return outcome;
        }
        for (head, list) in found {
            self.by_controller[index].push(head);
            self.change_log.add(head);
            self.by_head.insert(head, (index, list));
        }
        outcome
    }
}

/// Predicts the phases after the given phase, which has this start and duration.
fn predict(
    controller: &TrafficSignalController,
    phase: usize,
    (start, mut offset): (WallStamp, Duration),
    lights: &SyncedStores,
    found: &mut ByHead,
) -> Result<(), ActionRefusal> {
    let mut known = BTreeMap::new();
    let mut phases = controller.phases.iter().cycle().skip(phase);
    let mut left = phases.next().map(|phase| states(phase, lights)).transpose()?.unwrap_or_default();
    for visited in phases.take(PHASES_AHEAD) {
        let entered = states(visited, lights)?;
        // Leaving a phase clears the lights that it names.
        known.extend(left.keys().map(|head| (*head, BulbSet::EMPTY)));
        known.extend(entered.iter().map(|(head, bulbs)| (*head, *bulbs)));
        left = entered;
        for (head, bulbs) in &known {
            add(found.entry(*head).or_default(), start.after(offset), bulbs.iter());
        }
        let Some(duration) = visited.duration else { break };
        offset = offset.saturating_add(duration);
    }
    // A bulb that begins twice at the same time is one bulb.
    for predicted in found.values_mut().flatten() {
        predicted.bulbs = predicted.bulbs.drain(..).collect::<BulbSet>().iter().collect();
    }
    Ok(())
}

/// Returns the future V2I state of each head that has one in a phase, explicit or copied.
fn states(phase: &Phase, lights: &SyncedStores) -> Result<BTreeMap<HeadIndex, BulbSet>, ActionRefusal> {
    let (mut copied, mut truth, mut detected) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    for entry in &phase.entries {
        for head in heads_of(&lights.stores.map, entry.target.id)? {
            let store = entry.target.store;
            let known = match (store.channel, store.layer) {
                (LightChannel::V2i, StoreLayer::Detected) => &mut detected,
                (LightChannel::V2i, StoreLayer::GroundTruth) => &mut truth,
                (LightChannel::Conventional, StoreLayer::GroundTruth) if lights.is_enabled(head) => {
                    &mut copied
                }
                (LightChannel::Conventional, StoreLayer::GroundTruth | StoreLayer::Detected) => continue,
            };
            let bulbs: &mut BulbSet = known.entry(head).or_default();
            *bulbs = bulbs.union(entry.state.bulbs);
        }
    }
    copied.extend(truth);
    copied.extend(detected);
    Ok(copied)
}

/// Predicts the phases after the given phase by the rules of upstream.
fn predict_upstream(
    controller: &TrafficSignalController,
    phase: usize,
    (start, mut offset): (WallStamp, Duration),
    lights: &SyncedStores,
    found: &mut ByHead,
) -> Result<(), ActionRefusal> {
    let seconds = |phase: &Phase| phase.duration.map_or(f64::INFINITY, |duration| duration.as_secs_f64());
    if offset.as_secs_f64() > f64::from(upstream_cycle_s(controller.phases.iter().map(seconds))) {
        return Ok(());
    }
    let mut known = BTreeMap::new();
    for visited in controller.phases.iter().cycle().skip(phase + 1).take(PHASES_AHEAD) {
        let Some(duration) = visited.duration else { break };
        known.extend(upstream_states(visited, lights));
        for (id, states) in &known {
            for state in states {
                let bulb = state.single.ok_or_else(|| ActionRefusal::State {
                    text: state.text.clone(),
                    mistake: "only one bulb can be predicted".to_owned(),
                })?;
                for head in heads_of(&lights.stores.map, *id)? {
                    add(found.entry(head).or_default(), start.after(offset), [bulb]);
                }
            }
        }
        offset = offset.saturating_add(duration);
    }
    Ok(())
}

/// Returns the V2I entries of a phase by their ids as written, and the conventional entries of ids that have
/// none and belong to enabled heads, for truth and detections.
fn upstream_states<'a>(phase: &'a Phase, lights: &SyncedStores) -> BTreeMap<i64, Vec<&'a StateText>> {
    let of = |channel| phase.entries.iter().filter(move |entry| entry.target.store.channel == channel);
    let mut states: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for entry in of(LightChannel::V2i) {
        states.entry(entry.target.id).or_default().push(&entry.state);
    }
    let explicit: Vec<_> = states.keys().copied().collect();
    for entry in of(LightChannel::Conventional) {
        let id = entry.target.id;
        let is_copied = lights.stores.map.head(id).is_some_and(|head| lights.is_enabled(head));
        if is_copied && explicit.binary_search(&id).is_err() {
            states.entry(id).or_default().push(&entry.state);
        }
    }
    states
}

/// Adds bulbs to the prediction for a time, or creates a new prediction.
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
