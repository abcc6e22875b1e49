//! Vehicle lights: turn-indicator and hazard-light reports from bound frames.
//!
//! A *message* carries *signals*; an *observation* is the last raw value of a signal; a *reading* is an
//! observation with its age checked and its meaning; a *verdict* is the state of a report or the reason why
//! it is unavailable; a *finding* is the part of a verdict shown in diagnostics.

pub mod binding;
pub mod catalogue;
pub mod fusion;
pub mod lamp;
pub mod output;
pub mod raw_state;
pub mod role_texts;
pub mod sources;
pub mod stalk;
pub mod state;
mod status;
mod task;
pub mod verdict;
pub mod warning;

use crate::vehicle_report::{Publish, ReportFlow};
use binding::{HazardBinding, HazardSource, LightsBinding, NamedSource, TurnBinding, TurnSource};
use can_signal::can::{Bus, BusIndex, Frame};
use can_signal::validation::observation::{Arrival, Interruption, Observations};
use can_signal::validation::requirement::{RequirementStates, Unmet};
use can_signal::validation::table::{MessageIndex, SignalIndex};
use gateway_base::time::{MonoTime, Now, WallStamp};
use output::VehicleLightsOutput;
use sources::{LightsContext, SourceMemory};
use task::LightsTask;
use verdict::{HazardLights, TurnIndicators, judge};

pub use task::Task;

/// State machine of both reports.
#[derive(Debug, Clone)]
pub struct VehicleLights {
    binding: LightsBinding,
    observations: Observations,
    requirements: RequirementStates,
    memory: SourceMemory,
    turn: ReportFlow<TurnIndicators>,
    hazard: ReportFlow<HazardLights>,
    turn_task: LightsTask,
    hazard_task: LightsTask,
}

impl VehicleLights {
    /// Creates reports before any frame or publication.
    pub fn new(binding: LightsBinding, publish: Publish) -> Self {
        let signals_of = |task| signals_of(&binding, task);
        Self {
            turn_task: LightsTask::new(Task::TurnIndicators, signals_of(Task::TurnIndicators)),
            hazard_task: LightsTask::new(Task::HazardLights, signals_of(Task::HazardLights)),
            observations: Observations::new(&binding.table),
            requirements: RequirementStates::new(&binding.requirements),
            memory: SourceMemory::new(&binding),
            turn: ReportFlow::new(publish),
            hazard: ReportFlow::new(publish),
            binding,
        }
    }

    /// Continues with another binding and publication scheme. Received values, published reports and findings
    /// are kept as far as both bindings include them; a changed source starts without its history. Call
    /// [`Self::settle`] afterwards.
    pub fn reconfigure(&mut self, binding: LightsBinding, publish: Publish, now: MonoTime) {
        let (before, table) = (&self.binding, &binding.table);
        let is_same_signal = |signal: SignalIndex| {
            let [old, new] = [&before.table, table].map(|table| {
                let bound = table.signals.get(signal.0)?;
                let message = &table.messages[bound.message.0];
                Some((
                    &bound.name,
                    &bound.codec,
                    message.bus,
                    message.ids,
                    message.format,
                    &message.integrity,
                ))
            });
            old.is_some() && old == new
        };
        self.memory = self.memory.carried_over(before, &binding, is_same_signal);
        self.observations = self.observations.carried_over(&before.table, table);
        self.requirements = self.requirements.carried_over(&before.requirements, &binding.requirements);
        for task in [&mut self.turn_task, &mut self.hazard_task] {
            task.report.reconfigure(signals_of(&binding, task.task));
        }
        self.turn.reconfigure(publish, now);
        self.hazard.reconfigure(publish, now);
        self.binding = binding;
    }

    /// Returns the binding of the lights.
    pub fn binding(&self) -> &LightsBinding {
        &self.binding
    }

    /// Returns the tasks with diagnostics: all lights that the profile mentions.
    pub fn tasks(&self) -> impl Iterator<Item = Task> + use<> {
        let turn = !matches!(self.binding.turn, TurnBinding::LeftOut);
        let hazard = !matches!(self.binding.hazard, HazardBinding::LeftOut);
        let turn = turn.then_some(Task::TurnIndicators);
        turn.into_iter().chain(hazard.then_some(Task::HazardLights))
    }

