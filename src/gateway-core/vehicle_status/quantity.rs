//! A physical quantity on the bus: a linear signal with its unit, sign and valid raw values.

use super::state::{Judged, StatusContext, StatusReason};
use can_signal::validation::table::{Role, SignalIndex};
use can_signal::validation::unusable::Unusable;

/// Share of a raw step below which a difference from zero is only rounding.
const ROUNDING: f64 = 1e-6;

/// A physical quantity, in SI units and with the signs of Autoware.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Raw values that are measurements, and raw values that mean "no measurement"; all others are undefined.
    pub role: Role<()>,
    /// Value of one raw step.
    pub factor: f64,
    /// Value of raw 0.
    pub offset: f64,
    /// Another signal of the same message, whose value is added.
    pub plus: Option<Term>,
    /// Signal of the sign, where `true` reverses the sign of the magnitude.
    pub opposite: Option<Role<bool>>,
    /// Signals that indicate the quality of the value.
    pub flags: Vec<QualityFlag>,
}

/// A signal whose value is added.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// The signal; each raw value is valid.
    pub signal: SignalIndex,
    /// Value of one raw step.
    pub factor: f64,
}

impl Term {
    /// Returns the value that a raw value adds.
    pub fn value(&self, raw: i128) -> f64 {
        self.factor * as_f64(raw)
    }
}

/// A signal that indicates the quality of a value.
#[derive(Debug, Clone, PartialEq)]
pub struct QualityFlag {
    /// The signal, `true` = the value is good.
    pub role: Role<bool>,
    /// Name for display of the part that is otherwise not good, e.g. `rear left sensor`.
    pub text: String,
}

impl Quantity {
    /// Returns the value in SI units.
    pub fn read(&self, context: StatusContext<'_>) -> Judged<f64> {
        let ((), received) = context.defined(&self.role)?;
        for flag in &self.flags {
            if let (false, _) = context.defined(&flag.role)? {
                let raw = context.observations.last(flag.role.signal).map_or(0, |last| last.raw);
                return Err(StatusReason::BadQuality(flag.role.signal, raw));
            }
        }
        let sign = match &self.opposite {
            Some(role) if context.defined(role)?.0 => -1.0,
            Some(_) | None => 1.0,
        };
        let mut value = self.value(context.raw(self.role.signal)?);
        if let Some(term) = &self.plus {
            value += term.value(context.raw(term.signal)?);
        }
        Ok((sign * value, received))
    }

    /// Returns the value of a raw value of the main signal, without the other signals. A rounding error near
    /// zero, left by an offset such as −67.67, becomes zero.
    pub fn value(&self, raw: i128) -> f64 {
        let value = self.factor.mul_add(as_f64(raw), self.offset);
        if value.abs() < self.factor.abs() * ROUNDING { 0.0 } else { value }
    }

    /// Returns all signals, the main signal first.
    pub fn signals(&self) -> impl Iterator<Item = SignalIndex> {
        let others = self.plus.iter().map(|term| term.signal);
        let others = others.chain(self.opposite.iter().map(|role| role.signal));
        let flags = self.flags.iter().map(|flag| flag.role.signal);
        std::iter::once(self.role.signal).chain(others).chain(flags)
    }
}

/// Converts a raw value of at most 64 bits; beyond 2⁵³ the result is rounded.
#[allow(clippy::cast_precision_loss)]
fn as_f64(raw: i128) -> f64 {
    raw as f64
}

impl StatusContext<'_> {
    /// Returns the raw value of a signal if it is valid.
    fn raw(self, signal: SignalIndex) -> Result<i128, StatusReason> {
        let valid = self.observations.valid(self.table, signal, self.buses, self.now.mono);
        valid.map(|last| last.raw).map_err(|reason| Unusable::Absent(signal, reason).into())
    }
}
