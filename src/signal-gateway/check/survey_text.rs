//! Plays a recording, and reports its facts and findings.

use std::collections::BTreeMap;
use std::io;
use std::time::Duration;

use super::dimensions;
use super::fault_survey::seconds_text;
use super::finding_text::{finding_text, fix, kind};
use super::kind::CheckKind;
use super::kinematics;
use super::names::value_name;
use super::report::CheckReport;
use super::survey::{MAX_VALUES, RecordingSurvey, TASKS};
use crate::config::Settings;
use crate::io::sample_log::SampleLog;
use crate::replay::Replay;
use crate::report::text::{counted, times};
use can_log::{Breakage, Log, no_frame};
use can_signal::can::error_frame::class_name;
use can_signal::can::{CanId, source_address};
use can_signal::validation::display::raw_and_bits;
use can_signal::validation::integrity::IntegrityCounts;
use can_signal::validation::table::{BoundMessage, BoundSignal, MessageIndex, SignalIndex};
use can_signal::validation::unusable::FaultKind;
use gateway_base::time::MonoTime;
use gateway_base::time::gap_filling::ShortenedGaps;
use gateway_core::vehicle_lights::Task;
use gateway_core::vehicle_lights::binding::HazardBinding;
use gateway_core::vehicle_lights::role_texts::texts;
use vehicle_bringup::plausibility::finding::{FindingKind, Severity, findings, other_platform};

/// Maximum number of identifiers listed instead of a message.
const MAX_INSTEAD: usize = 4;

/// Plays a recording to its end and lists its frames, values and reports. The second value is an error if the
/// recording could not be read to its end, or has no frame.
pub fn recording(settings: &Settings, mut replay: Replay) -> (CheckReport, io::Result<()>) {
    let mut survey = RecordingSurvey::new(settings, &replay);
    let outcome = loop {
        if let Some((input, at)) = replay.upcoming()
            && let Some(input) = input.can()
        {
            survey.frame(settings, input, at);
        }
        let before = replay.now().mono;
        match replay.step() {
            Ok(true) => {}
            Ok(false) if replay.counts().records == 0 => break Err(no_frame()),
            Ok(false) => break Ok(()),
            Err(error) => break Err(error),
        }
        survey.passed(&replay, before);
        while let Some(output) = replay.poll_output() {
            survey.given_out(&output, &replay);
        }
    };
    let mut report = report(&survey, settings, &replay);
    let published: Vec<_> = survey.status.published().collect();
    let ratio = kinematics::motion(survey.motion, settings, &mut report);
    dimensions::of_recording(settings, &published, ratio, &mut report);
    (report, outcome)
}

fn report(survey: &RecordingSurvey, settings: &Settings, replay: &Replay) -> CheckReport {
    let mut report = CheckReport::default();
    let (counts, log) = (replay.counts(), replay.log());
    let length = seconds_text(replay.length());
    let entries = counted(counts.records, "frame");
    match log.interfaces() {
        [] => report.find(Severity::Error, CheckKind::NoFrame, "not one frame was read"),
        interfaces => {
            report.line("recording", format!("{entries} in {length} on {}", interfaces.join(", ")));
        }
    }
    for text in recording_faults(replay) {
        report.find(Severity::Warning, CheckKind::RecordingFault, text);
    }
    if counts.records > 0 && counts.foreign == counts.records {
        let text = "no frame was received on a configured interface";
        report.find(Severity::Error, CheckKind::ForeignInterface, text);
    }
    if survey.bound.is_empty() {
        let text = "the configuration binds no message, so the recording shows nothing";
        report.find(Severity::Warning, CheckKind::NothingBound, text);
    }
    errors(survey, settings, &mut report);
    messages(survey, settings, replay, &mut report);
    values(survey, settings, &mut report);
    let mut cold_starts = states(survey, settings, replay, &mut report);
    let explained = dimensions::withheld(settings, survey.status.published());
    cold_starts.extend(survey.status.lines(replay.now().mono, &explained, &mut report));
    if !cold_starts.is_empty() {
        let waits = cold_starts
            .iter()
            .map(|(name, waited)| format!("{name} for {}", seconds_text(MonoTime::ZERO.after(*waited))));
        let text =
            format!("withheld until the first values arrived: {}", waits.collect::<Vec<_>>().join(", "));
        report.find(Severity::Note, CheckKind::ColdStart, text);
    }
    let platforms = settings.dbcs.iter().filter_map(|dbc| {
        let fingerprint = &survey.buses.get(usize::from(dbc.index.0))?.fingerprint;
        other_platform(fingerprint.compare_best(dbc.identifier_lists.iter().copied())?)
    });
    for finding in platforms.chain(findings(&survey.evidence)) {
        // Values are listed individually, unless most are wrong.
        let is_listed =
            matches!(finding.kind, FindingKind::Undefined { .. }) && finding.severity < Severity::Error;
        if !is_listed {
            let text = finding_text(&survey.evidence, &finding.kind);
            let fix = fix(&survey.evidence, &finding.kind);
            report.find_fixable(finding.severity, kind(&finding.kind), text, fix);
        }
    }
    report
}

