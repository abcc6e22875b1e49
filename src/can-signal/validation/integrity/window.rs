//! AUTOSAR's common E2E state machine, which decides whether a message as a whole can be trusted.
//!
//! Results of single frames enter a window of the newest results. Enough good results make the message valid;
//! too many errors or too few good results make it invalid. Each state has its own window and limits.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest window, in results.
pub const MAX_WINDOW: u8 = 64;

/// Result of checking one frame (AUTOSAR `E2E_PCheckStatusType`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CheckStatus {
    /// The frame is intact and in sequence.
    Ok,
    /// The frame is damaged or belongs to another message.
    Error,
    /// The frame is intact and was received before.
    Repeated,
    /// The frame is intact and out of sequence.
    WrongSequence,
}

/// State of a message (AUTOSAR `E2E_SMStateType`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum E2eState {
    /// No usable frame yet.
    #[default]
    NoData,
    /// Frames arrive, but not enough good ones yet.
    Init,
    /// The message is trusted.
    Valid,
    /// Too many errors or too few good frames.
    Invalid,
}

/// Window and limits of one state for entering or keeping the valid state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowLimits {
    /// Number of newest results in the window, 1 to [`MAX_WINDOW`].
    pub size: u8,
    /// Least number of good results.
    pub min_ok: u8,
    /// Largest number of errors.
    pub max_error: u8,
}

/// Limits of all states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    init: WindowLimits,
    valid: WindowLimits,
    invalid: WindowLimits,
    clear_to_invalid: bool,
}

/// Violation of AUTOSAR's constraints on the limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum WindowError {
    #[error("a window holds 1 to 64 results, not {0}")]
    Size(u8),
    #[error("the window of the valid state must be the longest")]
    ValidNotLongest,
    #[error("a window of {size} results cannot hold {min_ok} good ones and {max_error} errors")]
    TooMany { size: u8, min_ok: u8, max_error: u8 },
    #[error("min_ok must be at least 1 and must not fall from valid to init to invalid")]
    MinOkOrder,
    #[error("max_error must not rise from valid to init to invalid")]
    MaxErrorOrder,
}

/// The state machine of one message.
#[derive(Debug, Clone, Default)]
pub struct WindowState {
    /// Current state.
    pub state: E2eState,
    /// One bit per result, set if it is good; the newest in bit 0.
    ok: u64,
    error: u64,
}

impl Window {
    /// Creates the limits of the three states. With `clear_to_invalid`, results from before the invalid state
    /// do not count towards leaving it.
    pub fn new(
        init: WindowLimits,
        valid: WindowLimits,
        invalid: WindowLimits,
        clear_to_invalid: bool,
    ) -> Result<Self, WindowError> {
        for WindowLimits { size, min_ok, max_error } in [init, valid, invalid] {
            if !(1..=MAX_WINDOW).contains(&size) {
                return Err(WindowError::Size(size));
            }
            if min_ok > size || u16::from(min_ok) + u16::from(max_error) > u16::from(valid.size) {
                return Err(WindowError::TooMany { size, min_ok, max_error });
            }
        }
        if init.size > valid.size || invalid.size > valid.size {
            return Err(WindowError::ValidNotLongest);
        }
        if valid.min_ok == 0 || valid.min_ok > init.min_ok || init.min_ok > invalid.min_ok {
            return Err(WindowError::MinOkOrder);
        }
        if valid.max_error < init.max_error || init.max_error < invalid.max_error {
            return Err(WindowError::MaxErrorOrder);
        }
        Ok(Self { init, valid, invalid, clear_to_invalid })
    }

    fn limits(&self, state: E2eState) -> WindowLimits {
        match state {
            E2eState::NoData | E2eState::Init => self.init,
            E2eState::Valid => self.valid,
            E2eState::Invalid => self.invalid,
        }
    }
}

