//! Texts for signals: why there is no value, and the meanings of raw values.

use super::meaning::{Meaning, RawRange, ValueMap};
use super::observation::MissingReason;
use super::table::{Role, SignalIndex, SignalTable};
use crate::core::can::{Bus, FrameFormat, link_text};
use crate::core::dbc::codec::SignalCodec;

/// Meaning of one raw value of a signal for the gateway.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueText {
    /// Text such as `turn left`, `hazard on (crash)` or `turn not available`.
    pub text: String,
    /// True if the profile gives the value a meaning.
    pub defined: bool,
}

/// One use of a signal, with its named values in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RoleTexts {
    /// The signal that is used.
    pub signal: SignalIndex,
    /// Name of the use, e.g. `turn`, `left`, `hazard`, `fault of front lamp`.
    pub subject: String,
    /// Named values with their texts.
    pub named: Vec<(RawRange, String)>,
    /// Whether a value can be used.
    pub meanings: ValueMap<()>,
}

impl RoleTexts {
    /// Returns the meaning of `raw` in this use.
    pub fn value_text(&self, raw: i128) -> ValueText {
        let named = self.named.iter().find(|(range, _)| range.contains(raw));
        match named {
            Some((_, text)) => ValueText { text: format!("{} {text}", self.subject), defined: true },
            None => ValueText { text: format!("{} UNDEFINED", self.subject), defined: false },
        }
    }
}

/// Returns the named values of a role; `name` gives the text of a defined value.
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
    RoleTexts {
        signal: role.signal,
        subject,
        named: role.values.entries().iter().map(value_text).collect(),
        meanings: role.values.map(|_| ()),
    }
}

/// Returns the text for a missing value, e.g. `BLINK is stale, silent for more than 500 ms`.
pub fn missing_reason_text(
    table: &SignalTable,
    buses: &[Bus],
    signal: SignalIndex,
    reason: MissingReason,
) -> String {
    let message = &table.messages[table.signals[signal.0].message.0];
    let interface = &buses[usize::from(message.bus.0)].settings().interface;
    match reason {
        MissingReason::Link(state) => link_text(interface, state),
        MissingReason::NeverSeen => {
            format!("no frame of {} ({}) on {interface} yet", message.name, message.ids)
        }
        MissingReason::NotAgain => {
            format!("no new frame of {} ({}) on {interface} yet", message.name, message.ids)
        }
        MissingReason::TooShort => format!("{} ({}) is received, but too short", message.name, message.ids),
        MissingReason::WrongFormat => match message.format {
            Some(FrameFormat::Fd) => {
                format!("{} ({}) is received, but not as CAN FD", message.name, message.ids)
            }
            Some(FrameFormat::Classic) | None => {
                format!("{} ({}) is received, but as CAN FD", message.name, message.ids)
            }
        },
        MissingReason::NotCarried => {
            let signal = &table.signals[signal.0].name;
            format!("{} ({}) is received, but without {signal}", message.name, message.ids)
        }
        MissingReason::SeveralSenders([one, other]) => {
            let name = &message.name;
            format!(
                "{name} is received from source addresses {one:02X} and {other:02X}: choose one with source_addresses"
            )
        }
        MissingReason::Stale => {
            let limit = message.timing.timeout().unwrap_or_default().as_millis();
            format!("{} is stale, silent for more than {limit} ms", message.name)
        }
        MissingReason::NotTrusted(reason) => format!("{} is not trusted: {}", message.name, reason.text()),
        MissingReason::BusSilent => {
            format!("{} may have changed: no frame of the vehicle profile on {interface}", message.name)
        }
        MissingReason::BusOff => format!("{} is not received, {interface} is bus-off", message.name),
        MissingReason::BusQuiet => format!("no frame of {}, as nothing on {interface}", message.name),
        MissingReason::BusAsleep => format!("no frame of {} since bus {interface} fell asleep", message.name),
    }
}

/// Returns a raw value in decimal and the bits of the frame in hexadecimal, e.g. `-1 (0xF)` for a signal of four bits.
pub fn raw_and_bits(raw: i128, codec: &SignalCodec) -> String {
    format!("{raw} (0x{:X})", codec.wire_bits(raw))
}

/// Returns a raw value in decimal and, from 10 on, in hexadecimal as candump shows it.
pub fn raw_text(raw: i128) -> String {
    if raw < 10 { raw.to_string() } else { format!("{raw} (0x{raw:X})") }
}
