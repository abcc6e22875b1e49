//! A recording, played to its end: frames, values, and the reports that would have been published.

use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

use super::Report;
use super::decode::signals_in;
use crate::config::Settings;
use crate::core::can::input::CanInput;
use crate::core::time::MonoTime;
use crate::core::validation::integrity::IntegrityCounts;
use crate::core::validation::table::{BoundMessage, MessageIndex, SignalIndex};
use crate::core::vehicle_lights::role_texts::texts;
use crate::core::vehicle_lights::{FaultKind, Task};
use crate::replay::Replay;

/// Plays a recording to its end and lists its frames, values and reports.
///
/// # Errors
/// A recording that cannot be read to its end.
pub fn recording(settings: &Settings, mut replay: Replay) -> (Report, io::Result<()>) {
    let mut survey = Survey::new(settings, &replay);
    let outcome = loop {
        if let Some((input, at)) = replay.upcoming() {
            survey.frame(settings, input, at);
        }
        let before = replay.now().mono;
        match replay.step() {
            Ok(true) => {}
            Ok(false) => break Ok(()),
            Err(error) => break Err(error),
        }
        while replay.poll_output().is_some() {}
        survey.passed(&replay, before);
    };
    (survey.report(settings, &replay), outcome)
}

/// The largest number of different values that are listed one by one.
const MAX_VALUES: usize = 32;

#[derive(Debug, Clone, Default)]
struct MessageSurvey {
    frames: u64,
    last: Option<MonoTime>,
    longest_gap: Duration,
    too_long: u64,
}

#[derive(Debug)]
struct Survey {
    messages: Vec<MessageSurvey>,
    /// Raw values of each signal, with their number and the time of the first.
    values: Vec<BTreeMap<i128, (u64, MonoTime)>>,
    faults: BTreeMap<(usize, FaultKind), FaultSurvey>,
    /// State of each report since the last step: its fault, and whether it is published.
    current: [(Option<FaultKind>, bool); 2],
    /// Time of the first frame on a configured interface.
    start: MonoTime,
    published: [Duration; 2],
}

#[derive(Debug, Clone, Copy)]
struct FaultSurvey {
    times: u64,
    total: Duration,
    first: MonoTime,
}

const TASKS: [Task; 2] = [Task::TurnIndicators, Task::HazardLights];

