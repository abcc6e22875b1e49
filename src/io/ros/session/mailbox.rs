//! Messages from the caller to the session's thread, and the status that the thread shows.
//!
//! A report, command or emission that waits to be sent is replaced by a newer one of the same topic. Diagnostics keep
//! their order; when `MAX_DIAGNOSTICS` wait, the oldest is dropped.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use super::status::RosStatus;
use crate::core::time::WallStamp;
use crate::core::traffic_light::emission::{Emission, LightsTopic};
use crate::core::turn_signal::decision::Decision;
use crate::core::vehicle_lights::report::Step;
use crate::io::ros::messages::{
    DiagnosticArray, HazardLightsCommand, HazardLightsReport, TurnIndicatorsCommand, TurnIndicatorsReport,
};

/// Diagnostics that may wait.
const MAX_DIAGNOSTICS: usize = 64;

/// An instruction for a report topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Publication<M> {
    /// Publish this message.
    Publish(M),
    /// Publish nothing, not even to late readers.
    Withdraw,
}

impl<M> Publication<M> {
    /// The publication of a step, as the message of its value.
    pub(super) fn of<T>(step: Step<T>, message: impl FnOnce(T, WallStamp) -> M) -> Self {
        match step {
            Step::Publish(value, stamp) => Self::Publish(message(value, stamp)),
            Step::Withdraw => Self::Withdraw,
        }
    }
}

/// A message for a topic, or the end.
#[derive(Debug)]
pub(super) enum OutgoingMessage {
    /// For the turn-indicators report.
    Turn(Publication<TurnIndicatorsReport>),
    /// For the hazard-lights report.
    Hazard(Publication<HazardLightsReport>),
    /// For the diagnostics.
    Diagnostics(DiagnosticArray),
    /// For the topics of its emissions; the thread makes the messages.
    Lights(Emission),
    /// For the turn command.
    TurnCommand(TurnIndicatorsCommand),
    /// For the hazard command.
    HazardCommand(HazardLightsCommand),
    /// For the topics of the decider's sections; the thread makes the messages.
    Sections(Arc<Decision>, WallStamp),
    /// Leave the graph.
    Stop,
}

/// Everything that waits.
#[derive(Debug, Default, PartialEq)]
pub(super) struct OutgoingMessages {
    /// The newest turn report, if there is a new one.
    pub(super) turn: Option<Publication<TurnIndicatorsReport>>,
    /// The newest hazard report, likewise.
    pub(super) hazard: Option<Publication<HazardLightsReport>>,
    /// Diagnostics, oldest first.
    pub(super) diagnostics: VecDeque<DiagnosticArray>,
    /// The newest emission of each topic.
    pub(super) lights: BTreeMap<LightsTopic, Emission>,
    /// The newest turn command.
    pub(super) turn_command: Option<TurnIndicatorsCommand>,
    /// The newest hazard command.
    pub(super) hazard_command: Option<HazardLightsCommand>,
    /// The newest decision with its sections, and its time.
    pub(super) sections: Option<(Arc<Decision>, WallStamp)>,
    /// Leave the graph after sending the rest.
    pub(super) stop: bool,
}

/// Between the caller and the thread; locks are held for moments only.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    messages: Mutex<OutgoingMessages>,
    arrived: Notify,
    status: Mutex<RosStatus>,
}

