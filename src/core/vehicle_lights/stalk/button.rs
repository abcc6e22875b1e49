//! A hazard button that springs back: each press turns the lights on or off.

use std::time::Duration;

use super::visibility::{Gap, Visibility};
use crate::core::time::MonoTime;

/// The button and what it has asked for.
#[derive(Debug, Clone)]
pub struct HazardToggle {
    visibility: Visibility,
    pressed: bool,
    on: bool,
}

impl HazardToggle {
    /// Nothing seen yet. `max_gap` and `settle` as in [`super::StalkSettings`]: the lights are taken to
    /// be off at start and after blindness.
    pub fn new(max_gap: Duration, startup_delay: Duration) -> Self {
        Self { visibility: Visibility::new(max_gap, startup_delay), pressed: false, on: false }
    }

    /// Takes a frame: `true` = pressed, `None` = unknown, also when the last frame is no longer
    /// believed. A `now` before the last one counts as the last one.
    pub fn observe(&mut self, pressed: Option<bool>, now: MonoTime) {
        self.advance(now);
        let Some(pressed) = pressed else {
            self.visibility.mark_unseen();
            return;
        };
        if self.visibility.mark_seen() == Gap::CouldHideAPress {
            // A button already pressed at first sight was not seen being pressed.
            (self.pressed, self.on) = (pressed, false);
        }
        self.on ^= pressed && !self.pressed;
        self.pressed = pressed;
    }

    /// Lets time pass without a frame.
    pub fn advance(&mut self, now: MonoTime) {
        self.visibility.advance(now);
    }

    /// Whether the lights were last turned on; `None` while that cannot be known.
    pub fn state(&self) -> Option<bool> {
        self.visibility.is_known().then_some(self.on)
    }

    /// When to call [`Self::advance`] with no frame coming.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.visibility.next_deadline()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }
    fn button() -> HazardToggle {
        HazardToggle::new(Duration::from_millis(100), Duration::from_secs(1))
    }

    #[test]
    fn each_press_toggles_once_however_long_it_is_held() {
        let mut button = button();
        let pressed = [(0, false), (1500, true), (1600, true), (1700, false), (2000, true), (2100, false)];
        let on = pressed.map(|(millis, pressed)| {
            button.observe(Some(pressed), at(millis));
            button.state()
        });
        assert_eq!(on, [None, Some(true), Some(true), Some(true), Some(false), Some(false)]);
    }

    #[test]
    fn it_is_unknown_until_watched_for_the_settling_time() {
        let mut button = button();
        assert_eq!((button.state(), button.next_deadline()), (None, None));
        button.observe(Some(true), at(10));
        assert_eq!((button.state(), button.next_deadline()), (None, Some(at(1010))));
        button.advance(at(1010));
        assert_eq!((button.state(), button.next_deadline()), (Some(false), None), "not seen being pressed");
    }

    #[test]
    fn a_short_blindness_is_bridged_and_a_long_one_forgets() {
        for (gap, afterwards) in [(100, Some(true)), (101, None)] {
            let mut button = button();
            button.observe(Some(false), at(0));
            button.observe(Some(true), at(2000));
            button.observe(None, at(3000));
            assert_eq!(button.state(), None);
            button.observe(Some(false), at(3000 + gap));
            assert_eq!(button.state(), afterwards, "{gap} ms");
        }
    }
}
