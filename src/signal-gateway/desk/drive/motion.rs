//! Speed and stops: the position of the vehicle after a time.

use crate::config::drive::{SpeedProfile, Stop};

/// A position nearer than this counts as reached, metres; only compensates for rounding.
const SAME_M: f64 = 1e-9;

/// Resolution of positions, metres.
const GRAIN_M: f64 = 1.0 / 1_073_741_824.0;

/// A vehicle that follows its speed profile and its stops.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Motion<'a> {
    profile: &'a SpeedProfile,
    stops: &'a [Stop],
    standing_s: f64,
    /// Position of the rear axle, metres along the route path.
    pub(super) at_m: f64,
    pub(super) at_s: f64,
}

impl<'a> Motion<'a> {
    pub(super) fn new(profile: &'a SpeedProfile, stops: &'a [Stop], at_m: f64) -> Self {
        let mut motion = Self { profile, stops, standing_s: 0.0, at_m, at_s: 0.0 };
        while motion.stops.first().is_some_and(|stop| stop.at_m < at_m - SAME_M) {
            motion.skip_stop();
        }
        motion.stop_here();
        motion
    }

    pub(super) fn speed_mps(&self) -> f64 {
        if self.standing_s > 0.0 { 0.0 } else { self.driving_mps() }
    }

    /// Drives for a time, including any stops and steps of the profile.
    pub(super) fn advance(&mut self, by_s: f64) {
        self.drive(by_s);
        // Prevents rounding errors from accumulating: a metre per cycle stays a metre per cycle.
        self.at_m = (self.at_m / GRAIN_M).round() * GRAIN_M;
    }

    fn drive(&mut self, by_s: f64) {
        let mut left_s = by_s;
        // Each pass ends at a step or a stop, so their number limits the passes.
        for _ in 0..self.most_steps() {
            if left_s <= 0.0 {
                return;
            }
            let stood_s = self.standing_s.min(left_s);
            self.standing_s -= stood_s;
            let speed_mps = self.driving_mps();
            let drives_s = if self.standing_s > 0.0 {
                0.0
            } else {
                (left_s - stood_s).min(self.until_change_s(speed_mps)).max(0.0)
            };
            self.at_m += speed_mps * drives_s;
            self.at_s += stood_s + drives_s;
            left_s -= stood_s + drives_s;
            if speed_mps > 0.0 {
                self.stop_here();
            }
        }
        self.at_s += left_s.max(0.0);
    }

    fn driving_mps(&self) -> f64 {
        let (steps, reached) = match self.profile {
            SpeedProfile::ByPosition(steps) => (steps, self.at_m + SAME_M),
            SpeedProfile::ByTime(steps) => (steps, self.at_s + SAME_M),
        };
        let last = steps.iter().take_while(|(from, _)| *from <= reached).last();
        last.or(steps.first()).map_or(0.0, |(_, mps)| *mps)
    }

    fn until_change_s(&self, speed_mps: f64) -> f64 {
        let next = |steps: &[(f64, f64)], at: f64| {
            steps.iter().map(|(from, _)| from - at).find(|ahead| *ahead > SAME_M).unwrap_or(f64::INFINITY)
        };
        let stop_m = self.stops.first().map_or(f64::INFINITY, |stop| stop.at_m - self.at_m);
        let seconds = |metres: f64| if speed_mps > 0.0 { metres / speed_mps } else { f64::INFINITY };
        match self.profile {
            SpeedProfile::ByPosition(steps) => seconds(next(steps, self.at_m).min(stop_m)),
            SpeedProfile::ByTime(steps) => next(steps, self.at_s).min(seconds(stop_m)),
        }
    }

    fn stop_here(&mut self) {
        while let Some(stop) = self.stops.first().filter(|stop| stop.at_m <= self.at_m + SAME_M) {
            self.at_m = stop.at_m;
            self.standing_s += stop.for_s;
            self.skip_stop();
        }
    }

    fn skip_stop(&mut self) {
        self.stops = self.stops.get(1..).unwrap_or_default();
    }

    fn most_steps(&self) -> usize {
        let (SpeedProfile::ByPosition(steps) | SpeedProfile::ByTime(steps)) = self.profile;
        2 * (steps.len() + self.stops.len()) + 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positions(motion: &mut Motion<'_>, cycles: usize) -> Vec<(f64, f64)> {
        let position = |_| {
            motion.advance(0.5);
            ((motion.at_m * 1e6).round() / 1e6, motion.speed_mps())
        };
        (0..cycles).map(position).collect()
    }

    #[test]
    fn speed_changes_and_stops_where_they_are() {
        let profile = SpeedProfile::ByPosition(vec![(0.0, 4.0), (3.0, 2.0), (6.0, 0.0)]);
        let stops = [Stop { at_m: -1.0, for_s: 9.0 }, Stop { at_m: 4.0, for_s: 0.75 }];
        let mut motion = Motion::new(&profile, &stops, 0.0);
        let expected = [(2.0, 4.0), (3.5, 2.0), (4.0, 0.0), (4.0, 2.0), (5.0, 2.0), (6.0, 0.0), (6.0, 0.0)];
        // At 4 m after 1.25 s, moving again after 2 s.
        assert_eq!(positions(&mut motion, 7), expected);
        assert!((motion.at_s - 3.5).abs() < 1e-9);
    }

    #[test]
    fn by_time_it_can_back_up() {
        let profile = SpeedProfile::ByTime(vec![(0.0, 0.0), (0.75, -1.0), (1.5, 2.0)]);
        let mut motion = Motion::new(&profile, &[], 10.0);
        assert_eq!(positions(&mut motion, 4), [(10.0, 0.0), (9.75, -1.0), (9.25, 2.0), (10.25, 2.0)]);
    }
}
