//! The state changed by actions and phases: lights, controllers, variables, predictions, rates.

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use super::controller::{Controllers, FrameTimes, Transition};
use super::event_log::{ActionSource, LoggedEvent, ScenarioEvent, ScenarioOutcome};
use super::periodic_timer::{PeriodicTimer, Rate, ScenarioMoment};
use super::prediction::Predictions;
use super::quirks::LightQuirks;
use super::refusal::ActionRefusal;
use super::scenario::{Action, ControllerIndex, Phase, PhaseEntry, Scenario, StateText};
use super::store::{LightChange, heads_of};
use super::sync::SyncedStores;
use super::target::{SignalTarget, StoreId};
use super::variable::VariableValue;
use gateway_base::time::WallStamp;
use lanelet2_map::light_map::HeadIndex;

/// Maximum number of events kept until they are polled; older ones are lost.
const MAX_EVENTS: usize = 16_384;

#[derive(Debug, Clone)]
pub(super) struct ScenarioState {
    pub(super) quirks: LightQuirks,
    pub(super) copy_on_enable: bool,
    pub(super) lights: SyncedStores,
    pub(super) controllers: Controllers,
    pub(super) variables: Vec<VariableValue>,
    pub(super) predictions: Predictions,
    pub(super) ground_truth: PeriodicTimer,
    pub(super) v2i: PeriodicTimer,
    pub(super) verdict: Option<ScenarioOutcome>,
    pub(super) events: VecDeque<LoggedEvent>,
    pub(super) is_first_frame: bool,
    pub(super) now: ScenarioMoment,
    /// The wall-clock time of that moment.
    pub(super) wall: WallStamp,
}

impl ScenarioState {
    pub(super) fn run_controllers(
        &mut self,
        scenario: &Scenario,
        frame: FrameTimes,
    ) -> Result<(), ActionRefusal> {
        let mut from = 0;
        while let Some(index) = self.controllers.next_awake(from, frame) {
            if let Some(to) = self.controllers.due(index, &scenario.controllers[index], frame) {
                self.enter(scenario, index, to)?;
            }
            from = index + 1;
        }
        Ok(())
    }

    /// Performs an action. In improved mode, a refused action changes nothing.
    pub(super) fn perform(
        &mut self,
        scenario: &Scenario,
        action: &Action,
        source: ActionSource,
    ) -> Result<(), ActionRefusal> {
        let rate = |hz| Rate::from_hz(hz).ok_or(ActionRefusal::Rate(hz));
        match action {
            Action::SetState { target, state } => self.set(*target, state)?,
            Action::Clear(target) => {
                self.lights.write(*target, LightChange::Clear)?;
            }
            Action::EnterPhase { controller, phase } => self.jump(scenario, *controller, phase)?,
            Action::SetV2iState { id, state, rate_hz } => {
                let rate = rate_hz.map(rate).transpose()?;
                let target = SignalTarget { id: *id, store: StoreId::V2I };
                if !self.quirks.finds_mistakes_late {
                    self.set(target, state)?;
                }
                if let Some(rate) = rate {
                    self.v2i.restart(rate, self.now.nanos);
                }
                if self.quirks.finds_mistakes_late {
                    self.set(target, state)?;
                }
            }
            Action::SetV2iRate(rate_hz) => self.v2i.restart(rate(*rate_hz)?, self.now.nanos),
            Action::SetGroundTruthRate(rate_hz) => self.ground_truth.restart(rate(*rate_hz)?, self.now.nanos),
            Action::EnableV2i(ids) => self.enable_v2i(scenario, ids)?,
            Action::DisableV2i(ids) => {
                if !self.lights.enable(ids, false)?.is_empty() {
                    self.renew_predictions(scenario)?;
                }
            }
            Action::SetConfidence { target, confidence } => {
                if !self.quirks.takes_any_confidence && !(0.0..=1.0).contains(confidence) {
                    return Err(ActionRefusal::Confidence(*confidence));
                }
                self.lights.write(*target, LightChange::Confidence(*confidence))?;
            }
            Action::SetVariable { variable, value } => {
                self.variables[variable.0].clone_from(value);
            }
            Action::ModifyVariable { variable, by } => self.variables[variable.0].modify(*by),
            Action::End(_) => {}
        }
        self.log(ScenarioEvent::ActionDone(source));
        if let Action::End(success) = action {
            self.end(if *success { ScenarioOutcome::Success } else { ScenarioOutcome::Failure });
        }
        Ok(())
    }

    /// Ends the scenario; only the first verdict counts.
    pub(super) fn end(&mut self, verdict: ScenarioOutcome) {
        if self.verdict.is_none() {
            self.verdict = Some(verdict.clone());
            self.log(ScenarioEvent::Ended(verdict));
            // The predicted phases will not begin; upstream predicts them nevertheless.
            if !self.quirks.predicts_after_end {
                self.predictions.clear();
            }
        }
    }

    pub(super) fn log(&mut self, event: ScenarioEvent) {
        if self.events.len() >= MAX_EVENTS {
            self.events.pop_front();
        }
        self.events.push_back(LoggedEvent { at: Duration::from_nanos(self.now.nanos), event });
    }

