//! State of a light source, or the reason why it is unavailable.

use derive_more::From;
use serde::Serialize;

use can_signal::can::ReceiveTime;
use can_signal::validation::requirement::Unmet;
use can_signal::validation::table::SignalIndex;
use can_signal::validation::unusable::{FaultKind, Unusable};
use gateway_base::names::named_by_variant;
use gateway_base::time::MonoTime;

/// State of the turn indicators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum TurnCode {
    Off,
    Left,
    Right,
    /// Both sides are on, as with hazard lights.
    Both,
}

named_by_variant!(TurnCode);

impl TurnCode {
    /// Returns the state in which these sides are on.
    pub fn from_sides(Sides { left, right }: Sides) -> Self {
        match (left, right) {
            (false, false) => Self::Off,
            (true, false) => Self::Left,
            (false, true) => Self::Right,
            (true, true) => Self::Both,
        }
    }
}

/// A flag for each side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(missing_docs)] // their names say it
pub struct Sides {
    pub left: bool,
    pub right: bool,
}

/// State of the hazard lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct HazardCode {
    /// True if the hazard lights are on.
    pub active: bool,
    /// Position of the reason in the list of the binding; `None` = no reason given.
    pub reason: Option<u8>,
}

impl HazardCode {
    /// Returns the name used in texts, `on` or `off`.
    pub fn name(self) -> &'static str {
        if self.active { "on" } else { "off" }
    }
}

/// A state with its receive time, or the reason why it is unavailable.
pub type Judged<T> = Result<(T, ReceiveTime), UnavailableReason>;

/// Reason why a state is unavailable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, From)]
pub enum UnavailableReason {
    /// No signal of the vehicle shows the state.
    NotVisible,
    /// A requirement of the profile is not met, so the profile may be for another vehicle.
    OtherVehicle(Unmet),
    /// The condition of the source is off with this raw value, so the source does not apply.
    NotSelected(SignalIndex, i128),
    /// A signal has no usable value.
    #[from]
    Signal(Unusable),
    /// Left and right are on at once, which the profile declares undefined.
    BothOn([(SignalIndex, i128); 2]),
    /// The lamps have not been observed for long enough to distinguish off from the dark part of a flash.
    WatchingLamps([SignalIndex; 2]),
    /// The stalk or button has not been observed for long enough to exclude an earlier press.
    Settling(SignalIndex),
}

impl UnavailableReason {
    /// Returns true for a permitted sleep of the bus, which is not a failure of the report.
    pub fn is_sleep(self) -> bool {
        matches!(self, Self::Signal(reason) if reason.is_sleep())
    }

    /// Returns true while the first value since the start is awaited. `is_starting` is true while frames are.
    pub fn is_awaited(self, is_starting: bool) -> bool {
        match self {
            Self::Signal(reason) => reason.is_awaited(),
            Self::OtherVehicle(unmet) => is_starting && !unmet.is_contradicted,
            Self::NotVisible
            | Self::NotSelected(..)
            | Self::BothOn(_)
            | Self::WatchingLamps(_)
            | Self::Settling(_) => false,
        }
    }

    /// Returns true while lamps or a stalk are observed.
    pub fn is_observing(self) -> bool {
        matches!(self, Self::WatchingLamps(_) | Self::Settling(_))
    }

    /// Returns the kind of failure that this reason causes.
    pub fn kind(self) -> FaultKind {
        match self {
            Self::Signal(reason) => reason.kind(),
            Self::BothOn(_) => FaultKind::Invalid,
            Self::NotVisible
            | Self::OtherVehicle(_)
            | Self::NotSelected(..)
            | Self::WatchingLamps(_)
            | Self::Settling(_) => FaultKind::Unknown,
        }
    }
}

/// A state machine that derives a steady state from the frames of a momentary or flashing signal.
///
/// Call [`Self::observe`] for every frame and once when the signal becomes unavailable, and [`Self::advance`]
/// at [`Self::next_deadline`]. A `now` before the previous one counts as the previous one.
pub trait StateMachine {
    /// Content of a frame.
    type Input;
    /// State that the sources derive.
    type State;

    /// Processes a frame; `None` = unknown, or the last frame is no longer valid.
    fn observe(&mut self, input: Option<Self::Input>, now: MonoTime);

    /// Advances the time without a frame.
    fn advance(&mut self, now: MonoTime);

    /// Returns the derived state; `None` while it is unknown.
    fn state(&self) -> Option<Self::State>;

    /// Returns the next instant at which [`Self::advance`] is due without a frame.
    fn next_deadline(&self) -> Option<MonoTime>;
}
