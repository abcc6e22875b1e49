//! Binding of a vehicle's status to signals, compiled from its profile.
//!
//! Built once at start-up by `config`, which has checked it against the DBC. Everything is addressed by
//! index, so no name is looked up per frame.

use super::control_mode::ControlModeBinding;
use super::doors::Door;
use super::gear::GearBinding;
use super::quantity::Quantity;
use super::steering::SteeringSource;
use super::velocity::binding::VelocityBinding;
use can_signal::validation::table::{SignalIndex, SignalTable};

/// Binding of the vehicle's status; empty if the profile does not describe it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StatusBinding {
    /// Messages and signals of the status.
    pub table: SignalTable,
    /// Velocity; `None` = the profile does not describe it.
    pub velocity: Option<VelocityBinding>,
    /// Sources of the steering, most trusted first; empty = the profile does not describe it.
    pub steering: Vec<SteeringSource>,
    /// Gear; `None` = the profile does not describe it.
    pub gear: Option<GearBinding>,
    /// Control mode; `None` = the profile does not describe it.
    pub control_mode: Option<ControlModeBinding>,
    /// Doors in the order of the profile.
    pub doors: Vec<Door>,
}

impl StatusBinding {
    /// Returns all quantities.
    pub fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        let speeds = self.velocity.iter().flat_map(VelocityBinding::speed_signals);
        let yaw_rates = self.velocity.iter().flat_map(VelocityBinding::yaw_rates);
        let steering = self.steering.iter().map(|source| &source.angle);
        speeds.map(|signal| &signal.quantity).chain(yaw_rates).chain(steering)
    }

    /// Returns the text of the quality flag on a signal; empty if it has no flag.
    pub fn flag_text(&self, signal: SignalIndex) -> &str {
        let mut flags = self.quantities().flat_map(|quantity| &quantity.flags);
        flags.find(|flag| flag.role.signal == signal).map_or("", |flag| &flag.text)
    }
}