    fn set(&mut self, target: SignalTarget, state: &StateText) -> Result<(), ActionRefusal> {
        if !self.quirks.finds_mistakes_late {
            readable(state)?;
        }
        self.lights.write(target, LightChange::Set(state.bulbs))?;
        readable(state)
    }

    fn jump(
        &mut self,
        scenario: &Scenario,
        index: ControllerIndex,
        phase: &str,
    ) -> Result<(), ActionRefusal> {
        let controller =
            scenario.controllers.get(index.0).ok_or(ActionRefusal::UnknownController(index.0))?;
        let to = controller.phases.iter().position(|known| known.name == phase).ok_or_else(|| {
            ActionRefusal::UnknownPhase { controller: controller.name.clone(), phase: phase.to_owned() }
        })?;
        self.enter(scenario, index.0, Transition { phase: to, start: self.now })
    }

    fn enable_v2i(&mut self, scenario: &Scenario, ids: &[i64]) -> Result<(), ActionRefusal> {
        let heads = self.lights.enable(ids, true)?;
        if heads.is_empty() {
            return Ok(());
        }
        if self.copy_on_enable {
            let explicit = self.explicit_heads(scenario)?;
            heads.difference(&explicit).for_each(|head| self.lights.copy_now(*head));
        }
        self.renew_predictions(scenario)
    }

    /// Returns the heads with an explicit V2I state in a running phase.
    fn explicit_heads(&self, scenario: &Scenario) -> Result<BTreeSet<HeadIndex>, ActionRefusal> {
        let mut explicit = BTreeSet::new();
        for index in 0..scenario.controllers.len() {
            let phase = self.controllers.phase(scenario, ControllerIndex(index));
            let entries = phase.into_iter().flat_map(|phase| &phase.entries);
            for entry in entries.filter(|entry| is_v2i_truth(entry)) {
                explicit.extend(heads_of(&self.lights.stores.map, entry.target.id)?);
            }
        }
        Ok(explicit)
    }

    /// Updates the predictions if other heads are copied; upstream waits for the next phase (Q5).
    fn renew_predictions(&mut self, scenario: &Scenario) -> Result<(), ActionRefusal> {
        if !self.quirks.renews_predictions_late && self.verdict.is_none() {
            for (index, controller) in scenario.controllers.iter().enumerate() {
                if let Some(state) = self.controllers.state(ControllerIndex(index)) {
                    self.predictions.renew(index, controller, state, &self.lights)?;
                }
            }
        }
        Ok(())
    }

    fn enter(&mut self, scenario: &Scenario, index: usize, to: Transition) -> Result<(), ActionRefusal> {
        let controller = &scenario.controllers[index];
        let entered = &controller.phases[to.phase];
        if let Some(left) = self.controllers.phase(scenario, ControllerIndex(index)) {
            self.clear(left.entries.iter())?;
        }
        let late = self.now.nanos.saturating_sub(to.start.nanos);
        let late = i64::try_from(late).unwrap_or(i64::MAX);
        let start_wall = WallStamp::from_nanos(self.wall.as_nanos().saturating_sub(late));
        self.controllers.enter(index, to, start_wall);
        self.log(ScenarioEvent::PhaseEntered { controller: ControllerIndex(index), phase: to.phase });
        if let Some(state) = self.controllers.state(ControllerIndex(index)) {
            self.predictions.renew(index, controller, state, &self.lights)?;
        }
        self.fill(entered)
    }

    fn clear<'a>(&mut self, mut entries: impl Iterator<Item = &'a PhaseEntry>) -> Result<(), ActionRefusal> {
        entries.try_for_each(|entry| self.lights.write(entry.target, LightChange::Clear).map(drop))
    }

    /// Clears the targets of a phase, then adds its states.
    fn fill(&mut self, phase: &Phase) -> Result<(), ActionRefusal> {
        self.clear(phase.entries.iter())?;
        if self.quirks.unites_copies {
            return self.add(phase.entries.iter());
        }
        // Explicit V2I states come last and replace copies.
        let (explicit, others): (Vec<_>, Vec<_>) =
            phase.entries.iter().partition(|entry| is_v2i_truth(entry));
        self.add(others.into_iter())?;
        self.clear(explicit.iter().copied())?;
        self.add(explicit.into_iter())
    }

    fn add<'a>(&mut self, entries: impl Iterator<Item = &'a PhaseEntry>) -> Result<(), ActionRefusal> {
        for entry in entries {
            self.lights.write(entry.target, LightChange::Add(entry.state.bulbs))?;
            readable(&entry.state)?;
        }
        Ok(())
    }
}

fn is_v2i_truth(entry: &PhaseEntry) -> bool {
    entry.target.store == StoreId::V2I
}

fn readable(state: &StateText) -> Result<(), ActionRefusal> {
    match &state.mistake {
        None => Ok(()),
        Some(mistake) => Err(ActionRefusal::State { text: state.text.clone(), mistake: mistake.clone() }),
    }
}
