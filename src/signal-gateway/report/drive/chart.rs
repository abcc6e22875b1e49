//! A drive as a chart: the lanelets of its route, the speed, the planner's manoeuvres, for each `compat` the
//! sections of every candidate and the resulting signal, each changeover with its reason, and the way on the
//! map.

mod map;

use std::ops::Range;

use super::sentence::Narrator;
use super::snapshot::Snapshot;
use crate::config::drive::{DriveFile, Expectation, IntervalUnit, PlanKind, PlannedShift};
use crate::report::chart::{Along, Bar, Chart, CommandKind, IndicatorState, Lane, Look, Mark, Row};
use turn_signal::compat::DeciderCompat;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::resolve::CandidateSource;
use turn_signal::subject::SignalSubject;

/// Records whose ends are closer together than this are one, metres; their starts may advance.
const SAME_M: f64 = 1.0;

/// Collects the contents of the chart during a drive, for one `compat` after the other.
#[derive(Debug, Clone)]
pub struct DriveChart<'a> {
    file: &'a DriveFile,
    lanelets: Vec<Bar>,
    /// The cycles of the first `compat`.
    cycles: Vec<map::Cycle>,
    runs: Vec<CompatRun>,
}

#[derive(Debug, Clone, Default)]
struct CompatRun {
    compat: DeciderCompat,
    records: Vec<Record>,
    signals: Vec<Driven>,
    received: Vec<Driven>,
    narrator: Narrator,
    /// Sentence for each change, with its position, metres.
    sentences: Vec<(f64, String)>,
}

/// A signal over a part of the route driven in one direction, metres.
#[derive(Debug, Clone, Copy)]
struct Driven {
    from_m: f64,
    to_m: f64,
    indicator: IndicatorState,
}

/// The sections of a candidate along the route.
#[derive(Debug, Clone)]
struct Record {
    source: CandidateSource,
    subject: SignalSubject,
    indicator: IndicatorState,
    desired_m: Range<f64>,
    required_m: Range<f64>,
}

impl<'a> DriveChart<'a> {
    /// Creates a chart without cycles.
    pub fn new(file: &'a DriveFile) -> Self {
        Self { file, lanelets: Vec::new(), cycles: Vec::new(), runs: Vec::new() }
    }

    /// Adds the decision at a cycle; the cycles of one `compat` must be consecutive.
    pub fn add(&mut self, snapshot: &Snapshot<'_>) {
        let &Snapshot { compat, at_m, decision, .. } = snapshot;
        if self.runs.last().is_none_or(|run| run.compat != compat) {
            self.runs.push(CompatRun { compat, ..CompatRun::default() });
        }
        if self.runs.len() == 1 {
            self.add_lanelet(snapshot);
            let indicator = indicator_of(decision.turn, decision.hazard);
            self.cycles.push(map::Cycle::new(snapshot, indicator));
        }
        let front_m = self.file.decider.vehicle.front_m();
        let Some(run) = self.runs.last_mut() else { return };
        add_signal(&mut run.signals, at_m, indicator_of(decision.turn, decision.hazard));
        let (sentence, is_new) = run.narrator.next(snapshot);
        let rule = decision.case().map_or_else(String::new, |case| format!(" (rule {case})"));
        run.sentences.extend(is_new.then(|| (at_m, sentence + &rule)));
        for evaluated in decision.evaluated() {
            let (Some(_), Some(distances)) = (evaluated.turn.side(), evaluated.distances) else { continue };
            let front_at = |distance_m: f64| at_m + front_m + distance_m;
            run.add_record(Record {
                source: evaluated.source,
                subject: evaluated.subject,
                indicator: indicator_of(evaluated.turn, HazardCommand::Disable),
                desired_m: front_at(distances.desired_start_m)..at_m + distances.desired_end_m,
                required_m: front_at(distances.required_start_m)..at_m + distances.required_end_m,
            });
        }
    }

    /// Adds the signal of another source at the last cycle; `None` while it is unknown.
    pub fn add_received(&mut self, at_m: f64, turn: Option<TurnCommand>) {
        let indicator = indicator_of(turn.unwrap_or(TurnCommand::NoCommand), HazardCommand::Disable);
        if let Some(run) = self.runs.last_mut() {
            add_signal(&mut run.received, at_m, indicator);
        }
    }

    /// Adds a mark with a sentence.
    pub fn add_mark(&mut self, at_m: f64, sentence: String) {
        if let Some(run) = self.runs.last_mut() {
            run.sentences.push((at_m, sentence));
        }
    }

