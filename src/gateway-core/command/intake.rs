//! Messages of one command topic: decides which of them are used, and what the sender currently requests.

use std::collections::VecDeque;
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Turn;
use super::feedback_monitor::Lights;
use super::origin::CommandOrigin;
use super::stale_message_filter::{StaleMessageFilter, Untimely};
use gateway_base::time::{MonoTime, Now, WallStamp, deadline_after};
use turn_signal::light_command::{EnumOrUnknown, HazardCommand, TurnCommand};

const UNDEFINED_SHOWN: Duration = Duration::from_secs(1);
/// Number of changes within a time span that indicates more than one sender.
const OSCILLATION: (usize, Duration) = (5, Duration::from_secs(1));

/// State that a command requests; `None` for `NO_COMMAND`. The error is the number of an undefined command.
pub type ReceivedRequest<T> = Result<Option<T>, u8>;

/// Returns the request of a turn command.
pub fn turn_request(command: EnumOrUnknown<TurnCommand>) -> ReceivedRequest<Turn> {
    Ok(match command {
        EnumOrUnknown::Known(TurnCommand::NoCommand) => None,
        EnumOrUnknown::Known(TurnCommand::Disable) => Some(Turn::Off),
        EnumOrUnknown::Known(TurnCommand::Left) => Some(Turn::Left),
        EnumOrUnknown::Known(TurnCommand::Right) => Some(Turn::Right),
        EnumOrUnknown::Unknown(number) => return Err(number),
    })
}

/// Returns the request of a hazard command, `true` = on.
pub fn hazard_request(command: EnumOrUnknown<HazardCommand>) -> ReceivedRequest<bool> {
    Ok(match command {
        EnumOrUnknown::Known(HazardCommand::NoCommand) => None,
        EnumOrUnknown::Known(HazardCommand::Disable) => Some(false),
        EnumOrUnknown::Known(HazardCommand::Enable) => Some(true),
        EnumOrUnknown::Unknown(number) => return Err(number),
    })
}

/// Current command of a sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CommandState<T> {
    /// Nothing has been received since start.
    #[default]
    NeverReceived,
    /// The sender sends `NO_COMMAND`, and its earlier request has timed out.
    NoCommand,
    /// The sender requests this state.
    Requested(T),
    /// Nothing has been received for longer than the timeout. The content is the last request, or `None`
    /// after `NO_COMMAND`.
    TimedOut(Option<T>),
}

/// The latest command as it is shown: a value, or why there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum LatestCommand {
    /// None since start.
    Never,
    /// The sender requests nothing.
    NothingRequested,
    /// Its timeout has passed.
    Silent,
    Off,
    Left,
    Right,
    On,
}

/// Number of messages since start, by outcome.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct IntakeCounts {
    /// Messages received from all writers.
    pub received: u64,
    /// Messages with `NO_COMMAND` that were used.
    pub no_command: u64,
    /// Messages with an undefined number.
    pub undefined: u64,
    /// Messages received after a later message of the same writer.
    pub overtaken: u64,
    /// Stale messages. They are shown only by this count, since an active sender soon sends again.
    pub stale: u64,
}

/// State of one command topic, with all its writers.
#[derive(Debug, Clone)]
pub struct Intake<T> {
    timeout: Duration,
    /// Last request with the latest time at which it was received.
    requested: Option<(T, MonoTime)>,
    last_used: Option<MonoTime>,
    undefined: Option<(u8, MonoTime)>,
    /// Times of the latest changes of the request, oldest first.
    changes: VecDeque<MonoTime>,
    stale_filter: StaleMessageFilter,
    /// Number of messages since start, by outcome.
    pub counts: IntakeCounts,
}

impl<T: Lights> Intake<T> {
    /// Creates the state of a topic subscribed to since `started`; its sender times out after `timeout`
    /// without a message.
    pub fn new(timeout: Duration, started: WallStamp) -> Self {
        Self {
            timeout,
            requested: None,
            last_used: None,
            undefined: None,
            changes: VecDeque::new(),
            stale_filter: StaleMessageFilter::new(started, timeout),
            counts: IntakeCounts::default(),
        }
    }

