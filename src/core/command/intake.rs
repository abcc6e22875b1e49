//! One command topic: which of its messages count, and what its sender wants now.

use std::collections::VecDeque;
use std::time::Duration;

use super::Turn;
use super::stale_message_filter::StaleMessageFilter;
use crate::core::time::{MonoTime, Now, WallStamp, deadline_after};

/// How long a refused message is shown.
const SHOWN: Duration = Duration::from_secs(1);
/// So many changes of what is wanted, within so long, are nobody's will.
const OSCILLATION: (usize, Duration) = (5, Duration::from_secs(1));
/// How long a stamp is held against later ones, at most: a sender whose clock was set back is heard
/// again, however long its commands may hold.
const STAMP_HOLDS: Duration = Duration::from_secs(1);

/// A value of a command message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandValue<T> {
    /// `NO_COMMAND`: no opinion.
    NoCommand,
    /// This is wanted.
    Request(T),
}

/// `TurnIndicatorsCommand.command`; `None` for a value that is not defined.
pub fn turn_command_value(raw: u8) -> Option<CommandValue<Turn>> {
    match raw {
        0 => Some(CommandValue::NoCommand),
        1 => Some(CommandValue::Request(Turn::Off)),
        2 => Some(CommandValue::Request(Turn::Left)),
        3 => Some(CommandValue::Request(Turn::Right)),
        _ => None,
    }
}

/// `HazardLightsCommand.command`; `None` for a value that is not defined.
pub fn hazard_command_value(raw: u8) -> Option<CommandValue<bool>> {
    match raw {
        0 => Some(CommandValue::NoCommand),
        1 => Some(CommandValue::Request(false)),
        2 => Some(CommandValue::Request(true)),
        _ => None,
    }
}

/// What a sender commands now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandState<T> {
    /// Nothing has come since start.
    NeverReceived,
    /// The sender says `NO_COMMAND`, and what it wanted before has run out.
    NoCommand,
    /// It wants this.
    Requested(T),
    /// Nothing has come for longer than the limit; its last word was this, or `NO_COMMAND`.
    TimedOut(Option<T>),
}

/// Why a message was not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The value is not defined.
    Undefined(u8),
    /// The stamp lies before that of a message used earlier.
    NonMonotonicStamp,
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
    /// Those that are stale. No refusal is shown for them: a sender that lives speaks again at once, and nothing
    /// has come of one that does not.
    pub stale: u64,
}

/// One topic.
#[derive(Debug, Clone)]
pub struct Intake<T> {
    parse: fn(u8) -> Option<CommandValue<T>>,
    limit: Duration,
    /// What was wanted last, and when it was said last.
    requested: Option<(T, MonoTime)>,
    /// The last message that was used: when it came, and its stamp in ns.
    last_used: Option<(MonoTime, i64)>,
    refused: Option<(Refusal, MonoTime)>,
    /// When what is wanted changed last; the oldest first.
    changes: VecDeque<MonoTime>,
    stale_filter: StaleMessageFilter,
    counts: IntakeCounts,
}

impl<T: Copy + PartialEq> Intake<T> {
    /// A topic whose values mean what `parse` says, which is silent after `limit` without a message, and is
    /// listened to from `started` on.
    pub fn new(parse: fn(u8) -> Option<CommandValue<T>>, limit: Duration, started: WallStamp) -> Self {
        Self {
            parse,
            limit,
            requested: None,
            last_used: None,
            refused: None,
            changes: VecDeque::new(),
            stale_filter: StaleMessageFilter::before(started),
            counts: IntakeCounts::default(),
        }
    }

