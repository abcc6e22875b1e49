//! A value of the vehicle's status, or the reason why it is unavailable.

use derive_more::From;

use super::plausibility::alarm::Alarm;
use super::settings::{GeometryKey, StatusSettings};
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
    /// A signal has no value that may be used.
    #[from]
    Signal(Unusable),
    /// A requirement of the profile is not met, so that the vehicle may be another one.
    #[from]
    OtherVehicle(Unmet),
    /// A flag of this signal says that the value is bad, by this raw value.
    BadQuality(SignalIndex, i128),
    /// The physical value of this signal is beyond what a vehicle can do.
    OutOfRange(SignalIndex),
    /// The gearbox is between two gears, for too long if `is_long`.
    BetweenGears {
        /// Signal of the gear.
        signal: SignalIndex,
        /// True if it stays there longer than a shift takes.
        is_long: bool,
    },
    /// The gearbox shows only whether reverse is engaged, and it is not.
    OnlyReverseShown(SignalIndex),
    /// The configuration does not give this dimension of the car.
    NotConfigured(GeometryKey),
    /// The steering ratio depends on the speed, which is unknown.
    NoSpeedForSteering,
    /// The part is much older than the frame with the speed.
    OutOfStep,
    /// No signal tells forward from backward now: the vehicle began to roll without a gear.
    DirectionNotTold,
    /// Speed and steering, or the rear wheels, give a heading rate beyond what a vehicle can do.
    HeadingRateOutOfRange,
    /// A rear wheel has no usable speed.
    NoRearWheels,
    /// It does not fit to the other parts of the motion.
    Implausible(Alarm),
    /// The configuration chooses another source, or the source does not count at this speed.
    NotChosen,
    /// The profile describes no source.
    NoSource,
}

impl StatusReason {
    /// Kind of failure; `None` for a reason that is none.
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

/// Binding, observations and buses at one moment.
#[derive(Debug, Clone, Copy)]
pub struct StatusContext<'a> {
    /// Messages and signals of the status.
    pub table: &'a SignalTable,
    /// What the configuration says of the vehicle.
    pub settings: &'a StatusSettings,
    /// Last values of the bound signals.
    pub observations: &'a Observations,
    /// Requirement of the profile that is not met; `None` = all are.
    pub unmet: Option<Unmet>,
    /// Buses that carry the signals.
    pub buses: &'a [Bus],
    /// Time of the evaluation.
    pub now: Now,
}

impl StatusContext<'_> {
    /// The defined value of a signal with its receive time.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn defined<T: Copy>(self, role: &Role<T>) -> Judged<T> {
        Ok(self.observations.defined(self.table, role, self.buses, self.now.mono)?)
    }
}

/// A value that the first usable of several sources gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chosen<T> {
    /// The value, or why no source has one.
    pub state: Judged<T>,
    /// Position of the source.
    pub source: usize,
    /// Why a more trusted source has none.
    pub fallback: Option<StatusReason>,
}

impl<T> Chosen<T> {
    /// The value of the first source that has one; if none has, the reason of the first. Sources that are not
    /// chosen do not count, unless none is.
    pub fn first<S>(sources: &[S], mut read: impl FnMut(usize, &S) -> Judged<T>) -> Self {
        let (mut first_reason, mut none) = (None, StatusReason::NoSource);
        for (source, bound) in sources.iter().enumerate() {
            match read(source, bound) {
                Ok(value) => return Self { state: Ok(value), source, fallback: first_reason },
                Err(StatusReason::NotChosen) => none = StatusReason::NotChosen,
                Err(reason) => first_reason = first_reason.or(Some(reason)),
            }
        }
        Self { state: Err(first_reason.unwrap_or(none)), source: 0, fallback: None }
    }
}
