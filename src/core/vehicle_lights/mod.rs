//! Vehicle lights: bound frames in, turn-indicator and hazard-light reports out.
//!
//! Vocabulary: a *message* carries *signals*; an *observation* is a signal's last raw value; a
//! *reading* is an observation judged by age and meaning; a *verdict* is what a report may say;
//! a *doubt* is why it may say nothing; a *finding* is what diagnostics should hear of it.

pub mod binding;
pub mod fusion;
pub mod lamp;
pub mod output;
pub mod report;
pub mod role_texts;
pub mod sources;
pub mod stalk;
pub mod state;
mod status;
pub mod verdict;
pub mod warning;

use crate::core::can::bus::Bus;
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;
use crate::core::time::{MonoTime, Now, WallStamp};
use crate::core::validation::observation::Observations;
use crate::core::validation::table::{MessageIndex, SignalIndex};
use binding::{HazardBinding, HazardSource, LightsBinding, TurnBinding};
use output::VehicleLightsOutput;
use report::{Publish, ReportFlow, Step};
use sources::{LightsContext, SourceMemory};
use status::LightsTask;
use verdict::{HazardLights, TurnIndicators, Verdict, judge};

pub use status::{FaultKind, LightsFinding, Task};

/// State of both reports.
#[derive(Debug, Clone)]
pub struct VehicleLights {
    binding: LightsBinding,
    observations: Observations,
    memory: SourceMemory,
    turn: ReportFlow<TurnIndicators>,
    hazard: ReportFlow<HazardLights>,
    turn_task: LightsTask,
    hazard_task: LightsTask,
}

/// What to do now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Steps {
    /// With the turn topic.
    pub turn: Option<Step<TurnIndicators>>,
    /// With the hazard topic.
    pub hazard: Option<Step<HazardLights>>,
    /// Whether the turn finding changed.
    pub turn_changed: bool,
    /// Whether the hazard finding changed.
    pub hazard_changed: bool,
}

impl Steps {
    /// What goes out, the turn report first.
    pub fn outputs(&self) -> impl Iterator<Item = VehicleLightsOutput> + use<> {
        let turn = self.turn.map(|step| match step {
            Step::Publish(report, stamp) => VehicleLightsOutput::TurnIndicators { report, stamp },
            Step::Withdraw => VehicleLightsOutput::WithdrawTurnIndicators,
        });
        let hazard = self.hazard.map(|step| match step {
            Step::Publish(report, stamp) => VehicleLightsOutput::HazardLights { report, stamp },
            Step::Withdraw => VehicleLightsOutput::WithdrawHazardLights,
        });
        turn.into_iter().chain(hazard)
    }
}

impl VehicleLights {
    /// Nothing seen, nothing published.
    pub fn new(binding: LightsBinding, publish: Publish) -> Self {
        let signals_of = |task| signals_of(&binding, task);
        Self {
            turn_task: LightsTask::new(Task::TurnIndicators, signals_of(Task::TurnIndicators)),
            hazard_task: LightsTask::new(Task::HazardLights, signals_of(Task::HazardLights)),
            observations: Observations::new(&binding.table),
            memory: SourceMemory::new(&binding),
            turn: ReportFlow::new(publish),
            hazard: ReportFlow::new(publish),
            binding,
        }
    }

    /// What the profile binds.
    pub fn binding(&self) -> &LightsBinding {
        &self.binding
    }

    /// What there is to say something of: all but what the profile leaves out.
    pub fn tasks(&self) -> impl Iterator<Item = Task> + use<> {
        let turn = !matches!(self.binding.turn, TurnBinding::LeftOut);
        let hazard = !matches!(self.binding.hazard, HazardBinding::LeftOut);
        let turn = turn.then_some(Task::TurnIndicators);
        turn.into_iter().chain(hazard.then_some(Task::HazardLights))
    }

    /// The last values.
    pub fn observations(&self) -> &Observations {
        &self.observations
    }

    /// Takes a frame of a bound message. Call [`Self::settle`] afterwards.
    pub fn frame_arrived(&mut self, message: MessageIndex, frame: &Frame, stamp: WallStamp, now: Now) {
        self.observations.frame_arrived(&self.binding.table, message, frame, stamp, now);
    }

    /// Forgets what came over a bus. Call [`Self::settle`] afterwards.
    pub fn forget_bus(&mut self, bus: BusIndex) {
        self.observations.forget_bus(&self.binding.table, bus);
    }

    /// Forgets the event messages of a bus that was silent. Call [`Self::settle`] afterwards.
    pub fn forget_events(&mut self, bus: BusIndex) {
        self.observations.forget_events(&self.binding.table, bus);
    }

    /// Judges what is known now and says what to do.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> Steps {
        let context = LightsContext { binding: &self.binding, observations: &self.observations, buses, now };
        let verdicts = judge(&mut self.memory, context);
        let context = (&self.binding, buses, now.mono);
        Steps {
            turn: self.turn.update(published(&verdicts.turn), now.mono),
            hazard: self.hazard.update(published(&verdicts.hazard), now.mono),
            turn_changed: self.turn_task.update(&verdicts.turn, context),
            hazard_changed: self.hazard_task.update(&verdicts.hazard, context),
        }
    }

    /// What is published at present, as settled last; `None` = withheld.
    pub fn reports(&self) -> (Option<TurnIndicators>, Option<HazardLights>) {
        (self.turn.current().map(|(turn, _)| turn), self.hazard.current().map(|(hazard, _)| hazard))
    }

    /// When to call [`Self::settle`] with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let stale = self.observations.next_deadline(&self.binding.table, now);
        let remembered = self.memory.next_deadline();
        [stale, remembered, self.turn.next_deadline(), self.hazard.next_deadline()]
            .into_iter()
            .flatten()
            .min()
    }
}

fn published<T: Copy>(verdict: &Verdict<T>) -> Option<(T, WallStamp)> {
    verdict.publish.map(|(value, received)| (value, received.stamp))
}

/// The signals a task's state depends on, without fault signals.
fn signals_of(binding: &LightsBinding, task: Task) -> Vec<SignalIndex> {
    let turn = match &binding.turn {
        TurnBinding::LeftOut | TurnBinding::NotFitted => &[][..],
        TurnBinding::From(sources) => &sources.list,
    };
    let hazard = match &binding.hazard {
        HazardBinding::LeftOut | HazardBinding::NotFitted | HazardBinding::Unbound => &[][..],
        HazardBinding::From(sources) => &sources.list,
    };
    let mut signals: Vec<SignalIndex> = Vec::new();
    match task {
        Task::TurnIndicators => signals.extend(turn.iter().flat_map(|named| named.source.signals())),
        Task::HazardLights => {
            for named in hazard {
                match &named.source {
                    HazardSource::BothSides => {
                        let sides = turn.iter().filter(|named| named.source.shows_both());
                        signals.extend(sides.flat_map(|named| named.source.signals()));
                    }
                    HazardSource::Signal { role, .. } => signals.push(role.signal),
                    HazardSource::Button { role, .. } => signals.push(role.signal),
                }
            }
        }
    }
    signals
}
