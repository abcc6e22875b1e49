//! `decide` with a recording: runs the decider over Autoware's messages of a drive, and compares the signals.

use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::ValueEnum;
use clap::builder::PossibleValue;

use super::arguments::{Every, draw, file_name};
use super::failure::Failure;
use super::messages;
use crate::check::sample_faults;
use crate::config::drive::DriveFile;
use crate::config::gateway::topic_names::TopicNames;
use crate::daemon::publisher::decider_subscriptions;
use crate::desk::drive::recorded::{RecordedCycle, RecordedDrive, SignalSource};
use crate::io::ros::topics::{OutgoingTopic, SubscriptionKind};
use crate::io::sample_log::{SampleKind, SampleLog, SampleTopic};
use crate::report::drive::chart::DriveChart;
use crate::report::drive::shadow::{ShadowManoeuvre, ShadowSummary};
use crate::report::drive::{DriveForm, DriveWriter};
use can_log::file_budget::FileBudget;
use gateway_base::time::MonoTime;
use turn_signal::decision::BasisKind;
use turn_signal::flow::{DeciderRole, TurnSignalSettings};
use turn_signal::signal_judge::JudgedManoeuvre;
use turn_signal::vehicle_state::VehicleUse;

impl ValueEnum for SignalSource {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Planner => "The turn command of the planner",
            Self::Command => "The turn command that the vehicle interface receives",
            Self::Report => "The turn report of the vehicle, by which a driver is judged as well",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

pub(super) struct ReportForm<'a> {
    pub(super) is_json: bool,
    pub(super) every: Every,
    pub(super) picture: Option<&'a Path>,
    /// Signal to judge; `None` for the first signal with samples.
    pub(super) signal: Option<SignalSource>,
}

/// Records of the cycles: time, distance driven, and a sentence for each new decision.
#[derive(Default)]
struct Notes {
    driven: Vec<(MonoTime, f64)>,
    sentences: Vec<(MonoTime, String)>,
    /// True once the decider has had all required inputs.
    has_decided: bool,
}

/// Runs the decider over a recording, with settings and map of `file`. The topic names come from a
/// configuration, or are Autoware's.
pub(super) fn run(
    recording: &Path,
    file: &DriveFile,
    names: Option<&TopicNames>,
    form: &ReportForm<'_>,
) -> Result<ExitCode, Failure> {
    let opened = SampleLog::open(recording, topics(names), FileBudget::default());
    let mut log = opened.map_err(Failure::file(recording))?;
    let mut out = messages::result_lines(form.is_json);
    let numbers = if form.is_json { DriveForm::Json } else { DriveForm::Numbers };
    let (mut writer, mut narrator) = (DriveWriter::new(numbers), DriveWriter::new(DriveForm::Sentences));
    let is_verbose = messages::options().verbose || form.every == Every::Step;
    let mut charts = form.picture.map(|_| SignalSource::ALL.map(|_| DriveChart::new(file)));
    let (mut notes, mut drive, mut failed) = (Notes::default(), None, Ok(()));
    let mut on_cycle = |cycle: &RecordedCycle<'_>| {
        notes.driven.push((cycle.at, cycle.snapshot.at_m));
        notes.has_decided |= cycle.snapshot.decision.basis.kind() != BasisKind::NoInputs;
        if let Some(sentence) = narrator.write(&cycle.snapshot, false) {
            notes.sentences.push((cycle.at, sentence.trim().to_owned()));
        }
        let lines = writer.write(&cycle.snapshot, form.every == Every::Step);
        if let Some(lines) = lines.filter(|_| is_verbose && failed.is_ok()) {
            failed = writeln!(out, "{lines}");
        }
        for (chart, received) in charts.iter_mut().flatten().zip(cycle.received) {
            chart.add(&cycle.snapshot);
            chart.add_received(cycle.snapshot.at_m, received);
        }
    };
    while let Some(sample) = log.next_sample().map_err(Failure::file(recording))? {
        let kind = log.topics().get(sample.topic).map(|topic| topic.kind);
        let start = sample.logged;
        let drive = drive.get_or_insert_with(|| RecordedDrive::new(settings(file), start));
        if let Some(kind) = kind {
            drive.take(sample, kind, &mut on_cycle);
        }
    }
    failed?;
    warn(recording, &log);
    let source = source(&log, form.signal, recording)?;
    let Some(mut drive) = drive else {
        let reason = format!("the recording has none of the topics of the decider; {}", log.other_topics());
        return Err(unfit(recording, reason));
    };
    if !notes.has_decided {
        let said = notes.sentences.last().map_or("", |(_, sentence)| sentence);
        return Err(unfit(recording, format!("the decider could never decide; at the end: {said}")));
    }
    drive.finish();
    let (judged, counts) = drive.judged(source);
    let manoeuvres: Vec<ShadowManoeuvre> = judged.iter().map(|judged| notes.described(judged)).collect();
    let topic = log.topics().iter().find(|topic| topic.kind == source.sample_kind());
    let last = notes.driven.last().copied().unwrap_or((MonoTime::ZERO, 0.0));
    let summary = ShadowSummary {
        signal: source.name(),
        topic: topic.map_or_else(String::new, |topic| topic.name.clone()),
        samples: topic.map_or(0, |topic| topic.received),
        length_s: last.0.since(MonoTime::ZERO).as_secs_f64(),
        driven_m: last.1,
        agreement_percent: counts.total().agreement_percent(),
        counts: counts.clone(),
    };
    for manoeuvre in &manoeuvres {
        writeln!(out, "{}", if form.is_json { manoeuvre.json().to_string() } else { manoeuvre.text() })?;
    }
    writeln!(out, "{}", if form.is_json { summary.json().to_string() } else { summary.text() })?;
    out.flush()?;
    let chart =
        charts.and_then(|charts| SignalSource::ALL.into_iter().zip(charts).find(|(one, _)| *one == source));
    if let (Some(path), Some((_, mut chart))) = (form.picture, chart) {
        let marks = manoeuvres.iter().filter_map(|manoeuvre| Some((manoeuvre.at_m, manoeuvre.mark()?)));
        marks.for_each(|(at_m, sentence)| chart.add_mark(at_m, sentence));
        draw(path, &chart.chart(file_name(recording)))?;
    }
    let total = counts.total();
    Ok(if total.agree == total.judged() { ExitCode::SUCCESS } else { ExitCode::from(5) })
}