    /// Takes a message. The stamps of a sender that speaks are compared with each other only. One that was
    /// silent, and so perhaps started anew with another clock, begins afresh; but its first message may be
    /// that are stale.
    pub fn take(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        let Now { mono, .. } = now;
        self.counts.received += 1;
        let Some(value) = (self.parse)(raw) else {
            self.counts.undefined += 1;
            self.refused = Some((Refusal::Undefined(raw), mono));
            return;
        };
        let heard_within = |limit| self.last_used.filter(|(at, _)| mono.since(*at) <= limit);
        let newest = heard_within(self.limit.min(STAMP_HOLDS)).map(|(_, newest)| newest);
        let is_active = heard_within(self.limit).is_some();
        if newest.is_some_and(|newest| stamp.as_nanos() < newest) {
            self.counts.backwards += 1;
            self.refused = Some((Refusal::NonMonotonicStamp, mono));
            return;
        }
        if self.stale_filter.rejects_as_stale(is_active, stamp, self.limit, now) {
            self.counts.stale += 1;
            return;
        }
        self.last_used = Some((mono, stamp.as_nanos()));
        match value {
            CommandValue::NoCommand => self.counts.no_command += 1,
            CommandValue::Request(requested) => {
                if self.requested.is_some_and(|(before, _)| before != requested) {
                    if self.changes.len() == OSCILLATION.0 {
                        self.changes.pop_front();
                    }
                    self.changes.push_back(mono);
                }
                self.requested = Some((requested, mono));
            }
        }
    }

    /// Whether what is wanted changes faster than anybody could mean it: two senders, as a rule.
    pub fn is_oscillating(&self, now: MonoTime) -> bool {
        self.changes.len() == OSCILLATION.0
            && self.changes.front().is_some_and(|at| now.since(*at) <= OSCILLATION.1)
    }

