//! Texts for the meanings of raw values of the lights.

use super::binding::{FaultBinding, HazardSource, LightsBinding, NamedSource, TurnSource};
use super::stalk::StalkPosition;
use super::state::TurnCode;
use can_signal::validation::display::{RoleTexts, ValueText, role_texts};
use can_signal::validation::table::SignalIndex;
use gateway_base::names::words;

/// Returns the meanings of `raw`, one for each role of `signal`.
pub fn texts(binding: &LightsBinding, signal: SignalIndex, raw: i128) -> Vec<ValueText> {
    roles(binding).into_iter().filter(|role| role.signal == signal).map(|role| role.value_text(raw)).collect()
}

/// Returns all roles of all signals in the order turn, hazard, faults.
pub fn roles(binding: &LightsBinding) -> Vec<RoleTexts> {
    let mut roles = Vec::new();
    for named in binding.turn.sources() {
        turn_roles(&named.source, &mut roles);
        roles.extend(condition_role(named));
    }
    for named in binding.hazard.sources() {
        roles.extend(hazard_role(&named.source));
        roles.extend(condition_role(named));
    }
    for faults in [&binding.turn_faults, &binding.hazard_faults] {
        roles.extend(fault_roles(faults));
    }
    roles
}

fn on_off(on: bool) -> String {
    if on { "on" } else { "off" }.to_owned()
}

fn turn_roles(source: &TurnSource, roles: &mut Vec<RoleTexts>) {
    let code = |code: TurnCode| code.name().to_owned();
    let position = |position: StalkPosition| words(&position);
    match source {
        TurnSource::Enumerated { role, .. } => roles.push(role_texts(role, "turn".into(), code)),
        TurnSource::Pair { pair, .. } => {
            roles.push(role_texts(&pair.left, "left".into(), on_off));
            roles.push(role_texts(&pair.right, "right".into(), on_off));
        }
        TurnSource::Lamps { pair, .. } => {
            roles.push(role_texts(&pair.left, "left lamp".into(), on_off));
            roles.push(role_texts(&pair.right, "right lamp".into(), on_off));
        }
        TurnSource::Stalk { role, .. } => roles.push(role_texts(role, "stalk".into(), position)),
    }
}

fn hazard_role(source: &HazardSource) -> Option<RoleTexts> {
    let pressed = |pressed| if pressed { "pressed" } else { "released" }.to_owned();
    match source {
        HazardSource::BothSides => None,
        HazardSource::Signal { role, reasons } => Some(role_texts(role, "hazard".into(), |code| {
            let reason = code.reason.and_then(|reason| reasons.get(usize::from(reason)));
            reason.map_or_else(|| on_off(code.active), |reason| format!("on ({reason})"))
        })),
        HazardSource::Button { role, .. } => Some(role_texts(role, "hazard button".into(), pressed)),
    }
}

fn condition_role<S>(named: &NamedSource<S>) -> Option<RoleTexts> {
    let applies = |on| if on { "applies" } else { "does not apply" }.to_owned();
    let role = named.condition.as_ref()?;
    Some(role_texts(role, format!("source {}", named.name), applies))
}

fn fault_roles(faults: &FaultBinding) -> impl Iterator<Item = RoleTexts> {
    // The profile names the part, or the fault itself, in free text.
    let subject = |text: &str| {
        if text.contains("fault") { text.to_owned() } else { format!("fault of {text}") }
    };
    faults.signals.iter().map(move |fault| role_texts(&fault.role, subject(&fault.text), on_off))
}