/// Returns the settings with which the file lets the decider run.
fn settings(file: &DriveFile) -> TurnSignalSettings {
    TurnSignalSettings {
        decider: file.decider.clone(),
        road: file.road.clone(),
        role: DeciderRole::Command,
        period: std::time::Duration::from_secs_f64(1.0 / file.planning_hz),
        publishes_sections: false,
        vehicle: VehicleUse::default(),
    }
}

impl Notes {
    /// Describes a manoeuvre with the distance driven until its start and the decision then.
    fn described(&self, judged: &JudgedManoeuvre) -> ShadowManoeuvre {
        let before = self.driven.partition_point(|(at, _)| *at < judged.start);
        let at_m = self.driven.get(before).map_or(0.0, |(_, driven_m)| *driven_m);
        let said = self.sentences.partition_point(|(at, _)| *at <= judged.start);
        let said = said.checked_sub(1).and_then(|said| self.sentences.get(said));
        ShadowManoeuvre::new(judged, at_m, said.map_or_else(String::new, |(_, sentence)| sentence.clone()))
    }
}

fn topics(names: Option<&TopicNames>) -> Vec<(String, SampleKind)> {
    let autoware = TopicNames::of_decider();
    let inputs = decider_subscriptions(names.unwrap_or(&autoware), true);
    let inputs = inputs.into_iter().map(|topic| (topic.name, SampleKind::Input(topic.kind)));
    let command = SubscriptionKind::TurnCommand;
    let report = OutgoingTopic::TurnIndicatorsReport.row().default_name;
    let signals = [
        (command.row().default_name.to_owned(), SampleKind::Input(command)),
        (report.to_owned(), SampleKind::TurnReport),
    ];
    inputs.chain(signals).collect()
}

fn source(log: &SampleLog, wanted: Option<SignalSource>, recording: &Path) -> Result<SignalSource, Failure> {
    let has_samples = |source: &SignalSource| {
        log.topics().iter().any(|topic| topic.kind == source.sample_kind() && topic.received > 0)
    };
    let mut sources =
        SignalSource::ALL.into_iter().filter(|source| wanted.is_none_or(|wanted| wanted == *source));
    sources.find(has_samples).ok_or_else(|| {
        let kinds = SignalSource::ALL.map(SignalSource::sample_kind);
        let is_signal = |topic: &&SampleTopic| kinds.contains(&topic.kind);
        let names: Vec<_> = log.topics().iter().filter(is_signal).map(|topic| topic.name.as_str()).collect();
        let reason = format!(
            "the recording has no turn signal to judge; {}; record one of {}",
            log.other_topics(),
            names.join(", ")
        );
        unfit(recording, reason)
    })
}

fn unfit(recording: &Path, reason: String) -> Failure {
    Failure::File(recording.to_owned(), io::Error::new(io::ErrorKind::InvalidData, reason))
}

fn warn(recording: &Path, log: &SampleLog) {
    let name = file_name(recording);
    for text in sample_faults(log) {
        messages::warn(&format!("{name}: {text}"));
    }
    let trajectory = SampleKind::Input(SubscriptionKind::Trajectory);
    let has_trajectory = log.topics().iter().any(|topic| topic.kind == trajectory && topic.received > 0);
    for topic in log.topics() {
        let advice = match topic.kind {
            SampleKind::Input(SubscriptionKind::Odometry | SubscriptionKind::Route) => String::new(),
            SampleKind::Input(SubscriptionKind::PlannedPath) if !has_trajectory => format!(
                "; for a planner that sends a trajectory, give a --config whose [turn_signal.inputs] names its topic: \
                 trajectory = \"/planning/trajectory\"; {}",
                log.other_topics()
            ),
            SampleKind::Input(_) | SampleKind::TurnReport | SampleKind::Frames { .. } | SampleKind::Calls => {
                continue;
            }
        };
        if topic.received == 0 && topic.undecodable == 0 {
            let topic = &topic.name;
            messages::warn(&format!(
                "{name} has no sample of {topic}, without which little can be decided{advice}"
            ));
        }
    }
}
