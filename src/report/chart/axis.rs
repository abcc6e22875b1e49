//! Values along a chart, seconds or metres: their positions, and the ticks.

/// Steps of seconds on clocks; below and above them 1, 2, 5 times powers of ten.
const CLOCK_STEPS_S: [f64; 17] = [
    1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1_800.0, 3_600.0, 7_200.0, 14_400.0,
    43_200.0, 86_400.0,
];
/// An axis that ends later has times in minutes and seconds.
const LONG_S: f64 = 300.0;

/// The quantity along a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Along {
    /// Time in seconds.
    Time,
    /// Distance in metres.
    Distance,
}

/// An interval of time or distance over a part of the chart's width.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axis {
    along: Along,
    from: f64,
    to: f64,
    left_px: f64,
    width_px: f64,
}

/// A value on the axis with its number.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: String,
}

impl Axis {
    /// Values `from` to `to`, from `left_px` on. An interval without length or end has the length 1.
    pub(super) fn new(along: Along, (from, to): (f64, f64), left_px: f64, width_px: f64) -> Self {
        let from = if from.is_finite() { from } else { 0.0 };
        let to = if to.is_finite() && to > from { to } else { from + 1.0 };
        Self { along, from, to, left_px, width_px }
    }

    /// Position of a value, pixels; values outside are at the edge.
    pub(super) fn x(&self, value: f64) -> f64 {
        let part = (value.clamp(self.from, self.to) - self.from) / (self.to - self.from);
        self.left_px + part * self.width_px
    }

    /// Left and right edge.
    pub(super) fn edges(&self) -> (f64, f64) {
        (self.left_px, self.left_px + self.width_px)
    }

    /// Round values at least `gap_px` apart, at most 1000 of them.
    pub(super) fn ticks(&self, gap_px: f64) -> Vec<Tick> {
        let least = (self.to - self.from) * (gap_px / self.width_px).max(0.001);
        let step = CLOCK_STEPS_S.into_iter().find(|step| *step >= least && least > 0.5);
        let step = step.filter(|_| self.along == Along::Time);
        let step = step.unwrap_or_else(|| decimal_step(least));
        let first = (self.from / step).ceil();
        let mut ticks = Vec::new();
        let mut number = first;
        // A hair beyond the end still counts: 0.1 * 3 is not 0.3.
        while number * step <= self.to + step * 1e-6 && ticks.len() < 1_000 {
            ticks.push(Tick { value: number * step, label: self.label(number * step, step) });
            number += 1.0;
        }
        ticks
    }

    /// A position with its unit.
    pub(super) fn position(&self, value: f64) -> String {
        match self.along {
            Along::Time => format!("{} s", seconds(value)),
            Along::Distance => format!("{} m", (value * 10.0).round() / 10.0 + 0.0),
        }
    }

    /// Both ends of a bar, with their unit.
    pub(super) fn interval(&self, from: f64, to: f64) -> String {
        match self.along {
            Along::Time => format!("{} s to {} s", seconds(from), seconds(to)),
            Along::Distance => format!("{from:.2} m to {to:.2} m"),
        }
    }

    /// Quantity and unit of the numbers.
    pub(super) fn caption(&self) -> &'static str {
        if self.along == Along::Distance {
            "distance [m]"
        } else if self.is_long() {
            if self.to >= 3_600.0 { "time [h:min:s]" } else { "time [min:s]" }
        } else {
            "time [s]"
        }
    }

    fn is_long(&self) -> bool {
        self.along == Along::Time && self.to > LONG_S
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a rounded time from 0 on
    fn label(&self, value: f64, step: f64) -> String {
        let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        if !self.is_long() || step < 1.0 || value < 0.0 {
            return format!("{value:.decimals$}");
        }
        let total = value.round() as u64;
        let (hours, minutes, seconds) = (total / 3_600, total / 60 % 60, total % 60);
        if self.to >= 3_600.0 {
            format!("{hours}:{minutes:02}:{seconds:02}")
        } else {
            format!("{minutes}:{seconds:02}")
        }
    }
}

/// Seconds, to the millisecond, without needless zeros.
fn seconds(value: f64) -> String {
    let rounded = (value * 1e3).round() / 1e3;
    rounded.to_string()
}

/// The smallest of 1, 2, 5 times a power of ten that is not below.
fn decimal_step(least: f64) -> f64 {
    let power = 10_f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0].into_iter().map(|digit| digit * power).find(|step| *step >= least).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(to: f64) -> Vec<String> {
        Axis::new(Along::Time, (0.0, to), 0.0, 1_000.0)
            .ticks(80.0)
            .into_iter()
            .map(|tick| tick.label)
            .collect()
    }

    #[test]
    fn ticks_are_round_from_a_blink_to_a_day() {
        assert_eq!(labels(0.3), ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
        assert_eq!(labels(5.0)[..3], ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(14.0), ["0", "2", "4", "6", "8", "10", "12", "14"]);
        assert_eq!(labels(120.0)[..4], ["0", "10", "20", "30"]);
        assert_eq!(labels(600.0)[..3], ["0:00", "1:00", "2:00"]);
        assert_eq!(labels(3_600.0)[..3], ["0:00:00", "0:05:00", "0:10:00"]);
        assert_eq!(labels(86_400.0)[1], "2:00:00");
    }

    #[test]
    fn metres_stay_metres() {
        let axis = Axis::new(Along::Distance, (0.0, 1_200.0), 0.0, 1_000.0);
        let labels: Vec<_> = axis.ticks(80.0).into_iter().map(|tick| tick.label).collect();
        assert_eq!(
            labels,
            ["0", "100", "200", "300", "400", "500", "600", "700", "800", "900", "1000", "1100", "1200"]
        );
        assert_eq!(axis.caption(), "distance [m]");
    }

    #[test]
    fn ticks_keep_their_distance_and_lie_inside() {
        for to in [0.001, 0.7, 5.0, 59.0, 61.0, 1_000.0, 3_600.0, 1e6] {
            let axis = Axis::new(Along::Time, (0.0, to), 100.0, 900.0);
            let xs: Vec<_> = axis.ticks(60.0).iter().map(|tick| axis.x(tick.value)).collect();
            assert!(xs.len() >= 3, "{to}: {xs:?}");
            assert!(xs.windows(2).all(|pair| pair[1] - pair[0] >= 59.9), "{to}: {xs:?}");
            assert!(xs.iter().all(|x| (100.0..=1_000.0).contains(x)), "{to}: {xs:?}");
        }
    }

    #[test]
    fn a_stretch_without_length_is_drawn_all_the_same() {
        for (from, to) in [(0.0, 0.0), (3.0, 1.0), (f64::NAN, f64::INFINITY)] {
            let axis = Axis::new(Along::Time, (from, to), 0.0, 100.0);
            assert!(axis.x(from.max(0.0)).is_finite() && !axis.ticks(10.0).is_empty());
        }
    }
}