    /// Returns the last values of the bound signals.
    pub fn observations(&self) -> &Observations {
        &self.observations
    }

    /// Handles a frame of a bound message. If it returns [`Arrival::News`], call [`Self::settle`] afterwards;
    /// otherwise reports and findings stay unchanged until their deadline.
    pub fn frame_arrived(
        &mut self,
        message: MessageIndex,
        frame: &Frame,
        stamp: WallStamp,
        now: Now,
    ) -> Arrival {
        match self.observations.frame_arrived(&self.binding.table, message, frame, stamp, now) {
            Ok(Arrival::Repetition) if !self.memory.observes_frames() => Arrival::Repetition,
            // A frame that is not used is counted, and its signals have no value as a result.
            Ok(_) | Err(_) => Arrival::News,
        }
    }

    /// Compares any received frame with the requirements of the profile; returns true if a state changes.
    /// `was_alive` is false if the bus had been silent before. Call [`Self::settle`] after a change.
    pub fn observe(&mut self, bus: BusIndex, frame: &Frame, was_alive: bool, now: MonoTime) -> bool {
        self.requirements.frame_arrived(&self.binding.requirements, bus, frame, was_alive, now)
    }

    /// Returns the requirement of the profile that is not met; `None` = all are met.
    pub fn unmet(&self) -> Option<Unmet> {
        self.requirements.unmet()
    }

    /// Forgets the values that do not survive an interruption of a bus.
    pub fn forget(&mut self, bus: BusIndex, by: Interruption) {
        self.observations.forget(&self.binding.table, bus, by);
        if by == Interruption::LinkLost {
            self.requirements.forget_bus(&self.binding.requirements, bus);
        }
    }

    /// Evaluates both reports, passes the actions to `emit`, and calls `changed` with each task whose finding
    /// has changed.
    pub fn settle(
        &mut self,
        buses: &[Bus],
        now: Now,
        emit: impl FnMut(VehicleLightsOutput),
        mut changed: impl FnMut(Task),
    ) {
        let (binding, observations, unmet) = (&self.binding, &self.observations, self.requirements.unmet());
        let context = LightsContext { binding, observations, unmet: unmet.as_ref(), buses, now };
        let verdicts = judge(&mut self.memory, context);
        let turn = self.turn.update(verdicts.turn.publish, now.mono);
        let hazard = self.hazard.update(verdicts.hazard.publish, now.mono);
        let turn = turn.map(VehicleLightsOutput::TurnIndicators);
        turn.into_iter().chain(hazard.map(VehicleLightsOutput::HazardLights)).for_each(emit);
        if self.turn_task.update(&verdicts.turn, context) {
            changed(Task::TurnIndicators);
        }
        if self.hazard_task.update(&verdicts.hazard, context) {
            changed(Task::HazardLights);
        }
    }

    /// Returns the currently published reports; `None` = withheld.
    pub fn reports(&self) -> (Option<TurnIndicators>, Option<HazardLights>) {
        (self.turn.value(), self.hazard.value())
    }

    /// Returns the next instant at which [`Self::settle`] is due without an event.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let stale = self.observations.next_deadline(&self.binding.table, now);
        let remembered = self.memory.next_deadline();
        [stale, remembered, self.turn.next_deadline(), self.hazard.next_deadline()]
            .into_iter()
            .flatten()
            .min()
    }
}

/// Returns the signals on which the state of a task depends, without fault signals.
pub fn signals_of(binding: &LightsBinding, task: Task) -> Vec<SignalIndex> {
    let turn = binding.turn.sources().iter();
    if task == Task::TurnIndicators {
        return turn.flat_map(turn_source_signals).collect();
    }
    let mut signals = Vec::new();
    for named in binding.hazard.sources() {
        if named.source == HazardSource::BothSides {
            let sides = turn.clone().filter(|named| named.source.shows_both());
            signals.extend(sides.flat_map(turn_source_signals));
        }
        signals.extend(named.source.signal().into_iter().chain(named.condition_signal()));
    }
    signals
}

/// Returns the signals of a turn source and of its condition.
fn turn_source_signals(named: &NamedSource<TurnSource>) -> impl Iterator<Item = SignalIndex> {
    named.source.signals().chain(named.condition_signal())
}
