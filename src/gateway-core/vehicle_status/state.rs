//! A value of the vehicle's status, or the reason why it is unavailable.

use derive_more::From;

use super::plausibility::alarm::Alarm;
use super::settings::{GeometryKey, StatusSettings};
use crate::vehicle_report::ReportState;
use can_signal::can::{Bus, ReceiveTime};
use can_signal::validation::observation::Observations;
use can_signal::validation::requirement::Unmet;
use can_signal::validation::table::{Role, SignalIndex, SignalTable};
use can_signal::validation::unusable::{FaultKind, Unusable};
use gateway_base::time::Now;

/// A value with its receive time, or the reason why it is unavailable.
pub type Judged<T> = Result<(T, ReceiveTime), StatusReason>;

/// Reason why a value is unavailable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, From)]
pub enum StatusReason {
    /// A signal has no usable value.
    #[from]
    Signal(Unusable),
    /// A requirement of the profile is not met, so the profile may be for another vehicle.
    #[from]
    OtherVehicle(Unmet),
    /// A flag indicates by this raw value that the value is bad.
    BadQuality(SignalIndex, i128),
    /// The physical value of this signal is impossible for a vehicle.
    OutOfRange(SignalIndex),
    /// The gearbox is between two gears.
    BetweenGears {
        /// Signal of the gear.
        signal: SignalIndex,
        /// True if it has been there for longer than a shift takes.
        is_long: bool,
    },
    /// The gearbox shows only whether reverse is engaged, and it is not.
    OnlyReverseShown(SignalIndex),
    /// This dimension of the car is not configured.
    NotConfigured(GeometryKey),
    /// The steering ratio depends on the speed, which is unknown.
    NoSpeedForSteering,
    /// The part is much older than the frame with the speed.
    OutOfStep,
    /// No signal distinguishes forward from backward: the vehicle began to roll without a gear.
    DirectionNotTold,
    /// Speed and steering, or the rear wheels, give a heading rate that is impossible for a vehicle.
    HeadingRateOutOfRange,
    /// A rear wheel has no usable speed.
    NoRearWheels,
    /// The value is inconsistent with other parts of the motion.
    Implausible(Alarm),
    /// The configuration chooses another source, or the source is not used at this speed.
    NotChosen,
    /// The profile describes no source.
    NoSource,
}

impl StatusReason {
    /// Returns true while the first value since the start is awaited. `is_starting` is true while frames are.
    pub fn is_awaited(self, is_starting: bool) -> bool {
        match self {
            Self::Signal(reason) => reason.is_awaited(),
            Self::OtherVehicle(unmet) => is_starting && !unmet.is_contradicted,
            Self::BadQuality(..)
            | Self::OutOfRange(_)
            | Self::BetweenGears { .. }
            | Self::OnlyReverseShown(_)
            | Self::NotConfigured(_)
            | Self::NoSpeedForSteering
            | Self::OutOfStep
            | Self::DirectionNotTold
            | Self::HeadingRateOutOfRange
            | Self::NoRearWheels
            | Self::Implausible(_)
            | Self::NotChosen
            | Self::NoSource => false,
        }
    }

    /// Returns the kind of failure; `None` for a reason that is not a failure.
    pub fn failure(self) -> Option<FaultKind> {
        match self {
            Self::Signal(reason) => (!reason.is_sleep()).then(|| reason.kind()),
            Self::BadQuality(..) => Some(FaultKind::HardwareFault),
            Self::OutOfRange(_)
            | Self::HeadingRateOutOfRange
            | Self::Implausible(_)
            | Self::BetweenGears { is_long: true, .. } => Some(FaultKind::Invalid),
            Self::OtherVehicle(_)
            | Self::NoSpeedForSteering
            | Self::OutOfStep
            | Self::DirectionNotTold
            | Self::NoRearWheels
            | Self::NotChosen
            | Self::NoSource => Some(FaultKind::Unknown),
            Self::BetweenGears { is_long: false, .. }
            | Self::OnlyReverseShown(_)
            | Self::NotConfigured(_) => None,
        }
    }
}

impl StatusReason {
    /// Returns the state of a report that has no value for this reason.
    pub fn state(self) -> ReportState {
        match (self.failure(), self) {
            (Some(kind), _) => kind.into(),
            (None, Self::BetweenGears { .. }) => ReportState::Shifting,
            (None, Self::OnlyReverseShown(_)) => ReportState::NotVisible,
            (None, Self::NotConfigured(_)) => ReportState::NotConfigured,
            (None, _) => ReportState::Asleep,
        }
    }
}

/// Binding, observations and buses at one instant.
#[derive(Debug, Clone, Copy)]
pub struct StatusContext<'a> {
    /// Messages and signals of the status.
    pub table: &'a SignalTable,
    /// Configuration of the vehicle and its reports.
    pub settings: &'a StatusSettings,
    /// Last values of the bound signals.
    pub observations: &'a Observations,
    /// Requirement of the profile that is not met; `None` = all are met.
    pub unmet: Option<Unmet>,
    /// Buses that carry the signals.
    pub buses: &'a [Bus],
    /// Time of the evaluation.
    pub now: Now,
}

impl StatusContext<'_> {
    /// Returns true while the first frames since the start are awaited on any bus.
    pub fn is_starting(self) -> bool {
        self.buses.iter().any(|bus| bus.is_starting(self.now.mono))
    }

    /// Returns the defined value of a signal with its receive time.
    pub fn defined<T: Copy>(self, role: &Role<T>) -> Judged<T> {
        Ok(self.observations.defined(self.table, role, self.buses, self.now.mono)?)
    }
}

/// Value of the first usable source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chosen<T> {
    /// The value, or the reason why no source has one.
    pub state: Judged<T>,
    /// Position of the deciding source in the profile.
    pub source: usize,
    /// Reason why a more trusted source has no value.
    pub fallback: Option<StatusReason>,
}

impl<T> Chosen<T> {
    /// Returns the value of the first source that has one; if none has, the reason of the first. Sources that
    /// are not chosen are ignored unless none is chosen.
    pub fn first<S>(sources: &[S], mut read: impl FnMut(usize, &S) -> Judged<T>) -> Self {
        let (mut first_reason, mut none) = (None, StatusReason::NoSource);
        for (source, bound) in sources.iter().enumerate() {
            match read(source, bound) {
                Ok(value) => return Self { state: Ok(value), source, fallback: first_reason },
                Err(StatusReason::NotChosen) => none = StatusReason::NotChosen,
                Err(reason) => first_reason = first_reason.or(Some(reason)),
            }
        }
        Self::none(first_reason.unwrap_or(none))
    }

    /// Returns the result for no usable source.
    pub fn none(reason: StatusReason) -> Self {
        Self { state: Err(reason), source: 0, fallback: None }
    }
}
