//! From readings to one verdict a report: publish this state, or withhold it for that reason.
//!
//! This is the one place where the four fates of a value collapse into a report
//! (docs/spec/vehicle-interface.md, "The four fates of a value" and "Report rules").

use super::binding::{FaultBinding, OnFault, TurnWhileHazard};
use super::sources::{LightsContext, SourceMemory, SourceStates};
use super::state::{HazardCode, Judged, TurnCode};
use super::warning::Warnings;
use crate::core::can::bus::Received;
use crate::core::validation::meaning::Meaning;
use crate::core::validation::observation::Reading;
use crate::core::validation::table::{FaultSignal, SignalIndex};

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
    pub warnings: Warnings,
    /// The source that decided the state, by position in the profile.
    pub source: usize,
}

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
pub fn judge(memory: &mut SourceMemory, context: LightsContext<'_>) -> Verdicts {
    let binding = context.binding;
    let SourceStates { turn, hazard } = memory.evaluate(context);
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
    let turn_verdict = with_faults(context, turn_state, &binding.turn_faults);
    let hazard_verdict = with_faults(context, hazard_state, &binding.hazard_faults);
    Verdicts {
        turn: Verdict { warnings: turn.warnings, source: turn.source, ..turn_verdict },
        hazard: Verdict { warnings: hazard.warnings, source: hazard.source, reason, ..hazard_verdict },
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

fn with_faults<T: Copy>(context: LightsContext<'_>, state: Judged<T>, faults: &FaultBinding) -> Verdict<T> {
    let is_on = |(index, fault): (usize, &FaultSignal)| match context.read(&fault.role) {
        Reading::Observed { meaning: Meaning::Defined(true) | Meaning::Fault, raw, .. } => {
            Some(ActiveFault { signal: fault.role.signal, raw, index })
        }
        Reading::Observed { .. } | Reading::Missing(_) => None,
    };
    let fault = faults.signals.iter().enumerate().find_map(is_on);
    let withheld = fault.is_some() && faults.on_fault == OnFault::Withhold;
    let publish = state.ok().filter(|_| !withheld);
    Verdict { state, fault, publish, reason: None, warnings: Warnings::default(), source: 0 }
}
