//! `[[command.driver]]` of a profile: signals that indicate that the driver has taken over.

use super::super::binder::{Binder, NOT_AVAILABLE};
use crate::config::reading::{Fields, Keywords};
use gateway_core::command::control_mode::Grants;
use gateway_core::command::settings::DriverSign;

const BOTH: Grants = Grants { turn: true, hazard: true };
const OVERRIDES: Keywords<Grants> = &[
    ("both", BOTH),
    ("turn", Grants { turn: true, hazard: false }),
    ("hazard", Grants { turn: false, hazard: true }),
];

/// Reads a signal that indicates that the driver has taken over, and the affected functions.
pub(super) fn driver_sign(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<DriverSign> {
    let role = binder.switch(fields, ["on", "off"], NOT_AVAILABLE, "");
    let overrides = fields.keyword("overrides", OVERRIDES).unwrap_or(BOTH);
    Some(DriverSign { role: role?, overrides })
}