    /// What the sender wants now. A `NO_COMMAND` takes nothing back: what was wanted holds until its
    /// own limit, but no longer, also when the sender falls silent.
    pub fn command_state(&self, now: MonoTime) -> CommandState<T> {
        let Some((last_used, _)) = self.last_used else { return CommandState::NeverReceived };
        let last = self.requested.filter(|(_, at)| *at == last_used).map(|(requested, _)| requested);
        match self.requested {
            Some((requested, at)) if now.since(at) <= self.limit => CommandState::Requested(requested),
            Some(_) | None if now.since(last_used) <= self.limit => CommandState::NoCommand,
            Some(_) | None => CommandState::TimedOut(last),
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
        self.last_used.map(|(at, _)| now.since(at))
    }

    /// When command state or refusal change with nothing happening.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let requested = self.requested.map(|(_, at)| deadline_after(at, self.limit));
        let last_used = self.last_used.map(|(at, _)| deadline_after(at, self.limit));
        let refused = self.refused.map(|(_, at)| deadline_after(at, SHOWN));
        let oscillating = self
            .changes
            .front()
            .filter(|_| self.is_oscillating(now))
            .map(|at| deadline_after(*at, OSCILLATION.1));
        [requested, last_used, refused, oscillating].into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// The command state of two senders on the hazard lights: the topic's, unless it has none, or the decider
/// wants them on. A decider that is silent or never spoke changes nothing.
pub fn merged_hazard(topic: CommandState<bool>, decider: CommandState<bool>) -> CommandState<bool> {
    match (topic, decider) {
        (_, CommandState::Requested(true)) => CommandState::Requested(true),
        (
            CommandState::NeverReceived | CommandState::NoCommand,
            CommandState::NoCommand | CommandState::Requested(false),
        ) => decider,
        (
            _,
            CommandState::NeverReceived
            | CommandState::NoCommand
            | CommandState::Requested(false)
            | CommandState::TimedOut(_),
        ) => topic,
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
        Intake::new(turn_command_value, Duration::from_millis(limit_ms), stamp(0))
    }

    #[test]
    fn no_command_takes_nothing_back_and_is_no_error() {
        let mut turns = turns(500);
        assert_eq!(turns.command_state(at(0)), CommandState::NeverReceived);
        turns.take(0, stamp(0), now(0));
        assert_eq!(turns.command_state(at(0)), CommandState::NoCommand);
        turns.take(2, stamp(100), now(100));
        turns.take(0, stamp(200), now(200));
        turns.take(0, stamp(600), now(600));
        assert_eq!(turns.command_state(at(600)), CommandState::Requested(Turn::Left));
        assert_eq!(
            turns.command_state(deadline_after(at(100), Duration::from_millis(500))),
            CommandState::NoCommand
        );
        assert_eq!(turns.command_state(at(1100)), CommandState::NoCommand);
        assert_eq!(
            turns.command_state(at(1101)),
            CommandState::TimedOut(None),
            "its last command requested nothing"
        );
        assert_eq!((turns.counts().no_command, turns.refusal(at(600))), (3, None));
    }

    #[test]
    fn undefined_values_are_ignored_and_shown_for_a_while() {
        let mut turns = turns(5000);
        turns.take(3, stamp(0), now(0));
        for raw in 4..=u8::MAX {
            turns.take(raw, stamp(10), now(10));
            assert_eq!(turns.command_state(at(10)), CommandState::Requested(Turn::Right), "{raw}");
            assert_eq!(turns.refusal(at(1010)), Some(Refusal::Undefined(raw)));
        }
        assert_eq!((turns.counts().undefined, turns.refusal(at(1011))), (252, None));
        assert_eq!(hazard_command_value(3), None);
    }

    #[test]
    fn stamps_that_go_backwards_are_rejected_until_the_sender_was_silent() {
        let mut turns = turns(500);
        turns.take(2, stamp(1000), now(0));
        turns.take(2, stamp(1000), now(10));
        assert_eq!(turns.refusal(at(10)), None, "the same stamp again is not a step back");
        turns.take(3, stamp(999), now(100));
        assert_eq!(turns.command_state(at(100)), CommandState::Requested(Turn::Left));
        assert_eq!(turns.refusal(at(100)), Some(Refusal::NonMonotonicStamp));
        turns.take(3, stamp(105), now(600));
        assert_eq!(
            (turns.command_state(at(600)), turns.counts().backwards),
            (CommandState::Requested(Turn::Right), 1)
        );
    }

    #[test]
    fn two_senders_that_want_different_things_are_noticed() {
        let mut turns = turns(500);
        for step in 0..6 {
            assert!(!turns.is_oscillating(at(step * 50)));
            turns.take(2 + u8::from(step % 2 == 1), stamp(0), now(step * 50));
        }
        // Changes from 50 to 250 ms.
        assert!(turns.is_oscillating(at(1050)) && !turns.is_oscillating(at(1051)));
        assert_eq!(turns.next_deadline(at(1000)), Some(deadline_after(at(50), Duration::from_secs(1))));
        (20..60).for_each(|step| turns.take(2, stamp(0), now(step * 50)));
        assert!(!turns.is_oscillating(at(3000)), "the same again and again");
    }

    #[test]
    fn a_clock_that_was_set_back_locks_nobody_out_for_long() {
        let mut turns = turns(3_600_000);
        turns.take(2, stamp(60_000), now(0));
        turns.take(3, stamp(1), now(1000));
        assert_eq!(turns.command_state(at(1000)), CommandState::Requested(Turn::Left));
        turns.take(3, stamp(101), now(1100));
        assert_eq!(turns.command_state(at(1100)), CommandState::Requested(Turn::Right));
    }

    #[test]
    fn what_a_sender_keeps_for_late_readers_is_not_carried_out() {
        let mut turns = turns(500);
        turns.take(2, stamp(-1), now(10));
        assert_eq!((turns.command_state(at(10)), turns.counts().stale), (CommandState::NeverReceived, 1));
        assert_eq!(
            turns.command_state(at(5000)),
            CommandState::NeverReceived,
            "nothing is held that was never used"
        );
        turns.take(3, stamp(-1), now(110));
        assert_eq!(
            (turns.command_state(at(110)), turns.counts().stale),
            (CommandState::Requested(Turn::Right), 1)
        );
    }
}
