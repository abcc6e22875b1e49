//! A drive as a picture: the lanelets of its way, what the planner does, and for each behaviour the
//! sections of every candidate and the signal that came out.

use super::course::{Course, Cycle};
use super::display;
use crate::config::drive::{AvoidanceLine, Expectation, Interval, PlanKind};
use crate::core::map::lane_network::TurnDirection;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::decision::Decision;
use crate::core::turn_signal::resolve::Source;
use crate::core::turn_signal::signal::{Hazard, Signal};
use crate::picture::strip_chart::{Group, IndicatorState, Look, Piece, Row, StripChart};

/// Records whose ends lie nearer than this are one, metres: some have starts that move on.
const SAME_M: f64 = 1.0;

/// Collects what is drawn while a drive goes on, behaviour by behaviour.
#[derive(Debug, Clone)]
pub struct DriveChart<'a> {
    course: &'a Course,
    road: Vec<Piece>,
    runs: Vec<CompatRun>,
}

#[derive(Debug, Clone)]
struct CompatRun {
    mode: DeciderCompat,
    records: Vec<Record>,
    signals: Vec<Shown>,
}

/// A signal over a stretch that was driven in one direction, metres along the way.
#[derive(Debug, Clone, Copy)]
struct Shown {
    from_m: f64,
    to_m: f64,
    indicator: IndicatorState,
}

/// A record as it was seen, metres along the way.
#[derive(Debug, Clone, Copy)]
struct Record {
    source: Source,
    indicator: IndicatorState,
    desired: (f64, f64),
    required: (f64, f64),
}

impl<'a> DriveChart<'a> {
    /// Nothing yet.
    pub fn new(course: &'a Course) -> Self {
        Self { course, road: Vec::new(), runs: Vec::new() }
    }

    /// Takes down what was decided at a cycle; the cycles of one behaviour come one after the other.
    pub fn take(&mut self, mode: DeciderCompat, cycle: &Cycle, decision: &Decision) {
        if self.runs.last().is_none_or(|run| run.mode != mode) {
            self.runs.push(CompatRun { mode, records: Vec::new(), signals: Vec::new() });
        }
        if self.runs.len() == 1 {
            self.note_road(cycle);
        }
        let front_m = self.course.file().vehicle.front_m();
        let Some(run) = self.runs.last_mut() else { return };
        run.note_signal(cycle.at_m, indicator_of(decision.turn, decision.hazard));
        let evaluated = display::resolution(decision).map(|resolution| &resolution.evaluated[..]);
        for evaluated in evaluated.unwrap_or_default() {
            let (Some(_), Some(distances)) = (evaluated.turn.side(), evaluated.distances) else { continue };
            let front_at = |distance_m: f64| cycle.at_m + front_m + distance_m;
            run.note_record(Record {
                source: evaluated.source,
                indicator: indicator_of(evaluated.turn, Hazard::Disable),
                desired: (front_at(distances.desired_start_m), cycle.at_m + distances.desired_end_m),
                required: (front_at(distances.required_start_m), cycle.at_m + distances.required_end_m),
            });
        }
    }

    /// The picture.
    pub fn strip_chart(self, title: String) -> StripChart {
        let file = self.course.file();
        let driven = self.runs.iter().flat_map(|run| &run.signals);
        let (mut from_m, mut to_m) = (f64::INFINITY, f64::NEG_INFINITY);
        for Shown { from_m: one, to_m: other, .. } in driven {
            (from_m, to_m) = (from_m.min(*one).min(*other), to_m.max(*one).max(*other));
        }
        let mut rows = vec![Row { label: "lanelets".to_owned(), pieces: self.road }];
        rows.extend(
            file.manoeuvres
                .iter()
                .map(|plan| Row { label: "planner".to_owned(), pieces: planned(&plan.kind) }),
        );
        let mut groups = vec![Group { label: "way".to_owned(), rows }];
        for run in &self.runs {
            let mode = run.mode;
            let expected: Vec<Piece> = file
                .expectations
                .iter()
                .filter(|one| one.modes.contains(&mode))
                .filter_map(expected)
                .collect();
            groups.push(run.group(expected));
        }
        for piece in groups.iter_mut().flat_map(|group| &mut group.rows).flat_map(|row| &mut row.pieces) {
            piece.from_m = piece.from_m.clamp(from_m.min(to_m), to_m.max(from_m));
            piece.to_m = piece.to_m.clamp(from_m.min(to_m), to_m.max(from_m));
        }
        for row in groups.iter_mut().flat_map(|group| &mut group.rows) {
            row.pieces.retain(|piece| piece.from_m < piece.to_m);
        }
        // What lies beyond the drive leaves no empty row.
        for group in &mut groups {
            group.rows.retain(|row| !row.pieces.is_empty());
        }
        let front_m = file.vehicle.front_m();
        let subtitle = format!(
            "signals over the place of the rear axle; the front, which is {front_m:.2} m ahead, counts for the \
             starts of sections, the rear axle for their ends"
        );
        StripChart { title, subtitle, from_m, to_m, groups }
    }

