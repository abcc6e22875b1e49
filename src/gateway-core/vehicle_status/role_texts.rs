//! Texts for the meanings of raw values of the status.

use super::binding::StatusBinding;
use super::control_mode::ControlModeSource;
use super::doors::DoorState;
use super::gear::GearCode;
use super::quantity::{Quantity, Term};
use super::steering::{AngleOf, SteeringSource};
use super::velocity::binding::Motion;
use super::velocity::binding::{SpeedSignal, SpeedSignals, VelocityBinding, WHEELS};
use crate::control_mode::ControlMode;
use can_signal::validation::display::{RoleTexts, ValueText, role_texts};
use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::SignalIndex;
use gateway_base::names::state_word;

/// Uses of all signals, with the texts of their values.
#[derive(Debug, Clone)]
pub struct StatusTexts {
    quantities: Vec<NamedQuantity>,
    roles: Vec<RoleTexts>,
}

impl StatusTexts {
    /// Returns the texts of a binding.
    pub fn of(binding: &StatusBinding) -> Self {
        Self { quantities: named_quantities(binding), roles: roles(binding) }
    }

    /// Returns the meanings of `raw`, one for each use of `signal`.
    pub fn texts(&self, signal: SignalIndex, raw: i128) -> Vec<ValueText> {
        let measured = self.quantities.iter().filter_map(|named| named.value_text(signal, raw));
        let named = self.roles.iter().filter(|role| role.signal == signal);
        measured.chain(named.map(|role| role.value_text(raw))).collect()
    }

    /// Like [`Self::texts`], but joined to one text.
    pub fn text(&self, signal: SignalIndex, raw: i128) -> String {
        self.texts(signal, raw).into_iter().map(|meaning| meaning.text).collect::<Vec<_>>().join(", ")
    }

    /// Returns the worst meaning of `raw` among all uses of `signal`.
    pub fn meaning(&self, signal: SignalIndex, raw: i128) -> Meaning<()> {
        let quantities = self.quantities.iter().filter(|named| named.quantity.role.signal == signal);
        let measured = quantities.map(|named| named.quantity.role.values.meaning(raw));
        let roles = self.roles.iter().filter(|role| role.signal == signal);
        let named = roles.map(|role| role.meanings.meaning(raw));
        measured.chain(named).max_by_key(|meaning| severity(*meaning)).unwrap_or(Meaning::Defined(()))
    }

    /// Returns true if the signal has measured values.
    pub fn is_measured(&self, signal: SignalIndex) -> bool {
        self.quantities.iter().any(|named| named.part_of(signal).is_some())
    }

    /// Returns all uses for a list; a quantity is listed by the values at the ends of its ranges.
    pub fn roles(&self) -> impl Iterator<Item = RoleTexts> {
        self.quantities.iter().map(NamedQuantity::role).chain(self.roles.iter().cloned())
    }
}

/// Returns all uses of signals with named values.
fn roles(binding: &StatusBinding) -> Vec<RoleTexts> {
    let is_good = |good| if good { "good" } else { "bad" }.to_owned();
    let on_off = |on| if on { "on" } else { "off" }.to_owned();
    let mut roles = Vec::new();
    for NamedQuantity { name, quantity, .. } in named_quantities(binding) {
        let opposite = |opposite| if opposite { "opposite" } else { "as given" }.to_owned();
        let subject = format!("sign of {name}");
        roles.extend(quantity.opposite.iter().map(|role| role_texts(role, subject.clone(), opposite)));
        roles.extend(quantity.flags.iter().map(|flag| role_texts(&flag.role, flag.text.clone(), is_good)));
    }
    for role in binding.velocity.iter().flat_map(VelocityBinding::motions) {
        roles.push(role_texts(role, "motion".to_owned(), |motion: Motion| motion.name().to_owned()));
    }
    for source in binding.gear.iter().flat_map(|gear| &gear.sources) {
        roles.push(role_texts(&source.role, "gear".to_owned(), GearCode::words));
    }
    if let Some(mode) = &binding.control_mode {
        if let ControlModeSource::Named(role) = &mode.source {
            let name = |mode: ControlMode| state_word(&mode);
            roles.push(role_texts(role, "mode".to_owned(), name));
        }
        let switches = mode.switches().into_iter();
        roles.extend(switches.map(|(name, role)| role_texts(role, name.to_owned(), on_off)));
    }
    for door in &binding.doors {
        let name = |state: DoorState| state_word(&state);
        roles.push(role_texts(&door.role, format!("door {}", door.name), name));
    }
    roles
}

