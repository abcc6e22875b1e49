//! `[command.control_mode]` and `[[command.driver]]` of a profile: signals that tell who is in control.

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::{Binder, no_state};
use super::super::raw_values::RawValues;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::command::control_mode::{ControlMode, Grants};
use crate::core::command::settings::DriverSign;
use crate::core::validation::table::Role;

const BOTH: Grants = Grants { turn: true, hazard: true };

keywords!(Grants {
    "both" => BOTH,
    "turn" => Grants { turn: true, hazard: false },
    "hazard" => Grants { turn: false, hazard: true },
});

fn both() -> Keyword<Grants> {
    Keyword(BOTH)
}

/// `[command.control_mode]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControlModeFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for AUTONOMOUS.
    pub autonomous: RawValues,
    /// Values for `AUTONOMOUS_STEER_ONLY`.
    pub steer_only: Option<RawValues>,
    /// Values for `AUTONOMOUS_VELOCITY_ONLY`.
    pub velocity_only: Option<RawValues>,
    /// Values for MANUAL.
    pub manual: RawValues,
    /// Values for DISENGAGED.
    pub disengaged: Option<RawValues>,
    /// Values for `NOT_READY`.
    pub not_ready: Option<RawValues>,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
}

/// `[[command.driver]]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriverFile {
    /// `MESSAGE.SIGNAL`
    pub signal: Spanned<String>,
    /// Values for "the driver has taken over".
    pub on: RawValues,
    /// Values for "he has not".
    pub off: RawValues,
    /// Values for "not available".
    pub not_available: Option<RawValues>,
    /// What he has taken; both when not given.
    #[serde(default = "both")]
    pub overrides: Keyword<Grants>,
}

/// The signal that tells the control mode.
pub(super) fn control_mode(binder: &mut Binder<'_>, file: &ControlModeFile) -> Option<Role<ControlMode>> {
    binder.require_values(&[&file.autonomous, &file.manual]);
    let modes = [
        (Some(&file.autonomous), ControlMode::Autonomous),
        (Some(&file.manual), ControlMode::Manual),
        (file.steer_only.as_ref(), ControlMode::AutonomousSteerOnly),
        (file.velocity_only.as_ref(), ControlMode::AutonomousVelocityOnly),
        (file.disengaged.as_ref(), ControlMode::Disengaged),
        (file.not_ready.as_ref(), ControlMode::NotReady),
    ];
    binder.state_role(&file.signal, modes, file.not_available.as_ref(), None)
}

/// A signal that tells that the driver has taken over.
pub(super) fn driver_sign(binder: &mut Binder<'_>, file: &DriverFile) -> Option<DriverSign> {
    let not_available = no_state(file.not_available.as_ref(), None);
    let role = binder.switch(&file.signal, [&file.on, &file.off], not_available)?;
    Some(DriverSign { role, overrides: file.overrides.0 })
}
