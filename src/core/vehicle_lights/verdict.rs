//! From readings to one verdict a report: publish this state, or withhold it for that reason.
//!
//! This is the one place where the four fates of a value collapse into a report
//! (vehicle-interface sections 1.3 and 4.2).

use super::binding::{FaultBinding, HazardCode, OnFault, TurnCode, TurnWhileHazard};
use super::remark::Remarks;
use super::sources::{Heard, Memory, View};
use crate::core::bus::Received;
use crate::core::trust::meaning::Meaning;
use crate::core::trust::observation::{Absence, Reading};
use crate::core::trust::table::{FaultSignal, SignalIndex};

/// `TurnIndicatorsReport.report`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TurnIndicators {
    /// DISABLE, 1.
    Disable,
    /// `ENABLE_LEFT`, 2.
    EnableLeft,
    /// `ENABLE_RIGHT`, 3.
    EnableRight,
}

/// `HazardLightsReport.report`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HazardLights {
    /// DISABLE, 1.
    Disable,
    /// ENABLE, 2.
    Enable,
}

impl TurnIndicators {
    /// The constant's name in the `.msg` file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disable => "DISABLE",
            Self::EnableLeft => "ENABLE_LEFT",
            Self::EnableRight => "ENABLE_RIGHT",
        }
    }
}

impl HazardLights {
    /// The constant's name in the `.msg` file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disable => "DISABLE",
            Self::Enable => "ENABLE",
        }
    }
}

/// Why a state is not published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doubt {
    /// The profile binds no signal that could tell.
    Unbound,
    /// Unknown: no believable value of this signal.
    Absent(SignalIndex, Absence),
    /// Unknown: the vehicle says "not available", with this raw value.
    NotAvailable(SignalIndex, i128),
    /// Invalid: the profile gives this raw value no meaning.
    Undefined(SignalIndex, i128),
    /// Invalid: left and right are on at once, which the profile calls undefined.
    BothOn([(SignalIndex, i128); 2]),
    /// The value itself says "fault".
    Fault(SignalIndex, i128),
    /// Unknown: lamps that are dark may be between two flashes.
    WatchingLamps([SignalIndex; 2]),
    /// Unknown: what this stalk or button was used for before it came into sight.
    Settling(SignalIndex),
}

/// A fault signal that is on: the signal and its position in the [`FaultBinding`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActiveFault {
    /// The signal.
    pub signal: SignalIndex,
    /// Its raw value.
    pub raw: i128,
    /// Position of its text.
    pub index: usize,
}

/// What is known of one report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdict<T> {
    /// The state and when it was received, or why there is none.
    pub state: Judged<T>,
    /// A fault the vehicle reports beside the state; the first one in the profile's order.
    pub fault: Option<ActiveFault>,
    /// What to publish: the state unless in doubt, or withheld for the fault.
    pub publish: Option<(T, Received)>,
    /// Why the hazard lights are on, for diagnostics.
    pub reason: Option<Reason>,
    /// What is odd, though it changes nothing.
    pub remarks: Remarks,
    /// The source that decided the state, by position in the profile.
    pub source: usize,
}

/// A state and when it was received, or why there is none.
pub type Judged<T> = Result<(T, Received), Doubt>;

/// Why the hazard lights are on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reason {
    /// The source that says so, by position.
    pub source: usize,
    /// Position in its list of reasons.
    pub index: u8,
}

/// Both verdicts at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdicts {
    /// Turn indicators.
    pub turn: Verdict<TurnIndicators>,
    /// Hazard lights.
    pub hazard: Verdict<HazardLights>,
}

/// Judges both reports now, and moves on what their sources remember.
pub fn judge(memory: &mut Memory, view: View<'_>) -> Verdicts {
    let binding = view.binding;
    let Heard { turn, hazard } = memory.hear(view);
    let hazard_state = hazard.state.map(|(code, received)| (lights_of(code), received));
    let turn_state = turn.state.map(|(code, received)| {
        let hazard_on = match hazard_state {
            Ok((HazardLights::Enable, since)) => Some(since),
            Ok((HazardLights::Disable, _)) | Err(_) => None,
        };
        match (binding.turn_while_hazard, hazard_on) {
            (TurnWhileHazard::Disable, Some(since)) => (TurnIndicators::Disable, received.newest(since)),
            (TurnWhileHazard::Keep, _) | (TurnWhileHazard::Disable, None) => (turn_of(code), received),
        }
    });
    let reason = hazard.state.ok().and_then(|(code, _)| code.reason);
    let reason = reason.map(|index| Reason { source: hazard.source, index });
    let turn_verdict = with_faults(view, turn_state, &binding.turn_faults);
    let hazard_verdict = with_faults(view, hazard_state, &binding.hazard_faults);
    Verdicts {
        turn: Verdict { remarks: turn.remarks, source: turn.source, ..turn_verdict },
        hazard: Verdict { remarks: hazard.remarks, source: hazard.source, reason, ..hazard_verdict },
    }
}

fn lights_of(code: HazardCode) -> HazardLights {
    if code.active { HazardLights::Enable } else { HazardLights::Disable }
}

/// Both sides on is hazard; the turn indicators then show no direction.
fn turn_of(code: TurnCode) -> TurnIndicators {
    match code {
        TurnCode::Left => TurnIndicators::EnableLeft,
        TurnCode::Right => TurnIndicators::EnableRight,
        TurnCode::Off | TurnCode::Both => TurnIndicators::Disable,
    }
}

fn with_faults<T: Copy>(view: View<'_>, state: Judged<T>, faults: &FaultBinding) -> Verdict<T> {
    let is_on = |(index, fault): (usize, &FaultSignal)| match view.read(&fault.role) {
        Reading::Seen { meaning: Meaning::Defined(true) | Meaning::Fault, raw, .. } => {
            Some(ActiveFault { signal: fault.role.signal, raw, index })
        }
        Reading::Seen { .. } | Reading::Absent(_) => None,
    };
    let fault = faults.signals.iter().enumerate().find_map(is_on);
    let withheld = fault.is_some() && faults.on_fault == OnFault::Withhold;
    let publish = state.ok().filter(|_| !withheld);
    Verdict { state, fault, publish, reason: None, remarks: Remarks::default(), source: 0 }
}
