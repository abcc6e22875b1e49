//! What must come out of a drive scenario.

use super::reading::{LONGEST_S, Reading, metres, number, word};
use crate::config::values::Value;
use crate::config::values::fields::Fields;
use crate::config::values::place::Place;
use crate::core::turn_signal::resolve::{Case, Source};
use crate::core::turn_signal::scene::Mode;
use crate::core::turn_signal::signal::{Hazard, Signal};

/// What must hold for a while.
#[derive(Debug, Clone, PartialEq)]
pub struct Expectation {
    /// In which behaviours.
    pub modes: Vec<Mode>,
    /// Where, or when.
    pub stretch: Stretch,
    /// What.
    pub wanted: Wanted,
    /// Where it stands.
    pub place: Place,
}

/// Where or when something holds; all of it but `tolerance` at either end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stretch {
    /// Metres along the way.
    Metres {
        /// From here.
        from: f64,
        /// To here.
        to: f64,
        /// Not looked at, at either end.
        tolerance: f64,
    },
    /// Seconds from the start.
    Seconds {
        /// From then.
        from: f64,
        /// To then.
        to: f64,
        /// Not looked at, at either end.
        tolerance: f64,
    },
}

/// What must hold; `None` = anything will do.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wanted {
    /// The turn command.
    pub command: Option<Signal>,
    /// The hazard command.
    pub hazard: Option<Hazard>,
    /// Who is signalled; `Some(None)` = nobody.
    pub winner: Option<Option<Source>>,
    /// The branch of the pairwise rule that decided last.
    pub case: Option<Case>,
    /// Words of a finding that some cycle has.
    pub finding: Option<String>,
}

impl Stretch {
    /// Whether a cycle counts.
    pub fn holds(&self, at_m: f64, at_s: f64) -> bool {
        let (value, (from, to, tolerance)) = match *self {
            Self::Metres { from, to, tolerance } => (at_m, (from, to, tolerance)),
            Self::Seconds { from, to, tolerance } => (at_s, (from, to, tolerance)),
        };
        (from + tolerance..=to - tolerance).contains(&value)
    }
}

const MODES: [(&str, &[Mode]); 3] = [
    ("improved", &[Mode::Improved]),
    ("upstream", &[Mode::Compat]),
    ("both", &[Mode::Improved, Mode::Compat]),
];
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
    ("behaviour", Some(Source::Behaviour)),
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

/// A key that says whose behaviour; both without it.
pub(super) fn modes(reading: &mut Reading, fields: &mut Fields<'_>, key: &'static str) -> Vec<Mode> {
    word(reading, fields, key, &MODES).unwrap_or(&[Mode::Improved, Mode::Compat]).to_vec()
}

/// The list `expect`.
pub(super) fn expectations(reading: &mut Reading, top: &mut Fields<'_>) -> Vec<Expectation> {
    top.list(reading, "expect").iter().filter_map(|value| expectation(reading, value)).collect()
}

fn expectation(reading: &mut Reading, value: &Value) -> Option<Expectation> {
    let mut fields = Fields::of(reading, value)?;
    let modes = modes(reading, &mut fields, "behaviour");
    let stretch = stretch(reading, &mut fields);
    let wanted = Wanted {
        command: word(reading, &mut fields, "command", &COMMANDS),
        hazard: word(reading, &mut fields, "hazard", &HAZARDS),
        winner: word(reading, &mut fields, "winner", &WINNERS),
        case: word(reading, &mut fields, "case", &CASES),
        finding: fields.text(reading, "finding").map(|given| given.text),
    };
    let says_something = ["command", "hazard", "winner", "case", "finding"].iter().any(|key| fields.has(key));
    fields.done(reading);
    if !says_something {
        reading.refuse(&value.spot, "nothing is expected", "give command, hazard, winner, case or finding");
    }
    Some(Expectation { modes, stretch: stretch?, wanted, place: reading.place(&value.spot) })
}

fn stretch(reading: &mut Reading, fields: &mut Fields<'_>) -> Option<Stretch> {
    let is_by_time = fields.has("from_s") || fields.has("to_s");
    let keys = if is_by_time { ["from_s", "to_s"] } else { ["from_m", "to_m"] };
    for key in keys {
        fields.must_have(reading, key);
    }
    let [from, to] = keys.map(|key| {
        if is_by_time {
            number(reading, fields, key, 0.0..=LONGEST_S, "s")
        } else {
            metres(reading, fields, key)
        }
    });
    let (key, unit, otherwise) =
        if is_by_time { ("tolerance_s", "s", 0.2) } else { ("tolerance_m", "m", 1.0) };
    let tolerance = number(reading, fields, key, 0.0..=1000.0, unit).unwrap_or(otherwise);
    let (from, to) = (from?, to?);
    if from + tolerance > to - tolerance {
        let reason =
            format!("from {from} to {to} {unit} nothing is left but the tolerance of {tolerance} {unit}");
        reading.refuse(fields.spot(), reason, &format!("give a longer stretch, or less {key}"));
        return None;
    }
    Some(if is_by_time {
        Stretch::Seconds { from, to, tolerance }
    } else {
        Stretch::Metres { from, to, tolerance }
    })
}
