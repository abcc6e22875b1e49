//! One command topic: which of its messages count, and what its sender wants now.

use std::collections::VecDeque;
use std::time::Duration;

use super::Turn;
use super::past::Past;
use crate::core::bus::past;
use crate::core::time::{MonoTime, Now, WallStamp};

/// How long a refused message is shown.
const SHOWN: Duration = Duration::from_secs(1);
/// So many changes of what is wanted, within so long, are nobody's will.
const UNSTEADY: (usize, Duration) = (5, Duration::from_secs(1));
/// How long a stamp is held against later ones, at most: a sender whose clock was set back is heard
/// again, however long its words may hold.
const STAMP_HOLDS: Duration = Duration::from_secs(1);

/// A value of a command message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word<T> {
    /// `NO_COMMAND`: no opinion.
    NoCommand,
    /// This is wanted.
    Wanted(T),
}

/// `TurnIndicatorsCommand.command`; `None` for a value that is not defined.
pub fn turn_word(raw: u8) -> Option<Word<Turn>> {
    match raw {
        0 => Some(Word::NoCommand),
        1 => Some(Word::Wanted(Turn::Off)),
        2 => Some(Word::Wanted(Turn::Left)),
        3 => Some(Word::Wanted(Turn::Right)),
        _ => None,
    }
}

/// `HazardLightsCommand.command`; `None` for a value that is not defined.
pub fn hazard_word(raw: u8) -> Option<Word<bool>> {
    match raw {
        0 => Some(Word::NoCommand),
        1 => Some(Word::Wanted(false)),
        2 => Some(Word::Wanted(true)),
        _ => None,
    }
}

/// What is left of a sender's words now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Opinion<T> {
    /// Nothing has come since start.
    Never,
    /// The sender says `NO_COMMAND`, and what it wanted before has run out.
    None,
    /// It wants this.
    Wanted(T),
    /// Nothing has come for longer than the limit; its last word was this, or `NO_COMMAND`.
    Silent(Option<T>),
}

/// Why a message was not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The value is not defined.
    Undefined(u8),
    /// The stamp lies before that of a message used earlier.
    StampBackwards,
}

/// Messages since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IntakeCounts {
    /// All.
    pub received: u64,
    /// Those that said `NO_COMMAND`.
    pub no_command: u64,
    /// Those with an undefined value.
    pub undefined: u64,
    /// Those whose stamp went backwards.
    pub backwards: u64,
    /// Those of the past. No refusal is shown for them: a sender that lives speaks again at once, and nothing
    /// has come of one that does not.
    pub past: u64,
}

/// One topic.
#[derive(Debug, Clone)]
pub struct Intake<T> {
    word: fn(u8) -> Option<Word<T>>,
    limit: Duration,
    /// What was wanted last, and when it was said last.
    wish: Option<(T, MonoTime)>,
    /// The last message that was used: when it came, and its stamp in ns.
    heard: Option<(MonoTime, i64)>,
    refused: Option<(Refusal, MonoTime)>,
    /// When what is wanted changed last; the oldest first.
    changes: VecDeque<MonoTime>,
    past: Past,
    counts: IntakeCounts,
}

impl<T: Copy + PartialEq> Intake<T> {
    /// A topic whose values mean what `word` says, which is silent after `limit` without a message, and is
    /// listened to from `started` on.
    pub fn new(word: fn(u8) -> Option<Word<T>>, limit: Duration, started: WallStamp) -> Self {
        Self {
            word,
            limit,
            wish: None,
            heard: None,
            refused: None,
            changes: VecDeque::new(),
            past: Past::before(started),
            counts: IntakeCounts::default(),
        }
    }

