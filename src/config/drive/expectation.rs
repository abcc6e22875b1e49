//! Expectations of a drive scenario.

use super::reader::{MAX_S, metres, modes};
use crate::config::reading::checker::Keywords;
use crate::config::reading::fields::Fields;
use crate::config::reading::location::SourceLocation;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::resolve::{Case, Source};
use crate::core::turn_signal::signal::{Hazard, Signal};

/// A condition that must hold for a while.
#[derive(Debug, Clone, PartialEq)]
pub struct Expectation {
    /// Behaviours in which it must hold.
    pub modes: Vec<DeciderCompat>,
    /// Stretch or time in which it must hold.
    pub interval: Interval,
    /// Condition.
    pub wanted: Wanted,
    /// Place in the file.
    pub location: SourceLocation,
}

/// A stretch or a time; `tolerance` at either end does not count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// Metres along the way.
    Metres {
        /// Start.
        from: f64,
        /// End.
        to: f64,
        /// Length at either end that does not count.
        tolerance: f64,
    },
    /// Seconds from the start.
    Seconds {
        /// Start.
        from: f64,
        /// End.
        to: f64,
        /// Length at either end that does not count.
        tolerance: f64,
    },
}

/// What must hold; `None` = any value.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wanted {
    /// Turn command.
    pub command: Option<Signal>,
    /// Hazard command.
    pub hazard: Option<Hazard>,
    /// Source that wins; `Some(None)` = none.
    pub winner: Option<Option<Source>>,
    /// Branch of the pairwise rule that decided last.
    pub case: Option<Case>,
    /// Part of a finding that some cycle has.
    pub finding: Option<String>,
}

impl Interval {
    /// Whether a cycle lies within it.
    pub fn holds(&self, at_m: f64, at_s: f64) -> bool {
        let (value, (from, to, tolerance)) = match *self {
            Self::Metres { from, to, tolerance } => (at_m, (from, to, tolerance)),
            Self::Seconds { from, to, tolerance } => (at_s, (from, to, tolerance)),
        };
        (from + tolerance..=to - tolerance).contains(&value)
    }
}

const COMMANDS: Keywords<Signal> = &[
    ("LEFT", Signal::Left),
    ("RIGHT", Signal::Right),
    ("DISABLE", Signal::Disable),
    ("NO_COMMAND", Signal::NoCommand),
];
const HAZARDS: Keywords<Hazard> =
    &[("ENABLE", Hazard::Enable), ("DISABLE", Hazard::Disable), ("NO_COMMAND", Hazard::NoCommand)];
const WINNERS: Keywords<Option<Source>> = &[
    ("intersection", Some(Source::Intersection)),
    ("roundabout", Some(Source::Roundabout)),
    ("manoeuvre", Some(Source::Manoeuvre)),
    ("none", None),
];
const CASES: Keywords<Case> = &[
    ("A1", Case::A1),
    ("A2", Case::A2),
    ("A3", Case::A3),
    ("A4", Case::A4),
    ("B1", Case::B1),
    ("B2", Case::B2),
];

/// Reads the list `expect`.
pub(super) fn expectations(top: &Fields<'_>) -> Vec<Expectation> {
    top.tables("expect").filter_map(expectation).collect()
}

fn expectation(fields: Fields<'_>) -> Option<Expectation> {
    let modes = modes(&fields);
    let interval = interval(&fields);
    let wanted = Wanted {
        command: fields.keyword("command", COMMANDS),
        hazard: fields.keyword("hazard", HAZARDS),
        winner: fields.keyword("winner", WINNERS),
        case: fields.keyword("case", CASES),
        finding: fields.string("finding").map(|given| given.text),
    };
    if !["command", "hazard", "winner", "case", "finding"].iter().any(|key| fields.has(key)) {
        let remedy = "give command, hazard, winner, case or finding";
        fields.checker.refuse(fields.location(), "nothing is expected", remedy);
    }
    let location = fields.checker.source_location(fields.location());
    fields.done();
    Some(Expectation { modes, interval: interval?, wanted, location })
}

fn interval(fields: &Fields<'_>) -> Option<Interval> {
    let is_by_time = fields.has("from_s") || fields.has("to_s");
    let (keys, tolerance_key, unit, default) = if is_by_time {
        (["from_s", "to_s"], "tolerance_s", "s", 0.2)
    } else {
        (["from_m", "to_m"], "tolerance_m", "m", 1.0)
    };
    fields.require(&keys, "");
    let [from, to] =
        keys.map(|key| if is_by_time { fields.number(key, 0.0..=MAX_S, "s") } else { metres(fields, key) });
    let tolerance = fields.number(tolerance_key, 0.0..=1000.0, unit).unwrap_or(default);
    let (from, to) = (from?, to?);
    if from + tolerance > to - tolerance {
        let reason =
            format!("from {from} to {to} {unit} nothing is left but the tolerance of {tolerance} {unit}");
        let remedy = format!("give a longer stretch, or less {tolerance_key}");
        fields.checker.refuse(fields.location(), reason, &remedy);
        return None;
    }
    Some(if is_by_time {
        Interval::Seconds { from, to, tolerance }
    } else {
        Interval::Metres { from, to, tolerance }
    })
}
