//! What the caller hands to the session's thread, and what it sees of it.
//!
//! A report, command or emission waiting to be sent is overtaken by a newer one of the same topic. Diagnostics
//! keep their order; when `MAX_DIAGNOSTICS` wait, the oldest is dropped and counted.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::task::Wake;
use std::time::Duration;

use super::RosStatus;
use crate::core::traffic_light::emission::{Emission, LightsTopic};
use crate::io::ros::messages::{
    DiagnosticArray, HazardLightsCommand, HazardLightsReport, TurnIndicatorsCommand, TurnIndicatorsReport,
};

/// Diagnostics that may wait.
const MAX_DIAGNOSTICS: usize = 64;

/// What a report topic is to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Publication<M> {
    /// This.
    Publish(M),
    /// Nothing, not even to readers that come later.
    Withdraw,
}

/// One thing to do.
#[derive(Debug)]
pub(super) enum OutgoingMessage {
    /// Publish, or withdraw.
    Turn(Publication<TurnIndicatorsReport>),
    /// Publish, or withdraw.
    Hazard(Publication<HazardLightsReport>),
    /// Publish.
    Diagnostics(DiagnosticArray),
    /// Publish; made into messages by the thread.
    Lights(Emission),
    /// Publish.
    TurnCommand(TurnIndicatorsCommand),
    /// Publish.
    HazardCommand(HazardLightsCommand),
    /// Leave.
    Stop,
}

/// Everything that waits.
#[derive(Debug, Default)]
pub(super) struct OutgoingMessages {
    /// `None` = nothing new.
    pub(super) turn: Option<Publication<TurnIndicatorsReport>>,
    /// `None` = nothing new.
    pub(super) hazard: Option<Publication<HazardLightsReport>>,
    /// Oldest first.
    pub(super) diagnostics: VecDeque<DiagnosticArray>,
    /// The newest of each topic.
    pub(super) lights: BTreeMap<LightsTopic, Emission>,
    /// The newest.
    pub(super) turn_command: Option<TurnIndicatorsCommand>,
    /// The newest.
    pub(super) hazard_command: Option<HazardLightsCommand>,
    /// Something was received: look.
    pub(super) rung: bool,
    /// Leave after sending the rest.
    pub(super) stop: bool,
}

impl OutgoingMessages {
    fn is_empty(&self) -> bool {
        self.turn.is_none()
            && self.hazard.is_none()
            && self.diagnostics.is_empty()
            && self.lights.is_empty()
            && self.turn_command.is_none()
            && self.hazard_command.is_none()
            && !self.rung
            && !self.stop
    }
}

/// Between the caller and the thread; locks are held for moments only.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    messages: Mutex<OutgoingMessages>,
    arrived: Condvar,
    status: Mutex<RosStatus>,
}

impl Mailbox {
    /// Puts a letter in.
    pub(super) fn put(&self, letter: OutgoingMessage) {
        let mut messages = lock(&self.messages);
        match letter {
            OutgoingMessage::Turn(publication) => messages.turn = Some(publication),
            OutgoingMessage::Hazard(publication) => messages.hazard = Some(publication),
            OutgoingMessage::Diagnostics(array) => {
                if messages.diagnostics.len() >= MAX_DIAGNOSTICS {
                    messages.diagnostics.pop_front();
                    lock(&self.status).dropped_diagnostics += 1;
                }
                messages.diagnostics.push_back(array);
            }
            OutgoingMessage::Lights(emission) => {
                if messages.lights.insert(emission.topic, emission).is_some() {
                    lock(&self.status).overtaken_lights += 1;
                }
            }
            OutgoingMessage::TurnCommand(command) => messages.turn_command = Some(command),
            OutgoingMessage::HazardCommand(command) => messages.hazard_command = Some(command),
            OutgoingMessage::Stop => messages.stop = true,
        }
        self.arrived.notify_one();
    }

    /// Takes everything out; waits at most `patience` for something to arrive.
    pub(super) fn take(&self, patience: Duration) -> OutgoingMessages {
        let messages = lock(&self.messages);
        let waited = self.arrived.wait_timeout_while(messages, patience, |messages| messages.is_empty());
        let (mut messages, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut messages)
    }

