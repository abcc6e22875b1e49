//! A physical quantity of a profile: an inline table with a signal, its unit, its sign and the valid raw
//! values.

use crate::config::reading::{Fields, Keywords};
use crate::config::vehicle::binder::{Binder, Meanings, NOT_AVAILABLE, UNUSABLE, unusable_values};
use crate::config::vehicle::raw_values::RawValues;
use can_signal::dbc::model::Signal;
use can_signal::validation::meaning::Meaning;
use gateway_core::vehicle_status::quantity::{QualityFlag, Quantity, Term};

/// A unit of quantities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    /// Factor to SI units.
    to_si: f64,
    /// True for the rotation of a wheel instead of a speed.
    pub(super) is_rotation: bool,
}

const fn unit(to_si: f64) -> Unit {
    Unit { to_si, is_rotation: false }
}

const fn rotation(to_radps: f64) -> Unit {
    Unit { to_si: to_radps, is_rotation: true }
}

/// Kind of a quantity, with its units and the words for its sign.
pub(super) struct QuantityKind {
    units: Keywords<Unit>,
    /// Words for the direction in which values grow; `true` = the sign of Autoware.
    directions: Keywords<bool>,
    /// True if each such quantity has a sign.
    has_sign: bool,
}

/// Radians of one degree.
const DEGREE: f64 = std::f64::consts::PI / 180.0;
const ANGLES: Keywords<bool> = &[("left", true), ("right", false)];
const SPEEDS: Keywords<bool> = &[("forward", true), ("backward", false)];

/// An angle of steering, rad, left positive.
pub(super) const STEERING_ANGLE: QuantityKind =
    QuantityKind { units: &[("deg", unit(DEGREE)), ("rad", unit(1.0))], directions: ANGLES, has_sign: true };

/// A heading rate, rad/s, to the left positive.
pub(super) const HEADING_RATE: QuantityKind = QuantityKind {
    units: &[("deg/s", unit(DEGREE)), ("rad/s", unit(1.0))],
    directions: ANGLES,
    has_sign: true,
};

/// The speed of the vehicle, m/s; forward positive if it has a sign.
pub(super) const SPEED: QuantityKind =
    QuantityKind { units: LINEAR_SPEEDS, directions: SPEEDS, has_sign: false };

const LINEAR_SPEEDS: Keywords<Unit> =
    &[("m/s", unit(1.0)), ("km/h", unit(1.0 / 3.6)), ("mph", unit(0.44704)), ("yd/s", unit(0.9144))];

/// Other spellings of units, in DBCs and profiles, in lower case and without blanks. The intended unit is
/// looked up and never guessed by similarity: `kph` is more similar to `mph` than to `km/h`.
#[rustfmt::skip]
const SPELLINGS: &[(&str, &[&str])] = &[
    ("km/h", &["kph", "khp", "kmh", "kmph", "km/hr", "km/hour", "kmhr", "kmperh", "km_h", "km_per_h", "km_per_hour", "kmh-1", "km*h-1"]),
    ("m/s", &["mps", "ms", "m/sec", "meter/s", "m_s", "m_per_s", "m_per_sec", "ms-1", "m*s-1"]),
    ("mph", &["mi/h", "mi/hr", "mile/h", "miles/h", "mileperhour", "milesperhour", "mi_per_h"]),
    ("yd/s", &["yps", "yard/s", "yards/s"]),
    ("rpm", &["1/min", "r/min", "rev/min", "u/min", "min-1", "rpms"]),
    ("deg", &["°", "degree", "degrees"]),
    ("rad", &["radian", "radians"]),
    ("deg/s", &["°/s", "°/sec", "deg/sec", "degree/s", "degrees/s", "degree/sec", "dps", "deg_s", "deg_per_s", "degs-1"]),
    ("rad/s", &["rad/sec", "radian/s", "radians/s", "radps", "rad_s", "rad_per_s", "rads-1"]),
];

/// The speed of a wheel, m/s or rad/s; forward positive if it has a sign.
pub(super) const WHEEL_SPEED: QuantityKind = QuantityKind {
    units: &[
        ("m/s", unit(1.0)),
        ("km/h", unit(1.0 / 3.6)),
        ("mph", unit(0.44704)),
        ("yd/s", unit(0.9144)),
        ("rad/s", rotation(1.0)),
        ("rpm", rotation(std::f64::consts::TAU / 60.0)),
    ],
    directions: SPEEDS,
    has_sign: false,
};

/// A quantity as read.
pub(super) struct ReadQuantity {
    pub(super) quantity: Quantity,
    pub(super) unit: Unit,
    /// True if its values have a sign.
    pub(super) has_sign: bool,
}