const fn severity(meaning: Meaning<()>) -> u8 {
    match meaning {
        Meaning::Defined(()) => 0,
        Meaning::NotAvailable => 1,
        Meaning::Undefined => 2,
        Meaning::Fault => 3,
    }
}

/// A quantity with its name, and its value in the usual unit for display.
#[derive(Debug, Clone)]
struct NamedQuantity {
    name: String,
    quantity: Quantity,
    text: fn(f64) -> String,
}

/// Returns all quantities.
fn named_quantities(binding: &StatusBinding) -> Vec<NamedQuantity> {
    let degrees = |angle: f64| format!("{:.1}°", angle.to_degrees());
    let rate = |rate: f64| format!("{:.2}°/s", rate.to_degrees());
    let mut named = Vec::new();
    for source in binding.velocity.iter().flat_map(|velocity| &velocity.speeds) {
        match &source.signals {
            SpeedSignals::Vehicle(signal) => named.push(NamedQuantity::speed(source.name.clone(), signal)),
            SpeedSignals::Wheels { wheels, .. } => {
                for (name, wheel) in WHEELS.iter().zip(wheels.iter()) {
                    named.extend(
                        wheel.iter().map(|wheel| NamedQuantity::speed(format!("{name} wheel"), wheel)),
                    );
                }
            }
        }
    }
    let rates = binding.velocity.iter().flat_map(VelocityBinding::yaw_rates);
    let name = || "yaw rate".to_owned();
    named.extend(rates.cloned().map(|quantity| NamedQuantity { name: name(), quantity, text: rate }));
    for SteeringSource { angle_of, angle, .. } in &binding.steering {
        let name = match angle_of {
            AngleOf::SteeringWheel => "steering wheel",
            AngleOf::Tire => "tire angle",
        };
        named.push(NamedQuantity { name: name.to_owned(), quantity: angle.clone(), text: degrees });
    }
    named
}

impl NamedQuantity {
    fn speed(name: String, signal: &SpeedSignal) -> Self {
        let text = if signal.is_rotation {
            |rotation| format!("{rotation:.2} rad/s")
        } else {
            |speed| format!("{speed:.2} m/s")
        };
        Self { name, quantity: signal.quantity.clone(), text }
    }

    /// Returns the part that a signal has in the quantity; `None` if it has none.
    fn part_of(&self, signal: SignalIndex) -> Option<Part<'_>> {
        let plus = self.quantity.plus.as_ref().filter(|term| term.signal == signal);
        let is_main = self.quantity.role.signal == signal;
        is_main.then_some(Part::Main).or(plus.map(Part::Plus))
    }

    fn value_text(&self, signal: SignalIndex, raw: i128) -> Option<ValueText> {
        let name = &self.name;
        let text = match self.part_of(signal)? {
            Part::Plus(term) => format!("{name} plus {}", (self.text)(term.value(raw))),
            Part::Main => match self.quantity.role.values.meaning(raw) {
                Meaning::Defined(()) => format!("{name} {}", (self.text)(self.quantity.value(raw))),
                Meaning::NotAvailable => format!("{name} not available"),
                Meaning::Fault => format!("{name} fault"),
                Meaning::Undefined => {
                    return Some(ValueText { text: format!("{name} UNDEFINED"), defined: false });
                }
            },
        };
        Some(ValueText { text, defined: true })
    }

    /// Returns the ranges of the quantity, with the values at their ends.
    fn role(&self) -> RoleTexts {
        let mut texts = role_texts(&self.quantity.role, self.name.clone(), |()| String::new());
        for (range, text) in texts.named.iter_mut().filter(|(_, text)| text.is_empty()) {
            let [first, last] = [range.first, range.last].map(|raw| (self.text)(self.quantity.value(raw)));
            *text = if range.first == range.last { first } else { format!("{first} to {last}") };
        }
        texts
    }
}

/// Part of a signal in a quantity.
enum Part<'a> {
    Main,
    Plus(&'a Term),
}