    /// Returns the chart of all snapshots.
    pub fn chart(self, title: String) -> Chart {
        let file = self.file;
        let driven = self.runs.iter().flat_map(|run| &run.signals);
        let ends = driven.flat_map(|driven| [driven.from_m, driven.to_m]);
        let driven_m = ends.fold(f64::INFINITY..f64::NEG_INFINITY, |driven_m, end_m| {
            driven_m.start.min(end_m)..driven_m.end.max(end_m)
        });
        let planner = |bars| Row { label: "planner".to_owned(), bars };
        let plans = file.manoeuvres.iter().map(|plan| planner(planned(&plan.kind)));
        let lanelets = Row { label: "lanelets".to_owned(), bars: self.lanelets };
        let speed = Row { label: map::speed_label(&self.cycles), bars: map::speed(&self.cycles, &driven_m) };
        let Range { start: from, end: to } = driven_m;
        let rows = [lanelets, speed].into_iter().chain(plans).collect();
        let mut lanes = vec![Lane { label: "route".to_owned(), rows }];
        lanes.extend(self.runs.iter().map(|run| {
            let ours = file.expectations.iter().filter(|one| one.compats.contains(&run.compat));
            run.lane(ours.filter_map(expected).collect())
        }));
        for lane in &mut lanes {
            for row in &mut lane.rows {
                for bar in &mut row.bars {
                    bar.from = bar.from.clamp(from.min(to), to.max(from));
                    bar.to = bar.to.clamp(from.min(to), to.max(from));
                }
                row.bars.retain(|bar| bar.from < bar.to);
            }
            // Bars beyond the drive must not leave an empty row.
            lane.rows.retain(|row| !row.bars.is_empty());
        }
        let plan = Some(map::plan(file, &self.cycles));
        let mut marks = map::stops(&self.cycles);
        marks.extend(changeovers(self.runs));
        let front_m = file.decider.vehicle.front_m();
        let subtitle = format!(
            "signals over the position of the rear axle; the front, which is {front_m:.2} m ahead, counts for the \
             starts of sections, the rear axle for their ends"
        );
        let along = Along::Distance;
        Chart { title, subtitle, along, from, to, lanes, marks, plan, ..Chart::default() }
    }

    fn add_lanelet(&mut self, snapshot: &Snapshot<'_>) {
        let lane = snapshot.lane.and_then(|id| self.file.road.lane(id));
        let side = lane.and_then(|lane| map::side(lane.turn_direction));
        let name = lane.map_or_else(|| "?".to_owned(), |lane| lane.id.to_string());
        let at_m = snapshot.at_m;
        let mut bar = Bar { from: at_m, to: at_m, look: Look::Lanelet(side, name) };
        let Some(first) = self.lanelets.first_mut() else { return self.lanelets.push(bar) };
        if at_m < first.from {
            // The vehicle backs beyond the start.
            bar.to = std::mem::replace(&mut first.from, at_m);
            if first.look != bar.look {
                first.from = bar.to;
                self.lanelets.insert(0, bar);
            }
        } else if let Some(last) = self.lanelets.last_mut().filter(|last| at_m >= last.to) {
            last.to = at_m;
            if last.look != bar.look {
                self.lanelets.push(bar);
            }
        }
    }
}