impl Mailbox {
    /// Adds a message; never blocks.
    pub(super) fn put(&self, message: OutgoingMessage) {
        let mut messages = lock(&self.messages);
        match message {
            OutgoingMessage::Turn(publication) => messages.turn = Some(publication),
            OutgoingMessage::Hazard(publication) => messages.hazard = Some(publication),
            OutgoingMessage::Diagnostics(array) => {
                if messages.diagnostics.len() >= MAX_DIAGNOSTICS {
                    messages.diagnostics.pop_front();
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
            OutgoingMessage::Sections(decision, stamp) => messages.sections = Some((decision, stamp)),
            OutgoingMessage::Stop => messages.stop = true,
        }
        self.arrived.notify_one();
    }

    /// Waits for something to arrive since the last wait. Cancellation loses nothing.
    pub(super) async fn arrived(&self) {
        self.arrived.notified().await;
    }

    /// Takes everything out.
    pub(super) fn take(&self) -> OutgoingMessages {
        std::mem::take(&mut lock(&self.messages))
    }

    /// True while a stop waits.
    pub(super) fn is_stopping(&self) -> bool {
        lock(&self.messages).stop
    }

    /// State and counts of the session.
    pub(super) fn status(&self) -> RosStatus {
        lock(&self.status).clone()
    }

    /// Changes the status that the caller sees.
    pub(super) fn update_status(&self, change: impl FnOnce(&mut RosStatus)) {
        change(&mut lock(&self.status));
    }
}

/// Nothing behind these locks can be left half done by a panic.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::diagnostics::Diagnostics;
    use crate::core::traffic_light::emission::Content;
    use crate::core::vehicle_lights::verdict::TurnIndicators;

    fn diagnostics(number: i64) -> OutgoingMessage {
        let nothing = Diagnostics { statuses: vec![], refresh: true };
        OutgoingMessage::Diagnostics(DiagnosticArray::new(&nothing, WallStamp::from_nanos(number), ""))
    }

    #[test]
    fn the_newest_report_or_withdrawal_replaces_what_waits() {
        let mailbox = Mailbox::default();
        let report = |state| TurnIndicatorsReport::new(state, WallStamp::default());
        mailbox.put(OutgoingMessage::Turn(Publication::Publish(report(TurnIndicators::EnableLeft))));
        mailbox.put(OutgoingMessage::Turn(Publication::Publish(report(TurnIndicators::EnableRight))));
        let taken = mailbox.take();
        assert_eq!(taken.turn, Some(Publication::Publish(report(TurnIndicators::EnableRight))));
        assert_eq!(taken.hazard, None);
        mailbox.put(OutgoingMessage::Turn(Publication::Publish(report(TurnIndicators::EnableLeft))));
        mailbox.put(OutgoingMessage::Turn(Publication::Withdraw));
        assert_eq!(mailbox.take().turn, Some(Publication::Withdraw));
        assert_eq!(mailbox.take(), OutgoingMessages::default());
    }

    #[test]
    fn the_newest_emission_of_each_topic_replaces_the_others_which_are_counted() {
        let mailbox = Mailbox::default();
        let emission = |topic, nanos| Emission {
            topic,
            stamp: WallStamp::from_nanos(nanos),
            content: Content::groups([]),
        };
        for (topic, nanos) in [(LightsTopic::V2i, 1), (LightsTopic::Camera, 2), (LightsTopic::V2i, 3)] {
            mailbox.put(OutgoingMessage::Lights(emission(topic, nanos)));
        }
        let taken = mailbox.take().lights;
        let stamps: Vec<_> = taken.values().map(|emission| emission.stamp.as_nanos()).collect();
        assert_eq!(stamps, [2, 3]);
        assert_eq!(mailbox.status().overtaken_lights, 1);
    }

    #[tokio::test]
    async fn a_message_ends_the_wait_also_when_it_came_before() {
        let mailbox = Mailbox::default();
        mailbox.put(OutgoingMessage::Stop);
        mailbox.arrived().await;
        assert!(mailbox.take().stop);
    }

    #[test]
    fn diagnostics_keep_their_order_and_the_oldest_are_dropped() {
        let mailbox = Mailbox::default();
        let most = u32::try_from(MAX_DIAGNOSTICS).unwrap();
        for number in 0..most + 2 {
            mailbox.put(diagnostics(number.into()));
        }
        let taken = mailbox.take().diagnostics;
        let numbers: Vec<u32> = taken.iter().map(|array| array.header.stamp.nanosec).collect();
        assert_eq!(numbers, (2..most + 2).collect::<Vec<_>>());
    }
}
