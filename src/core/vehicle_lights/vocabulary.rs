//! Words for what raw values mean, for people who look at a bus or check a profile.

use super::binding::{FaultBinding, HazardBinding, LightsBinding, Role, SignalIndex, TurnBinding, TurnCode};
use super::meaning::{Meaning, RawRange};

/// What one raw value of a signal means for the gateway.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// E.g. `turn left`, `hazard on (crash)`, `turn not available`.
    pub text: String,
    /// False when the profile gives the value no meaning.
    pub defined: bool,
}

/// What `raw` of `signal` means, once for each role the signal has.
pub fn words(binding: &LightsBinding, signal: SignalIndex, raw: i128) -> Vec<Word> {
    roles(binding)
        .into_iter()
        .filter(|role| role.signal == signal)
        .map(|role| {
            let named = role.named.into_iter().find(|(range, _)| range.first <= raw && raw <= range.last);
            match named {
                Some((_, text)) => Word { text: format!("{} {text}", role.subject), defined: true },
                None => Word { text: format!("{} UNDEFINED", role.subject), defined: false },
            }
        })
        .collect()
}

/// One use of a signal, with its named values in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RoleWords {
    /// The signal.
    pub signal: SignalIndex,
    /// What it tells of, e.g. `turn`, `left`, `hazard`, `fault of front lamp`.
    pub subject: String,
    /// Its values and what they mean.
    pub named: Vec<(RawRange, String)>,
}

/// Every use of every signal, in the order turn, hazard, faults.
pub fn roles(binding: &LightsBinding) -> Vec<RoleWords> {
    let on_off = |on: bool| if on { "on" } else { "off" }.to_owned();
    let mut roles = Vec::new();
    match &binding.turn {
        TurnBinding::NotFitted => {}
        TurnBinding::Enumerated(role) => roles.push(role_words(role, "turn".into(), |code| {
            match code {
                TurnCode::Off => "off",
                TurnCode::Left => "left",
                TurnCode::Right => "right",
                TurnCode::Both => "both",
            }
            .to_owned()
        })),
        TurnBinding::Pair { left, right, .. } => {
            roles.push(role_words(left, "left".into(), on_off));
            roles.push(role_words(right, "right".into(), on_off));
        }
    }
    match &binding.hazard {
        HazardBinding::NotFitted | HazardBinding::Unbound | HazardBinding::BothLamps => {}
        HazardBinding::Signal { role, reasons } => roles.push(role_words(role, "hazard".into(), |code| {
            match code.reason.and_then(|reason| reasons.get(usize::from(reason))) {
                Some(reason) => format!("on ({reason})"),
                None => on_off(code.active),
            }
        })),
    }
    for faults in [&binding.turn_faults, &binding.hazard_faults] {
        roles.extend(fault_roles(faults, on_off));
    }
    roles
}

fn fault_roles(faults: &FaultBinding, on_off: fn(bool) -> String) -> impl Iterator<Item = RoleWords> {
    faults
        .signals
        .iter()
        .map(move |fault| role_words(&fault.role, format!("fault of {}", fault.text), on_off))
}

fn role_words<T: Copy>(role: &Role<T>, subject: String, name: impl Fn(T) -> String) -> RoleWords {
    let word = |(range, meaning): &(RawRange, Meaning<T>)| {
        let text = match meaning {
            Meaning::Defined(value) => name(*value),
            Meaning::NotAvailable => "not available".to_owned(),
            Meaning::Fault => "fault".to_owned(),
            Meaning::Undefined => "UNDEFINED".to_owned(),
        };
        (*range, text)
    };
    RoleWords { signal: role.signal, subject, named: role.values.entries().iter().map(word).collect() }
}