fn errors(survey: &RecordingSurvey, settings: &Settings, report: &mut CheckReport) {
    for (bus, errors) in &survey.errors {
        let interface = &settings.gateway.buses[usize::from(bus.0)].interface;
        let classes =
            errors.classes.iter().map(|(bit, count)| format!("{} {}", class_name(*bit), times(*count)));
        let (frames, first) = (counted(errors.frames, "error frame"), seconds_text(errors.first));
        let classes = classes.collect::<Vec<_>>().join(", ");
        let text = format!("{interface}: {frames}, first at {first}: {classes}");
        report.find(Severity::Warning, CheckKind::ErrorFrames, text);
    }
}

fn messages(survey: &RecordingSurvey, settings: &Settings, replay: &Replay, report: &mut CheckReport) {
    let lights = &settings.gateway.lights.table.messages;
    let checkers = replay.gateway().lights().observations();
    for (index, (message, received)) in survey.bound.iter().zip(&survey.messages).enumerate() {
        let interface = &settings.gateway.buses[usize::from(message.bus.0)].interface;
        let (name, ids) = (&message.name, message.ids);
        if received.frames == 0 {
            let instead = instead_of(message, settings, replay);
            let text = format!("{name} ({ids}) was never received on {interface}{instead}");
            let (severity, kind) = if survey.published_without(settings, message) {
                (Severity::Note, CheckKind::UnusedAlternative)
            } else {
                (Severity::Warning, CheckKind::MessageNotReceived)
            };
            report.find(severity, kind, text);
            continue;
        }
        let (frames, gap) = (counted(received.frames, "frame"), received.longest_gap.as_millis());
        let median = survey.evidence.messages.get(index).and_then(|message| message.gaps.median());
        let usual =
            median.map_or(String::new(), |median| format!(", usually every {} ms", median.as_millis()));
        report.line("message", format!("{name} ({ids}): {frames}{usual}, longest gap {gap} ms"));
        senders(name, &received.senders, report);
        let gaps = [
            (received.missing, CheckKind::MessageMissing, "while other frames came on"),
            (received.bus_silent, CheckKind::BusSilent, "and so was everything else on"),
        ];
        for (count, kind, how) in gaps.into_iter().filter(|(count, ..)| *count > 0) {
            let count = times(count);
            let text = format!("{name} was missing for longer than its limit {count}, {how} {interface}");
            report.find(Severity::Warning, kind, text);
        }
        if index < lights.len()
            && let Some(counts) = checkers.integrity_counts(MessageIndex(index))
        {
            integrity(name, counts, report);
        }
    }
}

/// Lists the senders of a message that may have several. Two simultaneous senders contradict each other.
fn senders(name: &str, senders: &BTreeMap<u8, u64>, report: &mut CheckReport) {
    let counts = senders.iter().map(|(sender, count)| format!("{sender:02X} ({})", counted(*count, "frame")));
    let counts = counts.collect::<Vec<_>>().join(", ");
    match senders.len() {
        0 => {}
        1 => report.line("", format!("from source address {counts}")),
        _ => {
            let text = format!("{name} comes from source addresses {counts}");
            let remedy = format!("choose one with source_addresses of [message.{name}]");
            report.find_with(Severity::Warning, CheckKind::SeveralSenders, text, remedy);
        }
    }
}

