//! Expectations of a drive scenario.

use std::fmt;

use derive_more::Display;

use super::reader::{MAX_S, compats, metres};
use crate::config::reading::{Fields, Keywords, SourceLocation};
use turn_signal::compat::DeciderCompat;
use turn_signal::light_command::Numbered;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::resolve::{CandidateSource, Case};

/// A condition that must hold for a while.
#[derive(Debug, Clone, PartialEq)]
pub struct Expectation {
    /// Values of `compat` with which it must hold.
    pub compats: Vec<DeciderCompat>,
    /// Interval in which it must hold.
    pub interval: ExpectedInterval,
    /// Decision that every cycle in the interval must have.
    pub decision: ExpectedDecision,
    /// Position in the file.
    pub location: SourceLocation,
}

/// An interval of positions or times, ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExpectedInterval {
    /// Unit of its numbers.
    pub unit: IntervalUnit,
    /// Start of the interval.
    pub from: f64,
    /// End of the interval.
    pub to: f64,
    /// Length at either end that is not checked.
    pub tolerance: f64,
}

/// Unit of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Display)]
pub enum IntervalUnit {
    /// Metres along the route path.
    #[display("m")]
    Metres,
    /// Seconds from the start.
    #[display("s")]
    Seconds,
}

/// Values that a decision must have; `None` = any value.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ExpectedDecision {
    /// Command of the turn indicators.
    pub command: Option<TurnCommand>,
    /// Command of the hazard lights.
    pub hazard: Option<HazardCommand>,
    /// Source of the winner; `Some(None)` = no winner.
    pub winner: Option<Option<CandidateSource>>,
    /// Branch of the pairwise rule that decided last.
    pub case: Option<Case>,
    /// Text that must occur in a finding of some cycle.
    pub finding: Option<String>,
}

impl ExpectedInterval {
    /// Returns true if a cycle lies within the interval, without the tolerance at its ends.
    pub fn contains(&self, at_m: f64, at_s: f64) -> bool {
        let value = match self.unit {
            IntervalUnit::Metres => at_m,
            IntervalUnit::Seconds => at_s,
        };
        (self.from + self.tolerance..=self.to - self.tolerance).contains(&value)
    }
}

const WINNERS: Keywords<Option<CandidateSource>> = &[
    ("intersection", Some(CandidateSource::Intersection)),
    ("roundabout", Some(CandidateSource::Roundabout)),
    ("manoeuvre", Some(CandidateSource::Manoeuvre)),
    ("none", None),
];

pub(super) fn expectation(fields: &Fields<'_>) -> Option<Expectation> {
    let compats = compats(fields);
    let interval = interval(fields);
    let decision = ExpectedDecision {
        command: named(fields, "command", TurnCommand::ALL),
        hazard: named(fields, "hazard", HazardCommand::ALL),
        winner: fields.keyword("winner", WINNERS),
        case: named(fields, "case", &Case::ALL),
        finding: fields.string("finding").map(|given| given.text),
    };
    if !["command", "hazard", "winner", "case", "finding"].iter().any(|key| fields.has(key)) {
        let remedy = "give command, hazard, winner, case or finding";
        fields.checker.refuse(fields.location(), "nothing is expected", remedy);
    }
    let location = fields.checker.source_location(fields.location());
    Some(Expectation { compats, interval: interval?, decision, location })
}

/// Reads a key that names one of these values.
fn named<T: Copy + fmt::Display>(fields: &Fields<'_>, key: &'static str, values: &[T]) -> Option<T> {
    let names: Vec<_> = values.iter().map(ToString::to_string).collect();
    let keywords: Vec<_> = names.iter().map(String::as_str).zip(values.iter().copied()).collect();
    fields.keyword(key, &keywords)
}

fn interval(fields: &Fields<'_>) -> Option<ExpectedInterval> {
    let unit =
        if fields.has("from_s") || fields.has("to_s") { IntervalUnit::Seconds } else { IntervalUnit::Metres };
    let (keys, tolerance_key, default) = match unit {
        IntervalUnit::Metres => (["from_m", "to_m"], "tolerance_m", 1.0),
        IntervalUnit::Seconds => (["from_s", "to_s"], "tolerance_s", 0.2),
    };
    fields.require(&keys, "");
    let [from, to] = keys.map(|key| match unit {
        IntervalUnit::Metres => metres(fields, key),
        IntervalUnit::Seconds => fields.number(key, 0.0..=MAX_S, "s"),
    });
    let tolerance = fields.number(tolerance_key, 0.0..=1000.0, &unit.to_string()).unwrap_or(default);
    let (from, to) = (from?, to?);
    if from + tolerance > to - tolerance {
        let reason =
            format!("from {from} to {to} {unit} nothing is left but the tolerance of {tolerance} {unit}");
        let remedy = format!("give a longer stretch, or less {tolerance_key}");
        return fields.checker.refused(fields.location(), reason, &remedy);
    }
    Some(ExpectedInterval { unit, from, to, tolerance })
}