    fn note_road(&mut self, cycle: &Cycle) {
        let lane = cycle.lane.and_then(|id| self.course.road().lane(id));
        let direction = lane.map_or("", |lane| match lane.turn_direction {
            TurnDirection::None => "",
            TurnDirection::Straight => " straight",
            TurnDirection::Left => " left",
            TurnDirection::Right => " right",
        });
        let text = lane.map_or_else(|| "?".to_owned(), |lane| format!("{}{direction}", lane.id));
        let at_m = cycle.at_m;
        let plain = |from_m, to_m, text| Piece { from_m, to_m, look: Look::Plain, text };
        if let Some(first) = self.road.first_mut().filter(|first| at_m < first.from_m) {
            // Backing beyond the start.
            if first.text == text {
                first.from_m = at_m;
            } else {
                let begun = plain(at_m, first.from_m, text);
                self.road.insert(0, begun);
            }
            return;
        }
        match self.road.last_mut() {
            Some(last) if at_m < last.to_m => {}
            Some(last) => {
                last.to_m = at_m;
                if last.text != text {
                    self.road.push(plain(at_m, at_m, text));
                }
            }
            None => self.road.push(plain(at_m, at_m, text)),
        }
    }
}

impl CompatRun {
    fn note_signal(&mut self, at_m: f64, indicator: IndicatorState) {
        let begun = Shown { from_m: at_m, to_m: at_m, indicator };
        let Some(last) = self.signals.last_mut() else {
            self.signals.push(begun);
            return;
        };
        // The signal holds up to the next cycle.
        let held = *last;
        if held.turns_around(at_m) {
            self.signals.push(Shown { from_m: held.to_m, to_m: at_m, indicator: held.indicator });
        } else {
            last.to_m = at_m;
        }
        if held.indicator != indicator {
            self.signals.push(begun);
        }
    }

    fn note_record(&mut self, record: Record) {
        let is_same = |known: &&mut Record| {
            let near = |one: f64, other: f64| (one - other).abs() < SAME_M;
            known.source == record.source
                && known.indicator == record.indicator
                && near(known.desired.1, record.desired.1)
                && near(known.required.1, record.required.1)
        };
        match self.records.iter_mut().find(is_same) {
            Some(known) => {
                known.desired.0 = known.desired.0.min(record.desired.0);
                known.required.0 = known.required.0.min(record.required.0);
            }
            None => self.records.push(record),
        }
    }

    fn group(&self, expected: Vec<Piece>) -> Group {
        let mut rows = Vec::new();
        for source in Source::ALL {
            for record in self.records.iter().filter(|record| record.source == source) {
                let piece = |(from_m, to_m): (f64, f64), look, text: &str| Piece {
                    from_m,
                    to_m,
                    look,
                    text: text.to_owned(),
                };
                let pieces = vec![
                    piece(record.desired, Look::Desired(record.indicator), ""),
                    piece(record.required, Look::Required(record.indicator), record.indicator.name()),
                ];
                rows.push(Row { label: source.to_string(), pieces });
            }
        }
        let (backing, forwards): (Vec<Shown>, Vec<Shown>) =
            self.signals.iter().partition(|shown| shown.to_m < shown.from_m);
        for (label, shown) in [("backing", backing), ("signal", forwards)] {
            rows.push(Row { label: label.to_owned(), pieces: shown.into_iter().map(Shown::piece).collect() });
        }
        if !expected.is_empty() {
            rows.push(Row { label: "expected".to_owned(), pieces: expected });
        }
        Group { label: self.mode.name().to_owned(), rows }
    }
}

impl Shown {
    /// The vehicle goes the other way now.
    fn turns_around(&self, at_m: f64) -> bool {
        (self.to_m - self.from_m) * (at_m - self.to_m) < 0.0
    }

    fn piece(self) -> Piece {
        Piece {
            from_m: self.from_m.min(self.to_m),
            to_m: self.from_m.max(self.to_m),
            look: Look::Signal(self.indicator),
            text: self.indicator.name().to_owned(),
        }
    }
}

const fn indicator_of(turn: Signal, hazard: Hazard) -> IndicatorState {
    match (turn, hazard) {
        (_, Hazard::Enable) => IndicatorState::Hazard,
        (Signal::Left, _) => IndicatorState::Left,
        (Signal::Right, _) => IndicatorState::Right,
        (Signal::Disable, _) => IndicatorState::Off,
        (Signal::NoCommand, _) => IndicatorState::Nothing,
    }
}

/// Expected commands by place; those by time have none.
fn expected(expectation: &Expectation) -> Option<Piece> {
    let Interval::Metres { from, to, .. } = expectation.interval else { return None };
    let hazard = expectation.wanted.hazard.unwrap_or_default();
    let look = Look::Expected(indicator_of(expectation.wanted.command?, hazard));
    Some(Piece { from_m: from, to_m: to, look, text: String::new() })
}

fn planned(kind: &PlanKind) -> Vec<Piece> {
    let piece = |from_m: f64, to_m: f64, text: String| Piece { from_m, to_m, look: Look::Plain, text };
    match kind {
        PlanKind::Avoidance { lines } => {
            let shift = |line: &AvoidanceLine| {
                piece(line.from_m, line.to_m, format!("avoidance to {} m", line.offset_m))
            };
            lines.iter().map(shift).collect()
        }
        PlanKind::LaneChange { from_m, to_m, side, .. } => {
            vec![piece(*from_m, *to_m, format!("lane change {}", side.to_string().to_lowercase()))]
        }
        PlanKind::PullOut { from_m, to_m, offset_m, .. } => {
            vec![piece(*from_m, *to_m, format!("pull-out from {offset_m} m"))]
        }
        PlanKind::PullOver { from_m, to_m, offset_m, .. } => {
            vec![piece(*from_m, *to_m, format!("pull-over to {offset_m} m"))]
        }
        PlanKind::SideShift { from_m, to_m, offset_m } => {
            vec![piece(*from_m, *to_m, format!("side shift to {offset_m} m"))]
        }
    }
}