/// Returns the changeovers, those common to several runs only once.
fn changeovers(runs: Vec<CompatRun>) -> Vec<Mark> {
    let mut marks: Vec<(f64, String, Vec<&'static str>)> = Vec::new();
    let several = runs.len() > 1;
    for run in runs {
        for (at, sentence) in run.sentences {
            let known =
                marks.iter_mut().find(|(known, text, _)| known.total_cmp(&at).is_eq() && *text == sentence);
            match known {
                Some((.., names)) => names.push(run.compat.name()),
                None => marks.push((at, sentence, vec![run.compat.name()])),
            }
        }
    }
    let text = |sentence, names: Vec<_>| {
        if several { format!("{}: {sentence}", names.join(", ")) } else { sentence }
    };
    marks.into_iter().map(|(at, sentence, names)| Mark { at, text: text(sentence, names) }).collect()
}

impl CompatRun {
    /// Adds the sections of a candidate in a cycle. A turn at a lanelet is one turn, even if it is not
    /// visible in between; a manoeuvre is the same while its ends stay in place.
    fn add_record(&mut self, record: Record) {
        let is_turn = matches!(
            record.subject,
            SignalSubject::Turn(_) | SignalSubject::RoundaboutEntry(_) | SignalSubject::RoundaboutExit(_)
        );
        let is_same = |known: &&mut Record| {
            let near = |one: f64, other: f64| (one - other).abs() < SAME_M;
            let (desired_m, required_m) = (&known.desired_m, &known.required_m);
            let overlaps = desired_m.start < record.desired_m.end && record.desired_m.start < desired_m.end;
            known.source == record.source
                && known.subject == record.subject
                && known.indicator == record.indicator
                && ((is_turn && overlaps)
                    || (near(desired_m.end, record.desired_m.end)
                        && near(required_m.end, record.required_m.end)))
        };
        let joined =
            |one: &Range<f64>, other: &Range<f64>| one.start.min(other.start)..one.end.max(other.end);
        match self.records.iter_mut().find(is_same) {
            Some(known) => {
                known.desired_m = joined(&known.desired_m, &record.desired_m);
                known.required_m = joined(&known.required_m, &record.required_m);
            }
            None => self.records.push(record),
        }
    }

    fn lane(&self, expected: Vec<Bar>) -> Lane {
        let mut rows = Vec::new();
        for source in CandidateSource::ALL {
            for record in self.records.iter().filter(|record| record.source == source) {
                let bar = |section_m: &Range<f64>, kind| {
                    let look = Look::Command(kind, record.indicator);
                    Bar { from: section_m.start, to: section_m.end, look }
                };
                let bars = vec![
                    bar(&record.desired_m, CommandKind::Desired),
                    bar(&record.required_m, CommandKind::Required),
                ];
                let label = record.subject.label().unwrap_or_else(|| source.to_string());
                rows.push(Row { label, bars });
            }
        }
        let (backing, forwards): (Vec<Driven>, Vec<Driven>) =
            self.signals.iter().partition(|driven| driven.to_m < driven.from_m);
        for (label, driven) in
            [("backing", backing), ("signal", forwards), ("received", self.received.clone())]
        {
            rows.push(Row { label: label.to_owned(), bars: driven.into_iter().map(Driven::bar).collect() });
        }
        if !expected.is_empty() {
            rows.push(Row { label: "expected".to_owned(), bars: expected });
        }
        Lane { label: self.compat.name().to_owned(), rows }
    }
}

/// Adds a signal at a position; it extends to the next.
fn add_signal(signals: &mut Vec<Driven>, at_m: f64, indicator: IndicatorState) {
    let begun = Driven { from_m: at_m, to_m: at_m, indicator };
    let Some(last) = signals.last_mut() else { return signals.push(begun) };
    let held = *last;
    let turns_around = (held.to_m - held.from_m) * (at_m - held.to_m) < 0.0;
    if turns_around {
        signals.push(Driven { from_m: held.to_m, to_m: at_m, indicator: held.indicator });
    } else {
        last.to_m = at_m;
    }
    if held.indicator != indicator {
        signals.push(begun);
    }
}

impl Driven {
    fn bar(self) -> Bar {
        Bar {
            from: self.from_m.min(self.to_m),
            to: self.from_m.max(self.to_m),
            look: Look::Command(CommandKind::Signal, self.indicator),
        }
    }
}

const fn indicator_of(turn: TurnCommand, hazard: HazardCommand) -> IndicatorState {
    match (turn, hazard) {
        (_, HazardCommand::Enable) => IndicatorState::Hazard,
        (TurnCommand::Left, _) => IndicatorState::Left,
        (TurnCommand::Right, _) => IndicatorState::Right,
        (TurnCommand::Disable, _) => IndicatorState::Off,
        (TurnCommand::NoCommand, _) => IndicatorState::Nothing,
    }
}

/// Returns the bar of commands expected by position; `None` for expectations by time.
fn expected(expectation: &Expectation) -> Option<Bar> {
    let interval = Some(expectation.interval).filter(|interval| interval.unit == IntervalUnit::Metres)?;
    let hazard = expectation.decision.hazard.unwrap_or_default();
    let indicator = indicator_of(expectation.decision.command?, hazard);
    let look = Look::Command(CommandKind::Expected, indicator);
    Some(Bar { from: interval.from, to: interval.to, look })
}

fn planned(kind: &PlanKind) -> Vec<Bar> {
    let bar = |from: f64, to: f64, name: String| Bar { from, to, look: Look::Named(name) };
    let shifted = |shift: &PlannedShift, name: &str| {
        bar(shift.from_m, shift.to_m, format!("{name} {} m", shift.offset_m))
    };
    match kind {
        PlanKind::Avoidance(lines) => lines.iter().map(|line| shifted(line, "avoidance to")).collect(),
        PlanKind::LaneChange { from_m, to_m, side, .. } => {
            vec![bar(*from_m, *to_m, format!("lane change {}", side.to_string().to_lowercase()))]
        }
        PlanKind::PullOut { shift, .. } => vec![shifted(shift, "pull-out from")],
        PlanKind::PullOver { shift, .. } => vec![shifted(shift, "pull-over to")],
        PlanKind::SideShift(shift) => vec![shifted(shift, "side shift to")],
    }
}
