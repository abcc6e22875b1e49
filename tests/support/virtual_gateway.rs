//! A gateway on virtual time: inputs go in at the present instant, time passes from deadline to deadline, and
//! its outputs are kept.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::{Diagnostics, Level, Status};
use gateway_base::time::{MonoTime, Now};
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use gateway_core::command::sender::SendFailure;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::{Gateway, GatewaySettings};
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use signal_gateway::process_status::snapshot::Snapshot;

use super::clock::{at, millis};
use super::diagnostics::assert_listed;

pub(crate) struct VirtualGateway {
    pub(crate) gateway: Gateway,
    pub(crate) now: Now,
    /// All outputs but diagnostics, with their times.
    pub(crate) outputs: Vec<(MonoTime, Output)>,
    /// Every status whose level or message changed.
    pub(crate) changes: Vec<StatusChange>,
    /// Until then no frame can be sent, for lack of room.
    pub(crate) queue_full_until: MonoTime,
}

/// A status whose level or message has changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StatusChange {
    pub(crate) at: MonoTime,
    pub(crate) task: String,
    pub(crate) level: Level,
    pub(crate) message: String,
}

impl StatusChange {
    /// The changes among statuses that were sent together; none in a refresh.
    pub(crate) fn all(diagnostics: Diagnostics, at: MonoTime) -> impl Iterator<Item = Self> {
        let changed = diagnostics.statuses.into_iter().filter(move |_| !diagnostics.refresh);
        changed.inspect(assert_listed).map(move |status| Self {
            at,
            task: status.task,
            level: status.level,
            message: status.message,
        })
    }

    /// Its time in whole milliseconds.
    pub(crate) fn ms(&self) -> u64 {
        millis(self.at)
    }
}

impl VirtualGateway {
    /// At time zero, with every link up.
    pub(crate) fn new(settings: GatewaySettings) -> Self {
        Self::starting_at(MonoTime::ZERO, settings)
    }

    pub(crate) fn starting_at(start: MonoTime, settings: GatewaySettings) -> Self {
        Self::start(start, settings, LinkState::Up)
    }

    /// At time zero, with every link in that state.
    pub(crate) fn on_link(settings: GatewaySettings, link: LinkState) -> Self {
        Self::start(MonoTime::ZERO, settings, link)
    }

    fn start(start: MonoTime, settings: GatewaySettings, link: LinkState) -> Self {
        let mut started = Self {
            gateway: Gateway::new(settings, link, at(start)),
            now: at(start),
            outputs: Vec::new(),
            changes: Vec::new(),
            queue_full_until: MonoTime::ZERO,
        };
        started.take_outputs();
        started
    }

    pub(crate) fn snapshot(&self) -> Snapshot {
        self.gateway.snapshot(self.now)
    }

    pub(crate) fn handle(&mut self, input: impl Into<Input>) {
        self.gateway.handle(input, self.now);
        self.take_outputs();
    }

    /// A frame on the first bus: a classic one, or one of CAN FD for more than 8 bytes.
    pub(crate) fn receive(&mut self, id: CanId, data: &[u8]) {
        let frame = Frame::with_format(id, None, data).unwrap();
        self.handle(CanInput::Frame { bus: BusIndex(0), frame, stamp: self.now.wall });
    }

    /// Goes on to the next deadline, which is handled, or to `until` if that comes first; returns whether it
    /// was a deadline.
    pub(crate) fn step(&mut self, until: MonoTime) -> bool {
        let deadline = self.gateway.next_deadline().max(self.now.mono);
        let is_deadline = deadline <= until;
        self.now = at(deadline.min(until));
        if is_deadline {
            self.handle(Input::Tick);
            let next = self.gateway.next_deadline();
            assert!(next > self.now.mono, "a deadline that does not move");
        }
        is_deadline
    }

    /// Handles every deadline up to that time, also the one that falls on it.
    pub(crate) fn pass_until(&mut self, ms: u64) {
        while self.step(MonoTime::from_millis(ms)) {}
    }

    pub(crate) fn pass(&mut self, ms: u64) {
        self.pass_until(self.ms() + ms);
    }

    /// Likewise, but the deadline that falls on the end waits for the inputs of that instant.
    pub(crate) fn pass_without_end(&mut self, ms: u64) {
        let end = MonoTime::from_millis(self.ms() + ms);
        while self.step(MonoTime::from_nanos(end.as_nanos() - 1)) {}
        self.now = at(end);
    }

    /// The present in whole milliseconds.
    pub(crate) fn ms(&self) -> u64 {
        millis(self.now.mono)
    }

    /// The reports on the turn topic, in order: time, ms, and the constant's name, or `stops`.
    pub(crate) fn turn_reports(&self) -> Vec<(u64, &'static str)> {
        self.select(|output| {
            let Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) = output else {
                return None;
            };
            Some(step.value().map_or("stops", TurnIndicators::name))
        })
    }

    /// Likewise of the hazard topic.
    pub(crate) fn hazard_reports(&self) -> Vec<(u64, &'static str)> {
        self.select(|output| {
            let Output::VehicleLights(VehicleLightsOutput::HazardLights(step)) = output else { return None };
            Some(step.value().map_or("stops", HazardLights::name))
        })
    }

    pub(crate) fn turn_states(&self) -> Vec<&'static str> {
        self.turn_reports().into_iter().map(|(_, state)| state).collect()
    }

    pub(crate) fn hazard_states(&self) -> Vec<&'static str> {
        self.hazard_reports().into_iter().map(|(_, state)| state).collect()
    }

    /// The outputs that `pick` selects, each with its time, ms.
    pub(crate) fn select<T>(&self, pick: impl Fn(&Output) -> Option<T>) -> Vec<(u64, T)> {
        self.outputs.iter().filter_map(|(at, output)| Some((millis(*at), pick(output)?))).collect()
    }

    /// The status of a task now.
    pub(crate) fn status(&self, task: &str) -> Status {
        let statuses = self.gateway.statuses(self.now.mono);
        statuses.into_iter().find(|status| status.task == task).unwrap()
    }

    /// Level and message of a task now, as `WARN message`.
    pub(crate) fn status_text(&self, task: &str) -> String {
        let status = self.status(task);
        format!("{} {}", status.level, status.message)
    }

    /// A key of a task's status now.
    pub(crate) fn value(&self, task: &str, key: &str) -> String {
        let values = self.status(task).values;
        let value = values.iter().find(|(name, _)| *name == key);
        value.unwrap_or_else(|| panic!("no {key} in {values:?}")).1.clone()
    }

    /// Changes of a task's status.
    pub(crate) fn changes_of(&self, task: &str) -> impl Iterator<Item = &StatusChange> {
        self.changes.iter().filter(move |change| change.task == task)
    }

    fn take_outputs(&mut self) {
        let at = self.now.mono;
        while let Some(output) = self.gateway.poll_output() {
            if let Output::Diagnostics { diagnostics, stamp } = output {
                assert_eq!(stamp, self.now.wall);
                self.changes.extend(StatusChange::all(diagnostics, at));
            } else if let Output::Command(CommandOutput::Transmit { frame, .. }) = &output
                && at < self.queue_full_until
            {
                let (frame, failure) = (frame.clone(), SendFailure::QueueFull);
                self.gateway.handle_command(CommandInput::SendFailed { frame, failure }, self.now);
            } else {
                self.outputs.push((at, output));
            }
        }
    }
}
