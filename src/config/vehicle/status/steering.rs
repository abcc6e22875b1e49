//! `[steering]` of a profile: the angle of the steering wheel, or of the front wheels.

use super::quantity::{STEERING_ANGLE, quantity};
use super::sources::sources;
use crate::config::reading::Fields;
use crate::config::vehicle::binder::Binder;
use crate::core::vehicle_status::steering::{AngleOf, SteeringBinding, SteeringSource};

/// Reads the binding; `None` when a problem was noted.
pub(super) fn steering(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<SteeringBinding> {
    let sources = sources(binder, &fields, |binder, fields, name| {
        let keys = ["wheel", "tire"];
        let reason = "give either the steering wheel's angle or the front wheels' angle";
        let key = fields.only_one_of(&keys, reason);
        let Some(key) = key else {
            fields.refuse(
                "wheel",
                "missing key `wheel`",
                "give `wheel`, or `tire` if the vehicle sends the angle of the front wheels",
            );
            return None;
        };
        let angle_of = if key == "wheel" { AngleOf::SteeringWheel } else { AngleOf::Tire };
        let angle = quantity(binder, fields.table(key)?, &STEERING_ANGLE)?.quantity;
        Some(SteeringSource { name, angle_of, angle })
    });
    fields.done();
    (!sources.is_empty()).then_some(SteeringBinding { sources })
}
