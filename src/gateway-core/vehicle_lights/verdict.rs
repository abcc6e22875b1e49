//! Verdict of each report: the state to publish, or the reason to withhold it.
//!
//! Only here do the four fates of a value collapse into a report (docs/spec/vehicle-interface.md,
//! "The four fates of a value" and "Report rules").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::binding::{FaultBinding, FaultSignal, OnFault, TurnWhileHazard};
use super::sources::{LightsContext, SourceMemory, SourceStates};
use super::state::{HazardCode, Judged, TurnCode, UnavailableReason};
use super::warning::Warnings;
use can_signal::can::ReceiveTime;
use can_signal::validation::requirement::Unmet;
use can_signal::validation::table::SignalIndex;
use can_signal::validation::unusable::Unusable;
use gateway_base::names::named_by_variant;

/// State of the turn indicators, `TurnIndicatorsReport.report` of Autoware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum TurnIndicators {
    /// The constant `DISABLE` (1).
    Disable,
    /// The constant `ENABLE_LEFT` (2).
    EnableLeft,
    /// The constant `ENABLE_RIGHT` (3).
    EnableRight,
}

/// State of the hazard lights, `HazardLightsReport.report` of Autoware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum HazardLights {
    /// The constant `DISABLE` (1).
    Disable,
    /// The constant `ENABLE` (2).
    Enable,
}

named_by_variant!(TurnIndicators, HazardLights);

impl TurnIndicators {
    /// All states.
    pub const ALL: [Self; 3] = [Self::Disable, Self::EnableLeft, Self::EnableRight];
}

impl HazardLights {
    /// All states.
    pub const ALL: [Self; 2] = [Self::Disable, Self::Enable];
}

/// A fault signal that reports a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct ActiveFault {
    pub signal: SignalIndex,
    pub raw: i128,
    /// Position in the [`FaultBinding`].
    pub index: usize,
}

/// Verdict of one report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdict<T> {
    /// The state with its receive time, or the reason why it is unavailable.
    pub state: Judged<T>,
    /// First active fault in the order of the profile; `None` = no fault.
    pub fault: Option<ActiveFault>,
    /// State to publish; `None` if it is unavailable, or withheld because of a fault.
    pub publish: Option<(T, ReceiveTime)>,
    /// Reason why the hazard lights are on, for diagnostics; `None` = none given.
    pub reason: Option<Reason>,
    /// Irregularities that do not change the report.
    pub warnings: Warnings,
    /// Position of the deciding source in the profile.
    pub source: usize,
}

/// Reason why the hazard lights are on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reason {
    /// Position of the source that reports the reason.
    pub source: usize,
    /// Position of the reason in the list of the source.
    pub index: u8,
}

/// Verdicts of both reports at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub struct Verdicts {
    pub turn: Verdict<TurnIndicators>,
    pub hazard: Verdict<HazardLights>,
}

/// Evaluates the sources of both reports and returns the verdicts.
pub fn judge(memory: &mut SourceMemory, context: LightsContext<'_>) -> Verdicts {
    let binding = context.binding;
    let SourceStates { mut turn, mut hazard } = memory.evaluate(context);
    if let Some(unmet) = context.unmet {
        require(*unmet, &mut turn.state);
        require(*unmet, &mut hazard.state);
    }
    let hazard_state = hazard.state.map(|(code, received)| (lights_of(code), received));
    let turn_state = turn.state.map(|(code, received)| {
        if let Ok((HazardLights::Enable, since)) = hazard_state
            && binding.turn_while_hazard == TurnWhileHazard::Disable
        {
            (TurnIndicators::Disable, received.newest(since))
        } else {
            (turn_of(code), received)
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

/// Withholds a state while a requirement is not met. A contradicted requirement replaces any other reason,
/// except that the vehicle never shows the state; an open requirement replaces no reason.
fn require<T>(unmet: Unmet, state: &mut Judged<T>) {
    let has_reason = state
        .as_ref()
        .is_err_and(|reason| *reason == UnavailableReason::NotVisible || !unmet.is_contradicted);
    if !has_reason {
        *state = Err(UnavailableReason::OtherVehicle(unmet));
    }
}

fn lights_of(code: HazardCode) -> HazardLights {
    if code.active { HazardLights::Enable } else { HazardLights::Disable }
}

/// Returns the turn report of a state; while the hazard lights are on, the turn indicators show no direction.
fn turn_of(code: TurnCode) -> TurnIndicators {
    match code {
        TurnCode::Left => TurnIndicators::EnableLeft,
        TurnCode::Right => TurnIndicators::EnableRight,
        TurnCode::Off | TurnCode::Both => TurnIndicators::Disable,
    }
}

fn with_faults<T: Copy>(context: LightsContext<'_>, state: Judged<T>, faults: &FaultBinding) -> Verdict<T> {
    let is_on = |(index, fault): (usize, &FaultSignal)| {
        let is_on = match context.judge(&fault.role) {
            Ok((is_on, _)) => is_on,
            Err(reason) => matches!(reason, UnavailableReason::Signal(Unusable::Fault(..))),
        };
        let signal = fault.role.signal;
        let raw = context.observations.last(signal).filter(|_| is_on)?.raw;
        Some(ActiveFault { signal, raw, index })
    };
    let fault = faults.signals.iter().enumerate().find_map(is_on);
    let withheld = fault.is_some() && faults.on_fault == OnFault::Withhold;
    let publish = state.ok().filter(|_| !withheld);
    Verdict { state, fault, publish, reason: None, warnings: Warnings::default(), source: 0 }
}