    /// Takes a message. The stamps of a sender that speaks are compared with each other only. One that was
    /// silent, and so perhaps started anew with another clock, begins afresh; but its first message may be
    /// of the past.
    pub fn take(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        let Now { mono, .. } = now;
        self.counts.received += 1;
        let Some(word) = (self.word)(raw) else {
            self.counts.undefined += 1;
            self.refused = Some((Refusal::Undefined(raw), mono));
            return;
        };
        let heard_within = |limit| self.heard.filter(|(at, _)| mono.since(*at) <= limit);
        let newest = heard_within(self.limit.min(STAMP_HOLDS)).map(|(_, newest)| newest);
        let speaks = heard_within(self.limit).is_some();
        if newest.is_some_and(|newest| stamp.as_nanos() < newest) {
            self.counts.backwards += 1;
            self.refused = Some((Refusal::StampBackwards, mono));
            return;
        }
        if self.past.holds_back(speaks, stamp, self.limit, now) {
            self.counts.past += 1;
            return;
        }
        self.heard = Some((mono, stamp.as_nanos()));
        match word {
            Word::NoCommand => self.counts.no_command += 1,
            Word::Wanted(wish) => {
                if self.wish.is_some_and(|(before, _)| before != wish) {
                    if self.changes.len() == UNSTEADY.0 {
                        self.changes.pop_front();
                    }
                    self.changes.push_back(mono);
                }
                self.wish = Some((wish, mono));
            }
        }
    }

    /// Whether what is wanted changes faster than anybody could mean it: two senders, as a rule.
    pub fn is_unsteady(&self, now: MonoTime) -> bool {
        self.changes.len() == UNSTEADY.0
            && self.changes.front().is_some_and(|at| now.since(*at) <= UNSTEADY.1)
    }

    /// What the sender wants now. A `NO_COMMAND` takes nothing back: what was wanted holds until its
    /// own limit, but no longer, also when the sender falls silent.
    pub fn opinion(&self, now: MonoTime) -> Opinion<T> {
        let Some((heard, _)) = self.heard else { return Opinion::Never };
        let last = self.wish.filter(|(_, at)| *at == heard).map(|(wish, _)| wish);
        match self.wish {
            Some((wish, at)) if now.since(at) <= self.limit => Opinion::Wanted(wish),
            Some(_) | None if now.since(heard) <= self.limit => Opinion::None,
            Some(_) | None => Opinion::Silent(last),
        }
    }

    /// The last refused message, as long as it is worth showing.
    pub fn refusal(&self, now: MonoTime) -> Option<Refusal> {
        self.refused.filter(|(_, at)| now.since(*at) <= SHOWN).map(|(refusal, _)| refusal)
    }

    /// Messages since start.
    pub fn counts(&self) -> IntakeCounts {
        self.counts
    }

    /// How long since the last message that was used.
    pub fn age(&self, now: MonoTime) -> Option<Duration> {
        self.heard.map(|(at, _)| now.since(at))
    }

