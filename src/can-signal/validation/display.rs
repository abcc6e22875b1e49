//! Texts for signals: reasons for missing values, and meanings of raw values.

use super::catalogue;
use super::meaning::{Meaning, RawRange, ValueMap};
use super::observation::MissingReason;
use super::table::{Role, SignalIndex, SignalTable};
use crate::can::{Bus, FrameFormat, link_message};
use crate::dbc::codec::SignalCodec;
use gateway_base::diagnostics::MessagePart;

/// The gateway's interpretation of one raw value of a signal.
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
    /// Signal that is used.
    pub signal: SignalIndex,
    /// Name of the use, e.g. `turn`, `left`, `hazard`, `fault of front lamp`.
    pub subject: String,
    /// Ranges of named raw values with their texts.
    pub named: Vec<(RawRange, String)>,
    /// Raw values that can be used.
    pub meanings: ValueMap<()>,
}

impl RoleTexts {
    /// Returns the meaning of `raw` in this use.
    pub fn value_text(&self, raw: i128) -> ValueText {
        let named = self.named.iter().any(|(range, _)| range.contains(raw));
        ValueText { text: format!("{} {}", self.subject, self.state_text(raw)), defined: named }
    }

    /// Returns the state that `raw` names in this use, e.g. `left`.
    pub fn state_text(&self, raw: i128) -> &str {
        let named = self.named.iter().find(|(range, _)| range.contains(raw));
        named.map_or("UNDEFINED", |(_, text)| text)
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

/// Returns the reason for a missing value, e.g. `BLINK is stale, silent for more than 500 ms`.
pub fn missing_reason_message(
    table: &SignalTable,
    buses: &[Bus],
    signal: SignalIndex,
    reason: MissingReason,
) -> MessagePart {
    let message = &table.messages[table.signals[signal.0].message.0];
    let interface = &buses[usize::from(message.bus.0)].settings().interface;
    let (name, ids) = (&message.name, &message.ids);
    match reason {
        // A bus whose link is up has another reason.
        MissingReason::Link(state) => {
            link_message(interface, state).unwrap_or_else(|| catalogue::may_have_changed(name, interface))
        }
        MissingReason::Awaited => {
            let limit = buses[usize::from(message.bus.0)].settings().start_timeout.as_secs_f64();
            catalogue::awaited(name, ids, interface, limit)
        }
        MissingReason::NeverSeen => catalogue::no_frame_yet(name, ids, interface),
        MissingReason::NotAgain => catalogue::no_new_frame_yet(name, ids, interface),
        MissingReason::TooShort => catalogue::too_short(name, ids),
        MissingReason::WrongFormat => match message.format {
            Some(FrameFormat::Fd) => catalogue::not_as_can_fd(name, ids),
            Some(FrameFormat::Classic) | None => catalogue::as_can_fd(name, ids),
        },
        MissingReason::NotCarried => catalogue::not_carried(name, ids, &table.signals[signal.0].name),
        MissingReason::SeveralSenders(addresses) => {
            let [one, other] = addresses.map(|address| format!("{address:02X}"));
            catalogue::several_senders(name, one, other)
        }
        MissingReason::Stale => {
            catalogue::stale(name, message.timing.timeout().unwrap_or_default().as_millis())
        }
        MissingReason::NotTrusted(reason) => catalogue::not_trusted(name, reason.text()),
        MissingReason::BusSilent => catalogue::may_have_changed(name, interface),
        MissingReason::BusOff => catalogue::bus_off(name, interface),
        MissingReason::BusQuiet => catalogue::bus_quiet(name, interface),
        MissingReason::BusAsleep => catalogue::bus_asleep(name, interface),
    }
}

/// Returns a raw value in decimal and the bits of the frame in hexadecimal, e.g. `-1 (0xF)` for a four-bit
/// signal.
pub fn raw_and_bits(raw: i128, codec: &SignalCodec) -> String {
    format!("{raw} (0x{:X})", codec.wire_bits(raw))
}

/// Returns a raw value in decimal and, from 10 on, in hexadecimal, as in candump.
pub fn raw_text(raw: i128) -> String {
    if raw < 10 { raw.to_string() } else { format!("{raw} (0x{raw:X})") }
}