fn values(survey: &RecordingSurvey, settings: &Settings, report: &mut CheckReport) {
    let lights = &settings.gateway.lights;
    let mut rows = Vec::new();
    for (index, values) in survey.values.iter().enumerate() {
        let BoundSignal { name, codec, .. } = &lights.table.signals[index];
        for (raw, (count, first)) in values {
            let signal = SignalIndex(index);
            let texts = texts(lights, signal, *raw);
            let meaning: Vec<_> = texts.iter().map(|meaning| meaning.text.as_str()).collect();
            let meaning = meaning.join(", ");
            let named = value_name(settings, &lights.table, signal, *raw)
                .map_or(String::new(), |name| format!(" {name:?}"));
            let (first, seen) = (seconds_text(*first), times(*count));
            if !texts.iter().all(|meaning| meaning.defined) {
                let severity = if *count == 1 { Severity::Note } else { Severity::Warning };
                let value = raw_and_bits(*raw, codec);
                let text = format!("{name} = {value}{named} {meaning}: {seen}, first at {first}");
                report.find(severity, CheckKind::UndefinedValue, text);
            }
            rows.push([format!("{name} = {raw}{named}"), meaning, format!("{seen}, first at {first}")]);
        }
        if values.len() == MAX_VALUES {
            rows.push([format!("{name}: further values"), String::new(), "not listed".to_owned()]);
        }
    }
    let width = |column: usize| {
        rows.iter().map(|row: &[String; 3]| row[column].chars().count()).max().unwrap_or_default()
    };
    let (first, second) = (width(0), width(1));
    for [value, meaning, count] in &rows {
        report.line("value", format!("{value:first$}  {meaning:second$}  {count}"));
    }
}

/// Lists how long each report of the lights would be published, and its faults. Returns the reports that had
/// to wait for their first value.
fn states(
    survey: &RecordingSurvey,
    settings: &Settings,
    replay: &Replay,
    report: &mut CheckReport,
) -> Vec<(&'static str, Duration)> {
    let mut cold_starts = Vec::new();
    let lights = replay.gateway().lights();
    for (index, task) in TASKS.into_iter().enumerate() {
        let is_not_visible = task == Task::HazardLights
            && matches!(settings.gateway.lights.hazard, HazardBinding::NotVisible { .. });
        if is_not_visible || lights.tasks().all(|other| other != task) {
            continue;
        }
        let published = seconds_text(MonoTime::ZERO.after(survey.published[index]));
        let whole = seconds_text(replay.now().mono);
        report.line("report", format!("{} would be published for {published} of {whole}", task.name()));
        let faults = survey.faults.iter().filter(|((of, _), _)| *of == index);
        for (of, survey_of_fault) in faults {
            let (_, fault) = of;
            let kind = match fault {
                FaultKind::Unknown => "unknown",
                FaultKind::Invalid => "invalid",
                FaultKind::HardwareFault => "hardware fault",
            };
            let text = format!("{} {kind} {}", task.name(), survey_of_fault.text());
            if survey_of_fault.is_cold_start(Some(*fault), survey.was_published[index]) {
                report.line("", text);
                cold_starts.push((task.name(), survey_of_fault.total));
            } else {
                let remedy = survey.remedies.get(of).filter(|remedy| !remedy.is_empty());
                let remedy = remedy.map_or(CheckKind::ReportWithheld.remedy(), String::as_str);
                report.find_with(Severity::Warning, CheckKind::ReportWithheld, text, remedy);
            }
        }
    }
    cold_starts
}

/// Describes unreadable parts of a recording, and implausible stamps.
pub fn log_faults(log: &Log) -> impl Iterator<Item = String> {
    let bad_lines = log.first_bad().map(|(line, reason)| {
        let lines = counted(log.bad_lines(), "line");
        format!("{lines} cannot be read; the first is line {line}: {reason}")
    });
    let breakage = log.breakage().map(Breakage::to_string);
    bad_lines.into_iter().chain(breakage).chain(log.densest().map(|crowd| crowd.to_string()))
}