    /// Handles a message. Commands of all writers count in the order of reception. A stale or overtaken
    /// message is only counted; for hazard lights on, stamps are ignored.
    pub fn handle_command(
        &mut self,
        request: ReceivedRequest<T>,
        origin: CommandOrigin,
        stamp: WallStamp,
        now: Now,
    ) {
        let mono = now.mono;
        self.counts.received += 1;
        let request = match request {
            Ok(request) => request,
            Err(number) => {
                self.counts.undefined += 1;
                self.undefined = Some((number, mono));
                return;
            }
        };
        if let CommandOrigin::Topic(sample) = origin {
            let ignores_stamp = T::IS_HAZARD && request.is_some_and(Lights::is_lit);
            if let Err(untimely) = self.stale_filter.check(sample, stamp, ignores_stamp, now) {
                match untimely {
                    Untimely::Overtaken => self.counts.overtaken += 1,
                    Untimely::Stale => self.counts.stale += 1,
                }
                return;
            }
        }
        self.last_used = Some(mono);
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

    /// Returns true if the request changes faster than a single sender would change it.
    pub fn is_oscillating(&self, now: MonoTime) -> bool {
        self.changes.len() == OSCILLATION.0
            && self.changes.front().is_some_and(|at| now.since(*at) <= OSCILLATION.1)
    }

    /// Returns the current command of the sender. `NO_COMMAND` does not cancel a request, which holds until
    /// its own timeout even if the sender falls silent.
    pub fn command_state(&self, now: MonoTime) -> CommandState<T> {
        let Some(last_used) = self.last_used else { return CommandState::NeverReceived };
        let last = self.requested.filter(|(_, at)| *at == last_used).map(|(requested, _)| requested);
        match self.requested {
            Some((requested, at)) if now.since(at) <= self.timeout => CommandState::Requested(requested),
            Some(_) | None if now.since(last_used) <= self.timeout => CommandState::NoCommand,
            Some(_) | None => CommandState::TimedOut(last),
        }
    }

    /// Returns the undefined number of a command within the last second.
    pub fn undefined_number(&self, now: MonoTime) -> Option<u8> {
        self.undefined.filter(|(_, at)| now.since(*at) <= UNDEFINED_SHOWN).map(|(number, _)| number)
    }

    /// Returns the time since the last message that was used; `None` before the first message.
    pub fn age(&self, now: MonoTime) -> Option<Duration> {
        self.last_used.map(|at| now.since(at))
    }

    /// Returns the time at which command state, undefined number or oscillation changes without another
    /// message.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let requested = self.requested.map(|(_, at)| deadline_after(at, self.timeout));
        let last_used = self.last_used.map(|at| deadline_after(at, self.timeout));
        let undefined = self.undefined.map(|(_, at)| deadline_after(at, UNDEFINED_SHOWN));
        let oscillating = self
            .changes
            .front()
            .filter(|_| self.is_oscillating(now))
            .map(|at| deadline_after(*at, OSCILLATION.1));
        [requested, last_used, undefined, oscillating].into_iter().flatten().filter(|at| *at > now).min()
    }
}

