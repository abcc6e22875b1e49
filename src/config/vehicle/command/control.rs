//! `[command.control_mode]` and `[[command.driver]]` of a profile: signals that show who is in control.

use super::super::binder::{Binder, NOT_AVAILABLE};
use crate::config::reading::{Fields, Keywords};
use crate::core::command::control_mode::Grants;
use crate::core::command::settings::DriverSign;
use crate::core::control_mode::ControlMode;
use crate::core::validation::table::Role;

const BOTH: Grants = Grants { turn: true, hazard: true };
const OVERRIDES: Keywords<Grants> = &[
    ("both", BOTH),
    ("turn", Grants { turn: true, hazard: false }),
    ("hazard", Grants { turn: false, hazard: true }),
];

/// Reads the signal of the control mode.
pub(super) fn control_mode(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<Role<ControlMode>> {
    let required = [("autonomous", ControlMode::Autonomous), ("manual", ControlMode::Manual)];
    let optional = [
        ("steer_only", ControlMode::AutonomousSteerOnly),
        ("velocity_only", ControlMode::AutonomousVelocityOnly),
        ("disengaged", ControlMode::Disengaged),
        ("not_ready", ControlMode::NotReady),
    ];
    let role = binder.states(&fields, [&required, &optional], NOT_AVAILABLE, "");
    fields.done();
    role
}

/// Reads a signal that shows that the driver has taken over, and the functions that he has taken.
pub(super) fn driver_sign(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<DriverSign> {
    let role = binder.switch(&fields, ["on", "off"], NOT_AVAILABLE, "");
    let overrides = fields.keyword("overrides", OVERRIDES).unwrap_or(BOTH);
    fields.done();
    Some(DriverSign { role: role?, overrides })
}
