//! State of the lights shown by a raw value of a bound signal, for pictures and pages; its texts are in
//! [`role_texts`](super::role_texts).

use super::binding::{FaultBinding, HazardSource, LightsBinding, TurnSource};
use super::stalk::StalkPosition;
use super::state::TurnCode;
use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::{Role, SignalIndex};

/// State shown by a raw value. If a signal has several uses, the first variant in this order applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum RawState {
    /// A fault, or a value without a meaning.
    Faulty,
    /// Both sides or the hazard lights are on.
    Hazard,
    /// The left side is on.
    Left,
    /// The right side is on.
    Right,
    /// The vehicle reports "not available".
    NotAvailable,
    /// Off, at rest, or no fault.
    Off,
    /// None of the above: a button, or a condition.
    Other,
}

/// Returns the state shown by a raw value, over all uses of its signal.
pub fn raw_state(binding: &LightsBinding, signal: SignalIndex, raw: i128) -> RawState {
    let mut states = Vec::new();
    let mut use_of = UseOf { signal, raw, states: &mut states };
    for named in binding.turn.sources() {
        use_of.turn(&named.source);
        use_of.condition(named.condition.as_ref());
    }
    for named in binding.hazard.sources() {
        use_of.hazard(&named.source);
        use_of.condition(named.condition.as_ref());
    }
    for FaultBinding { signals, .. } in [&binding.turn_faults, &binding.hazard_faults] {
        for fault in signals {
            use_of.role(&fault.role, |is_faulty| if is_faulty { RawState::Faulty } else { RawState::Off });
        }
    }
    states.into_iter().min().unwrap_or(RawState::Other)
}

/// Uses of one signal, with the state that its value shows in each.
struct UseOf<'a> {
    signal: SignalIndex,
    raw: i128,
    states: &'a mut Vec<RawState>,
}

impl UseOf<'_> {
    fn role<T: Copy>(&mut self, role: &Role<T>, defined: impl Fn(T) -> RawState) {
        if role.signal != self.signal {
            return;
        }
        self.states.push(match role.values.meaning(self.raw) {
            Meaning::Defined(value) => defined(value),
            Meaning::NotAvailable => RawState::NotAvailable,
            Meaning::Fault | Meaning::Undefined => RawState::Faulty,
        });
    }

    fn turn(&mut self, source: &TurnSource) {
        match source {
            TurnSource::Enumerated { role, .. } => self.role(role, |code| match code {
                TurnCode::Off => RawState::Off,
                TurnCode::Left => RawState::Left,
                TurnCode::Right => RawState::Right,
                TurnCode::Both => RawState::Hazard,
            }),
            TurnSource::Pair { pair, .. } | TurnSource::Lamps { pair, .. } => {
                self.role(&pair.left, |is_on| if is_on { RawState::Left } else { RawState::Off });
                self.role(&pair.right, |is_on| if is_on { RawState::Right } else { RawState::Off });
            }
            TurnSource::Stalk { role, .. } => self.role(role, |position| match position {
                StalkPosition::Idle => RawState::Off,
                StalkPosition::LeftHalf | StalkPosition::LeftFull => RawState::Left,
                StalkPosition::RightHalf | StalkPosition::RightFull => RawState::Right,
            }),
        }
    }

    fn hazard(&mut self, source: &HazardSource) {
        match source {
            HazardSource::BothSides => {}
            HazardSource::Signal { role, .. } => {
                self.role(role, |code| if code.active { RawState::Hazard } else { RawState::Off });
            }
            HazardSource::Button { role, .. } => self.role(role, |_| RawState::Other),
        }
    }

    fn condition(&mut self, condition: Option<&Role<bool>>) {
        if let Some(role) = condition {
            self.role(role, |_| RawState::Other);
        }
    }
}