    /// What the session is doing.
    pub(super) fn status(&self) -> RosStatus {
        lock(&self.status).clone()
    }

    /// Changes what the caller sees.
    pub(super) fn update_status(&self, change: impl FnOnce(&mut RosStatus)) {
        change(&mut lock(&self.status));
    }
}

/// RustDDS calls it when something was received.
impl Wake for Mailbox {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        lock(&self.messages).rung = true;
        self.arrived.notify_one();
    }
}

/// Nothing behind these locks can be left half done by a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::task::Waker;

    use super::*;
    use crate::core::diagnostics::Diagnostics;
    use crate::core::time::WallStamp;
    use crate::core::traffic_light::emission::Content;
    use crate::core::vehicle_lights::verdict::TurnIndicators;

    fn diagnostics(number: i64) -> OutgoingMessage {
        let nothing = Diagnostics { statuses: vec![], refresh: true };
        OutgoingMessage::Diagnostics(DiagnosticArray::new(&nothing, WallStamp::from_nanos(number), ""))
    }

    #[test]
    fn the_newest_report_wins_and_a_withdrawal_is_news() {
        let mailbox = Mailbox::default();
        let report = |state| TurnIndicatorsReport::new(state, WallStamp::default());
        mailbox.put(OutgoingMessage::Turn(Publication::Publish(report(TurnIndicators::EnableLeft))));
        mailbox.put(OutgoingMessage::Turn(Publication::Publish(report(TurnIndicators::EnableRight))));
        let taken = mailbox.take(Duration::ZERO);
        assert_eq!(taken.turn, Some(Publication::Publish(report(TurnIndicators::EnableRight))));
        assert_eq!(taken.hazard, None);
        mailbox.put(OutgoingMessage::Turn(Publication::Publish(report(TurnIndicators::EnableLeft))));
        mailbox.put(OutgoingMessage::Turn(Publication::Withdraw));
        assert_eq!(mailbox.take(Duration::ZERO).turn, Some(Publication::Withdraw));
        assert!(mailbox.take(Duration::ZERO).is_empty());
    }

    #[test]
    fn the_newest_emission_of_each_topic_wins_and_the_others_are_counted() {
        let mailbox = Mailbox::default();
        let emission = |topic, nanos| Emission {
            topic,
            stamp: WallStamp::from_nanos(nanos),
            content: Content::groups([]),
        };
        for (topic, nanos) in [(LightsTopic::V2i, 1), (LightsTopic::Camera, 2), (LightsTopic::V2i, 3)] {
            mailbox.put(OutgoingMessage::Lights(emission(topic, nanos)));
        }
        let taken = mailbox.take(Duration::ZERO).lights;
        let stamps: Vec<_> = taken.values().map(|emission| emission.stamp.as_nanos()).collect();
        assert_eq!(stamps, [2, 3]);
        assert_eq!(mailbox.status().overtaken_lights, 1);
    }

    #[test]
    fn a_call_wakes_and_is_forgotten_once_heard() {
        let mailbox = Arc::new(Mailbox::default());
        Waker::from(Arc::clone(&mailbox)).wake();
        assert!(mailbox.take(Duration::from_secs(60)).rung);
        assert!(mailbox.take(Duration::ZERO).is_empty());
    }

    #[test]
    fn diagnostics_keep_their_order_and_the_oldest_are_dropped_and_counted() {
        let mailbox = Mailbox::default();
        let most = u32::try_from(MAX_DIAGNOSTICS).unwrap();
        for number in 0..most + 2 {
            mailbox.put(diagnostics(number.into()));
        }
        let taken = mailbox.take(Duration::ZERO).diagnostics;
        let numbers: Vec<u32> = taken.iter().map(|array| array.header.stamp.nanosec).collect();
        assert_eq!(numbers, (2..most + 2).collect::<Vec<_>>());
        assert_eq!(mailbox.status().dropped_diagnostics, 2);
    }
}
