//! Binding of a vehicle's status to signals, compiled from its profile.
//!
//! Built once at start-up by `config`, which has checked it against the DBC. Everything is addressed by
//! index, so no name is looked up per frame.

use super::control_mode::ControlModeBinding;
use super::doors::Door;
use super::gear::GearBinding;
use super::measure::StatusReport;
use super::quantity::Quantity;
use super::steering::{AngleOf, SteeringSource};
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

    /// Returns the reports that a profile describes, in their order.
    pub fn reports(&self) -> impl Iterator<Item = StatusReport> + use<> {
        let described = [
            (StatusReport::Velocity, self.velocity.is_some()),
            (StatusReport::Steering, !self.steering.is_empty()),
            (StatusReport::Gear, self.gear.is_some()),
            (StatusReport::ControlMode, self.control_mode.is_some()),
            (StatusReport::Doors, !self.doors.is_empty()),
        ];
        described.into_iter().filter_map(|(report, is_described)| is_described.then_some(report))
    }

    /// Returns the signals on which a report depends.
    pub fn signals(&self, report: StatusReport) -> Vec<SignalIndex> {
        let mut signals: Vec<_> = match report {
            StatusReport::Velocity => self.velocity.iter().flat_map(VelocityBinding::signals).collect(),
            StatusReport::Steering => {
                self.steering.iter().flat_map(|source| source.angle.signals()).collect()
            }
            StatusReport::Gear => self.gear.iter().flat_map(GearBinding::signals).collect(),
            StatusReport::ControlMode => {
                self.control_mode.iter().flat_map(ControlModeBinding::signals).collect()
            }
            StatusReport::Doors => self.doors.iter().map(|door| door.role.signal).collect(),
        };
        let mut seen = Vec::new();
        signals.retain(|signal| {
            let is_new = !seen.contains(signal);
            seen.push(*signal);
            is_new
        });
        signals
    }

    /// Returns true if the steering source at a position is converted with the steering ratio.
    pub(super) fn uses_ratio(&self, position: usize) -> bool {
        self.steering.get(position).is_some_and(|source| source.angle_of == AngleOf::SteeringWheel)
    }

    /// Returns the name of the source of a report at a position; empty for the only source.
    pub(super) fn source_name(&self, report: StatusReport, position: usize) -> &str {
        let Self { velocity, steering, gear, .. } = self;
        let name = match report {
            StatusReport::Velocity => {
                velocity.iter().flat_map(|of| &of.speeds).nth(position).map(|source| &source.name)
            }
            StatusReport::Steering => steering.get(position).map(|source| &source.name),
            StatusReport::Gear => {
                gear.iter().flat_map(|of| &of.sources).nth(position).map(|source| &source.name)
            }
            StatusReport::ControlMode | StatusReport::Doors => None,
        };
        name.map_or("", String::as_str)
    }
}
