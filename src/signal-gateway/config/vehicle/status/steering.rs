//! `[steering]` of a profile: the angle of the steering wheel, or of the front wheels.

use super::quantity::{STEERING_ANGLE, quantity};
use super::sources::sources;
use crate::config::reading::Fields;
use crate::config::vehicle::binder::Binder;
use gateway_core::vehicle_status::steering::{AngleOf, SteeringSource};

/// Reads the sources, most trusted first; omits sources with a problem.
pub(super) fn steering(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Vec<SteeringSource> {
    sources(binder, fields, |binder, fields, name| {
        let (angle_of, angle) = match (fields.table("wheel"), fields.table("tire")) {
            (Some(wheel), None) => (AngleOf::SteeringWheel, wheel),
            (None, Some(tire)) => (AngleOf::Tire, tire),
            (None, None) => {
                let remedy = "give `wheel`, or `tire` if the vehicle sends the angle of the front wheels";
                return fields.refused("wheel", "missing key `wheel`", remedy);
            }
            (Some(_), Some(_)) => {
                let remedy = "keep one of them";
                return fields.refused("tire", "the angle of the steering wheel is given as well", remedy);
            }
        };
        let angle = angle.read_all(|fields| quantity(binder, fields, &STEERING_ANGLE))?.quantity;
        Some(SteeringSource { name, angle_of, angle })
    })
}
