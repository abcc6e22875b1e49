//! AUTOSAR's common E2E state machine: is the message as a whole to be trusted?
//!
//! Single results go into a window of the newest ones. Enough good ones make the message valid,
//! too many errors or too few good ones make it invalid. Each state has its own window and limits.

/// Results the machine can look back on.
pub const MAX_WINDOW: u8 = 64;

/// What a check found, as far as the machine cares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CheckStatus {
    /// A good frame.
    Ok,
    /// A frame that is damaged or not ours.
    Error,
    /// A whole frame that came before.
    Repeated,
    /// A whole frame, out of sequence.
    WrongSequence,
    /// No frame when one was due.
    NoNewData,
}

/// States of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum E2eState {
    /// Nothing usable yet.
    #[default]
    NoData,
    /// Frames come; not enough good ones yet.
    Init,
    /// To be trusted.
    Valid,
    /// Was not good enough.
    Invalid,
}

/// What keeps or brings the machine into the valid state, seen from one state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Newest results looked at, 1 to [`MAX_WINDOW`].
    pub size: u8,
    /// Good ones needed.
    pub min_ok: u8,
    /// Errors allowed.
    pub max_error: u8,
}

/// Limits of each state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    init: Limits,
    valid: Limits,
    invalid: Limits,
    clear_to_invalid: bool,
}

/// Limits that contradict each other; AUTOSAR's constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum WindowError {
    /// A size outside 1 to 64.
    #[error("a window holds 1 to 64 results, not {0}")]
    Size(u8),
    /// Another state's window is longer.
    #[error("the window of the valid state must be the longest")]
    ValidNotLongest,
    /// More results needed than the window holds.
    #[error("of {size} results, {min_ok} good ones and {max_error} errors cannot be asked for")]
    TooMany {
        /// Results in the window.
        size: u8,
        /// Good ones needed.
        min_ok: u8,
        /// Errors allowed.
        max_error: u8,
    },
    /// Good ones needed: not 1 ≤ valid ≤ init ≤ invalid.
    #[error("min_ok must be at least 1 and must not fall from valid to init to invalid")]
    MinOkOrder,
    /// Errors allowed: not valid ≥ init ≥ invalid.
    #[error("max_error must not rise from valid to init to invalid")]
    MaxErrorOrder,
}

/// The machine.
#[derive(Debug, Clone, Default)]
pub struct WindowState {
    phase: E2eState,
    /// The newest result in bit 0.
    ok: u64,
    error: u64,
}

