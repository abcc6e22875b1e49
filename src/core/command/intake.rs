//! One command topic: which of its messages are used, and what its sender requests now.

use std::collections::VecDeque;
use std::time::Duration;

use super::Turn;
use super::stale_message_filter::StaleMessageFilter;
use crate::core::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};
use crate::core::time::{MonoTime, Now, WallStamp, deadline_after};

/// The time for which a refused message is shown.
const REFUSAL_SHOWN: Duration = Duration::from_secs(1);
/// So many changes of the request within so long come from more than one sender, as a rule.
const OSCILLATION: (usize, Duration) = (5, Duration::from_secs(1));
/// The longest time for which a stamp rejects earlier ones: a sender whose clock was set back is accepted
/// again, however long its commands hold.
const MAX_STAMP_MEMORY: Duration = Duration::from_secs(1);

/// The request in a command; `None` for `NO_COMMAND`.
impl From<TurnCommand> for Option<Turn> {
    fn from(command: TurnCommand) -> Self {
        match command {
            TurnCommand::NoCommand => None,
            TurnCommand::Disable => Some(Turn::Off),
            TurnCommand::Left => Some(Turn::Left),
            TurnCommand::Right => Some(Turn::Right),
        }
    }
}

/// The request in a command, `true` = on; `None` for `NO_COMMAND`.
impl From<HazardCommand> for Option<bool> {
    fn from(command: HazardCommand) -> Self {
        match command {
            HazardCommand::NoCommand => None,
            HazardCommand::Disable => Some(false),
            HazardCommand::Enable => Some(true),
        }
    }
}

/// The present command of a sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CommandState<T> {
    /// Nothing has been received since start.
    #[default]
    NeverReceived,
    /// The sender sends `NO_COMMAND`, and its request before has timed out.
    NoCommand,
    /// It requests this.
    Requested(T),
    /// Nothing has been received for longer than the limit; the last message requested this, or was
    /// `NO_COMMAND`.
    TimedOut(Option<T>),
}

/// Why a message was not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// The number stands for no command.
    Undefined(u8),
    /// The stamp lies before that of a message used earlier.
    NonMonotonicStamp,
}

/// Messages since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IntakeCounts {
    /// All messages.
    pub received: u64,
    /// Those with `NO_COMMAND` that were used.
    pub no_command: u64,
    /// Those with an undefined number.
    pub undefined: u64,
    /// Those whose stamp lies before that of an earlier message.
    pub non_monotonic: u64,
    /// Stale ones. No refusal is shown for them: a sender that is alive sends again at once, and one that is
    /// not has no effect.
    pub stale: u64,
}

/// One topic.
#[derive(Debug, Clone)]
pub struct Intake<T> {
    timeout: Duration,
    /// The last request, and when it was received last.
    requested: Option<(T, MonoTime)>,
    /// The last message that was used: when it was received, and its stamp in ns.
    last_used: Option<(MonoTime, i64)>,
    refused: Option<(Refusal, MonoTime)>,
    /// When the request changed last, the oldest change first.
    changes: VecDeque<MonoTime>,
    stale_filter: StaleMessageFilter,
    counts: IntakeCounts,
}

impl<T: Copy + PartialEq> Intake<T> {
    /// A topic that is subscribed to since `started`, and whose sender has timed out after more than `timeout`
    /// without a message.
    pub fn new(timeout: Duration, started: WallStamp) -> Self {
        Self {
            timeout,
            requested: None,
            last_used: None,
            refused: None,
            changes: VecDeque::new(),
            stale_filter: StaleMessageFilter::before(started),
            counts: IntakeCounts::default(),
        }
    }

