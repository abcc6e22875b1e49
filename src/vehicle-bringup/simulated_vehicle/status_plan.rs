//! Adds the vehicle status signals to the plan.

use super::encoder::{ReportedSubject, SignalValue};
use super::measured::{Measured, MeasuredQuantity, QuantityPart};
use super::motion::Dimensions;
use super::plan::{Draft, PlanError};
use can_signal::validation::table::SignalTable;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_status::binding::StatusBinding;
use gateway_core::vehicle_status::control_mode::{Axes, ControlModeBinding, ControlModeSource};
use gateway_core::vehicle_status::steering::AngleOf;
use gateway_core::vehicle_status::velocity::binding::{SpeedSignals, VelocityBinding};

const STEERED: &[ControlMode] = &[ControlMode::Autonomous, ControlMode::AutonomousSteerOnly];
const DRIVEN: &[ControlMode] = &[ControlMode::Autonomous, ControlMode::AutonomousVelocityOnly];
const TAKEN_OVER: &[ControlMode] = &[ControlMode::Disengaged];
const FAULTY: &[ControlMode] = &[ControlMode::NotReady];
const READY: &[ControlMode] = &[
    ControlMode::Autonomous,
    ControlMode::AutonomousSteerOnly,
    ControlMode::AutonomousVelocityOnly,
    ControlMode::Manual,
    ControlMode::Disengaged,
];

impl Draft<'_> {
    /// Adds all status signals that the profile reads, each source with its own signals.
    pub(super) fn status(
        &mut self,
        status: &StatusBinding,
        dimensions: &Dimensions,
    ) -> Result<(), PlanError> {
        let table = &status.table;
        if let Some(velocity) = &status.velocity {
            self.velocity(table, velocity, dimensions)?;
        }
        for source in &status.steering {
            let measured = match source.angle_of {
                AngleOf::SteeringWheel => Measured::SteeringWheel,
                AngleOf::Tire => Measured::FrontWheels,
            };
            self.quantity(table, &MeasuredQuantity::new(table, &source.angle, measured))?;
        }
        for source in status.gear.iter().flat_map(|gear| &gear.sources) {
            self.add(table, &source.role, ReportedSubject::Gear, SignalValue::Gear)?;
        }
        if let Some(control_mode) = &status.control_mode {
            self.control_mode(table, control_mode)?;
        }
        for (position, door) in status.doors.iter().enumerate() {
            self.add(table, &door.role, ReportedSubject::Door(position), SignalValue::Door)?;
        }
        Ok(())
    }

    fn velocity(
        &mut self,
        table: &SignalTable,
        velocity: &VelocityBinding,
        dimensions: &Dimensions,
    ) -> Result<(), PlanError> {
        for source in &velocity.speeds {
            let signals: Vec<_> = match &source.signals {
                SpeedSignals::Vehicle(signal) => vec![(Measured::Speed, signal)],
                SpeedSignals::Wheels { wheels, .. } => {
                    let wheels = wheels.iter().enumerate();
                    wheels.filter_map(|(at, wheel)| Some((Measured::Wheel(at), wheel.as_ref()?))).collect()
                }
            };
            for (measured, signal) in signals {
                self.quantity(table, &MeasuredQuantity::speed(table, signal, measured, dimensions))?;
            }
        }
        for rate in velocity.yaw_rates() {
            self.quantity(table, &MeasuredQuantity::new(table, rate, Measured::YawRate))?;
        }
        for role in velocity.motions() {
            self.add(table, role, ReportedSubject::Direction, SignalValue::Motion)?;
        }
        Ok(())
    }

    fn quantity(&mut self, table: &SignalTable, encoded: &MeasuredQuantity) -> Result<(), PlanError> {
        let quantity = &encoded.quantity;
        let parts = quantity.plus.iter().map(|term| (term.signal, QuantityPart::Term));
        for (signal, part) in parts.chain([(quantity.role.signal, QuantityPart::Main)]) {
            self.encoder(table, signal)?.measure(encoded, part);
        }
        if let Some(role) = &quantity.opposite {
            let is_magnitude_negative = encoded.is_magnitude_negative();
            let subject = ReportedSubject::Opposite { measured: encoded.measured, is_magnitude_negative };
            self.add(table, role, subject, SignalValue::On)?;
        }
        for flag in &quantity.flags {
            self.add(table, &flag.role, ReportedSubject::Condition, SignalValue::On)?;
        }
        Ok(())
    }

    fn control_mode(
        &mut self,
        table: &SignalTable,
        control_mode: &ControlModeBinding,
    ) -> Result<(), PlanError> {
        let axes: &Axes = match &control_mode.source {
            ControlModeSource::Named(role) => {
                return self.add(table, role, ReportedSubject::Mode, SignalValue::Mode);
            }
            ControlModeSource::Axes(axes) => axes,
        };
        let groups = [
            (axes.steering.as_slice(), STEERED),
            (&axes.longitudinal, DRIVEN),
            (&axes.ready, READY),
            (&axes.overrides, TAKEN_OVER),
            (&axes.faults, FAULTY),
        ];
        for (roles, modes) in groups {
            for role in roles {
                self.add(table, role, ReportedSubject::OnIn(modes), SignalValue::On)?;
            }
        }
        Ok(())
    }
}
