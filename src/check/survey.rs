//! A recording, played to its end: frames, values, and the reports that would have been published.

mod listing;

use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

use super::Report;
use super::decode::signals_in;
use crate::config::Settings;
use crate::core::can::error_frame::{bits, class};
use crate::core::can::frame::CanId;
use crate::core::can::input::CanInput;
use crate::core::can::link::BusIndex;
use crate::core::plausibility::evidence::ProfileEvidence;
use crate::core::time::MonoTime;
use crate::core::validation::table::BoundMessage;
use crate::core::vehicle_lights::{FaultKind, Task};
use crate::io::can::log::no_frame;
use crate::replay::Replay;
pub use listing::bad_lines_text;

/// Plays a recording to its end and lists its frames, values and reports.
///
/// # Errors
/// A recording that cannot be read to its end, or of which not one frame was read.
pub fn recording(settings: &Settings, mut replay: Replay) -> (Report, io::Result<()>) {
    let mut survey = Survey::new(settings, &replay);
    let outcome = loop {
        if let Some((input, at)) = replay.upcoming() {
            survey.frame(settings, input, at);
        }
        let before = replay.now().mono;
        match replay.step() {
            Ok(true) => {}
            Ok(false) if replay.counts().records == 0 => break Err(no_frame()),
            Ok(false) => break Ok(()),
            Err(error) => break Err(error),
        }
        while replay.poll_output().is_some() {}
        survey.passed(&replay, before);
    };
    (listing::report(&survey, settings, &replay), outcome)
}

/// The largest number of different values that are listed one by one.
const MAX_VALUES: usize = 32;

#[derive(Debug, Clone, Default)]
struct MessageSurvey {
    frames: u64,
    last: Option<MonoTime>,
    longest_gap: Duration,
    /// Gaps beyond the limit with other frames on the same bus in between.
    missing: u64,
    /// Gaps beyond the limit without any frame on the bus in between.
    bus_silent: u64,
}

/// Error frames of one bus.
#[derive(Debug, Clone, Default)]
struct ErrorSurvey {
    frames: u64,
    first: MonoTime,
    classes: BTreeMap<u32, u64>,
}

#[derive(Debug)]
struct Survey {
    evidence: ProfileEvidence,
    /// Messages of the vehicle's lights, then those of V2I alone.
    bound: Vec<BoundMessage>,
    messages: Vec<MessageSurvey>,
    errors: BTreeMap<BusIndex, ErrorSurvey>,
    /// The last frames of each bus, bound or not.
    last_frames: BTreeMap<BusIndex, LastFrames>,
    /// Raw values of each signal, with their number and the time of the first.
    values: Vec<BTreeMap<i128, (u64, MonoTime)>>,
    faults: BTreeMap<(usize, FaultKind), FaultSurvey>,
    /// State of each report since the last step: its fault, and whether it is published.
    current: [(Option<FaultKind>, bool); 2],
    /// Time of the first frame on a configured interface.
    start: MonoTime,
    published: [Duration; 2],
}

/// The last two different identifiers on a bus, with the time of their last frame: at the end of a gap of one message
/// the newest frame of another one is among them.
#[derive(Debug, Clone, Copy)]
struct LastFrames {
    newest: (CanId, MonoTime),
    other: Option<(CanId, MonoTime)>,
}

impl LastFrames {
    fn add(&mut self, id: CanId, at: MonoTime) {
        if self.newest.0 != id {
            self.other = Some(self.newest);
        }
        self.newest = (id, at);
    }

    /// The time of the newest frame of another identifier.
    fn newest_but(&self, id: CanId) -> Option<MonoTime> {
        let candidates = [Some(self.newest), self.other];
        candidates.into_iter().flatten().find(|(known, _)| *known != id).map(|(_, at)| at)
    }
}

#[derive(Debug, Clone, Copy)]
struct FaultSurvey {
    count: u64,
    total: Duration,
    first: MonoTime,
}

const TASKS: [Task; 2] = [Task::TurnIndicators, Task::HazardLights];

impl Survey {
    fn new(settings: &Settings, replay: &Replay) -> Self {
        let (lights, start) = (&settings.gateway.lights, replay.now().mono);
        let known = &lights.table.messages;
        // A message with both is one message.
        let others = settings.gateway.v2i.table.messages.iter().filter(|message| !known.contains(message));
        let bound: Vec<_> = known.iter().chain(others).cloned().collect();
        let databases: Vec<_> = settings.dbcs.iter().map(|dbc| &dbc.database).collect();
        let mut survey = Self {
            evidence: ProfileEvidence::new(lights, &settings.gateway.v2i.table, &databases),
            messages: vec![MessageSurvey::default(); bound.len()],
            bound,
            errors: BTreeMap::new(),
            last_frames: BTreeMap::new(),
            values: vec![BTreeMap::new(); lights.table.signals.len()],
            faults: BTreeMap::new(),
            current: [(None, false); 2],
            start,
            published: [Duration::ZERO; 2],
        };
        survey.passed(replay, start);
        survey
    }

    /// Takes a frame that is about to be handled.
    fn frame(&mut self, settings: &Settings, input: &CanInput, at: MonoTime) {
        if let CanInput::ErrorFrame { bus, error } = input {
            let fresh = ErrorSurvey { first: at, ..ErrorSurvey::default() };
            let survey = self.errors.entry(*bus).or_insert(fresh);
            survey.frames += 1;
            for bit in bits(error.class()).filter(|bit| *bit != class::COUNTERS) {
                *survey.classes.entry(bit).or_default() += 1;
            }
        }
        let CanInput::Frame { bus, frame, .. } = input else { return };
        let id = frame.id();
        self.evidence.frame(*bus, frame, at);
        let fresh = LastFrames { newest: (id, at), other: None };
        let last_frames = self.last_frames.entry(*bus).or_insert(fresh);
        let other_at = last_frames.newest_but(id);
        last_frames.add(id, at);
        let is_bound = |message: &BoundMessage| message.bus == *bus && message.id == id;
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

    /// Adds the time of one step to the states during it, then takes over the present ones.
    fn passed(&mut self, replay: &Replay, before: MonoTime) {
        let now = replay.now().mono;
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
                let fresh = FaultSurvey { count: 0, total: Duration::ZERO, first: now };
                self.faults.entry((index, fault)).or_insert(fresh).count += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests;
