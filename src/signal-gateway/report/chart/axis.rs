//! Values along a chart, seconds or metres: their positions, and the ticks.

use std::ops::Range;

/// Units of time, smallest first: name, length in seconds, and the longest axis for which the unit is used.
const TIME_UNITS: [(&str, f64, f64); 3] =
    [("s", 1.0, 180.0), ("min", 60.0, 10_800.0), ("h", 3_600.0, f64::INFINITY)];

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Along {
    /// Time in seconds.
    #[default]
    Time,
    /// Distance in metres.
    Distance,
}

/// Maps an interval of time or distance to a part of the chart's width.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    along: Along,
    from: f64,
    to: f64,
    left_px: f64,
    width_px: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

impl Axis {
    /// Creates an axis for values over a width in pixels. An empty or infinite interval gets the length 1.
    pub(super) fn new(along: Along, values: Range<f64>, px: Range<f64>) -> Self {
        let from = if values.start.is_finite() { values.start } else { 0.0 };
        let to = if values.end.is_finite() && values.end > from { values.end } else { from + 1.0 };
        Self { along, from, to, left_px: px.start, width_px: px.end - px.start }
    }

    /// Returns the position of a value, pixels; values outside are at the edge.
    pub(super) fn x(&self, value: f64) -> f64 {
        let part = (value.clamp(self.from, self.to) - self.from) / (self.to - self.from);
        self.left_px + part * self.width_px
    }

    /// Returns the left and right edge, pixels.
    pub(super) fn edges(&self) -> Range<f64> {
        self.left_px..self.left_px + self.width_px
    }

    /// Returns at most 1000 round values at least `gap_px` apart: 1, 2 and 5 times powers of ten of the unit.
    pub(super) fn ticks(&self, gap_px: f64) -> Vec<Tick> {
        let (unit, length) = self.unit();
        let (from, to) = (self.from / length, self.to / length);
        let step = decimal_step((to - from) * (gap_px / self.width_px).max(0.001));
        let decimals = decimals(step);
        let mut ticks = Vec::new();
        let mut number = (from / step).ceil();
        // A value marginally beyond the end still counts: 0.1 * 3 is not 0.3.
        while number * step <= to + step * 1e-6 && ticks.len() < 1_000 {
            // Avoids minus zero, which prints its sign.
            let value = number * step + 0.0;
            ticks.push(Tick { value: value * length, label: format!("{value:.decimals$} {unit}") });
            number += 1.0;
        }
        ticks
    }

    pub(super) fn position(&self, value: f64) -> String {
        match self.along {
            Along::Time => self.clock(value),
            Along::Distance => format!("{} m", (value * 10.0).round() / 10.0 + 0.0),
        }
    }

    pub(super) fn interval(&self, from: f64, to: f64) -> String {
        match self.along {
            Along::Time => format!("{} to {}", self.clock(from), self.clock(to)),
            Along::Distance => format!("{from:.2} m to {to:.2} m"),
        }
    }

    pub(super) fn caption(&self) -> &'static str {
        match self.along {
            Along::Time => "time",
            Along::Distance => "distance",
        }
    }

    /// Returns the unit of the ticks, and its length in seconds or metres.
    fn unit(&self) -> (&'static str, f64) {
        if self.along == Along::Distance {
            return ("m", 1.0);
        }
        let span = self.to - self.from;
        let fitting = TIME_UNITS.into_iter().find(|(.., longest)| span <= *longest);
        fitting.map_or(("s", 1.0), |(name, length, _)| (name, length))
    }

    /// Formats a time in hours, minutes and seconds, down from the unit of the ticks.
    fn clock(&self, value: f64) -> String {
        let (_, unit) = self.unit();
        let mut rest = (value * 1e3).round() / 1e3 + 0.0;
        let mut text = String::new();
        for (name, length, _) in TIME_UNITS.into_iter().rev().filter(|(_, length, _)| *length > 1.0) {
            if unit >= length && rest >= length {
                let count = (rest / length).floor();
                rest = ((rest - count * length) * 1e3).round() / 1e3;
                text += &format!("{count} {name} ");
            }
        }
        text + &format!("{rest} s")
    }
}

