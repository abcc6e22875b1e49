//! Words for signals: why there is no value, and what raw values mean, for people who look at a bus or
//! check a profile.

use super::meaning::{Meaning, RawRange};
use super::observation::MissingReason;
use super::table::{Role, SignalIndex, SignalTable};
use crate::core::can::bus::Bus;
use crate::core::can::bus_status::link_text;

/// What one raw value of a signal means for the gateway.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueText {
    /// E.g. `turn left`, `hazard on (crash)`, `turn not available`.
    pub text: String,
    /// False when the profile gives the value no meaning.
    pub defined: bool,
}

/// One use of a signal, with its named values in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RoleTexts {
    /// The signal.
    pub signal: SignalIndex,
    /// What it tells of, e.g. `turn`, `left`, `hazard`, `fault of front lamp`.
    pub subject: String,
    /// Its values and what they mean.
    pub named: Vec<(RawRange, String)>,
}

impl RoleTexts {
    /// What `raw` means in this use.
    pub fn value_text(&self, raw: i128) -> ValueText {
        let named = self.named.iter().find(|(range, _)| range.first <= raw && raw <= range.last);
        match named {
            Some((_, text)) => ValueText { text: format!("{} {text}", self.subject), defined: true },
            None => ValueText { text: format!("{} UNDEFINED", self.subject), defined: false },
        }
    }
}

/// The named values of a role; `name` says what a defined one means.
pub fn role_texts<T: Copy>(role: &Role<T>, subject: String, name: impl Fn(T) -> String) -> RoleTexts {
    let value_text = |(range, meaning): &(RawRange, Meaning<T>)| {
        let text = match meaning {
            Meaning::Defined(value) => name(*value),
            Meaning::NotAvailable => "not available".to_owned(),
            Meaning::Fault => "fault".to_owned(),
            Meaning::Undefined => "UNDEFINED".to_owned(),
        };
        (*range, text)
    };
    RoleTexts { signal: role.signal, subject, named: role.values.entries().iter().map(value_text).collect() }
}

/// Why there is no value of a signal, e.g. `BLINK is stale, silent for more than 500 ms`.
pub fn missing_reason_text(
    table: &SignalTable,
    buses: &[Bus],
    signal: SignalIndex,
    why: MissingReason,
) -> String {
    let message = &table.messages[table.signals[signal.0].message.0];
    let interface = &buses[usize::from(message.bus.0)].settings().interface;
    match why {
        MissingReason::Link(state) => link_text(interface, state),
        MissingReason::NeverSeen => {
            format!("no frame of {} ({}) on {interface} yet", message.name, message.id)
        }
        MissingReason::NotAgain => {
            format!("no new frame of {} ({}) on {interface} yet", message.name, message.id)
        }
        MissingReason::TooShort => format!("{} ({}) comes, but too short", message.name, message.id),
        MissingReason::NotCarried => {
            format!("{} ({}) comes, but not with {}", message.name, message.id, table.signals[signal.0].name)
        }
        MissingReason::Stale => {
            let limit = message.timing.timeout().unwrap_or_default().as_millis();
            format!("{} is stale, silent for more than {limit} ms", message.name)
        }
        MissingReason::NotTrusted(why) => format!("{} is not trusted: {why}", message.name),
        MissingReason::BusSilent => format!("bus {interface} is silent"),
        MissingReason::BusOff => format!("{} does not come, {interface} is bus-off", message.name),
        MissingReason::BusAsleep => format!("no frame of {} since bus {interface} fell asleep", message.name),
    }
}

/// Decimal and hexadecimal, for those who read candump beside it.
pub fn raw_text(raw: i128) -> String {
    if raw < 10 { raw.to_string() } else { format!("{raw} (0x{raw:X})") }
}
