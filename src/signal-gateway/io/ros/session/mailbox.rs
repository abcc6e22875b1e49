//! Messages from the caller to the session's thread, and the thread's status for the caller.

use std::sync::Mutex;

use tokio::sync::Notify;

use super::status::RosStatus;
use crate::io::lock::lock;
use crate::io::ros::outgoing::messages::OutgoingMessages;
use gateway_core::gateway::event::Output;
use ros_transport::parameters::Parameters;

/// Shared by the caller and the thread. Locks are held only briefly.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    messages: Mutex<OutgoingMessages>,
    arrived: Notify,
    status: Mutex<RosStatus>,
}

impl Mailbox {
    /// Adds the messages of an output. Never blocks.
    pub(super) fn put(&self, output: &Output, hardware_id: &str) {
        if lock(&self.messages).put(output, hardware_id) {
            lock(&self.status).overtaken_lights += 1;
        }
        self.arrived.notify_one();
    }

    /// Replaces the parameters of the node.
    pub(super) fn put_parameters(&self, parameters: Parameters) {
        lock(&self.messages).parameters = Some(Box::new(parameters));
        self.arrived.notify_one();
    }

    /// Requests that the session sends the waiting messages and ends.
    pub(super) fn stop(&self) {
        lock(&self.messages).stop = true;
        self.arrived.notify_one();
    }

    /// Waits until something has arrived since the last wait. Cancel safe.
    pub(super) async fn arrived(&self) {
        self.arrived.notified().await;
    }

    /// Removes and returns all waiting messages.
    pub(super) fn take(&self) -> OutgoingMessages {
        std::mem::take(&mut lock(&self.messages))
    }

    /// Returns true while a stop is pending.
    pub(super) fn is_stopping(&self) -> bool {
        lock(&self.messages).stop
    }

    /// Returns state and counts of the session.
    pub(super) fn status(&self) -> RosStatus {
        lock(&self.status).clone()
    }

    /// Changes or reads the status that the caller sees.
    pub(super) fn update_status<T>(&self, change: impl FnOnce(&mut RosStatus) -> T) -> T {
        change(&mut lock(&self.status))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ros::topics::OutgoingTopic;
    use gateway_base::diagnostics::Diagnostics;
    use gateway_base::time::WallStamp;
    use gateway_core::vehicle_lights::output::VehicleLightsOutput;
    use gateway_core::vehicle_lights::verdict::TurnIndicators;
    use gateway_core::vehicle_report::Step;
    use traffic_lights::emission::{Emission, LightsContent, LightsTopic};
    use traffic_lights::output::TrafficLightOutput;

    impl Mailbox {
        fn put_all(&self, outputs: impl IntoIterator<Item = Output>) {
            outputs.into_iter().for_each(|output| self.put(&output, ""));
        }
    }

    /// Returns the messages that wait for a topic, oldest first.
    fn waiting(messages: &OutgoingMessages, topic: OutgoingTopic) -> Vec<String> {
        messages.topics.get(&topic).into_iter().flatten().map(|waiting| format!("{waiting:?}")).collect()
    }

    #[test]
    fn the_newest_report_or_withdrawal_replaces_what_waits() {
        let mailbox = Mailbox::default();
        let turn = |step| Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step));
        let report = |state| turn(Step::Publish(state, WallStamp::default()));
        mailbox.put_all([report(TurnIndicators::EnableLeft), report(TurnIndicators::EnableRight)]);
        let taken = mailbox.take();
        let right = r#"Publish({"stamp":{"sec":0,"nanosec":0},"report":3})"#;
        assert_eq!(waiting(&taken, OutgoingTopic::TurnIndicatorsReport), [right]);
        assert_eq!(waiting(&taken, OutgoingTopic::HazardLightsReport), [""; 0]);
        mailbox.put_all([report(TurnIndicators::EnableLeft), turn(Step::Withdraw)]);
        assert_eq!(waiting(&mailbox.take(), OutgoingTopic::TurnIndicatorsReport), ["Withdraw"]);
        assert!(mailbox.take().is_empty());
    }

    #[test]
    fn the_newest_emission_of_each_topic_replaces_the_others_which_are_counted() {
        let mailbox = Mailbox::default();
        let emission = |(topic, nanos)| {
            let (stamp, content) = (WallStamp::from_nanos(nanos), LightsContent::groups([]));
            Output::TrafficLights(TrafficLightOutput::Publish(Emission { topic, stamp, content }))
        };
        let emissions = [(LightsTopic::V2i, 1), (LightsTopic::Camera, 2), (LightsTopic::V2i, 3)];
        mailbox.put_all(emissions.map(emission));
        let taken = mailbox.take().lights;
        let stamps: Vec<_> = taken.values().map(|emission| emission.stamp.as_nanos()).collect();
        assert_eq!(stamps, [2, 3]);
        assert_eq!(mailbox.status().overtaken_lights, 1);
    }

    #[tokio::test]
    async fn a_message_ends_the_wait_also_when_it_came_before() {
        let mailbox = Mailbox::default();
        mailbox.stop();
        mailbox.arrived().await;
        assert!(mailbox.take().stop);
    }

    #[test]
    fn diagnostics_keep_their_order_and_the_oldest_are_dropped() {
        let mailbox = Mailbox::default();
        let diagnostics = |number| Output::Diagnostics {
            diagnostics: Diagnostics { node: "gw".to_owned(), statuses: vec![], refresh: true },
            stamp: WallStamp::from_nanos(number),
        };
        let most = i64::try_from(OutgoingTopic::Diagnostics.row().max_waiting).unwrap();
        mailbox.put_all((0..most + 2).map(diagnostics));
        let waiting = waiting(&mailbox.take(), OutgoingTopic::Diagnostics);
        let expected = |number| {
            format!(
                r#"Publish({{"header":{{"stamp":{{"sec":0,"nanosec":{number}}},"frame_id":""}},"status":[]}})"#
            )
        };
        assert_eq!(waiting, (2..most + 2).map(expected).collect::<Vec<_>>());
    }
}
