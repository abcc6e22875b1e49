//! State of the lights shown by a raw value of a bound signal, for pictures and pages; its texts are in
//! [`role_texts`](super::role_texts).

use super::binding::{HazardSource, LightsBinding, TurnSource};
use super::state::TurnCode;
use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::{Role, SignalIndex};

/// State shown by a raw value. If a signal has several uses, the first variant in this order applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs)] // their names say it
pub enum RawState {
    /// A fault, or a value without a meaning.
    Faulty,
    /// Both sides or the hazard lights are on.
    Hazard,
    Left,
    Right,
    /// The vehicle reports "not available".
    NotAvailable,
    /// Off, at rest, or no fault.
    Off,
    /// None of the above: a button, or a condition.
    Other,
}

impl From<TurnCode> for RawState {
    fn from(code: TurnCode) -> Self {
        match code {
            TurnCode::Off => Self::Off,
            TurnCode::Left => Self::Left,
            TurnCode::Right => Self::Right,
            TurnCode::Both => Self::Hazard,
        }
    }
}

/// Returns the state shown by a raw value, over all uses of its signal.
pub fn raw_state(binding: &LightsBinding, signal: SignalIndex, raw: i128) -> RawState {
    let mut uses = Uses { signal, raw, state: RawState::Other };
    for named in binding.turn.sources() {
        match &named.source {
            TurnSource::Enumerated { role, .. } => uses.add(role, RawState::from),
            TurnSource::Pair { pair, .. } | TurnSource::Lamps { pair, .. } => {
                uses.switch(&pair.left, RawState::Left);
                uses.switch(&pair.right, RawState::Right);
            }
            TurnSource::Stalk { role, .. } => uses.add(role, |position| position.side().into()),
        }
        named.condition.iter().for_each(|role| uses.add(role, |_| RawState::Other));
    }
    for named in binding.hazard.sources() {
        match &named.source {
            HazardSource::BothSides => {}
            HazardSource::Signal { role, .. } => {
                uses.add(role, |code| if code.active { RawState::Hazard } else { RawState::Off });
            }
            HazardSource::Button { role, .. } => uses.add(role, |_| RawState::Other),
        }
        named.condition.iter().for_each(|role| uses.add(role, |_| RawState::Other));
    }
    for fault in binding.turn_faults.signals.iter().chain(&binding.hazard_faults.signals) {
        uses.switch(&fault.role, RawState::Faulty);
    }
    uses.state
}

/// Uses of one signal, with the first state that its value shows in any of them.
struct Uses {
    signal: SignalIndex,
    raw: i128,
    state: RawState,
}

impl Uses {
    fn add<T: Copy>(&mut self, role: &Role<T>, defined: impl Fn(T) -> RawState) {
        if role.signal == self.signal {
            self.state = self.state.min(match role.values.meaning(self.raw) {
                Meaning::Defined(value) => defined(value),
                Meaning::NotAvailable => RawState::NotAvailable,
                Meaning::Fault | Meaning::Undefined => RawState::Faulty,
            });
        }
    }

    fn switch(&mut self, role: &Role<bool>, on: RawState) {
        self.add(role, |is_on| if is_on { on } else { RawState::Off });
    }
}
