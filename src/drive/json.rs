//! A drive as JSON, one object a line: decisions, then for each behaviour what was expected.

use serde::Serialize;

use super::course::Cycle;
use super::verdict::Verdicts;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::decision::Decision;
use crate::explanation::Explanation;

/// The line for a decision, without line end.
pub fn line(mode: DeciderCompat, cycle: &Cycle, decision: &Decision) -> String {
    let position = cycle.pose.position;
    text(&Line {
        compat: mode.name(),
        t: cycle.at_s,
        at_m: cycle.at_m,
        x_m: position.x_m,
        y_m: position.y_m,
        yaw_rad: cycle.pose.yaw_rad,
        speed_mps: cycle.speed_mps,
        decision: Explanation::of(decision),
    })
}

/// The line that sums a behaviour up, without line end.
pub fn summary(mode: DeciderCompat, verdicts: &Verdicts<'_>) -> String {
    let failed = verdicts
        .failed()
        .into_iter()
        .map(|failed| FailedOut { expectation: failed.expectation.location.to_string(), what: failed.what });
    let summary = SummaryOut { met: verdicts.met(), failed: failed.collect() };
    text(&SummaryLine { compat: mode.name(), expectations: summary })
}

fn text(line: &impl Serialize) -> String {
    // Plain structs of numbers and strings: this cannot fail.
    serde_json::to_string(line).unwrap_or_default()
}

#[derive(Serialize)]
struct Line {
    compat: &'static str,
    t: f64,
    at_m: f64,
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
    speed_mps: f64,
    #[serde(flatten)]
    decision: Explanation,
}

#[derive(Serialize)]
struct SummaryLine {
    compat: &'static str,
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
