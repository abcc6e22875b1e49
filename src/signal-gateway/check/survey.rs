//! Counts the frames and values of a replayed recording, and the reports that would have been published.

use std::collections::BTreeMap;
use std::time::Duration;

use super::decode::signals_in;
use super::fault_survey::FaultSurvey;
use super::vehicle_status::{StatusSurvey, bound_messages};
use crate::config::Settings;
use crate::replay::Replay;
use can_signal::can::error_frame::{bits, class};
use can_signal::can::{BusIndex, CanId, CanInput, source_address};
use can_signal::validation::table::BoundMessage;
use can_signal::validation::unusable::FaultKind;
use gateway_base::time::MonoTime;
use gateway_core::vehicle_lights::Task;
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
    /// Time of the first frame on a configured interface.
    pub(super) start: MonoTime,
    pub(super) published: [Duration; 2],
    pub(super) status: StatusSurvey,
    pub(super) motion: KinematicSurvey,
}

/// The frames of a bus: their identifiers, and the last times of the two most recent identifiers. For a
/// missing message, one of them is the newest frame of another message.
#[derive(Debug, Default)]
pub(super) struct BusFrames {
    pub(super) fingerprint: Fingerprint,
    newest: Option<(CanId, MonoTime)>,
    other: Option<(CanId, MonoTime)>,
}

impl BusFrames {
    fn add_last(&mut self, id: CanId, at: MonoTime) {
        if self.newest.is_some_and(|(known, _)| known != id) {
            self.other = self.newest;
        }
        self.newest = Some((id, at));
    }

    /// Returns the time of the newest frame with another identifier.
    fn newest_but(&self, id: CanId) -> Option<MonoTime> {
        let candidates = [self.newest, self.other];
        candidates.into_iter().flatten().find(|(known, _)| *known != id).map(|(_, at)| at)
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
            start,
            published: [Duration::ZERO; 2],
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
        let other_at = frames.newest_but(id);
        frames.add_last(id, at);
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
                let is_between = |other: MonoTime| other > last && other < at;
                let others_came = other_at.is_some_and(is_between);
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
            let (fault, _) = self.current[index];
            if let Some(survey) = previous_fault.and_then(|was| self.faults.get_mut(&(index, was))) {
                survey.total += now.since(before);
            }
            if was_published {
                self.published[index] += now.since(before);
            }
            if previous_fault != fault
                && let Some(fault) = fault
            {
                self.faults.entry((index, fault)).or_insert(FaultSurvey::begin(now)).count += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests;
