//! A drive as JSON, one object a line: decisions, then for each behaviour what was expected.

use serde::Serialize;

use super::course::Cycle;
use super::verdict::Verdicts;
use super::words;
use crate::core::turn_signal::decision::Decision;
use crate::core::turn_signal::resolve::Weighed;
use crate::core::turn_signal::scene::Mode;
use crate::core::turn_signal::steady::Held;

/// The line for a decision, without line end.
pub fn line(mode: Mode, cycle: &Cycle, decision: &Decision) -> String {
    let weighed = words::resolution(decision).map(|resolution| &resolution.weighed[..]);
    let position = cycle.pose.position;
    text(&Line {
        behaviour: words::mode(mode),
        t: cycle.at_s,
        at_m: cycle.at_m,
        x_m: position.x_m,
        y_m: position.y_m,
        yaw_rad: cycle.pose.yaw_rad,
        speed_mps: cycle.speed_mps,
        command: decision.turn.to_string(),
        hazard: words::hazard(decision.hazard),
        ground: words::ground(decision),
        winner: words::winner(decision).map(|source| source.to_string()),
        case: words::case(decision).map(|case| case.to_string()),
        held: decision.held.map(|held| match held {
            Held::On(side) => format!("{side} not on for long enough"),
            Held::Off => "not off for long enough".to_owned(),
        }),
        candidates: weighed.unwrap_or_default().iter().map(Candidate::new).collect(),
        remarks: decision.remarks.iter().map(ToString::to_string).collect(),
        findings: decision.findings.iter().map(ToString::to_string).collect(),
    })
}

/// The line that sums a behaviour up, without line end.
pub fn summary(mode: Mode, verdicts: &Verdicts<'_>) -> String {
    let failed = verdicts
        .failed()
        .into_iter()
        .map(|failed| FailedOut { expectation: failed.expectation.place.to_string(), what: failed.what });
    let summary = SummaryOut { met: verdicts.met(), failed: failed.collect() };
    text(&SummaryLine { behaviour: words::mode(mode), expectations: summary })
}

fn text(line: &impl Serialize) -> String {
    // Plain structs of numbers and strings: this cannot fail.
    serde_json::to_string(line).unwrap_or_default()
}

#[derive(Serialize)]
struct Line {
    behaviour: &'static str,
    t: f64,
    at_m: f64,
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
    speed_mps: f64,
    command: String,
    hazard: &'static str,
    ground: String,
    winner: Option<String>,
    case: Option<String>,
    held: Option<String>,
    candidates: Vec<Candidate>,
    remarks: Vec<String>,
    findings: Vec<String>,
}

#[derive(Serialize)]
struct Candidate {
    source: String,
    command: String,
    /// Null without a record, or where it is no number.
    desired_start_m: Option<f64>,
    desired_end_m: Option<f64>,
    required_start_m: Option<f64>,
    required_end_m: Option<f64>,
    fate: String,
}

#[derive(Serialize)]
struct SummaryLine {
    behaviour: &'static str,
    expectations: SummaryOut,
}

#[derive(Serialize)]
struct SummaryOut {
    met: usize,
    failed: Vec<FailedOut>,
}

#[derive(Serialize)]
struct FailedOut {
    expectation: String,
    what: String,
}

impl Candidate {
    fn new(weighed: &Weighed) -> Self {
        let distances = weighed.distances;
        Self {
            source: weighed.source.to_string(),
            command: weighed.turn.to_string(),
            desired_start_m: distances.map(|distances| distances.desired_start_m),
            desired_end_m: distances.map(|distances| distances.desired_end_m),
            required_start_m: distances.map(|distances| distances.required_start_m),
            required_end_m: distances.map(|distances| distances.required_end_m),
            fate: weighed.fate.to_string(),
        }
    }
}