    /// Takes a message. The stamps of an active sender are only compared with each other. One that was silent,
    /// and so perhaps restarted with another clock, begins afresh; but its first message may be stale.
    pub fn handle_command(
        &mut self,
        command: EnumOrUnknown<impl Into<Option<T>>>,
        stamp: WallStamp,
        now: Now,
    ) {
        let mono = now.mono;
        self.counts.received += 1;
        let request = match command {
            EnumOrUnknown::Known(command) => command.into(),
            EnumOrUnknown::Unknown(number) => {
                self.counts.undefined += 1;
                self.refused = Some((Refusal::Undefined(number), mono));
                return;
            }
        };
        let used_within = |limit| self.last_used.filter(|(at, _)| mono.since(*at) <= limit);
        let newest = used_within(self.timeout.min(MAX_STAMP_MEMORY)).map(|(_, newest)| newest);
        let is_active = used_within(self.timeout).is_some();
        if newest.is_some_and(|newest| stamp.as_nanos() < newest) {
            self.counts.non_monotonic += 1;
            self.refused = Some((Refusal::NonMonotonicStamp, mono));
            return;
        }
        if self.stale_filter.rejects_as_stale(is_active, stamp, self.timeout, now) {
            self.counts.stale += 1;
            return;
        }
        self.last_used = Some((mono, stamp.as_nanos()));
        match request {
            None => self.counts.no_command += 1,
            Some(requested) => {
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

    /// True if the request changes faster than one sender would change it.
    pub fn is_oscillating(&self, now: MonoTime) -> bool {
        self.changes.len() == OSCILLATION.0
            && self.changes.front().is_some_and(|at| now.since(*at) <= OSCILLATION.1)
    }

    /// The present command of the sender. `NO_COMMAND` takes no request back: it holds until its own timeout, but no
    /// longer, also when the sender falls silent.
    pub fn command_state(&self, now: MonoTime) -> CommandState<T> {
        let Some((last_used, _)) = self.last_used else { return CommandState::NeverReceived };
        let last = self.requested.filter(|(_, at)| *at == last_used).map(|(requested, _)| requested);
        match self.requested {
            Some((requested, at)) if now.since(at) <= self.timeout => CommandState::Requested(requested),
            Some(_) | None if now.since(last_used) <= self.timeout => CommandState::NoCommand,
            Some(_) | None => CommandState::TimedOut(last),
        }
    }

    /// Why the last refused message was not used, for a second after it.
    pub fn refusal(&self, now: MonoTime) -> Option<Refusal> {
        self.refused.filter(|(_, at)| now.since(*at) <= REFUSAL_SHOWN).map(|(refusal, _)| refusal)
    }

    /// Messages since start.
    pub fn counts(&self) -> IntakeCounts {
        self.counts
    }

    /// The time since the last message that was used; `None` before the first.
    pub fn age(&self, now: MonoTime) -> Option<Duration> {
        self.last_used.map(|(at, _)| now.since(at))
    }

    /// When command state, refusal or oscillation change without another message.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let requested = self.requested.map(|(_, at)| deadline_after(at, self.timeout));
        let last_used = self.last_used.map(|(at, _)| deadline_after(at, self.timeout));
        let refused = self.refused.map(|(_, at)| deadline_after(at, REFUSAL_SHOWN));
        let oscillating = self
            .changes
            .front()
            .filter(|_| self.is_oscillating(now))
            .map(|at| deadline_after(*at, OSCILLATION.1));
        [requested, last_used, refused, oscillating].into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// The command state of two senders on the hazard lights: the topic's, unless it requests nothing, or the
/// decider requests on. A decider that is silent or never sent anything changes nothing.
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
        Intake::new(Duration::from_millis(limit_ms), stamp(0))
    }

    fn turn(number: u8) -> EnumOrUnknown<TurnCommand> {
        number.into()
    }

    #[test]
    fn no_command_takes_nothing_back_and_is_no_error() {
        let mut turns = turns(500);
        assert_eq!(turns.command_state(at(0)), CommandState::NeverReceived);
        turns.handle_command(turn(0), stamp(0), now(0));
        assert_eq!(turns.command_state(at(0)), CommandState::NoCommand);
        turns.handle_command(turn(2), stamp(100), now(100));
        turns.handle_command(turn(0), stamp(200), now(200));
        turns.handle_command(turn(0), stamp(600), now(600));
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
        turns.handle_command(turn(3), stamp(0), now(0));
        for raw in 4..=u8::MAX {
            turns.handle_command(turn(raw), stamp(10), now(10));
            assert_eq!(turns.command_state(at(10)), CommandState::Requested(Turn::Right), "{raw}");
            assert_eq!(turns.refusal(at(1010)), Some(Refusal::Undefined(raw)));
        }
        assert_eq!((turns.counts().undefined, turns.refusal(at(1011))), (252, None));
    }

    #[test]
    fn stamps_that_go_backwards_are_rejected_until_the_sender_was_silent() {
        let mut turns = turns(500);
        turns.handle_command(turn(2), stamp(1000), now(0));
        turns.handle_command(turn(2), stamp(1000), now(10));
        assert_eq!(turns.refusal(at(10)), None, "the same stamp again is not a step back");
        turns.handle_command(turn(3), stamp(999), now(100));
        assert_eq!(turns.command_state(at(100)), CommandState::Requested(Turn::Left));
        assert_eq!(turns.refusal(at(100)), Some(Refusal::NonMonotonicStamp));
        turns.handle_command(turn(3), stamp(105), now(600));
        assert_eq!(
            (turns.command_state(at(600)), turns.counts().non_monotonic),
            (CommandState::Requested(Turn::Right), 1)
        );
    }

    #[test]
    fn two_senders_with_different_requests_are_noticed() {
        let mut turns = turns(500);
        for step in 0..6 {
            assert!(!turns.is_oscillating(at(step * 50)));
            turns.handle_command(turn(2 + u8::from(step % 2 == 1)), stamp(0), now(step * 50));
        }
        // Changes from 50 to 250 ms.
        assert!(turns.is_oscillating(at(1050)) && !turns.is_oscillating(at(1051)));
        assert_eq!(turns.next_deadline(at(1000)), Some(deadline_after(at(50), Duration::from_secs(1))));
        (20..60).for_each(|step| turns.handle_command(turn(2), stamp(0), now(step * 50)));
        assert!(!turns.is_oscillating(at(3000)), "the same again and again");
    }

    #[test]
    fn a_clock_that_was_set_back_locks_nobody_out_for_long() {
        let mut turns = turns(3_600_000);
        turns.handle_command(turn(2), stamp(60_000), now(0));
        turns.handle_command(turn(3), stamp(1), now(1000));
        assert_eq!(turns.command_state(at(1000)), CommandState::Requested(Turn::Left));
        turns.handle_command(turn(3), stamp(101), now(1100));
        assert_eq!(turns.command_state(at(1100)), CommandState::Requested(Turn::Right));
    }

    #[test]
    fn what_a_sender_keeps_for_late_readers_is_not_carried_out() {
        let mut turns = turns(500);
        turns.handle_command(turn(2), stamp(-1), now(10));
        assert_eq!((turns.command_state(at(10)), turns.counts().stale), (CommandState::NeverReceived, 1));
        assert_eq!(
            turns.command_state(at(5000)),
            CommandState::NeverReceived,
            "nothing is held that was never used"
        );
        turns.handle_command(turn(3), stamp(-1), now(110));
        assert_eq!(
            (turns.command_state(at(110)), turns.counts().stale),
            (CommandState::Requested(Turn::Right), 1)
        );
    }
}