impl Survey {
    fn new(settings: &Settings, replay: &Replay) -> Self {
        let (lights, start) = (&settings.gateway.lights, replay.now().mono);
        let mut survey = Self {
            messages: vec![MessageSurvey::default(); lights.table.messages.len()],
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
        let CanInput::Frame { bus, frame, .. } = input else { return };
        let lights = &settings.gateway.lights;
        for (index, _, raw) in signals_in(&lights.table, *bus, frame) {
            let values = &mut self.values[index.0];
            if values.len() < MAX_VALUES || values.contains_key(&raw) {
                values.entry(raw).or_insert((0, at)).0 += 1;
            }
        }
        let is_bound = |message: &BoundMessage| message.bus == *bus && message.id == frame.id();
        let Some(position) = lights.table.messages.iter().position(is_bound) else { return };
        let survey = &mut self.messages[position];
        survey.frames += 1;
        if let Some(last) = survey.last.replace(at) {
            let gap = at.since(last);
            survey.longest_gap = survey.longest_gap.max(gap);
            if let Some(timeout) = lights.table.messages[position].timing.timeout() {
                survey.too_long += u64::from(gap > timeout);
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
                let fresh = FaultSurvey { times: 0, total: Duration::ZERO, first: now };
                self.faults.entry((index, fault)).or_insert(fresh).times += 1;
            }
        }
    }

    fn report(&self, settings: &Settings, replay: &Replay) -> Report {
        let mut report = Report::default();
        let (counts, log) = (replay.counts(), replay.log());
        let length = seconds_text(replay.length());
        let interfaces = log.interfaces().join(", ");
        report.line("recording", &format!("{} frames in {length} on {interfaces}", counts.records));
        if let Some((line, reason)) = log.first_bad() {
            let bad = log.bad_lines();
            report.concern(&format!("{bad} lines cannot be read; the first is line {line}: {reason}"));
        }
        if counts.backwards + counts.jumps > 0 {
            let (late, jumps) = (counts.backwards, counts.jumps);
            report.concern(&format!("{late} stamps run backwards; jumps of the recorder's clock: {jumps}"));
        }
        if counts.records > 0 && counts.foreign == counts.records {
            report.concern("no frame was received on a configured interface: use --map INTERFACE=BUS");
        }
        self.report_messages(settings, replay, &mut report);
        self.report_values(settings, &mut report);
        self.report_faults(replay, &mut report);
        report
    }

    fn report_messages(&self, settings: &Settings, replay: &Replay, report: &mut Report) {
        let checkers = replay.gateway().lights().observations();
        for (index, (message, survey)) in
            settings.gateway.lights.table.messages.iter().zip(&self.messages).enumerate()
        {
            let interface = &settings.gateway.buses[usize::from(message.bus.0)].interface;
            let (name, id) = (&message.name, message.id);
            if survey.frames == 0 {
                report.concern(&format!("{name} ({id}) was never received on {interface}"));
                continue;
            }
            let gap = survey.longest_gap.as_millis();
            report.line("message", &format!("{name} ({id}): {} frames, longest gap {gap} ms", survey.frames));
            if survey.too_long > 0 {
                let times = times_text(survey.too_long);
                report.concern(&format!("{name} was silent for longer than its limit {times}"));
            }
            if let Some(counts) = checkers.integrity_counts(MessageIndex(index)) {
                report_integrity(name, counts, report);
            }
        }
    }

    fn report_values(&self, settings: &Settings, report: &mut Report) {
        let lights = &settings.gateway.lights;
        for (index, values) in self.values.iter().enumerate() {
            let name = &lights.table.signals[index].name;
            for (raw, (count, first)) in values {
                let texts = texts(lights, SignalIndex(index), *raw);
                let text: Vec<_> = texts.iter().map(|meaning| meaning.text.as_str()).collect();
                let first = seconds_text(*first);
                let line = format!(
                    "{name} = {raw} (0x{raw:X}) {}: {}, first at {first}",
                    text.join(", "),
                    times_text(*count)
                );
                if texts.iter().all(|meaning| meaning.defined) {
                    report.line("value", &line);
                } else {
                    report.concern(&line);
                }
            }
            if values.len() == MAX_VALUES {
                report.line("value", &format!("{name}: further values are not listed"));
            }
        }
    }

    fn report_faults(&self, replay: &Replay, report: &mut Report) {
        let lights = replay.gateway().lights();
        for (index, task) in TASKS.into_iter().enumerate() {
            if lights.tasks().all(|other| other != task) {
                continue;
            }
            let published = seconds_text(MonoTime::ZERO.after(self.published[index]));
            let whole = seconds_text(replay.now().mono);
            report.line("report", &format!("{} would be published for {published} of {whole}", task.name()));
            let faults = self.faults.iter().filter(|((of, _), _)| *of == index);
            for ((_, fault), FaultSurvey { times, total, first }) in faults {
                let kind = match fault {
                    FaultKind::Unknown => "unknown",
                    FaultKind::Invalid => "invalid",
                    FaultKind::HardwareFault => "hardware fault",
                };
                let total = seconds_text(MonoTime::ZERO.after(*total));
                let text = format!(
                    "{} {kind} {}, {total} in all, first at {}",
                    task.name(),
                    times_text(*times),
                    seconds_text(*first)
                );
                // Nothing is known before the first frame; that alone is not a concern.
                let start_only = *fault == FaultKind::Unknown
                    && *times == 1
                    && *first == self.start
                    && self.published[index] > Duration::ZERO;
                if start_only { report.line("", &text) } else { report.concern(&text) }
            }
        }
    }
}

/// Reports the integrity checks of a message's frames. The first frame of a counter cannot be checked, also after
/// a silence; that is not a warning.
fn report_integrity(name: &str, counts: IntegrityCounts, report: &mut Report) {
    let reasons: Vec<_> = counts
        .by_reason()
        .into_iter()
        .filter(|(_, count)| *count > 0)
        .map(|(reason, count)| format!("{count} {reason}"))
        .collect();
    let (trusted, lost, rejected) = (counts.trusted, counts.lost, counts.rejected());
    let why = if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join(", ")) };
    let text = format!("{name}: {trusted} trusted, {rejected} rejected{why}, {lost} lost by the counter");
    if rejected > counts.initial { report.concern(&text) } else { report.line("", &text) }
}

