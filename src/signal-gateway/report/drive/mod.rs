//! Reports a drive of the turn signal decider as lines.

pub mod chart;
mod sentence;
pub mod shadow;
mod snapshot;

use std::fmt;

use serde_json::{Value, json};

use super::{decision, joined};
use crate::config::drive::Expectation;
use sentence::Narrator;
pub use snapshot::Snapshot;
use turn_signal::compat::DeciderCompat;
use turn_signal::headline::Headline;

/// The result of the expectations for one `compat`.
#[derive(Debug, Clone)]
pub struct Verdict<'a> {
    /// The `compat` of the decider.
    pub compat: DeciderCompat,
    /// Number of expectations that were met.
    pub met: usize,
    /// Failed expectations.
    pub failed: Vec<Failed<'a>>,
}

/// An expectation that failed.
#[derive(Debug, Clone)]
pub struct Failed<'a> {
    /// The expectation.
    pub expectation: &'a Expectation,
    /// The `compat` of the decider.
    pub compat: DeciderCompat,
    /// The first mismatch, with its position.
    pub reason: String,
}

/// Writes a drive as lines, for one `compat` after the other.
#[derive(Debug, Clone)]
pub struct DriveWriter {
    form: DriveForm,
    last: Option<Headline>,
    narrator: Narrator,
}

/// The form of the lines of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveForm {
    /// One sentence for each change.
    Sentences,
    /// The sentence with all numbers below it, also for each change of a reason.
    Numbers,
    /// One JSON object for each change of a reason.
    Json,
}

const INDENT: &str = "  ";
const DETAILS: &str = "      ";

impl DriveWriter {
    /// Creates a writer that has written nothing yet.
    pub fn new(form: DriveForm) -> Self {
        Self { form, last: None, narrator: Narrator::default() }
    }

    /// Begins a `compat`; the first decision after it is a change.
    pub fn begin(&mut self, compat: DeciderCompat) -> Option<String> {
        *self = Self::new(self.form);
        (self.form != DriveForm::Json).then(|| compat.name().to_owned())
    }

    /// Returns the lines of a cycle; `None` if the decision equals the previous one, apart from distances and
    /// ages, and `whole` is false. Must be called for every cycle, in order.
    pub fn write(&mut self, snapshot: &Snapshot<'_>, whole: bool) -> Option<String> {
        let (sentence, is_new) = self.narrator.next(snapshot);
        let headline = Some(Headline::of(snapshot.decision));
        let differs = self.last != headline;
        self.last = headline;
        let is_written = whole || if self.form == DriveForm::Sentences { is_new } else { differs };
        is_written.then(|| match self.form {
            DriveForm::Sentences => format!("{INDENT}{sentence}"),
            DriveForm::Numbers => format!("{INDENT}{sentence}{}", details(snapshot)),
            DriveForm::Json => fields(snapshot).to_string(),
        })
    }

    /// Returns the lines that end a `compat`: the number of expectations that were met, and each failed one.
    pub fn end(&self, verdict: &Verdict<'_>) -> String {
        let Verdict { compat, met, failed } = verdict;
        if self.form != DriveForm::Json {
            let count = format!("expectations: {met} met, {} failed", failed.len());
            let failed = failed.iter().map(|failed| format!("\nFAILED {failed}"));
            return std::iter::once(count).chain(failed).collect();
        }
        let failed = failed.iter().map(
            |failed| json!({ "expectation": failed.expectation.location.to_string(), "what": failed.reason }),
        );
        let expectations = json!({ "met": met, "failed": failed.collect::<Vec<_>>() });
        json!({ "compat": compat.name(), "expectations": expectations }).to_string()
    }
}

/// Returns time, position, speed, basis and every reason, each on its own line.
fn details(snapshot: &Snapshot<'_>) -> String {
    let Snapshot { at_s, at_m, speed_mps, decision, .. } = snapshot;
    let basis = decision::basis(decision);
    let first = format!("{at_s:.3} s, {at_m:.2} m, {speed_mps:.2} m/s: {basis}");
    let lines = std::iter::once(first).chain(decision::reasons(decision));
    lines.map(|line| format!("\n{DETAILS}{line}")).collect()
}

fn fields(snapshot: &Snapshot<'_>) -> Value {
    let position = snapshot.pose.position;
    let vehicle = json!({
        "compat": snapshot.compat.name(),
        "t": snapshot.at_s,
        "at_m": snapshot.at_m,
        "x_m": position.x_m,
        "y_m": position.y_m,
        "yaw_rad": snapshot.pose.yaw_rad,
        "speed_mps": snapshot.speed_mps,
    });
    joined(vehicle, decision::fields(snapshot.decision))
}

/// `file:line:column: key: from 37 to 116 m, improved: expected LEFT, found DISABLE at 40.00 m (4.000 s)`
impl fmt::Display for Failed<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Expectation { location, interval, .. } = self.expectation;
        let (from, to, unit) = (interval.from, interval.to, interval.unit);
        write!(f, "{location}: from {from} to {to} {unit}, {}: {}", self.compat.name(), self.reason)
    }
}