impl Window {
    /// Limits for the states of that name. With `clear_to_invalid`, results before a fall into the
    /// invalid state do not count for the way out of it.
    pub fn new(
        init: Limits,
        valid: Limits,
        invalid: Limits,
        clear_to_invalid: bool,
    ) -> Result<Self, WindowError> {
        for Limits { size, min_ok, max_error } in [init, valid, invalid] {
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

    fn limits(&self, phase: E2eState) -> Limits {
        match phase {
            E2eState::NoData | E2eState::Init => self.init,
            E2eState::Valid => self.valid,
            E2eState::Invalid => self.invalid,
        }
    }
}

impl WindowState {
    /// The state after `outcome`.
    pub fn step(&mut self, window: &Window, outcome: CheckStatus) -> E2eState {
        let limits = window.limits(self.phase);
        self.ok = self.ok << 1 | u64::from(outcome == CheckStatus::Ok);
        self.error = self.error << 1 | u64::from(outcome == CheckStatus::Error);
        let mask = u64::MAX >> (u64::BITS - u32::from(limits.size));
        let enough = (self.ok & mask).count_ones() >= u32::from(limits.min_ok);
        let spoilt = (self.error & mask).count_ones() > u32::from(limits.max_error);
        let next = match self.phase {
            E2eState::NoData if matches!(outcome, CheckStatus::Error | CheckStatus::NoNewData) => {
                E2eState::NoData
            }
            E2eState::Init if spoilt => E2eState::Invalid,
            E2eState::Init if enough => E2eState::Valid,
            E2eState::NoData | E2eState::Init => E2eState::Init,
            E2eState::Valid | E2eState::Invalid if enough && !spoilt => E2eState::Valid,
            E2eState::Valid | E2eState::Invalid => E2eState::Invalid,
        };
        if next != self.phase {
            let forget =
                self.phase == E2eState::NoData || (next == E2eState::Invalid && window.clear_to_invalid);
            // What the state before did not look at does not count for the next one either.
            let kept = if forget { 0 } else { mask };
            self.ok &= kept;
            self.error &= kept;
        }
        self.phase = next;
        next
    }

    /// The state now.
    pub fn phase(&self) -> E2eState {
        self.phase
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::VecDeque;

    const INIT: Limits = Limits { size: 3, min_ok: 2, max_error: 0 };
    const VALID: Limits = Limits { size: 5, min_ok: 1, max_error: 2 };
    const INVALID: Limits = Limits { size: 4, min_ok: 3, max_error: 0 };

    fn window() -> Window {
        Window::new(INIT, VALID, INVALID, false).unwrap()
    }

    fn run(window: &Window, outcomes: &[CheckStatus]) -> Vec<E2eState> {
        let mut state = WindowState::default();
        outcomes.iter().map(|outcome| state.step(window, *outcome)).collect()
    }

    #[test]
    fn a_message_becomes_valid_after_enough_good_frames() {
        use CheckStatus::{Error, NoNewData, Ok, WrongSequence};
        use E2eState::{Init, NoData, Valid};
        let outcomes = [NoNewData, Error, WrongSequence, Ok, NoNewData, Ok];
        assert_eq!(run(&window(), &outcomes), [NoData, NoData, Init, Init, Init, Valid]);
    }

    #[test]
    fn errors_make_it_invalid_and_good_frames_in_a_row_valid_again() {
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
    fn what_the_way_back_did_not_look_at_is_forgotten() {
        use CheckStatus::{Error, Ok};
        let limits = |size, min_ok, max_error| Limits { size, min_ok, max_error };
        let window = Window::new(limits(2, 1, 0), limits(6, 1, 1), limits(2, 2, 0), false).unwrap();
        let phases = run(&window, &[Ok, Ok, Error, Error, Ok, Ok, Ok, Ok]);
        assert_eq!(
            phases[3..],
            [E2eState::Invalid, E2eState::Invalid, E2eState::Valid, E2eState::Valid, E2eState::Valid]
        );
    }

    #[test]
    fn repetitions_push_the_good_ones_out() {
        use CheckStatus::{Ok, Repeated};
        let outcomes = [vec![Ok; 3], vec![Repeated; 5]].concat();
        let phases = run(&window(), &outcomes);
        assert_eq!((phases[6], phases[7]), (E2eState::Valid, E2eState::Invalid));
    }

    #[test]
    fn contradicting_limits_are_refused() {
        let refused = |init, valid, invalid| Window::new(init, valid, invalid, false).unwrap_err();
        let limits = |size, min_ok, max_error| Limits { size, min_ok, max_error };
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

    /// The machine as the standard tells it: a list of results, counted anew each time.
    fn reference(window: &Window, outcomes: &[CheckStatus]) -> Vec<E2eState> {
        let (mut phase, mut list) = (E2eState::NoData, VecDeque::new());
        let mut phases = Vec::new();
        for outcome in outcomes {
            if phase == E2eState::NoData {
                if !matches!(outcome, CheckStatus::Error | CheckStatus::NoNewData) {
                    phase = E2eState::Init;
                }
                phases.push(phase);
                continue;
            }
            let Limits { size, min_ok, max_error } = window.limits(phase);
            list.push_front(*outcome);
            let newest = list.iter().take(size.into());
            let ok = newest.clone().filter(|o| **o == CheckStatus::Ok).count() >= min_ok.into();
            let good = newest.filter(|o| **o == CheckStatus::Error).count() <= max_error.into();
            let next = match (phase, ok, good) {
                (_, _, false) | (E2eState::Valid | E2eState::Invalid, false, _) => E2eState::Invalid,
                (_, true, true) => E2eState::Valid,
                (same, ..) => same,
            };
            if next != phase {
                list.truncate(size.into());
                if next == E2eState::Invalid && window.clear_to_invalid {
                    list.clear();
                }
            }
            phase = next;
            phases.push(phase);
        }
        phases
    }

    /// Limits in the order they must have; those that still contradict each other are left out.
    fn windows() -> impl Strategy<Value = Window> {
        let sizes = (1_u8..10, 1_u8..10, 6_u8..12);
        let needed = (prop::array::uniform3(1_u8..5), prop::array::uniform3(0_u8..4), any::<bool>());
        (sizes, needed).prop_filter_map(
            "contradicting",
            |((init, invalid, valid), (mut ok, mut error, clear))| {
                ok.sort_unstable();
                error.sort_unstable();
                let limits = |size, at: usize| Limits { size, min_ok: ok[at], max_error: error[2 - at] };
                Window::new(limits(init, 1), limits(valid, 0), limits(invalid, 2), clear).ok()
            },
        )
    }

    fn outcomes() -> impl Strategy<Value = Vec<CheckStatus>> {
        use CheckStatus::{Error, NoNewData, Ok, Repeated, WrongSequence};
        let kinds = vec![Ok, Ok, Ok, Ok, Ok, Error, Error, Repeated, WrongSequence, NoNewData];
        prop::collection::vec(prop::sample::select(kinds), 0..200)
    }

    proptest! {
        #[test]
        fn the_machine_does_what_a_list_of_results_says(window in windows(), outcomes in outcomes()) {
            prop_assert_eq!(run(&window, &outcomes), reference(&window, &outcomes));
        }
    }
}