/// Merges the hazard commands of topic and decider: the topic's command applies, unless it requests nothing
/// or the decider requests on. A silent decider has no effect.
pub fn merged_hazard(topic: CommandState<bool>, decider: CommandState<bool>) -> CommandState<bool> {
    match (topic, decider) {
        (_, CommandState::Requested(true))
        | (
            CommandState::NeverReceived | CommandState::NoCommand,
            CommandState::NoCommand | CommandState::Requested(false),
        ) => decider,
        _ => topic,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::origin::{SampleId, WriterId};

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

    /// Handles a turn command of one writer, whose sequence numbers are the receive times.
    fn take(turns: &mut Intake<Turn>, number: u8, stamp_ms: i64, ms: u64) {
        let sample = SampleId { writer: WriterId::default(), sequence: i64::try_from(ms).unwrap() };
        let command = EnumOrUnknown::<TurnCommand>::from(number);
        turns.handle_command(turn_request(command), CommandOrigin::Topic(sample), stamp(stamp_ms), now(ms));
    }

    #[test]
    fn no_command_takes_nothing_back_and_is_no_error() {
        let mut turns = turns(500);
        assert_eq!(turns.command_state(at(0)), CommandState::NeverReceived);
        take(&mut turns, 0, 0, 0);
        assert_eq!(turns.command_state(at(0)), CommandState::NoCommand);
        take(&mut turns, 2, 100, 100);
        take(&mut turns, 0, 200, 200);
        take(&mut turns, 0, 600, 600);
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
        assert_eq!((turns.counts.no_command, turns.undefined_number(at(600))), (3, None));
    }

    #[test]
    fn undefined_values_are_ignored_and_shown_for_a_while() {
        let mut turns = turns(5000);
        take(&mut turns, 3, 0, 0);
        for raw in 4..=u8::MAX {
            take(&mut turns, raw, 10, 10);
            assert_eq!(turns.command_state(at(10)), CommandState::Requested(Turn::Right), "{raw}");
            assert_eq!(turns.undefined_number(at(1010)), Some(raw));
        }
        assert_eq!((turns.counts.undefined, turns.undefined_number(at(1011))), (252, None));
    }

    #[test]
    fn stamps_that_go_backwards_or_ahead_are_followed() {
        let mut turns = turns(500);
        take(&mut turns, 2, 0, 0);
        for (step, stamp_ms) in (1..).zip([1_000_000_000, -5_000, 100, i64::MIN / 1_000_000]) {
            let number = 2 + u8::from(step % 2 == 1);
            take(&mut turns, number, stamp_ms, step * 100);
            let side = if number == 2 { Turn::Left } else { Turn::Right };
            assert_eq!(turns.command_state(at(step * 100)), CommandState::Requested(side), "{stamp_ms}");
        }
        assert_eq!((turns.counts.overtaken, turns.counts.stale), (0, 0));
    }

    #[test]
    fn an_earlier_message_does_not_replace_a_later_one_of_the_same_writer() {
        let mut turns = turns(500);
        take(&mut turns, 2, 0, 100);
        let sample = SampleId { writer: WriterId::default(), sequence: 99 };
        let command = EnumOrUnknown::Known(TurnCommand::Right);
        turns.handle_command(turn_request(command), CommandOrigin::Topic(sample), stamp(0), now(110));
        assert_eq!(turns.command_state(at(110)), CommandState::Requested(Turn::Left));
        assert_eq!(turns.counts.overtaken, 1);
    }

    #[test]
    fn hazard_lights_on_are_requested_whatever_the_stamp() {
        let mut hazard = Intake::new(Duration::from_millis(500), stamp(0));
        for (writer, command, stamp_ms, requested) in
            [(1, HazardCommand::Disable, -1, None), (2, HazardCommand::Enable, -1_000_000, Some(true))]
        {
            let sample = SampleId { writer: WriterId([writer; 16]), sequence: 1 };
            let command = EnumOrUnknown::Known(command);
            hazard.handle_command(
                hazard_request(command),
                CommandOrigin::Topic(sample),
                stamp(stamp_ms),
                now(10),
            );
            let state = requested.map_or(CommandState::NeverReceived, CommandState::Requested);
            assert_eq!(hazard.command_state(at(10)), state);
        }
    }

    #[test]
    fn two_senders_with_different_requests_are_noticed() {
        let mut turns = turns(500);
        for step in 0..6 {
            assert!(!turns.is_oscillating(at(step * 50)));
            take(&mut turns, 2 + u8::from(step % 2 == 1), 0, step * 50);
        }
        // Changes from 50 to 250 ms.
        assert!(turns.is_oscillating(at(1050)) && !turns.is_oscillating(at(1051)));
        assert_eq!(turns.next_deadline(at(1000)), Some(deadline_after(at(50), Duration::from_secs(1))));
        (20..60).for_each(|step| take(&mut turns, 2, 0, step * 50));
        assert!(!turns.is_oscillating(at(3000)), "the same again and again");
    }

    #[test]
    fn what_a_sender_keeps_for_late_readers_is_not_carried_out() {
        let mut turns = turns(500);
        take(&mut turns, 2, -1, 10);
        assert_eq!((turns.command_state(at(10)), turns.counts.stale), (CommandState::NeverReceived, 1));
        assert_eq!(
            turns.command_state(at(5000)),
            CommandState::NeverReceived,
            "nothing is held that was never used"
        );
        take(&mut turns, 3, -1, 110);
        assert_eq!(
            (turns.command_state(at(110)), turns.counts.stale),
            (CommandState::Requested(Turn::Right), 1)
        );
    }
}
