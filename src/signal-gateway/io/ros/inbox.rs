//! The queue of received ROS 2 messages on their way to the gateway.
//!
//! The inbox is bounded. A waiting state is replaced by a newer state of the same subscription, and so is a
//! command for the vehicle, since its sender repeats it. Text commands keep their order; when `MAX_COMMANDS`
//! wait, the oldest is dropped.

use std::collections::VecDeque;
use std::sync::Mutex;

use tokio::sync::Notify;

use crate::io::lock::lock;
use gateway_core::gateway::event::Input;
use ros_messages::cdr::{CdrBytes, Endian};
use traffic_lights::input::TrafficLightInput;

/// A received sample, decoded and in its original bytes.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// Position of the subscription in the settings' list.
    pub subscription: usize,
    /// The decoded sample.
    pub input: Input,
    /// The sample without its encapsulation header, for a recording.
    pub bytes: CdrBytes,
    /// Byte order of `bytes`.
    pub endian: Endian,
}

/// Maximum number of waiting text commands.
const MAX_COMMANDS: usize = 256;

#[derive(Debug, Default)]
struct WaitingInputs {
    /// Samples in order of arrival; at most one state for each subscription.
    arrivals: VecDeque<Arrival>,
    commands: usize,
    is_closed: bool,
}

/// Queue between the session's thread and a task. Locks are held only briefly.
#[derive(Debug, Default)]
pub struct Inbox {
    waiting: Mutex<WaitingInputs>,
    arrived: Notify,
}

impl Inbox {
    /// Adds a received sample. Never blocks.
    pub fn put(&self, arrival: Arrival) {
        let mut waiting = lock(&self.waiting);
        if !is_text_command(&arrival) {
            let subscription = arrival.subscription;
            waiting.arrivals.retain(|old| old.subscription != subscription || is_text_command(old));
        } else if waiting.commands < MAX_COMMANDS {
            waiting.commands += 1;
        } else if let Some(oldest) = waiting.arrivals.iter().position(is_text_command) {
            waiting.arrivals.remove(oldest);
        }
        waiting.arrivals.push_back(arrival);
        drop(waiting);
        self.arrived.notify_one();
    }

    /// Removes and returns the oldest sample, if there is one.
    pub fn try_take(&self) -> Option<Arrival> {
        let mut waiting = lock(&self.waiting);
        let arrival = waiting.arrivals.pop_front()?;
        waiting.commands -= usize::from(is_text_command(&arrival));
        Some(arrival)
    }

    /// Waits for the next sample; returns `None` once the inbox is closed and empty. For one task at a time.
    /// Cancel safe.
    pub async fn take(&self) -> Option<Arrival> {
        loop {
            if let Some(arrival) = self.try_take() {
                return Some(arrival);
            }
            if lock(&self.waiting).is_closed {
                return None;
            }
            // An earlier notification is remembered.
            self.arrived.notified().await;
        }
    }

    /// Closes the inbox: waiting samples can still be taken, but no more are added.
    pub fn close(&self) {
        lock(&self.waiting).is_closed = true;
        self.arrived.notify_one();
    }
}

/// Returns true for inputs that must all be processed; for all others only the newest matters.
const fn is_text_command(arrival: &Arrival) -> bool {
    matches!(arrival.input, Input::TrafficLight(TrafficLightInput::Command(_)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::thread;

    use super::*;
    use gateway_base::time::WallStamp;
    use gateway_core::command::input::CommandInput;
    use gateway_core::command::origin::{CommandOrigin, SampleId};
    use traffic_lights::target::{LightChannel, StoreId, StoreLayer};

    fn arrival(subscription: usize, input: impl Into<Input>) -> Arrival {
        Arrival { subscription, input: input.into(), bytes: CdrBytes::default(), endian: Endian::Little }
    }

    fn command(number: usize) -> Arrival {
        arrival(9, TrafficLightInput::Command(number.to_string()))
    }

    fn state(subscription: usize, nanos: i64) -> Arrival {
        let store = StoreId { channel: LightChannel::V2i, layer: StoreLayer::GroundTruth };
        let (stamp, states) = (WallStamp::from_nanos(nanos), Vec::new());
        arrival(subscription, TrafficLightInput::States { store, stamp, states, rejected: 0 })
    }

    fn all(inbox: &Inbox) -> Vec<Arrival> {
        std::iter::from_fn(|| inbox.try_take()).collect()
    }

    #[test]
    fn the_newest_state_of_each_subscription_is_kept_and_commands_keep_their_order() {
        let inbox = Inbox::default();
        for arrival in [state(0, 1), command(1), state(1, 2), state(0, 3), command(2), state(0, 4)] {
            inbox.put(arrival);
        }
        assert_eq!(all(&inbox), [command(1), state(1, 2), command(2), state(0, 4)]);
        assert_eq!(all(&inbox), []);
    }

    #[test]
    fn a_newer_command_for_the_vehicle_replaces_the_one_that_waits() {
        let inbox = Inbox::default();
        let turn = |number: u8, nanos| {
            let (command, stamp) = (number.into(), WallStamp::from_nanos(nanos));
            let origin = CommandOrigin::Topic(SampleId::default());
            arrival(3, CommandInput::Turn { origin, command, stamp })
        };
        for arrival in [turn(2, 1), command(1), turn(3, 2), turn(1, 3), command(2)] {
            inbox.put(arrival);
        }
        assert_eq!(all(&inbox), [command(1), turn(1, 3), command(2)]);
    }

    #[test]
    fn the_oldest_commands_are_dropped_and_states_stay() {
        let inbox = Inbox::default();
        let put = |arrival| inbox.put(arrival);
        put(state(0, 1));
        (0..MAX_COMMANDS + 2).map(command).for_each(put);
        let kept: Vec<_> = std::iter::once(state(0, 1)).chain((2..MAX_COMMANDS + 2).map(command)).collect();
        assert_eq!(all(&inbox), kept);
        (0..MAX_COMMANDS).map(command).for_each(put);
        assert_eq!(all(&inbox).len(), MAX_COMMANDS, "what was taken makes room");
    }

    #[tokio::test]
    async fn a_task_waits_for_inputs_of_another_thread_and_for_the_end() {
        let inbox = Arc::new(Inbox::default());
        let sender = Arc::clone(&inbox);
        let putting = thread::spawn(move || {
            (0..100).map(command).for_each(|arrival| sender.put(arrival));
            sender.close();
        });
        for number in 0..100 {
            assert_eq!(inbox.take().await, Some(command(number)));
        }
        assert_eq!(inbox.take().await, None);
        assert_eq!(inbox.take().await, None, "and for ever");
        putting.join().unwrap();
    }
}
