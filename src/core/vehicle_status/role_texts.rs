//! Texts for the meanings of raw values of the status.

use super::binding::StatusBinding;
use super::control_mode::ControlModeSource;
use super::doors::DoorState;
use super::gear::GearCode;
use super::quantity::Quantity;
use super::steering::{AngleOf, SteeringSource};
use crate::core::control_mode::ControlMode;
use crate::core::names::words;
use crate::core::validation::display::{RoleTexts, ValueText, role_texts};
use crate::core::validation::meaning::Meaning;
use crate::core::validation::table::SignalIndex;

/// Meanings of `raw`, one for each use of `signal`.
pub fn texts(binding: &StatusBinding, signal: SignalIndex, raw: i128) -> Vec<ValueText> {
    let quantities = named_quantities(binding);
    let quantities = quantities.filter(|(_, quantity)| quantity.role.signal == signal);
    let measured = quantities.map(|(name, quantity)| measured_text(name, quantity, raw));
    let named = roles(binding).into_iter().filter(|role| role.signal == signal);
    measured.chain(named.map(|role| role.value_text(raw))).collect()
}

/// All uses of signals with named values.
pub fn roles(binding: &StatusBinding) -> Vec<RoleTexts> {
    let is_good = |good| if good { "good" } else { "bad" }.to_owned();
    let on_off = |on| if on { "on" } else { "off" }.to_owned();
    let mut roles = Vec::new();
    for (name, quantity) in named_quantities(binding) {
        let opposite = |opposite| if opposite { "opposite" } else { "as given" }.to_owned();
        roles.extend(
            quantity.opposite.iter().map(|role| role_texts(role, format!("sign of {name}"), opposite)),
        );
        roles.extend(quantity.flags.iter().map(|flag| role_texts(&flag.role, flag.text.clone(), is_good)));
    }
    for source in binding.gear.iter().flat_map(|gear| &gear.sources) {
        roles.push(role_texts(&source.role, "gear".to_owned(), |code: GearCode| code.name().to_owned()));
    }
    if let Some(mode) = &binding.control_mode {
        if let ControlModeSource::Named(role) = &mode.source {
            let name = |mode: ControlMode| mode.name().to_owned();
            roles.push(role_texts(role, "control mode".to_owned(), name));
        }
        roles.extend(
            mode.switches().into_iter().map(|(name, role)| role_texts(role, name.to_owned(), on_off)),
        );
    }
    for door in &binding.doors {
        roles.push(role_texts(&door.role, format!("door {}", door.name), |state: DoorState| words_of(state)));
    }
    roles
}

fn words_of(state: DoorState) -> String {
    words(&state).to_lowercase()
}

/// All quantities with their names and units for people.
fn named_quantities(binding: &StatusBinding) -> impl Iterator<Item = (&'static str, &Quantity)> {
    let steering = binding.steering.iter().flat_map(|steering| &steering.sources);
    steering.map(|SteeringSource { angle_of, angle, .. }| match angle_of {
        AngleOf::SteeringWheel => ("steering wheel", angle),
        AngleOf::Tire => ("front wheels", angle),
    })
}

fn measured_text(name: &str, quantity: &Quantity, raw: i128) -> ValueText {
    let text = match quantity.role.values.meaning(raw) {
        Meaning::Defined(()) => format!("{name} {:.1}°", quantity.value(raw).to_degrees()),
        Meaning::NotAvailable => format!("{name} not available"),
        Meaning::Fault => format!("{name} fault"),
        Meaning::Undefined => return ValueText { text: format!("{name} UNDEFINED"), defined: false },
    };
    ValueText { text, defined: true }
}
