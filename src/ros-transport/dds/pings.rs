//! Decides when a ping is answered: once its echo has returned or, where no echo is possible, once RustDDS's
//! thread has shown that it works.

use std::time::{Duration, Instant};

use super::echo::SignsOfLife;

/// Time after which a missing echo may mean that there is no network. RustDDS's thread reports the missing
/// echo earlier.
const ECHO_PATIENCE: Duration = Duration::from_millis(300);

#[derive(Debug)]
pub(super) struct Pings {
    /// The newest unanswered ping, and the arrival time of the oldest.
    open: Option<(u64, Instant)>,
    /// An echo has returned on this computer.
    echo_is_proven: bool,
    /// RustDDS's thread has worked since the oldest ping.
    noticed_silence: bool,
    /// The highest answered number; no number is answered twice.
    answered: u64,
    /// Samples received outside our participant since the last answer.
    witnessed: u64,
}

/// An answer to all pings up to a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Answer {
    pub(super) number: u64,
    /// True if the answer is due to an echo.
    pub(super) has_echo: bool,
    /// True if a sample was received outside our participant since the last answer.
    pub(super) is_heard: bool,
}

impl Pings {
    pub(super) fn new(echo_is_proven: bool) -> Self {
        Self { open: None, echo_is_proven, noticed_silence: false, answered: 0, witnessed: 0 }
    }

    /// Records a ping, whose echo was sent.
    pub(super) fn asked(&mut self, number: u64, now: Instant) {
        self.noticed_silence &= self.open.is_some();
        self.open = Some((number, self.open.map_or(now, |(_, since)| since)));
    }

    /// Returns the answer that these signs of life allow; `has_network` is called if no echo returned in
    /// time.
    pub(super) fn answer(
        &mut self,
        signs: SignsOfLife,
        now: Instant,
        has_network: impl FnOnce() -> bool,
    ) -> Option<Answer> {
        self.noticed_silence |= signs.noticed_silence;
        self.witnessed = self.witnessed.saturating_add(signs.witnessed);
        if let Some(number) = signs.echo.filter(|number| *number > self.answered) {
            (self.echo_is_proven, self.answered) = (true, number);
            self.open = self.open.filter(|(newest, _)| *newest > number).map(|(newest, _)| (newest, now));
            return Some(self.answered(number, true));
        }
        let (number, since) = self.open?;
        let is_late = now.saturating_duration_since(since) >= ECHO_PATIENCE;
        if is_late && self.noticed_silence && (!self.echo_is_proven || !has_network()) {
            (self.open, self.answered) = (None, number);
            return Some(self.answered(number, false));
        }
        None
    }

    fn answered(&mut self, number: u64, has_echo: bool) -> Answer {
        Answer { number, has_echo, is_heard: std::mem::take(&mut self.witnessed) > 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: SignsOfLife = SignsOfLife { echo: None, noticed_silence: false, witnessed: 0 };
    const SILENCE: SignsOfLife = SignsOfLife { noticed_silence: true, ..NONE };

    /// Returns the last answer within two seconds of pings, with these signs of life at each tenth of a
    /// second.
    fn answer(echo_is_proven: bool, has_network: bool, signs: impl Fn(u64) -> SignsOfLife) -> Option<Answer> {
        let (start, mut pings) = (Instant::now(), Pings::new(echo_is_proven));
        let mut last = None;
        for tenth in 0..20 {
            let now = start + Duration::from_millis(tenth * 100);
            if tenth % 2 == 0 {
                pings.asked(1 + tenth / 2, now);
            }
            let answer = pings.answer(signs(tenth), now, || has_network);
            assert!(answer.is_none_or(|answer| last.is_none_or(|last: Answer| last.number < answer.number)));
            last = answer.or(last);
        }
        last
    }

    #[test]
    fn an_echo_is_an_answer_to_its_ping_and_those_before() {
        let echo = |tenth| SignsOfLife { echo: (tenth % 4 == 1).then_some(1 + tenth / 2), ..NONE };
        assert_eq!(answer(true, true, echo), Some(Answer { number: 9, has_echo: true, is_heard: false }));
    }

    #[test]
    fn silence_that_was_noticed_is_an_answer_only_where_no_echo_can_be() {
        let without_echo = Some(Answer { number: 10, has_echo: false, is_heard: false });
        assert_eq!(answer(false, true, |_| SILENCE), without_echo);
        assert_eq!(answer(true, false, |_| SILENCE), without_echo);
        assert_eq!(answer(true, true, |_| SILENCE), None);
    }

    #[test]
    fn a_thread_that_hangs_is_no_answer_whatever_the_network() {
        for (echo_is_proven, has_network) in [(false, false), (false, true), (true, false), (true, true)] {
            assert_eq!(answer(echo_is_proven, has_network, |_| NONE), None);
        }
        // An event before the first unanswered ping proves nothing about later.
        let once = |tenth| if tenth == 0 { SignsOfLife { echo: Some(1), ..SILENCE } } else { NONE };
        assert_eq!(answer(false, false, once), Some(Answer { number: 1, has_echo: true, is_heard: false }));
    }

    #[test]
    fn an_echo_after_its_answer_is_not_counted_again() {
        let late = |tenth| if tenth == 7 { SignsOfLife { echo: Some(1), ..SILENCE } } else { SILENCE };
        assert_eq!(answer(false, true, late).map(|answer| answer.has_echo), Some(false));
    }
}
