//! Counts the frames and values of a replayed recording, and the reports that would have been published.

use std::collections::BTreeMap;
use std::time::Duration;

use super::decode::signals_in;
use super::fault_survey::FaultSurvey;
use super::vehicle_status::{StatusSurvey, bound_messages};
use crate::config::Settings;
use crate::replay::Replay;
use can_signal::can::error_frame::{bits, class};
use can_signal::can::{BusIndex, CanInput, source_address};
use can_signal::validation::table::{BoundMessage, SignalIndex, SignalTable};
use can_signal::validation::unusable::FaultKind;
use gateway_base::time::MonoTime;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::{Task, signals_of};
use gateway_core::vehicle_status::kinematics::survey::KinematicSurvey;
use vehicle_bringup::plausibility::evidence::ProfileEvidence;
use vehicle_bringup::plausibility::fingerprint::Fingerprint;

/// Maximum number of different values that are listed.
pub(super) const MAX_VALUES: usize = 32;

#[derive(Debug, Clone, Default)]
pub(super) struct MessageSurvey {
    pub(super) frames: u64,
    pub(super) last: Option<MonoTime>,
    pub(super) longest_gap: Duration,
    /// Number of gaps beyond the limit while other frames arrived on the bus.
    pub(super) missing: u64,
    /// Number of gaps beyond the limit in which the whole bus was silent.
    pub(super) bus_silent: u64,
    /// Number of frames by sender, for a message that may have several.
    pub(super) senders: BTreeMap<u8, u64>,
}

#[derive(Debug, Clone, Default)]
pub(super) struct ErrorSurvey {
    pub(super) frames: u64,
    pub(super) first: MonoTime,
    pub(super) classes: BTreeMap<u32, u64>,
}

#[derive(Debug)]
pub(super) struct RecordingSurvey {
    pub(super) evidence: ProfileEvidence,
    /// See [`bound_messages`].
    pub(super) bound: Vec<BoundMessage>,
    pub(super) messages: Vec<MessageSurvey>,
    pub(super) errors: BTreeMap<BusIndex, ErrorSurvey>,
    /// The frames of each bus, in the order of the settings.
    pub(super) buses: Vec<BusFrames>,
    /// Count and first time of each raw value, by signal.
    pub(super) values: Vec<BTreeMap<i128, (u64, MonoTime)>>,
    pub(super) faults: BTreeMap<(usize, FaultKind), FaultSurvey>,
    /// Fault of each report after the last step, and whether it was published.
    pub(super) current: [(Option<FaultKind>, bool); 2],
    pub(super) published: [Duration; 2],
    /// True for each report of the lights once it was published.
    pub(super) was_published: [bool; 2],
    /// Remedy for each fault of the lights, from the diagnostics.
    pub(super) remedies: BTreeMap<(usize, FaultKind), String>,
    pub(super) status: StatusSurvey,
    pub(super) motion: KinematicSurvey,
}

/// The frames of a bus: their identifiers, the newest stamp, and the newest stamp before that.
#[derive(Debug, Default)]
pub(super) struct BusFrames {
    pub(super) fingerprint: Fingerprint,
    newest: Option<MonoTime>,
    before: Option<MonoTime>,
}

impl BusFrames {
    fn add(&mut self, at: MonoTime) {
        if self.newest.is_none_or(|newest| at > newest) {
            self.before = self.newest.replace(at);
        }
    }
}

pub(super) const TASKS: [Task; 2] = [Task::TurnIndicators, Task::HazardLights];

impl RecordingSurvey {
    pub(super) fn new(settings: &Settings, replay: &Replay) -> Self {
        let (lights, start) = (&settings.gateway.lights, replay.now().mono);
        let bound: Vec<_> = bound_messages(settings).into_iter().cloned().collect();
        let databases: Vec<_> = settings.dbcs.iter().map(|dbc| &dbc.database).collect();
        let mut survey = Self {
            evidence: ProfileEvidence::new(lights, &settings.gateway.v2i.table, &databases),
            messages: vec![MessageSurvey::default(); bound.len()],
            bound,
            errors: BTreeMap::new(),
            buses: settings.gateway.buses.iter().map(|_| BusFrames::default()).collect(),
            values: vec![BTreeMap::new(); lights.table.signals.len()],
            faults: BTreeMap::new(),
            current: [(None, false); 2],
            published: [Duration::ZERO; 2],
            was_published: [false; 2],
            remedies: BTreeMap::new(),
            status: StatusSurvey::new(&settings.gateway.status),
            motion: KinematicSurvey::default(),
        };
        survey.passed(replay, start);
        survey
    }

