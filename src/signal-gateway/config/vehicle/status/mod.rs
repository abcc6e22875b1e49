//! `[velocity]`, `[steering]`, `[gear]`, `[control_mode]` and `[[doors.door]]` of a profile: the status of
//! the vehicle apart from its lights.

mod control_mode;
mod doors;
mod gear;
mod quantity;
mod sources;
mod steering;
mod velocity;

use super::binder::Binder;
use crate::config::reading::Fields;
use control_mode::control_mode;
use doors::doors;
use gateway_core::vehicle_status::binding::StatusBinding;
use gateway_core::vehicle_status::velocity::binding::DirectionSource;
use gear::gear;
use steering::steering;
use velocity::velocity;

/// Reads the sections to a binding without messages and signals; `None` if a problem was recorded.
pub(super) fn status(binder: &mut Binder<'_>, top: &Fields<'_>) -> Option<StatusBinding> {
    let before = binder.checker.count();
    let binding = StatusBinding {
        velocity: top.table("velocity").and_then(|fields| velocity(binder, fields)),
        steering: top.read_table("steering", |fields| Some(steering(binder, fields))).unwrap_or_default(),
        gear: top.read_table("gear", |fields| gear(binder, fields)),
        control_mode: top.read_table("control_mode", |fields| control_mode(binder, fields)),
        doors: top.read_table("doors", |fields| Some(doors(binder, fields))).unwrap_or_default(),
        ..StatusBinding::default()
    };
    let needs = binding.velocity.as_ref();
    if needs.is_some_and(|velocity| velocity.directions.contains(&DirectionSource::Gear)) && !top.has("gear")
    {
        let reason = "the direction comes from the gear, which the profile does not describe";
        top.refuse("velocity", reason, "add [gear], or another source of the direction");
    }
    (binder.checker.count() == before).then_some(binding)
}