/// A number of occurrences.
fn times_text(count: u64) -> String {
    if count == 1 { "once".to_owned() } else { format!("{count} times") }
}

/// Seconds with three decimals.
fn seconds_text(at: MonoTime) -> String {
    let millis = at.as_nanos() / 1_000_000;
    format!("{}.{:03} s", millis / 1000, millis % 1000)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::files::{DEMO_CONFIG, Disk, Embedded};
    use crate::config::{Overrides, load, load_profile};
    use crate::io::can::log::Log;
    use crate::replay::Routes;

    fn survey(text: &str) -> Report {
        survey_of(&load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap(), text)
    }

    fn survey_of(settings: &Settings, text: &str) -> Report {
        let log = Log::new(Box::new(io::Cursor::new(text.as_bytes().to_vec()))).unwrap();
        let routes = Routes::by_interface(&settings.gateway);
        let replay = Replay::new(settings.gateway.clone(), log, routes).unwrap();
        let (report, outcome) = recording(settings, replay);
        outcome.unwrap();
        report
    }

    #[test]
    fn waiting_for_the_first_frame_is_not_a_warning() {
        let both = "(1.3) can0 2A5#0000000000000000\n(1.3) can0 2C1#0000000000000000\n(1.5) can0 111#\n";
        for before in ["", "(1.0) can9 111#00\n", "(1.0) can0 111#00\n"] {
            let report = survey(&format!("{before}{both}"));
            assert_eq!(report.concerns, 0, "{}", report.text);
        }
    }

    #[test]
    fn the_time_until_the_first_frame_counts_as_unknown() {
        let report = survey("(1.0) can0 111#00\n(1.3) can0 2A5#0000000000000000\n(1.4) can0 2A5#00\n");
        assert!(report.text.contains("turn_indicators unknown once, 0.300 s in all"), "{}", report.text);
        assert!(report.text.contains("turn_indicators would be published for 0.100 s of 0.400 s"));
    }

    /// The Volvo's two bits of counter, and 20 ms between frames.
    fn volvo(counters: &[u8]) -> (Settings, Report) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles/volvo_s60_2002.toml");
        let settings = load_profile(&Disk, &path).unwrap();
        let line = |(at, counter): (usize, &u8)| {
            format!("(1.{:03}) can0 0261300A#{:02X}00000000000000\n", at * 20, counter << 6)
        };
        let text: String = counters.iter().enumerate().map(line).collect();
        let report = survey_of(&settings, &text);
        (settings, report)
    }

    #[test]
    fn rejected_frames_are_a_warning_unless_they_are_the_first() {
        let (settings, report) = volvo(&[0, 1, 2, 3, 0]);
        let text = "           Indicator_Stalk: 4 trusted, 1 rejected (1 first frame, no counter before it)";
        assert!(report.text.contains(text), "{}", report.text);
        assert_eq!(report.concerns, 1, "only that hazard is not bound: {}", report.text);
        let (_, report) = volvo(&[0, 1, 3, 3, 0, 1, 2]);
        let text = "! Indicator_Stalk: 4 trusted, 3 rejected (1 first frame, no counter before it, \
                    1 repeated counter, 1 counter not in sequence for long enough), 1 lost by the counter";
        assert!(report.text.contains(text), "{}", report.text);
        assert_eq!(report.concerns, 2, "{}", report.text);
        let text = super::super::binding(&settings).text;
        assert!(text.contains("integrity check: a counter of 0 to 3 in steps of at most 2"), "{text}");
    }

    #[test]
    fn undefined_values_and_silences_are_warnings() {
        let report = survey("(1.0) can0 2A5#0000000000000000\n(2.0) can0 2A5#00000A0000000000\n");
        for concern in [
            "! BCM_TurnIndicators.TurnIndicatorState = 5 (0x5) turn UNDEFINED: once, first at 1.000 s",
            "! BCM_TurnIndicators was silent for longer than its limit once",
            "! BCM_Hazard (2C1) was never received on can0",
            "! turn_indicators invalid once, 0.000 s in all, first at 1.000 s",
        ] {
            assert!(report.text.contains(concern), "{concern}\n{}", report.text);
        }
    }
}