    /// Counts an input before it is handled.
    pub(super) fn frame(&mut self, settings: &Settings, input: &CanInput, at: MonoTime) {
        if let CanInput::ErrorFrame { bus, error } = input {
            let fresh = ErrorSurvey { first: at, ..ErrorSurvey::default() };
            let survey = self.errors.entry(*bus).or_insert(fresh);
            survey.frames += 1;
            for bit in bits(error.class).filter(|bit| *bit != class::COUNTERS) {
                *survey.classes.entry(bit).or_default() += 1;
            }
        }
        let CanInput::Frame { bus, frame, .. } = input else { return };
        let id = frame.id();
        self.evidence.frame(*bus, frame, at);
        let Some(frames) = self.buses.get_mut(usize::from(bus.0)) else { return };
        frames.fingerprint.frame(frame);
        frames.add(at);
        let before = frames.before;
        let is_bound = |message: &BoundMessage| message.bus == *bus && message.ids.contains(id);
        let Some(position) = self.bound.iter().position(is_bound) else { return };
        let lights = &settings.gateway.lights;
        for (index, _, raw) in signals_in(&lights.table, *bus, frame) {
            let values = &mut self.values[index.0];
            if values.len() < MAX_VALUES || values.contains_key(&raw) {
                values.entry(raw).or_insert((0, at)).0 += 1;
            }
        }
        let survey = &mut self.messages[position];
        survey.frames += 1;
        if self.bound[position].ids.has_several_senders()
            && let Some(sender) = source_address(id)
        {
            *survey.senders.entry(sender).or_default() += 1;
        }
        if let Some(last) = survey.last.replace(at) {
            let gap = at.since(last);
            survey.longest_gap = survey.longest_gap.max(gap);
            if self.bound[position].timing.timeout().is_some_and(|timeout| gap > timeout) {
                // A frame since the last one of this message, other than one with the present stamp.
                let others_came = before.is_some_and(|before| before > last);
                survey.missing += u64::from(others_came);
                survey.bus_silent += u64::from(!others_came);
            }
        }
    }

    /// Adds the time of one step to the states before it, then reads the new states.
    pub(super) fn passed(&mut self, replay: &Replay, before: MonoTime) {
        let now = replay.now().mono;
        self.status.passed(now.since(before));
        let gateway = replay.gateway();
        self.motion.observe(gateway.vehicle_status(), gateway.buses(), replay.now());
        let lights = replay.gateway().lights();
        for (index, task) in TASKS.into_iter().enumerate() {
            let (previous_fault, was_published) =
                std::mem::replace(&mut self.current[index], lights.failure(task));
            let (fault, is_published) = self.current[index];
            self.was_published[index] |= is_published;
            if let Some(survey) = previous_fault.and_then(|was| self.faults.get_mut(&(index, was))) {
                survey.total += now.since(before);
            }
            if was_published {
                self.published[index] += now.since(before);
            }
            if previous_fault != fault
                && let Some(fault) = fault
            {
                let survey = self.faults.entry((index, fault)).or_insert(FaultSurvey::begin(now));
                survey.begins_again(self.was_published[index]);
            }
        }
    }

    /// Adds an output of a step.
    pub(super) fn given_out(&mut self, output: &Output, replay: &Replay) {
        self.status.given_out(output, replay);
        let Output::Diagnostics { diagnostics, .. } = output else { return };
        for status in &diagnostics.statuses {
            let Some(index) = TASKS.iter().position(|task| task.name() == status.task) else { continue };
            if let (Some(fault), _) = self.current[index] {
                self.remedies.entry((index, fault)).or_insert_with(|| status.remedy.clone());
            }
        }
    }

    /// Returns true if reports depend on a message, and each of them was published all the same.
    pub(super) fn published_without(&self, settings: &Settings, message: &BoundMessage) -> bool {
        let lights = &settings.gateway.lights;
        let is_of = |table: &SignalTable, signals: Vec<SignalIndex>| {
            signals.into_iter().any(|signal| {
                let of = &table.messages[table.signals[signal.0].message.0];
                (of.bus, of.ids) == (message.bus, message.ids)
            })
        };
        let of_lights = TASKS.into_iter().zip(self.was_published);
        let of_lights = of_lights.filter(|(task, _)| is_of(&lights.table, signals_of(lights, *task)));
        let status = &settings.gateway.status;
        let of_status = self.status.published();
        let of_status = of_status.filter(|(report, _)| is_of(&status.table, status.signals(*report)));
        let users: Vec<_> = of_lights
            .map(|(_, published)| published)
            .chain(of_status.map(|(_, published)| published))
            .collect();
        !users.is_empty() && users.into_iter().all(|was_published| was_published)
    }
}

#[cfg(test)]
mod tests;