/// Reads a quantity; `None` if a problem was recorded.
pub(super) fn quantity(
    binder: &mut Binder<'_>,
    fields: &Fields<'_>,
    kind: &QuantityKind,
) -> Option<ReadQuantity> {
    let is_complete = fields.require(&["signal", "unit", "valid"], "a quantity needs signal, unit and valid");
    let given = fields.string("signal");
    let unit = unit_of(fields, kind.units);
    if kind.has_sign {
        fields.require(&["positive"], "name the direction in which values grow");
    }
    let is_autowares_sign = fields.keyword("positive", kind.directions);
    let has_sign = kind.has_sign || fields.has("positive");
    if fields.has("sign") && !has_sign {
        let remedy = "name the direction that the sign calls positive";
        fields.refuse("sign", "a sign needs `positive`", remedy);
    }
    let scale = fields.number("scale", 0.01..=100.0, "").unwrap_or(1.0);
    let valid = RawValues::some_given(fields, "valid").map(|values| (values, Meaning::Defined(())));
    let mut meanings: Meanings<()> = valid.into_iter().collect();
    meanings.extend(unusable_values(fields, UNUSABLE));
    let opposite = fields.table("sign").map(|sign| {
        let remedy = "a sign needs signal, positive and negative";
        sign.read_all(|sign| binder.switch(sign, ["negative", "positive"], UNUSABLE, remedy))
    });
    let flags = fields.tables("flags").map(|flag| flag.read_all(|flag| quality_flag(binder, flag)));
    let flags: Vec<_> = flags.collect();
    let plus = fields.string("plus");
    is_complete?;
    let given = given?;
    let role = binder.role(&given, &meanings);
    let (main_bus, main_message, main) = binder.find_signal(&given)?;
    let plus = match plus {
        None => None,
        Some(plus) => {
            let (bus, message, term) = binder.find_signal(&plus)?;
            if (bus, &message.name) != (main_bus, &main_message.name) {
                let reason = format!("{} is in another message than {}", term.name, main.name);
                return binder.checker.refused(&plus.location, reason, "name a signal of the same message");
            }
            Some((binder.signal(&plus)?.0, term))
        }
    };
    let sign = if has_sign && !is_autowares_sign? { -1.0 } else { 1.0 };
    let unit = unit?;
    let to_si = sign * scale * unit.to_si;
    let offset = main.offset + plus.map_or(0.0, |(_, term): (_, &Signal)| term.offset);
    let quantity = Quantity {
        role: role?,
        factor: to_si * main.factor,
        offset: to_si * offset,
        plus: plus.map(|(signal, term)| Term { signal, factor: to_si * term.factor }),
        opposite: match opposite {
            None => None,
            Some(role) => Some(role?),
        },
        flags: flags.into_iter().collect::<Option<_>>()?,
    };
    Some(ReadQuantity { quantity, unit, has_sign })
}

/// Reads the unit of a quantity with these units.
fn unit_of(fields: &Fields<'_>, units: Keywords<Unit>) -> Option<Unit> {
    let given = fields.text("unit")?;
    let named = |name: &str| units.iter().find(|(unit, _)| *unit == name);
    if let Some((_, unit)) = named(&given.text) {
        return Some(*unit);
    }
    let remedy = match spelled(&given.text).and_then(named) {
        Some((meant, _)) => format!("did you mean {meant}?"),
        None => format!("give one of {}", units.iter().map(|(unit, _)| *unit).collect::<Vec<_>>().join(", ")),
    };
    fields.refused("unit", format!("unknown unit {:?}", given.text), &remedy)
}

/// Returns the unit that is spelled differently in `given`.
fn spelled(given: &str) -> Option<&'static str> {
    let plain: String = given.to_lowercase().split_whitespace().collect();
    let is_meant =
        |(unit, spellings): &&(&str, &[&str])| *unit == plain || spellings.contains(&plain.as_str());
    SPELLINGS.iter().find(is_meant).map(|(unit, _)| *unit)
}

/// Reads a quality flag; `None` if a problem was recorded.
fn quality_flag(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<QualityFlag> {
    fields.require(&["text"], "say what is not good, for diagnostics");
    let text = fields.string("text");
    let role =
        binder.switch(fields, ["good", "bad"], NOT_AVAILABLE, "a quality flag needs signal, good and bad");
    Some(QualityFlag { role: role?, text: text?.text })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_dbcs_mean_a_unit_that_exists_and_never_two() {
        for (given, expected) in [
            ("kph", Some("km/h")),
            ("Khp", Some("km/h")),
            ("KM/H", Some("km/h")),
            ("km / h", Some("km/h")),
            ("kmph", Some("km/h")),
            ("mps", Some("m/s")),
            ("MPH", Some("mph")),
            ("deg/sec", Some("deg/s")),
            ("RPM", Some("rpm")),
            ("rps", None),
            ("grad", None),
        ] {
            assert_eq!(spelled(given), expected, "{given}");
        }
        let known: Vec<_> = [STEERING_ANGLE, HEADING_RATE, SPEED, WHEEL_SPEED]
            .iter()
            .flat_map(|kind| kind.units.iter().map(|(unit, _)| *unit))
            .collect();
        let mut all: Vec<_> = SPELLINGS.iter().flat_map(|(_, spellings)| *spellings).collect();
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count, "a spelling of two units");
        for (unit, spellings) in SPELLINGS {
            assert!(known.contains(unit) && !spellings.contains(unit), "{unit}");
        }
    }
}
