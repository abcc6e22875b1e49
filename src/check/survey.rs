//! A recording, played to its end: frames, values, and the reports that would have been published.

use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

use super::Report;
use super::decode::signals_in;
use crate::config::Settings;
use crate::core::can::error_frame::{bits, class, class_name};
use crate::core::can::frame::CanId;
use crate::core::can::input::CanInput;
use crate::core::can::link::BusIndex;
use crate::core::time::MonoTime;
use crate::core::validation::integrity::IntegrityCounts;
use crate::core::validation::table::{BoundMessage, MessageIndex, SignalIndex};
use crate::core::vehicle_lights::role_texts::texts;
use crate::core::vehicle_lights::{FaultKind, Task};
use crate::io::can::formats::BadLine;
use crate::io::can::log::no_frame;
use crate::replay::Replay;
use crate::report::text::{counted, times};

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
    (survey.report(settings, &replay), outcome)
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
        let mut survey = Self {
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
        let fresh = LastFrames { newest: (id, at), other: None };
        let last_frames = self.last_frames.entry(*bus).or_insert(fresh);
        let other_at = last_frames.newest_but(id);
        last_frames.add(id, at);
        let lights = &settings.gateway.lights;
        for (index, _, raw) in signals_in(&lights.table, *bus, frame) {
            let values = &mut self.values[index.0];
            if values.len() < MAX_VALUES || values.contains_key(&raw) {
                values.entry(raw).or_insert((0, at)).0 += 1;
            }
        }
        let is_bound = |message: &BoundMessage| message.bus == *bus && message.id == id;
        let Some(position) = self.bound.iter().position(is_bound) else { return };
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

    fn report(&self, settings: &Settings, replay: &Replay) -> Report {
        let mut report = Report::default();
        let (counts, log) = (replay.counts(), replay.log());
        let length = seconds_text(replay.length());
        let entries = counted(counts.records, "frame");
        match log.interfaces() {
            [] => report.concern("not one frame was read"),
            interfaces => {
                report.line("recording", &format!("{entries} in {length} on {}", interfaces.join(", ")));
            }
        }
        if let Some(first) = log.first_bad() {
            report.concern(&bad_lines_text(log.bad_lines(), first));
        }
        if counts.backwards > 0 {
            report.concern(&format!("the stamps run backwards {}", times(counts.backwards)));
        }
        if counts.jumps > 0 {
            report.concern(&format!("the recorder's clock jumped {}", times(counts.jumps)));
        }
        if counts.records > 0 && counts.foreign == counts.records {
            report.concern("no frame was received on a configured interface: use --map INTERFACE=BUS");
        }
        if self.bound.is_empty() {
            report.concern("the configuration binds no message, so the recording shows nothing");
        }
        self.report_errors(settings, &mut report);
        self.report_messages(settings, replay, &mut report);
        self.report_values(settings, &mut report);
        self.report_faults(replay, &mut report);
        report
    }

    fn report_errors(&self, settings: &Settings, report: &mut Report) {
        for (bus, survey) in &self.errors {
            let interface = &settings.gateway.buses[usize::from(bus.0)].interface;
            let classes =
                survey.classes.iter().map(|(bit, count)| format!("{} {}", class_name(*bit), times(*count)));
            let (frames, first) = (counted(survey.frames, "error frame"), seconds_text(survey.first));
            let classes = classes.collect::<Vec<_>>().join(", ");
            report.concern(&format!("{interface}: {frames}, first at {first}: {classes}"));
        }
    }

    fn report_messages(&self, settings: &Settings, replay: &Replay, report: &mut Report) {
        let lights = &settings.gateway.lights.table.messages;
        let checkers = replay.gateway().lights().observations();
        for (index, (message, survey)) in self.bound.iter().zip(&self.messages).enumerate() {
            let interface = &settings.gateway.buses[usize::from(message.bus.0)].interface;
            let (name, id) = (&message.name, message.id);
            if survey.frames == 0 {
                let instead = instead_of(message, settings, replay);
                report.concern(&format!("{name} ({id}) was never received on {interface}{instead}"));
                continue;
            }
            let (frames, gap) = (counted(survey.frames, "frame"), survey.longest_gap.as_millis());
            report.line("message", &format!("{name} ({id}): {frames}, longest gap {gap} ms"));
            let gaps = [
                (survey.missing, "while other frames came on"),
                (survey.bus_silent, "and so was everything else on"),
            ];
            for (count, how) in gaps.into_iter().filter(|(count, _)| *count > 0) {
                let count = times(count);
                report.concern(&format!(
                    "{name} was missing for longer than its limit {count}, {how} {interface}"
                ));
            }
            if index < lights.len()
                && let Some(counts) = checkers.integrity_counts(MessageIndex(index))
            {
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
                let (text, count) = (text.join(", "), times(*count));
                let line = format!("{name} = {raw} (0x{raw:X}) {text}: {count}, first at {first}");
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
            for ((_, fault), FaultSurvey { count, total, first }) in faults {
                let kind = match fault {
                    FaultKind::Unknown => "unknown",
                    FaultKind::Invalid => "invalid",
                    FaultKind::HardwareFault => "hardware fault",
                };
                let total = seconds_text(MonoTime::ZERO.after(*total));
                let text = format!(
                    "{} {kind} {}, {total} in all, first at {}",
                    task.name(),
                    times(*count),
                    seconds_text(*first)
                );
                // Nothing is known before the first frame; that alone is not a concern.
                let start_only = *fault == FaultKind::Unknown
                    && *count == 1
                    && *first == self.start
                    && self.published[index] > Duration::ZERO;
                if start_only { report.line("", &text) } else { report.concern(&text) }
            }
        }
    }
}

/// Text for the lines of a recording that cannot be read, with number and fault of the first.
pub fn bad_lines_text(count: u64, (line, reason): (u64, BadLine)) -> String {
    format!("{} cannot be read; the first is line {line}: {reason}", counted(count, "line"))
}

/// What came instead of a message that never came: its identifier with another number of bits, or on another interface.
fn instead_of(message: &BoundMessage, settings: &Settings, replay: &Replay) -> String {
    let other_kind = match message.id {
        CanId::Standard(id) => (CanId::extended(id.into()), 29),
        CanId::Extended(id) => (CanId::standard(id), 11),
    };
    let bus = &settings.gateway.buses[usize::from(message.bus.0)].name;
    let same = replay.seen_on(message.id).map(|interface| (interface, message.id, String::new()));
    let other =
        other_kind.0.into_iter().flat_map(|id| replay.seen_on(id).map(move |interface| (interface, id)));
    let other = other.map(|(interface, id)| (interface, id, format!(" with {} bits", other_kind.1)));
    let seen: Vec<_> = same
        .chain(other)
        .map(|(interface, id, bits)| match replay.bus_of(interface) {
            Some(known) if known == message.bus => format!(", but {id}{bits} was"),
            _ => format!(", but {id}{bits} was on {interface} (--map {interface}={bus})"),
        })
        .collect();
    seen.concat()
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
        let replay = Replay::surveying(settings.gateway.clone(), log, routes).unwrap();
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
    fn a_message_that_is_missing_while_others_come_is_told_from_a_silent_bus() {
        let before = "(1.0) can0 2A5#0000000000000000\n(1.0) can0 2C1#0000000000000000\n";
        let between = "(1.5) can0 111#00\n";
        let after = "(2.0) can0 2A5#0000000000000000\n";
        let text = survey(&format!("{before}{between}{after}")).text;
        let missing = "BCM_TurnIndicators was missing for longer than its limit once";
        assert!(text.contains(&format!("! {missing}, while other frames came on can0\n")), "{text}");
        let text = survey(&format!("{before}{after}")).text;
        assert!(text.contains(&format!("! {missing}, and so was everything else on can0\n")), "{text}");
    }

    #[test]
    fn error_frames_are_listed_by_class() {
        let text = survey(
            "(1.0) can0 2A5#0000000000000000\n(1.1) can0 20000204#0008000000006000\n(1.2) can0 20000088#0000000000000000\n\
             (1.3) can0 20000008#0000000000000000\n(1.4) can9 20000088#0000000000000000\n",
        )
        .text;
        let line =
            "! can0: 3 error frames, first at 0.100 s: controller once, protocol 2 times, bus-error once\n";
        assert!(text.contains(line), "{text}");
    }

    #[test]
    fn a_message_that_came_otherwise_is_said() {
        let text = survey("(1.0) can0 000002A5#00\n(1.1) can1 2C1#00\n(1.2) can0 000002A5#00\n").text;
        for line in [
            "! BCM_TurnIndicators (2A5) was never received on can0, but 000002A5 with 29 bits was\n",
            "! BCM_Hazard (2C1) was never received on can0, but 2C1 was on can1 (--map can1=body)\n",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
    }

    #[test]
    fn undefined_values_and_silences_are_warnings() {
        let report = survey("(1.0) can0 2A5#0000000000000000\n(2.0) can0 2A5#00000A0000000000\n");
        for concern in [
            "! BCM_TurnIndicators.TurnIndicatorState = 5 (0x5) turn UNDEFINED: once, first at 1.000 s",
            "! BCM_TurnIndicators was missing for longer than its limit once, and so was everything else on can0",
            "! BCM_Hazard (2C1) was never received on can0",
            "! turn_indicators invalid once, 0.000 s in all, first at 1.000 s",
        ] {
            assert!(report.text.contains(concern), "{concern}\n{}", report.text);
        }
    }
}
