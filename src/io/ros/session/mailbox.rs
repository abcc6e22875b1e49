//! Messages from the caller to the session's thread, and the status that the thread shows.
//!
//! A report, command or emission that waits to be sent is replaced by a newer one of the same topic. Diagnostics keep
//! their order; when `MAX_DIAGNOSTICS` wait, the oldest is dropped.

use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use super::status::RosStatus;
use crate::io::ros::outgoing::messages::{OutgoingMessage, OutgoingMessages};

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
        if lock(&self.messages).put(message) {
            lock(&self.status).overtaken_lights += 1;
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
    use crate::core::time::WallStamp;
    use crate::core::traffic_light::emission::{Emission, LightsContent, LightsTopic};
    use crate::core::vehicle_lights::verdict::TurnIndicators;
    use crate::io::ros::messages::autoware_vehicle_msgs::TurnIndicatorsReport;
    use crate::io::ros::messages::diagnostic_msgs::DiagnosticArray;
    use crate::io::ros::outgoing::messages::{MAX_DIAGNOSTICS, Publication};

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
            content: LightsContent::groups([]),
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
