//! A momentary hazard button. Each press toggles the lights, so the button is pressed until the report shows
//! the request or the attempts are used up.

use std::time::Duration;

use gateway_base::time::MonoTime;

/// Timing and number of the presses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct PushButtonSettings {
    /// Time for which the button is held down.
    pub press: Duration,
    /// Time to wait for the report after a press. It must exceed the delay of the report, since a second
    /// press would undo the first.
    pub wait: Duration,
    /// Largest number of presses for one request.
    pub attempts: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ButtonState {
    Released,
    Pressed { until: MonoTime },
    AwaitingFeedback { until: MonoTime },
}

/// State of a momentary button.
#[derive(Debug, Clone)]
pub struct PushButton {
    settings: PushButtonSettings,
    state: ButtonState,
    requested: Option<bool>,
    /// True if the report has shown the request, so a later change has another cause.
    done: bool,
    presses: u8,
}

impl PushButton {
    /// Creates a button that is not pressed.
    pub fn new(settings: PushButtonSettings) -> Self {
        Self { settings, state: ButtonState::Released, requested: None, done: false, presses: 0 }
    }

    /// Updates the button to `now` and returns true while it is pressed. Without a report the button is not
    /// pressed.
    pub fn update(&mut self, requested: Option<bool>, reported: Option<bool>, now: MonoTime) -> bool {
        if requested != self.requested {
            (self.requested, self.done, self.presses) = (requested, false, 0);
        }
        match self.state {
            ButtonState::Pressed { until } if now >= until => {
                self.state = ButtonState::AwaitingFeedback { until: now.after(self.settings.wait) };
            }
            ButtonState::AwaitingFeedback { until } if now >= until => self.state = ButtonState::Released,
            ButtonState::Released | ButtonState::Pressed { .. } | ButtonState::AwaitingFeedback { .. } => {}
        }
        if requested.is_none() {
            // Without authority the button is released; the report of a press cut short is awaited.
            if matches!(self.state, ButtonState::Pressed { .. }) {
                self.state = ButtonState::AwaitingFeedback { until: now.after(self.settings.wait) };
            }
        } else if requested == reported {
            // A press for the previous request may still show.
            self.done |= self.presses > 0 || self.state == ButtonState::Released;
        } else if self.state == ButtonState::Released
            && reported.is_some()
            && !self.done
            && !self.is_exhausted()
        {
            self.presses += 1;
            self.state = ButtonState::Pressed { until: now.after(self.settings.press) };
        }
        matches!(self.state, ButtonState::Pressed { .. })
    }

    /// Returns true if no attempt for the current request had a response.
    pub fn has_given_up(&self) -> bool {
        self.state == ButtonState::Released && !self.done && self.is_exhausted()
    }

    fn is_exhausted(&self) -> bool {
        self.presses >= self.settings.attempts
    }

    /// Releases the button and resets the attempts, because the vehicle cannot be reached. A request that the
    /// report has shown stays done.
    pub fn forget(&mut self) {
        (self.state, self.presses) = (ButtonState::Released, 0);
    }

    /// Returns the time at which the button changes without a new request or report.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        match self.state {
            ButtonState::Released => None,
            ButtonState::Pressed { until } | ButtonState::AwaitingFeedback { until } => Some(until),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: PushButtonSettings = PushButtonSettings {
        press: Duration::from_millis(200),
        wait: Duration::from_millis(800),
        attempts: 3,
    };

    /// Returns the times at which the button is pressed on a vehicle whose report follows a press after
    /// `delay_ms`, or never.
    fn presses(requested: bool, delay_ms: Option<u64>) -> Vec<u64> {
        let mut button = PushButton::new(RULES);
        let (mut down, mut lit, mut flips) = (false, false, Vec::new());
        let mut pressed_at = Vec::new();
        for ms in (0..10_000).step_by(50) {
            lit ^= flips.contains(&ms);
            let now = button.update(Some(requested), Some(lit), MonoTime::from_millis(ms));
            if now && !down {
                pressed_at.push(ms);
                flips.extend(delay_ms.map(|delay| ms + delay));
            }
            down = now;
        }
        assert_eq!(lit, requested && delay_ms.is_some());
        pressed_at
    }

    #[test]
    fn it_is_pressed_until_the_report_shows_it_and_then_released() {
        assert_eq!(presses(true, Some(100)), [0]);
        assert_eq!(presses(true, Some(950)), [0]);
        assert_eq!(presses(false, Some(100)), [0; 0]);
        assert_eq!(presses(true, None), [0, 1000, 2000], "three attempts");
    }

    #[test]
    fn what_the_driver_switches_off_afterwards_is_not_pressed_on_again() {
        let mut button = PushButton::new(RULES);
        let at = MonoTime::from_millis;
        assert!(button.update(Some(true), Some(false), at(0)));
        assert!(button.update(Some(true), Some(true), at(100)), "a press is never cut short by its success");
        assert!(!button.update(Some(true), Some(true), at(200)));
        assert!((300..9000).step_by(100).all(|ms| !button.update(Some(true), Some(false), at(ms))));
        assert!(!button.update(Some(false), Some(false), at(9000)));
        assert!(button.update(Some(true), Some(false), at(9100)), "a new request is a new press");
        assert!(button.update(Some(true), Some(true), at(9200)));
        button.forget();
        assert!(!button.update(Some(true), Some(false), at(9300)), "nor because the link was lost meanwhile");
    }

    #[test]
    fn without_a_report_it_is_not_pressed_and_without_authority_it_is_released() {
        let mut button = PushButton::new(RULES);
        let at = MonoTime::from_millis;
        assert!(!button.update(Some(true), None, at(0)));
        assert!(button.update(Some(true), Some(false), at(10)));
        assert!(!button.update(None, Some(false), at(20)));
        assert!(!button.update(Some(true), Some(false), at(30)), "the press may still show");
        assert!(button.update(Some(true), Some(false), at(820)));
        assert!(!button.has_given_up());
    }
}
