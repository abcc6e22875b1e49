//! Expectations of a drive scenario.

use super::reader::{MAX_S, Reader, keyword, metres, modes, number};
use crate::config::reading::fields::Fields;
use crate::config::reading::location::SourceLocation;
use crate::config::reading::value::Value;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::resolve::{Case, Source};
use crate::core::turn_signal::signal::{Hazard, Signal};

/// An expectation for a stretch of the drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Expectation {
    /// The behaviours in which it must hold.
    pub modes: Vec<DeciderCompat>,
    /// The stretch, by place or time.
    pub interval: Interval,
    /// Everything that must hold there.
    pub wanted: Wanted,
    /// Its place in the file.
    pub location: SourceLocation,
}

/// Where or when something holds; all of it but `tolerance` at either end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// Metres along the way.
    Metres {
        /// Start, metres along the way.
        from: f64,
        /// End, metres along the way.
        to: f64,
        /// Length that is not looked at, at either end.
        tolerance: f64,
    },
    /// Seconds from the start.
    Seconds {
        /// Start, seconds.
        from: f64,
        /// End, seconds.
        to: f64,
        /// Length that is not looked at, at either end.
        tolerance: f64,
    },
}

/// Everything that must hold; `None` = anything will do.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wanted {
    /// The turn command.
    pub command: Option<Signal>,
    /// The hazard command.
    pub hazard: Option<Hazard>,
    /// The source that is signalled; `Some(None)` = none.
    pub winner: Option<Option<Source>>,
    /// The branch of the pairwise rule that decided last.
    pub case: Option<Case>,
    /// Words of a finding that some cycle has.
    pub finding: Option<String>,
}

impl Interval {
    /// Returns whether a cycle lies within it.
    pub fn holds(&self, at_m: f64, at_s: f64) -> bool {
        let (value, (from, to, tolerance)) = match *self {
            Self::Metres { from, to, tolerance } => (at_m, (from, to, tolerance)),
            Self::Seconds { from, to, tolerance } => (at_s, (from, to, tolerance)),
        };
        (from + tolerance..=to - tolerance).contains(&value)
    }
}

const COMMANDS: [(&str, Signal); 4] = [
    ("LEFT", Signal::Left),
    ("RIGHT", Signal::Right),
    ("DISABLE", Signal::Disable),
    ("NO_COMMAND", Signal::NoCommand),
];
const HAZARDS: [(&str, Hazard); 3] =
    [("ENABLE", Hazard::Enable), ("DISABLE", Hazard::Disable), ("NO_COMMAND", Hazard::NoCommand)];
const WINNERS: [(&str, Option<Source>); 4] = [
    ("intersection", Some(Source::Intersection)),
    ("roundabout", Some(Source::Roundabout)),
    ("manoeuvre", Some(Source::Manoeuvre)),
    ("none", None),
];
const CASES: [(&str, Case); 6] = [
    ("A1", Case::A1),
    ("A2", Case::A2),
    ("A3", Case::A3),
    ("A4", Case::A4),
    ("B1", Case::B1),
    ("B2", Case::B2),
];

/// The list `expect`.
pub(super) fn expectations(reader: &mut Reader, top: &mut Fields<'_>) -> Vec<Expectation> {
    top.list(reader, "expect").iter().filter_map(|value| expectation(reader, value)).collect()
}

fn expectation(reader: &mut Reader, value: &Value) -> Option<Expectation> {
    let mut fields = Fields::of(reader, value)?;
    let modes = modes(reader, &mut fields);
    let interval = interval(reader, &mut fields);
    let wanted = Wanted {
        command: keyword(reader, &mut fields, "command", &COMMANDS),
        hazard: keyword(reader, &mut fields, "hazard", &HAZARDS),
        winner: keyword(reader, &mut fields, "winner", &WINNERS),
        case: keyword(reader, &mut fields, "case", &CASES),
        finding: fields.text(reader, "finding").map(|given| given.text),
    };
    let says_something = ["command", "hazard", "winner", "case", "finding"].iter().any(|key| fields.has(key));
    fields.done(reader);
    if !says_something {
        reader.refuse(
            &value.location,
            "nothing is expected",
            "give command, hazard, winner, case or finding",
        );
    }
    Some(Expectation {
        modes,
        interval: interval?,
        wanted,
        location: reader.source_location(&value.location),
    })
}

fn interval(reader: &mut Reader, fields: &mut Fields<'_>) -> Option<Interval> {
    let is_by_time = fields.has("from_s") || fields.has("to_s");
    let keys = if is_by_time { ["from_s", "to_s"] } else { ["from_m", "to_m"] };
    for key in keys {
        fields.must_have(reader, key);
    }
    let [from, to] = keys.map(|key| {
        if is_by_time { number(reader, fields, key, 0.0..=MAX_S, "s") } else { metres(reader, fields, key) }
    });
    let (key, unit, otherwise) =
        if is_by_time { ("tolerance_s", "s", 0.2) } else { ("tolerance_m", "m", 1.0) };
    let tolerance = number(reader, fields, key, 0.0..=1000.0, unit).unwrap_or(otherwise);
    let (from, to) = (from?, to?);
    if from + tolerance > to - tolerance {
        let reason =
            format!("from {from} to {to} {unit} nothing is left but the tolerance of {tolerance} {unit}");
        reader.refuse(fields.location(), reason, &format!("give a longer stretch, or less {key}"));
        return None;
    }
    Some(if is_by_time {
        Interval::Seconds { from, to, tolerance }
    } else {
        Interval::Metres { from, to, tolerance }
    })
}