    /// When opinion or refusal change with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let wish = self.wish.map(|(_, at)| past(at, self.limit));
        let heard = self.heard.map(|(at, _)| past(at, self.limit));
        let refused = self.refused.map(|(_, at)| past(at, SHOWN));
        let unsteady = self.changes.front().filter(|_| self.is_unsteady(now)).map(|at| past(*at, UNSTEADY.1));
        [wish, heard, refused, unsteady].into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// The opinion of two senders on the hazard lights: the topic's, unless it has none, or the decider
/// wants them on. A decider that is silent or never spoke changes nothing.
pub fn joined_hazard(topic: Opinion<bool>, decider: Opinion<bool>) -> Opinion<bool> {
    match (topic, decider) {
        (_, Opinion::Wanted(true)) => Opinion::Wanted(true),
        (Opinion::Never | Opinion::None, Opinion::None | Opinion::Wanted(false)) => decider,
        (_, Opinion::Never | Opinion::None | Opinion::Wanted(false) | Opinion::Silent(_)) => topic,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> MonoTime {
        MonoTime::from_millis(ms)
    }

    fn stamp(ms: i64) -> WallStamp {
        WallStamp::from_nanos(ms * 1_000_000)
    }

    fn now(ms: u64) -> Now {
        Now { mono: at(ms), wall: WallStamp::from_nanos(i64::try_from(ms).unwrap() * 1_000_000) }
    }

    fn turns(limit_ms: u64) -> Intake<Turn> {
        Intake::new(turn_word, Duration::from_millis(limit_ms), stamp(0))
    }

    #[test]
    fn no_command_takes_nothing_back_and_is_no_error() {
        let mut turns = turns(500);
        assert_eq!(turns.opinion(at(0)), Opinion::Never);
        turns.take(0, stamp(0), now(0));
        assert_eq!(turns.opinion(at(0)), Opinion::None);
        turns.take(2, stamp(100), now(100));
        turns.take(0, stamp(200), now(200));
        turns.take(0, stamp(600), now(600));
        assert_eq!(turns.opinion(at(600)), Opinion::Wanted(Turn::Left));
        assert_eq!(turns.opinion(past(at(100), Duration::from_millis(500))), Opinion::None);
        assert_eq!(turns.opinion(at(1100)), Opinion::None);
        assert_eq!(turns.opinion(at(1101)), Opinion::Silent(None), "its last word was no wish");
        assert_eq!((turns.counts().no_command, turns.refusal(at(600))), (3, None));
    }

    #[test]
    fn undefined_values_are_ignored_and_shown_for_a_while() {
        let mut turns = turns(5000);
        turns.take(3, stamp(0), now(0));
        for raw in 4..=u8::MAX {
            turns.take(raw, stamp(10), now(10));
            assert_eq!(turns.opinion(at(10)), Opinion::Wanted(Turn::Right), "{raw}");
            assert_eq!(turns.refusal(at(1010)), Some(Refusal::Undefined(raw)));
        }
        assert_eq!((turns.counts().undefined, turns.refusal(at(1011))), (252, None));
        assert_eq!(hazard_word(3), None);
    }

    #[test]
    fn stamps_that_go_backwards_are_rejected_until_the_sender_was_silent() {
        let mut turns = turns(500);
        turns.take(2, stamp(1000), now(0));
        turns.take(2, stamp(1000), now(10));
        assert_eq!(turns.refusal(at(10)), None, "the same stamp again is no step back");
        turns.take(3, stamp(999), now(100));
        assert_eq!(turns.opinion(at(100)), Opinion::Wanted(Turn::Left));
        assert_eq!(turns.refusal(at(100)), Some(Refusal::StampBackwards));
        turns.take(3, stamp(105), now(600));
        assert_eq!((turns.opinion(at(600)), turns.counts().backwards), (Opinion::Wanted(Turn::Right), 1));
    }

    #[test]
    fn two_senders_that_want_different_things_are_noticed() {
        let mut turns = turns(500);
        for step in 0..6 {
            assert!(!turns.is_unsteady(at(step * 50)));
            turns.take(2 + u8::from(step % 2 == 1), stamp(0), now(step * 50));
        }
        // Changes from 50 to 250 ms.
        assert!(turns.is_unsteady(at(1050)) && !turns.is_unsteady(at(1051)));
        assert_eq!(turns.next_deadline(at(1000)), Some(past(at(50), Duration::from_secs(1))));
        (20..60).for_each(|step| turns.take(2, stamp(0), now(step * 50)));
        assert!(!turns.is_unsteady(at(3000)), "the same again and again");
    }

    #[test]
    fn a_clock_that_was_set_back_locks_nobody_out_for_long() {
        let mut turns = turns(3_600_000);
        turns.take(2, stamp(60_000), now(0));
        turns.take(3, stamp(1), now(1000));
        assert_eq!(turns.opinion(at(1000)), Opinion::Wanted(Turn::Left));
        turns.take(3, stamp(101), now(1100));
        assert_eq!(turns.opinion(at(1100)), Opinion::Wanted(Turn::Right));
    }

    #[test]
    fn what_a_sender_keeps_for_late_readers_is_not_carried_out() {
        let mut turns = turns(500);
        turns.take(2, stamp(-1), now(10));
        assert_eq!((turns.opinion(at(10)), turns.counts().past), (Opinion::Never, 1));
        assert_eq!(turns.opinion(at(5000)), Opinion::Never, "nothing is held that was never used");
        turns.take(3, stamp(-1), now(110));
        assert_eq!((turns.opinion(at(110)), turns.counts().past), (Opinion::Wanted(Turn::Right), 1));
    }
}