/// Describes ROS 2 samples of a recording that could not be read.
pub fn sample_faults(log: &SampleLog) -> impl Iterator<Item = String> {
    let (losses, first) = log.losses();
    let lost = first.map(|reason| format!("{losses} parts could not be read, the first one: {reason}"));
    let undecodable = log.topics().iter().filter_map(|topic| {
        let (count, reason) = (topic.undecodable, topic.reason.as_ref()?);
        Some(format!("{}: {count} samples are not of the topic's type: {reason}", topic.name))
    });
    lost.into_iter().chain(undecodable)
}

/// Describes the faults of a replayed recording.
pub fn recording_faults(replay: &Replay) -> Vec<String> {
    let counts = replay.counts();
    let count = |count: u64, text: String| (count > 0).then_some(text);
    let of_times = [
        count(counts.backwards, format!("the stamps run backwards {}", times(counts.backwards))),
        count(counts.jumps, format!("the recorder's clock jumped {}", times(counts.jumps))),
        count(counts.gaps, {
            let longest = seconds_text(MonoTime::ZERO.after(counts.longest_gap));
            format!(
                "the recording is silent for more than a minute {}, for {longest} at most",
                times(counts.gaps)
            )
        }),
    ];
    let ShortenedGaps { count: shortened, first } = replay.shortened_gaps();
    let shortened = count(shortened, {
        let (gaps, first) = (times(shortened), seconds_text(first));
        format!(
            "the recording is mostly silence, and reports are not repeated for long in {gaps}, from {first} on: replay its \
             parts one by one"
        )
    });
    // A truncated file is also reported for its frames.
    let of_samples = replay.samples().into_iter().flat_map(sample_faults);
    log_faults(replay.log())
        .chain(of_times.into_iter().flatten())
        .chain(shortened)
        .chain(of_samples)
        .collect()
}

/// Describes frames that arrived instead of a missing message: on another interface, with another identifier
/// length, or from another sender.
fn instead_of(message: &BoundMessage, settings: &Settings, replay: &Replay) -> String {
    let (ids, described) = (message.ids, message.ids.described());
    let bus = &settings.gateway.buses[usize::from(message.bus.0)].name;
    let instead = replay.seen().filter(|(_, id, _)| ids.resembles(*id)).map(|(interface, id, count)| {
        let how = match id {
            _ if ids.contains(id) => String::new(),
            CanId::Standard(_) => " with 11 bits".to_owned(),
            CanId::Extended(number) if number == described.number() => " with 29 bits".to_owned(),
            CanId::Extended(_) => {
                let source = source_address(id).unwrap_or_default();
                format!(", the same J1939 group from source address {source:02X},")
            }
        };
        let frames = counted(count, "frame");
        match replay.bus_of(interface) {
            Some(known) if known == message.bus => format!(", but {frames} of {id}{how} came"),
            _ => format!(", but {frames} of {id}{how} came on {interface} (--map {interface}={bus})"),
        }
    });
    instead.take(MAX_INSTEAD).collect()
}

/// Reports the integrity checks of a message. A counter cannot be checked in its first frame, or in the first
/// after a silence; this is not a finding.
fn integrity(name: &str, counts: IntegrityCounts, report: &mut CheckReport) {
    let reasons: Vec<_> = counts
        .by_reason()
        .into_iter()
        .filter(|(_, count)| *count > 0)
        .map(|(reason, count)| format!("{count} {reason}"))
        .collect();
    let (trusted, lost, rejected) = (counts.trusted, counts.lost, counts.rejected());
    let why = if reasons.is_empty() { String::new() } else { format!(" ({})", reasons.join(", ")) };
    let text = format!("{name}: {trusted} trusted, {rejected} rejected{why}, {lost} lost by the counter");
    if rejected > counts.initial {
        report.find(Severity::Warning, CheckKind::IntegrityRejected, text);
    } else {
        report.line("", text);
    }
}