impl WindowState {
    /// Adds the result of a frame and returns the new state.
    pub fn step(&mut self, window: &Window, result: CheckStatus) -> E2eState {
        let limits = window.limits(self.state);
        self.ok = self.ok << 1 | u64::from(result == CheckStatus::Ok);
        self.error = self.error << 1 | u64::from(result == CheckStatus::Error);
        let mask = u64::MAX >> (u64::BITS - u32::from(limits.size));
        let enough = (self.ok & mask).count_ones() >= u32::from(limits.min_ok);
        let too_many_errors = (self.error & mask).count_ones() > u32::from(limits.max_error);
        let next = match self.state {
            E2eState::NoData if result == CheckStatus::Error => E2eState::NoData,
            E2eState::Init if too_many_errors => E2eState::Invalid,
            E2eState::Init if enough => E2eState::Valid,
            E2eState::NoData | E2eState::Init => E2eState::Init,
            E2eState::Valid | E2eState::Invalid if enough && !too_many_errors => E2eState::Valid,
            E2eState::Valid | E2eState::Invalid => E2eState::Invalid,
        };
        if next != self.state {
            let forget =
                self.state == E2eState::NoData || (next == E2eState::Invalid && window.clear_to_invalid);
            // Results outside the window of the previous state do not count in the next window either.
            let kept = if forget { 0 } else { mask };
            self.ok &= kept;
            self.error &= kept;
        }
        self.state = next;
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::VecDeque;

    const INIT: WindowLimits = WindowLimits { size: 3, min_ok: 2, max_error: 0 };
    const VALID: WindowLimits = WindowLimits { size: 5, min_ok: 1, max_error: 2 };
    const INVALID: WindowLimits = WindowLimits { size: 4, min_ok: 3, max_error: 0 };

    fn window() -> Window {
        Window::new(INIT, VALID, INVALID, false).unwrap()
    }

    fn run(window: &Window, results: &[CheckStatus]) -> Vec<E2eState> {
        let mut state = WindowState::default();
        results.iter().map(|result| state.step(window, *result)).collect()
    }

    #[test]
    fn enough_good_frames_make_message_valid() {
        use CheckStatus::{Error, Ok, Repeated, WrongSequence};
        use E2eState::{Init, NoData, Valid};
        let results = [Error, Error, WrongSequence, Ok, Repeated, Ok];
        assert_eq!(run(&window(), &results), [NoData, NoData, Init, Init, Init, Valid]);
    }

    #[test]
    fn errors_make_message_invalid_and_good_frames_valid_again() {
        use CheckStatus::{Error, Ok};
        use E2eState::{Init, Invalid, Valid};
        let fall = [Ok, Ok, Ok, Error, Error, Error];
        assert_eq!(run(&window(), &fall), [Init, Init, Valid, Valid, Valid, Invalid]);
        // The last error has to leave the window of four.
        let rise = [fall.to_vec(), vec![Ok; 4]].concat();
        assert_eq!(run(&window(), &rise)[6..], [Invalid, Invalid, Invalid, Valid]);
        let cleared = Window::new(INIT, VALID, INVALID, true).unwrap();
        assert_eq!(run(&cleared, &rise)[6..], [Invalid, Invalid, Valid, Valid]);
        assert_eq!(run(&window(), &[Ok, Error])[1], Invalid, "an error in the first window");
    }

    #[test]
    fn results_outside_old_window_are_forgotten() {
        use CheckStatus::{Error, Ok};
        let limits = |size, min_ok, max_error| WindowLimits { size, min_ok, max_error };
        let window = Window::new(limits(2, 1, 0), limits(6, 1, 1), limits(2, 2, 0), false).unwrap();
        let states = run(&window, &[Ok, Ok, Error, Error, Ok, Ok, Ok, Ok]);
        assert_eq!(
            states[3..],
            [E2eState::Invalid, E2eState::Invalid, E2eState::Valid, E2eState::Valid, E2eState::Valid]
        );
    }

    #[test]
    fn repetitions_make_message_invalid() {
        use CheckStatus::{Ok, Repeated};
        let results = [vec![Ok; 3], vec![Repeated; 5]].concat();
        let states = run(&window(), &results);
        assert_eq!((states[6], states[7]), (E2eState::Valid, E2eState::Invalid));
    }

    #[test]
    fn contradictory_limits_are_refused() {
        let refused = |init, valid, invalid| Window::new(init, valid, invalid, false).unwrap_err();
        let limits = |size, min_ok, max_error| WindowLimits { size, min_ok, max_error };
        assert_eq!(refused(limits(0, 0, 0), VALID, INVALID), WindowError::Size(0));
        assert_eq!(refused(INIT, limits(65, 1, 2), INVALID), WindowError::Size(65));
        assert_eq!(refused(INIT, limits(3, 1, 2), INVALID), WindowError::ValidNotLongest);
        assert_eq!(refused(limits(6, 2, 0), VALID, INVALID), WindowError::ValidNotLongest);
        assert_eq!(
            refused(limits(3, 3, 3), VALID, INVALID),
            WindowError::TooMany { size: 3, min_ok: 3, max_error: 3 }
        );
        assert_eq!(refused(INIT, limits(5, 0, 2), INVALID), WindowError::MinOkOrder);
        assert_eq!(refused(limits(3, 3, 0), VALID, limits(4, 2, 0)), WindowError::MinOkOrder);
        assert_eq!(refused(INIT, limits(5, 1, 0), limits(4, 3, 1)), WindowError::MaxErrorOrder);
    }

    /// Runs the state machine as the standard describes it: a list of results, counted again at each step.
    fn reference(window: &Window, results: &[CheckStatus]) -> Vec<E2eState> {
        let (mut state, mut list) = (E2eState::NoData, VecDeque::new());
        let mut states = Vec::new();
        for result in results {
            if state == E2eState::NoData {
                if *result != CheckStatus::Error {
                    state = E2eState::Init;
                }
                states.push(state);
                continue;
            }
            let WindowLimits { size, min_ok, max_error } = window.limits(state);
            list.push_front(*result);
            let newest = list.iter().take(size.into());
            let ok = newest.clone().filter(|o| **o == CheckStatus::Ok).count() >= min_ok.into();
            let good = newest.filter(|o| **o == CheckStatus::Error).count() <= max_error.into();
            let next = match (state, ok, good) {
                (_, _, false) | (E2eState::Valid | E2eState::Invalid, false, _) => E2eState::Invalid,
                (_, true, true) => E2eState::Valid,
                (same, ..) => same,
            };
            if next != state {
                list.truncate(size.into());
                if next == E2eState::Invalid && window.clear_to_invalid {
                    list.clear();
                }
            }
            state = next;
            states.push(state);
        }
        states
    }

    /// Limits in the required order that also satisfy all other constraints.
    fn windows() -> impl Strategy<Value = Window> {
        let sizes = (1_u8..10, 1_u8..10, 6_u8..12);
        let needed = (prop::array::uniform3(1_u8..5), prop::array::uniform3(0_u8..4), any::<bool>());
        (sizes, needed).prop_filter_map(
            "contradicting",
            |((init, invalid, valid), (mut ok, mut error, clear))| {
                ok.sort_unstable();
                error.sort_unstable();
                let limits =
                    |size, at: usize| WindowLimits { size, min_ok: ok[at], max_error: error[2 - at] };
                Window::new(limits(init, 1), limits(valid, 0), limits(invalid, 2), clear).ok()
            },
        )
    }

    fn results() -> impl Strategy<Value = Vec<CheckStatus>> {
        use CheckStatus::{Error, Ok, Repeated, WrongSequence};
        let kinds = vec![Ok, Ok, Ok, Ok, Ok, Error, Error, Repeated, WrongSequence];
        prop::collection::vec(prop::sample::select(kinds), 0..200)
    }

    proptest! {
        #[test]
        fn state_agrees_with_list_of_results(window in windows(), results in results()) {
            prop_assert_eq!(run(&window, &results), reference(&window, &results));
        }
    }
}
