//! A drive as lines for people: each change of the decision with its reasons, and what was expected.

use std::mem::{Discriminant, discriminant};

use super::course::Cycle;
use super::display;
use super::verdict::Verdicts;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::decision::Decision;
use crate::core::turn_signal::inputs::Finding;
use crate::core::turn_signal::manoeuvre::ManoeuvreOutcome;
use crate::core::turn_signal::min_duration::Held;
use crate::core::turn_signal::resolve::CandidateOutcome;
use crate::core::turn_signal::signal::{Hazard, Signal};

/// What stands before reasons.
const INDENT: &str = "                                   ";

/// Finds out when a decision is another one, distances and ages apart.
#[derive(Debug, Clone, Default)]
pub struct Changes {
    last: Option<Look>,
}

#[derive(Debug, Clone, PartialEq)]
struct Look {
    commands: (Signal, Hazard),
    basis: String,
    fates: Vec<(Signal, CandidateOutcome)>,
    held: Option<Held>,
    remarks: Vec<ManoeuvreOutcome>,
    findings: Vec<Discriminant<Finding>>,
}

impl Changes {
    /// Whether the decision differs from the one before; the first one does.
    pub fn take(&mut self, decision: &Decision) -> bool {
        let evaluated = display::resolution(decision).map(|resolution| &resolution.evaluated[..]);
        let look = Look {
            commands: (decision.turn, decision.hazard),
            basis: display::basis(decision),
            fates: evaluated
                .unwrap_or_default()
                .iter()
                .map(|evaluated| (evaluated.turn, evaluated.outcome))
                .collect(),
            held: decision.held,
            remarks: decision.remarks.clone(),
            findings: decision.findings.iter().map(discriminant).collect(),
        };
        let is_other = self.last.as_ref() != Some(&look);
        self.last = Some(look);
        is_other
    }
}

/// The heading of a behaviour.
pub fn heading(mode: DeciderCompat) -> String {
    format!("{}\n{:>9}  {:>9}  {:>8}", mode.name(), "seconds", "metres", "m/s")
}

/// One decision: when, where, how fast, what, on what ground; then every reason.
pub fn lines(cycle: &Cycle, decision: &Decision) -> Vec<String> {
    let Cycle { at_s, at_m, speed_mps, .. } = cycle;
    let command = match decision.hazard {
        Hazard::Enable => format!("{} + hazard", decision.turn),
        Hazard::Disable | Hazard::NoCommand => decision.turn.to_string(),
    };
    let basis = display::basis(decision);
    let mut lines = vec![format!("{at_s:>9.3}  {at_m:>9.2}  {speed_mps:>8.2}  {command:<10}  {basis}")];
    let evaluated = display::resolution(decision).map(|resolution| &resolution.evaluated[..]);
    let mut reason = |text: String| lines.push(format!("{INDENT}{text}"));
    evaluated.unwrap_or_default().iter().for_each(|evaluated| reason(evaluated.to_string()));
    decision.held.iter().for_each(|held| reason(format!("held: {held}")));
    decision.remarks.iter().for_each(|remark| reason(remark.to_string()));
    decision.findings.iter().for_each(|finding| reason(format!("finding: {finding}")));
    lines
}

/// Expectations met, and each that failed.
pub fn summary(verdicts: &Verdicts<'_>) -> Vec<String> {
    let failed = verdicts.failed();
    let count = format!("expectations: {} met, {} failed", verdicts.met(), failed.len());
    std::iter::once(count).chain(failed.iter().map(|failed| format!("FAILED {failed}"))).collect()
}
