//! Control mode of a vehicle with drive-by-wire, from a signal that names the mode or from bits for each
//! axis.

use super::state::{Judged, StatusContext, StatusReason};
use crate::control_mode::ControlMode;
use can_signal::can::ReceiveTime;
use can_signal::validation::table::{Role, SignalIndex};

/// Binding of the control mode.
#[derive(Debug, Clone, PartialEq)]
pub struct ControlModeBinding {
    /// Signals of the mode.
    pub source: ControlModeSource,
    /// True if `NOT_READY` is published while the mode is unknown; false if nothing is published then.
    pub is_not_ready_while_unknown: bool,
}

/// Signals of the control mode.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlModeSource {
    /// One signal names the mode.
    Named(Role<ControlMode>),
    /// One bit for each axis.
    Axes(Box<Axes>),
}

/// Bits for each axis, `true` = the computer controls it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axes {
    /// Steering; `None` if the kit cannot steer.
    pub steering: Option<Role<bool>>,
    /// Accelerator, brake and other bits of longitudinal control; empty if the kit has none.
    pub longitudinal: Vec<Role<bool>>,
    /// Bits that are true if the kit can be engaged.
    pub ready: Vec<Role<bool>>,
    /// Bits that are true if the driver or an emergency stop has taken over.
    pub overrides: Vec<Role<bool>>,
    /// Bits that are true if the kit is faulty.
    pub faults: Vec<Role<bool>>,
}

impl ControlModeBinding {
    /// Returns all roles with their names in texts.
    pub fn switches(&self) -> Vec<(&'static str, &Role<bool>)> {
        let ControlModeSource::Axes(axes) = &self.source else { return Vec::new() };
        let groups = [
            ("steering by wire", axes.steering.as_slice()),
            ("longitudinal control by wire", &axes.longitudinal),
            ("ready", &axes.ready),
            ("override", &axes.overrides),
            ("fault", &axes.faults),
        ];
        let switches =
            groups.into_iter().flat_map(|(name, roles)| roles.iter().map(move |role| (name, role)));
        switches.collect()
    }

    /// Returns all signals.
    pub fn signals(&self) -> Vec<SignalIndex> {
        match &self.source {
            ControlModeSource::Named(role) => vec![role.signal],
            ControlModeSource::Axes(_) => self.switches().into_iter().map(|(_, role)| role.signal).collect(),
        }
    }

    /// Evaluates the mode.
    ///
    /// # Errors
    /// Fails with the reason why the mode is unknown: `AUTONOMOUS` and every other mode need each signal.
    pub fn judge(&self, context: StatusContext<'_>) -> Judged<ControlMode> {
        match &self.source {
            ControlModeSource::Named(role) => context.defined(role),
            ControlModeSource::Axes(axes) => axes.judge(context),
        }
    }
}

impl Axes {
    fn judge(&self, context: StatusContext<'_>) -> Judged<ControlMode> {
        let mut newest = None;
        let mut is_on = |role: &Role<bool>| -> Result<bool, StatusReason> {
            let (is_on, received) = context.defined(role)?;
            newest = Some(newest.map_or(received, |newest: ReceiveTime| newest.newest(received)));
            Ok(is_on)
        };
        let mut all = |roles: &[Role<bool>]| -> Result<Group, StatusReason> {
            let mut seen = Group { any_on: false, any_off: false };
            for role in roles {
                if is_on(role)? { seen.any_on = true } else { seen.any_off = true }
            }
            Ok(seen)
        };
        let steering = all(self.steering.as_slice())?;
        let longitudinal = all(&self.longitudinal)?;
        let (ready, overrides, faults) = (all(&self.ready)?, all(&self.overrides)?, all(&self.faults)?);
        let mode = if faults.any_on || ready.any_off {
            ControlMode::NotReady
        } else if overrides.any_on {
            ControlMode::Disengaged
        } else if longitudinal.any_on && longitudinal.any_off {
            // A partly controlled axis belongs neither to the computer nor to the driver.
            ControlMode::NotReady
        } else {
            match (steering.any_on, longitudinal.any_on) {
                (true, true) => ControlMode::Autonomous,
                (true, false) => ControlMode::AutonomousSteerOnly,
                (false, true) => ControlMode::AutonomousVelocityOnly,
                (false, false) => ControlMode::Manual,
            }
        };
        newest.map(|received| (mode, received)).ok_or(StatusReason::NoSource)
    }
}

/// Combined state of the signals of a group.
struct Group {
    any_on: bool,
    any_off: bool,
}
