//! A physical quantity of a profile: an inline table with a signal, its unit, its sign and the raw values that count.

use crate::config::reading::{Fields, Keywords};
use crate::config::vehicle::binder::{Binder, Meanings, NOT_AVAILABLE, UNUSABLE, unusable_values};
use crate::config::vehicle::raw_values::RawValues;
use crate::core::dbc::model::Signal;
use crate::core::validation::meaning::Meaning;
use crate::core::vehicle_status::quantity::{QualityFlag, Quantity, Term};

/// The kind of a quantity, which has its units and the words for its sign.
pub(super) struct QuantityKind {
    /// Units with the factor to SI units.
    pub(super) units: Keywords<f64>,
    /// Words for the direction in which values grow; `true` = the sign of Autoware. Empty where values are never negative.
    pub(super) directions: Keywords<bool>,
}

/// An angle of steering, rad, left positive.
pub(super) const STEERING_ANGLE: QuantityKind = QuantityKind {
    units: &[("deg", std::f64::consts::PI / 180.0), ("rad", 1.0)],
    directions: &[("left", true), ("right", false)],
};

/// Reads a quantity; `None` when a problem was noted.
pub(super) fn quantity(binder: &mut Binder<'_>, fields: Fields<'_>, kind: &QuantityKind) -> Option<Quantity> {
    let is_complete = fields.require(&["signal", "unit", "valid"], "a quantity needs signal, unit and valid");
    let given = fields.string("signal");
    let unit = fields.keyword("unit", kind.units);
    let is_autowares_sign = match kind.directions {
        [] => Some(true),
        directions => {
            fields.require(&["positive"], "name the direction in which values grow")?;
            fields.keyword("positive", directions)
        }
    };
    let scale = fields.number("scale", 0.01..=100.0, "").unwrap_or(1.0);
    let mut meanings: Meanings<()> = RawValues::some_given(&fields, "valid")
        .map(|values| (values, Meaning::Defined(())))
        .into_iter()
        .collect();
    meanings.extend(unusable_values(&fields, UNUSABLE));
    let opposite = fields.table("sign").map(|sign| {
        let role = binder.switch(
            &sign,
            ["negative", "positive"],
            UNUSABLE,
            "a sign needs signal, positive and negative",
        );
        sign.done();
        role
    });
    let flags: Vec<_> = fields.tables("flags").map(|flag| quality_flag(binder, flag)).collect();
    let plus = fields.string("plus");
    fields.done();
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
                binder.refuse(&plus.location, reason, "name a signal of the same message");
                return None;
            }
            Some((binder.signal(&plus)?.0, term))
        }
    };
    let sign = if is_autowares_sign? { 1.0 } else { -1.0 };
    let to_si = sign * scale * unit?;
    let offset = main.offset + plus.map_or(0.0, |(_, term): (_, &Signal)| term.offset);
    Some(Quantity {
        role: role?,
        factor: to_si * main.factor,
        offset: to_si * offset,
        plus: plus.map(|(signal, term)| Term { signal, factor: to_si * term.factor }),
        opposite: match opposite {
            None => None,
            Some(role) => Some(role?),
        },
        flags: flags.into_iter().collect::<Option<_>>()?,
    })
}

/// Reads a quality flag; `None` when a problem was noted.
fn quality_flag(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<QualityFlag> {
    fields.require(&["text"], "say what is not good, for diagnostics");
    let text = fields.string("text");
    let role =
        binder.switch(&fields, ["good", "bad"], NOT_AVAILABLE, "a quality flag needs signal, good and bad");
    fields.done();
    Some(QualityFlag { role: role?, text: text?.text })
}
