//! Reasons why a signal has no usable value, and the kinds of failure they cause.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue;
use super::display::{missing_reason_message, raw_text};
use super::meaning::Meaning;
use super::observation::{MissingReason, Observation, Observations};
use super::table::{Role, SignalIndex, SignalTable};
use crate::can::{Bus, ReceiveTime};
use gateway_base::diagnostics::MessagePart;
use gateway_base::time::MonoTime;

/// Kind of failure of a report (docs/spec/vehicle-interface.md, "Unknown, invalid, hardware fault").
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// There is no valid value.
    Unknown,
    /// The value has no meaning in the profile.
    Invalid,
    /// The vehicle reports a fault.
    HardwareFault,
}

/// Reason why a signal has no usable value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unusable {
    /// The signal has no valid value.
    Absent(SignalIndex, MissingReason),
    /// The signal reports "not available" with this raw value.
    NotAvailable(SignalIndex, i128),
    /// The signal has a raw value without a meaning.
    Undefined(SignalIndex, i128),
    /// The signal reports a fault with this raw value.
    Fault(SignalIndex, i128),
}

impl Unusable {
    /// Returns true for a permitted sleep of the bus, which is not a failure.
    pub fn is_sleep(self) -> bool {
        matches!(self, Self::Absent(_, reason) if reason.is_sleep())
    }

    /// Returns true while the first value since the start is awaited.
    pub fn is_awaited(self) -> bool {
        matches!(self, Self::Absent(_, MissingReason::Awaited))
    }

    /// Returns the kind of failure that this reason causes.
    pub fn kind(self) -> FaultKind {
        match self {
            Self::Fault(..) => FaultKind::HardwareFault,
            Self::Undefined(..) => FaultKind::Invalid,
            Self::Absent(..) | Self::NotAvailable(..) => FaultKind::Unknown,
        }
    }

    /// Returns the reason as text, without its kind.
    pub fn message(self, table: &SignalTable, buses: &[Bus]) -> MessagePart {
        let name = |signal: SignalIndex| &table.signals[signal.0].name;
        match self {
            Self::Absent(signal, reason) => missing_reason_message(table, buses, signal, reason),
            Self::NotAvailable(signal, raw) => catalogue::not_available(name(signal), raw_text(raw)),
            Self::Undefined(signal, raw) => catalogue::undefined(name(signal), raw_text(raw)),
            Self::Fault(signal, raw) => catalogue::fault(name(signal), raw_text(raw)),
        }
    }
}

impl Observations {
    /// Returns the defined value of a signal with its receive time.
    ///
    /// # Errors
    /// Fails with the reason why there is no usable value.
    pub fn defined<T: Copy>(
        &self,
        table: &SignalTable,
        role: &Role<T>,
        buses: &[Bus],
        now: MonoTime,
    ) -> Result<(T, ReceiveTime), Unusable> {
        let absent = |reason| Unusable::Absent(role.signal, reason);
        let Observation { raw, received } = self.valid(table, role.signal, buses, now).map_err(absent)?;
        Ok((role.defined(raw)?, received))
    }
}

impl<T: Copy> Role<T> {
    /// Returns the defined value of a raw value.
    ///
    /// # Errors
    /// Fails with the reason why the raw value cannot be used.
    pub fn defined(&self, raw: i128) -> Result<T, Unusable> {
        match self.values.meaning(raw) {
            Meaning::Defined(value) => Ok(value),
            Meaning::NotAvailable => Err(Unusable::NotAvailable(self.signal, raw)),
            Meaning::Undefined => Err(Unusable::Undefined(self.signal, raw)),
            Meaning::Fault => Err(Unusable::Fault(self.signal, raw)),
        }
    }
}