/// Returns round numbers from below the lowest to above the highest of measured values, each with its text.
pub(crate) fn value_ticks(low: f64, high: f64, unit: &str) -> Vec<(f64, String)> {
    let size = if high > low { high - low } else { high.abs().max(1.0) };
    let step = decimal_step(size / 4.0);
    let (first, decimals) = ((low / step + 1e-9).floor(), decimals(step));
    let last = (high / step - 1e-9).ceil().max(first + 1.0);
    let numbers = (0_u8..16).map(|number| first + f64::from(number)).take_while(|number| *number <= last);
    // Avoids minus zero, which prints its sign.
    numbers
        .map(|number| number * step + 0.0)
        .map(|value| (value, format!("{value:.decimals$}{unit}")))
        .collect()
}

/// Returns the number of decimals that a multiple of a step needs.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped
fn decimals(step: f64) -> usize {
    (-step.log10().floor()).clamp(0.0, 9.0) as usize
}

/// Returns the smallest value of 1, 2 or 5 times a power of ten that is at least `least`.
pub(super) fn decimal_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|digit| digit * power).find(|step| *step >= least).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(to: f64) -> Vec<String> {
        Axis::new(Along::Time, 0.0..to, 0.0..1_000.0).ticks(80.0).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round_and_have_a_unit_from_a_blink_to_a_day() {
        let ends = [0.3, 5.0, 14.0, 120.0, 600.0, 7_200.0, 36_000.0, 86_400.0];
        let first_two = ends.map(|to| labels(to)[..2].join(", "));
        let expected = [
            "0.00 s, 0.05 s",
            "0.0 s, 0.5 s",
            "0 s, 2 s",
            "0 s, 10 s",
            "0 min, 1 min",
            "0 min, 10 min",
            "0 h, 1 h",
            "0 h, 2 h",
        ];
        assert_eq!(first_two, expected);
    }

    #[test]
    fn positions_are_written_in_the_units_of_the_axis_and_smaller_ones() {
        let position = |to: f64, value| Axis::new(Along::Time, 0.0..to, 0.0..1_000.0).position(value);
        assert_eq!(position(100.0, 75.25), "75.25 s");
        assert_eq!(position(600.0, 75.25), "1 min 15.25 s");
        assert_eq!(position(36_000.0, 3_675.25), "1 h 1 min 15.25 s");
        assert_eq!(position(36_000.0, 0.067), "0.067 s");
    }

    #[test]
    fn metres_stay_metres() {
        let axis = Axis::new(Along::Distance, 0.0..1_200.0, 0.0..1_000.0);
        let labels: Vec<_> = axis.ticks(80.0).into_iter().map(|tick| tick.label).collect();
        assert_eq!(labels[..3], ["0 m", "100 m", "200 m"]);
        assert_eq!((labels.len(), axis.caption()), (13, "distance"));
    }

    #[test]
    fn ticks_keep_their_distance_and_lie_inside() {
        for to in [0.001, 0.7, 5.0, 59.0, 61.0, 1_000.0, 3_600.0, 1e6] {
            let axis = Axis::new(Along::Time, 0.0..to, 100.0..1_000.0);
            let xs: Vec<_> = axis.ticks(60.0).iter().map(|tick| axis.x(tick.value)).collect();
            assert!(xs.len() >= 3, "{to}: {xs:?}");
            assert!(xs.windows(2).all(|pair| pair[1] - pair[0] >= 59.9), "{to}: {xs:?}");
            assert!(xs.iter().all(|x| (100.0..=1_000.0).contains(x)), "{to}: {xs:?}");
        }
    }

    #[test]
    fn a_stretch_without_length_is_drawn_all_the_same() {
        for (from, to) in [(0.0, 0.0), (3.0, 1.0), (f64::NAN, f64::INFINITY)] {
            let axis = Axis::new(Along::Time, from..to, 0.0..100.0);
            assert!(axis.x(from.max(0.0)).is_finite() && !axis.ticks(10.0).is_empty());
        }
    }
}
