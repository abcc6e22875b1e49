//! Words for signals: why there is no value, and what raw values mean, for people who look at a bus or
//! check a profile.

use super::meaning::{Meaning, RawRange};
use super::observation::Absence;
use super::table::{Role, SignalIndex, SignalTable};
use crate::core::bus::Bus;
use crate::core::bus_status::link_text;

/// What one raw value of a signal means for the gateway.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// E.g. `turn left`, `hazard on (crash)`, `turn not available`.
    pub text: String,
    /// False when the profile gives the value no meaning.
    pub defined: bool,
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

impl RoleWords {
    /// What `raw` means in this use.
    pub fn word(&self, raw: i128) -> Word {
        let named = self.named.iter().find(|(range, _)| range.first <= raw && raw <= range.last);
        match named {
            Some((_, text)) => Word { text: format!("{} {text}", self.subject), defined: true },
            None => Word { text: format!("{} UNDEFINED", self.subject), defined: false },
        }
    }
}

/// The named values of a role; `name` says what a defined one means.
pub fn role_words<T: Copy>(role: &Role<T>, subject: String, name: impl Fn(T) -> String) -> RoleWords {
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

/// Why there is no value of a signal, e.g. `BLINK is stale, silent for more than 500 ms`.
pub fn absence_text(table: &SignalTable, buses: &[Bus], signal: SignalIndex, why: Absence) -> String {
    let message = &table.messages[table.signals[signal.0].message.0];
    let interface = &buses[usize::from(message.bus.0)].settings().interface;
    match why {
        Absence::Link(state) => link_text(interface, state),
        Absence::NeverSeen => format!("no frame of {} ({}) on {interface} yet", message.name, message.id),
        Absence::NotAgain => format!("no new frame of {} ({}) on {interface} yet", message.name, message.id),
        Absence::TooShort => format!("{} ({}) comes, but too short", message.name, message.id),
        Absence::NotCarried => {
            format!("{} ({}) comes, but not with {}", message.name, message.id, table.signals[signal.0].name)
        }
        Absence::Stale => {
            let limit = message.timing.timeout().unwrap_or_default().as_millis();
            format!("{} is stale, silent for more than {limit} ms", message.name)
        }
        Absence::NotTrusted(why) => format!("{} is not trusted: {why}", message.name),
        Absence::BusSilent => format!("bus {interface} is silent"),
        Absence::BusOff => format!("{} does not come, {interface} is bus-off", message.name),
        Absence::BusAsleep => format!("no frame of {} since bus {interface} fell asleep", message.name),
    }
}

/// Decimal and hexadecimal, for those who read candump beside it.
pub fn raw_text(raw: i128) -> String {
    if raw < 10 { raw.to_string() } else { format!("{raw} (0x{raw:X})") }
}
