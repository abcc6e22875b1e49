//! Texts for the meanings of raw values of the status.

use super::binding::StatusBinding;
use super::control_mode::ControlModeSource;
use super::doors::DoorState;
use super::gear::GearCode;
use super::quantity::Quantity;
use super::steering::{AngleOf, SteeringSource};
use super::velocity::binding::{SpeedSignal, SpeedSignals, VelocityBinding, WHEELS};
use super::velocity::direction::Motion;
use crate::core::control_mode::ControlMode;
use crate::core::names::words;
use crate::core::validation::display::{RoleTexts, ValueText, role_texts};
use crate::core::validation::meaning::Meaning;
use crate::core::validation::table::SignalIndex;

/// Meanings of `raw`, one for each use of `signal`.
pub fn texts(binding: &StatusBinding, signal: SignalIndex, raw: i128) -> Vec<ValueText> {
    let quantities = named_quantities(binding).into_iter();
    let measured = quantities.filter(|named| named.quantity.role.signal == signal);
    let measured = measured.map(|named| named.value_text(raw));
    let named = roles(binding).into_iter().filter(|role| role.signal == signal);
    measured.chain(named.map(|role| role.value_text(raw))).collect()
}

/// All uses of signals with named values.
pub fn roles(binding: &StatusBinding) -> Vec<RoleTexts> {
    let is_good = |good| if good { "good" } else { "bad" }.to_owned();
    let on_off = |on| if on { "on" } else { "off" }.to_owned();
    let mut roles = Vec::new();
    for NamedQuantity { name, quantity, .. } in named_quantities(binding) {
        let opposite = |opposite| if opposite { "opposite" } else { "as given" }.to_owned();
        roles.extend(
            quantity.opposite.iter().map(|role| role_texts(role, format!("sign of {name}"), opposite)),
        );
        roles.extend(quantity.flags.iter().map(|flag| role_texts(&flag.role, flag.text.clone(), is_good)));
    }
    for role in binding.velocity.iter().flat_map(VelocityBinding::motions) {
        roles.push(role_texts(role, "motion".to_owned(), |motion: Motion| motion.name().to_owned()));
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

/// A quantity with its name, and its value in the unit that people expect.
struct NamedQuantity<'a> {
    name: String,
    quantity: &'a Quantity,
    text: fn(f64) -> String,
}

/// All quantities.
fn named_quantities(binding: &StatusBinding) -> Vec<NamedQuantity<'_>> {
    let degrees = |angle: f64| format!("{:.1}°", angle.to_degrees());
    let rate = |rate: f64| format!("{:.2}°/s", rate.to_degrees());
    let mut named = Vec::new();
    for source in binding.velocity.iter().flat_map(|velocity| &velocity.speeds) {
        match &source.signals {
            SpeedSignals::Vehicle(signal) => named.push(NamedQuantity::speed(source.name.clone(), signal)),
            SpeedSignals::Wheels { wheels, .. } => {
                named.extend(WHEELS.iter().zip(wheels.iter()).filter_map(|(name, wheel)| {
                    Some(NamedQuantity::speed(format!("{name} wheel"), wheel.as_ref()?))
                }));
            }
        }
    }
    let rates = binding.velocity.iter().flat_map(VelocityBinding::yaw_rates);
    named.extend(rates.map(|quantity| NamedQuantity { name: "yaw rate".to_owned(), quantity, text: rate }));
    for SteeringSource { angle_of, angle, .. } in
        binding.steering.iter().flat_map(|steering| &steering.sources)
    {
        let name = match angle_of {
            AngleOf::SteeringWheel => "steering wheel",
            AngleOf::Tire => "front wheels",
        };
        named.push(NamedQuantity { name: name.to_owned(), quantity: angle, text: degrees });
    }
    named
}

impl<'a> NamedQuantity<'a> {
    fn speed(name: String, signal: &'a SpeedSignal) -> Self {
        let text = if signal.is_rotation {
            |rotation| format!("{rotation:.2} rad/s")
        } else {
            |speed| format!("{speed:.2} m/s")
        };
        Self { name, quantity: &signal.quantity, text }
    }

    fn value_text(&self, raw: i128) -> ValueText {
        let name = &self.name;
        let text = match self.quantity.role.values.meaning(raw) {
            Meaning::Defined(()) => format!("{name} {}", (self.text)(self.quantity.value(raw))),
            Meaning::NotAvailable => format!("{name} not available"),
            Meaning::Fault => format!("{name} fault"),
            Meaning::Undefined => return ValueText { text: format!("{name} UNDEFINED"), defined: false },
        };
        ValueText { text, defined: true }
    }
}
