//! Raw values of a linear signal: the profile's quantity from the sender's side.

use super::motion::{Dimensions, Readings};
use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::SignalTable;
use gateway_core::vehicle_status::quantity::Quantity;
use gateway_core::vehicle_status::velocity::binding::SpeedSignal;

/// Physical value that a quantity measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measured {
    Speed,
    /// A wheel, in the order in which wheels are bound.
    Wheel(usize),
    YawRate,
    SteeringWheel,
    FrontWheels,
}

impl Readings {
    fn of(&self, measured: Measured) -> f64 {
        match measured {
            Measured::Speed => self.motion.speed_mps,
            Measured::Wheel(wheel) => self.wheels_mps[wheel],
            Measured::YawRate => self.motion.heading_rate_radps,
            Measured::SteeringWheel => self.steering_wheel_rad,
            Measured::FrontWheels => self.tire_rad,
        }
    }

    /// Returns true if a reading has the opposite sign of its magnitude on the bus.
    pub(super) fn is_opposite(&self, measured: Measured, is_magnitude_negative: bool) -> bool {
        let reading = self.of(measured);
        if is_magnitude_negative { reading > 0.0 } else { reading < 0.0 }
    }
}

/// A quantity with the reading that is sent.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MeasuredQuantity {
    pub(super) quantity: Quantity,
    pub(super) measured: Measured,
    /// Value of the quantity for one unit of the reading.
    gain: f64,
    is_magnitude: bool,
    /// Lowest and highest raw value of the signal that is added.
    term_range: (i128, i128),
}

/// The part of a quantity that a signal carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum QuantityPart {
    /// The signal with the valid values.
    Main,
    /// The signal that is added.
    Term,
}

impl MeasuredQuantity {
    pub(super) fn new(table: &SignalTable, quantity: &Quantity, measured: Measured) -> Self {
        let term = quantity.plus.as_ref().and_then(|term| table.signals.get(term.signal.0));
        Self {
            quantity: quantity.clone(),
            measured,
            gain: 1.0,
            is_magnitude: false,
            term_range: term.map_or((0, 0), |term| term.codec.range()),
        }
    }

    pub(super) fn speed(
        table: &SignalTable,
        signal: &SpeedSignal,
        measured: Measured,
        dimensions: &Dimensions,
    ) -> Self {
        let radius_m = if signal.is_rotation { dimensions.wheel_radius_m } else { 1.0 };
        Self {
            gain: 1.0 / (radius_m * dimensions.speed_scale),
            is_magnitude: !signal.is_signed,
            ..Self::new(table, &signal.quantity, measured)
        }
    }

    /// Returns true if the magnitude on the bus has negative values.
    pub(super) fn is_magnitude_negative(&self) -> bool {
        self.quantity.factor < 0.0
    }

    fn value(&self, readings: &Readings) -> f64 {
        let value = self.gain * readings.of(self.measured);
        let has_sign_signal = self.quantity.opposite.is_some();
        if self.is_magnitude {
            value.abs()
        } else if has_sign_signal && readings.is_opposite(self.measured, self.is_magnitude_negative()) {
            -value
        } else {
            value
        }
    }

    /// Returns the raw value of a part: the valid value that, together with the other part, is closest to the
    /// reading.
    pub(super) fn raw(&self, readings: &Readings, part: QuantityPart) -> i128 {
        let value = self.value(readings);
        let exact = (value - self.quantity.offset) / self.quantity.factor;
        let Some(term) = &self.quantity.plus else { return self.nearest_valid(exact.round()) };
        let (lowest, highest) = self.term_range;
        let [below, above] = [exact.floor(), exact.ceil()].map(|main| {
            let main = self.nearest_valid(main);
            let rest = value - self.quantity.value(main);
            let term_raw = as_raw((rest / term.factor).round()).clamp(lowest, highest);
            ((rest - term.value(term_raw)).abs(), main, term_raw)
        });
        let (_, main, term_raw) = if below.0 <= above.0 { below } else { above };
        match part {
            QuantityPart::Main => main,
            QuantityPart::Term => term_raw,
        }
    }

    fn nearest_valid(&self, raw: f64) -> i128 {
        let raw = as_raw(raw);
        let valid = self.quantity.role.values.entries().iter();
        let valid = valid.filter(|(_, meaning)| *meaning == Meaning::Defined(()));
        let nearest = valid.map(|(range, _)| raw.clamp(range.first, range.last));
        nearest.min_by_key(|nearest| (nearest - raw).abs()).unwrap_or(raw)
    }
}

/// Readings are far below the limits of an integer.
#[allow(clippy::cast_possible_truncation)]
fn as_raw(value: f64) -> i128 {
    value as i128
}
