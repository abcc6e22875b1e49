//! A momentary hazard button; each press switches the lights on or off.

use std::time::Duration;

use super::super::state::StateMachine;
use super::visibility::Visibility;
use gateway_base::time::MonoTime;

/// State machine of a hazard button. Its state is whether the lights are on; they are assumed off at
/// start and after a gap that could hide a press.
#[derive(Debug, Clone)]
pub struct HazardToggle {
    visibility: Visibility,
    pressed: bool,
    on: bool,
}

impl HazardToggle {
    /// Creates the machine before any frame. For `max_gap` and `startup_delay` see [`super::StalkSettings`].
    pub fn new(max_gap: Duration, startup_delay: Duration) -> Self {
        Self { visibility: Visibility::new(max_gap, startup_delay), pressed: false, on: false }
    }
}

impl StateMachine for HazardToggle {
    /// True if the button is pressed.
    type Input = bool;
    type State = bool;

    fn observe(&mut self, pressed: Option<bool>, now: MonoTime) {
        self.advance(now);
        let Some(pressed) = pressed else {
            self.visibility.unknown_frame();
            return;
        };
        if self.visibility.known_frame() {
            // A button already pressed in the first frame was pressed earlier.
            (self.pressed, self.on) = (pressed, false);
        }
        self.on ^= pressed && !self.pressed;
        self.pressed = pressed;
    }

    fn advance(&mut self, now: MonoTime) {
        self.visibility.advance(now);
    }

    fn state(&self) -> Option<bool> {
        self.visibility.is_known().then_some(self.on)
    }

    fn next_deadline(&self) -> Option<MonoTime> {
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
    fn state_is_unknown_until_startup_delay() {
        let mut button = button();
        assert_eq!((button.state(), button.next_deadline()), (None, None));
        button.observe(Some(true), at(10));
        assert_eq!((button.state(), button.next_deadline()), (None, Some(at(1010))));
        button.advance(at(1010));
        assert_eq!(
            (button.state(), button.next_deadline()),
            (Some(false), None),
            "pressed before the first frame"
        );
    }

    #[test]
    fn gap_up_to_max_gap_is_bridged_and_longer_one_resets() {
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
