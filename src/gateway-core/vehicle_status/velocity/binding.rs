//! Binding of the velocity to signals, compiled from the profile.

use std::time::Duration;

use serde::Serialize;

use crate::vehicle_status::plausibility::limits::STANDING_MPS;
use crate::vehicle_status::quantity::Quantity;
use crate::vehicle_status::state::StatusReason;
use can_signal::can::ReceiveTime;
use can_signal::validation::table::{Role, SignalIndex};
use gateway_base::names::named_by_variant;

/// Names of the wheels in the order in which they are bound.
pub const WHEELS: [&str; 4] = ["front left", "front right", "rear left", "rear right"];

/// Binding of the velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct VelocityBinding {
    /// At least one source of the speed, most trusted first.
    pub speeds: Vec<SpeedSource>,
    /// Sources of the direction, most trusted first; empty if each speed has a sign.
    pub directions: Vec<DirectionSource>,
    /// At least one source of the heading rate, most trusted first.
    pub heading_rates: Vec<HeadingRateSource>,
    /// True if 0 is published while the heading rate is unknown; false if nothing is published then.
    pub is_unknown_heading_rate_zero: bool,
    /// Maximum age of a part relative to the frame with the speed.
    pub max_skew: Duration,
}

/// A source of the speed.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct SpeedSource {
    pub name: String,
    pub signals: SpeedSignals,
    /// The source is used only while it reads less than this, m/s; `None` = always.
    pub below_mps: Option<f64>,
}

/// Signals of a speed.
#[derive(Debug, Clone, PartialEq)]
pub enum SpeedSignals {
    /// One signal with the speed of the vehicle.
    Vehicle(SpeedSignal),
    /// Signals of single wheels.
    Wheels {
        /// Front left, front right, rear left, rear right, `None` if the profile does not name the wheel.
        wheels: Box<[Option<SpeedSignal>; 4]>,
        /// Wheels from which the speed is calculated.
        used: WheelsUsed,
    },
}

/// Wheels from which the speed of the vehicle is calculated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WheelsUsed {
    /// Mean of the rear wheels, whose axle is the reference of the report.
    #[default]
    Rear,
    /// Mean of all four wheels, which is too high in curves.
    All,
    /// Mean of the front wheels, projected to the rear axle using the steering; for cars whose rear wheels
    /// slip.
    FrontProjected,
}

impl SpeedSignals {
    /// Returns all signals.
    pub fn all(&self) -> Vec<&SpeedSignal> {
        match self {
            Self::Vehicle(signal) => vec![signal],
            Self::Wheels { wheels, .. } => wheels.iter().flatten().collect(),
        }
    }
}

/// A signal of a speed.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct SpeedSignal {
    /// Speed, m/s, or rad/s for a rotation; forward positive if it has a sign.
    pub quantity: Quantity,
    pub is_signed: bool,
    pub is_rotation: bool,
}

/// Direction of motion according to a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum Motion {
    Forward,
    Backward,
    Standstill,
}

named_by_variant!(Motion);

impl Motion {
    /// Returns the motion of a vehicle with this speed; below 0.1 m/s it stands still, as in Autoware.
    pub fn of(speed_mps: f64) -> Self {
        match speed_mps {
            speed if speed.abs() < STANDING_MPS => Self::Standstill,
            speed if speed < 0.0 => Self::Backward,
            _ => Self::Forward,
        }
    }
}

/// A source of the direction.
#[derive(Debug, Clone, PartialEq)]
pub enum DirectionSource {
    /// A signal with the direction in which the vehicle or a wheel moves.
    Signal(Role<Motion>),
    /// The engaged gear.
    Gear,
}

/// A source of the heading rate.
#[derive(Debug, Clone, PartialEq)]
pub enum HeadingRateSource {
    /// A yaw rate sensor.
    YawRate {
        /// Heading rate, rad/s, counter-clockwise positive.
        rate: Quantity,
        /// True if its zero is measured while the vehicle stands still.
        has_zero_at_standstill: bool,
    },
    /// Calculated from speed, angle of the front wheels and wheel base.
    Steering,
    /// Calculated from the difference between the rear wheels and their distance.
    Wheels,
}

impl HeadingRateSource {
    /// Returns the name used in diagnostics.
    pub fn name(&self) -> &'static str {
        match self {
            Self::YawRate { .. } => "yaw rate sensor",
            Self::Steering => "steering",
            Self::Wheels => "rear wheels",
        }
    }
}

impl VelocityBinding {
    /// Returns all speed signals.
    pub fn speed_signals(&self) -> impl Iterator<Item = &SpeedSignal> {
        self.speeds.iter().flat_map(|source| source.signals.all())
    }

    /// Returns all yaw rate sensors.
    pub fn yaw_rates(&self) -> impl Iterator<Item = &Quantity> {
        self.heading_rates.iter().filter_map(|source| match source {
            HeadingRateSource::YawRate { rate, .. } => Some(rate),
            HeadingRateSource::Steering | HeadingRateSource::Wheels => None,
        })
    }

    /// Returns the roles of the direction signals.
    pub fn motions(&self) -> impl Iterator<Item = &Role<Motion>> {
        self.directions.iter().filter_map(|source| match source {
            DirectionSource::Signal(role) => Some(role),
            DirectionSource::Gear => None,
        })
    }

    /// Returns all signals on which the velocity depends, except signals of gear and steering.
    pub fn signals(&self) -> impl Iterator<Item = SignalIndex> {
        let speeds = self.speed_signals().flat_map(|signal| signal.quantity.signals());
        let directions = self.motions().map(|role| role.signal);
        speeds.chain(directions).chain(self.yaw_rates().flat_map(Quantity::signals))
    }

    /// Returns a part, unless it is older than the frame with the speed by more than `max_skew`.
    pub fn in_step<T>(&self, part: (T, ReceiveTime), received: ReceiveTime) -> Result<T, StatusReason> {
        let is_in_step = received.at.is_within(self.max_skew, part.1.at);
        if is_in_step { Ok(part.0) } else { Err(StatusReason::OutOfStep) }
    }
}
