//! What was received, on its way to whoever acts on it.
//!
//! The inbox is bounded: a state that waits is replaced by a newer one of the same subscription;
//! commands keep their order, and when [`MOST_COMMANDS`] wait, the oldest is dropped and counted.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

use super::messages::ReceivedGroups;
use crate::core::time::WallStamp;
use crate::core::traffic_light::target::StoreId;
use crate::core::turn_signal::told::Told;

/// Commands that may wait.
pub const MOST_COMMANDS: usize = 256;

/// What a sample said.
#[derive(Debug, Clone, PartialEq)]
pub enum Incoming {
    /// The state of groups, for a store.
    Groups {
        /// Which store.
        store: StoreId,
        /// What it said.
        groups: ReceivedGroups,
    },
    /// A command in words.
    Command(String),
    /// Something the decider wants to know.
    Told(Told),
    /// `TurnIndicatorsCommand` for the vehicle.
    TurnCommand {
        /// As sent.
        raw: u8,
        /// The sender's.
        stamp: WallStamp,
    },
    /// `HazardLightsCommand` for the vehicle.
    HazardCommand {
        /// As sent.
        raw: u8,
        /// The sender's.
        stamp: WallStamp,
    },
    /// `ControlModeReport` of the vehicle.
    ControlMode {
        /// As sent.
        raw: u8,
        /// The sender's.
        stamp: WallStamp,
    },
}

impl Incoming {
    /// Whether each counts. Of states only the newest does, and of commands for the vehicle, which are
    /// said again and again.
    const fn is_command(&self) -> bool {
        match self {
            Self::Command(_) => true,
            Self::Groups { .. }
            | Self::Told(_)
            | Self::TurnCommand { .. }
            | Self::HazardCommand { .. }
            | Self::ControlMode { .. } => false,
        }
    }
}

/// A sample that arrived.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// By which subscription, by position in the settings' list.
    pub subscription: usize,
    /// What it said.
    pub incoming: Incoming,
}

#[derive(Debug, Default)]
struct Waiting {
    /// In the order of their arrival; at most one state for each subscription.
    arrivals: VecDeque<Arrival>,
    commands: usize,
    dropped_commands: u64,
    is_closed: bool,
}

/// Between the session's thread and a task; locks are held for moments only.
#[derive(Debug, Default)]
pub struct Inbox {
    waiting: Mutex<Waiting>,
    arrived: Notify,
}

impl Inbox {
    /// Puts an arrival in; never blocks.
    pub fn put(&self, arrival: Arrival) {
        let mut waiting = self.lock();
        if !arrival.incoming.is_command() {
            let same = |old: &Arrival| old.subscription == arrival.subscription && !old.incoming.is_command();
            waiting.arrivals.retain(|old| !same(old));
        } else if waiting.commands < MOST_COMMANDS {
            waiting.commands += 1;
        } else {
            if let Some(oldest) = waiting.arrivals.iter().position(|old| old.incoming.is_command()) {
                waiting.arrivals.remove(oldest);
            }
            waiting.dropped_commands += 1;
        }
        waiting.arrivals.push_back(arrival);
        drop(waiting);
        self.arrived.notify_one();
    }

    /// Takes the oldest arrival, if there is one.
    pub fn try_take(&self) -> Option<Arrival> {
        let mut waiting = self.lock();
        let arrival = waiting.arrivals.pop_front()?;
        waiting.commands -= usize::from(arrival.incoming.is_command());
        Some(arrival)
    }

    /// Waits for the next arrival; `None` when nothing will come any more. For one task at a time.
    /// Loses nothing when it is given up.
    pub async fn take(&self) -> Option<Arrival> {
        loop {
            if let Some(arrival) = self.try_take() {
                return Some(arrival);
            }
            if self.lock().is_closed {
                return None;
            }
            // A notification from before is remembered.
            self.arrived.notified().await;
        }
    }

    /// Nothing will come any more.
    pub fn close(&self) {
        self.lock().is_closed = true;
        self.arrived.notify_one();
    }

    /// Commands dropped because nobody took them.
    pub fn dropped_commands(&self) -> u64 {
        self.lock().dropped_commands
    }

    /// Nothing behind this lock can be left half done by a panic.
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::thread;

    use super::*;
    use crate::core::traffic_light::target::{Channel, Layer};

    fn command(number: usize) -> Arrival {
        Arrival { subscription: 9, incoming: Incoming::Command(number.to_string()) }
    }

    fn state(subscription: usize, nanos: i64) -> Arrival {
        let store = StoreId { channel: Channel::V2i, layer: Layer::GroundTruth };
        let groups = ReceivedGroups { stamp: WallStamp::from_nanos(nanos), ..ReceivedGroups::default() };
        Arrival { subscription, incoming: Incoming::Groups { store, groups } }
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
    fn of_commands_for_the_vehicle_the_newest_is_kept_in_its_place() {
        let inbox = Inbox::default();
        let turn = |raw, nanos| Arrival {
            subscription: 3,
            incoming: Incoming::TurnCommand { raw, stamp: WallStamp::from_nanos(nanos) },
        };
        for arrival in [turn(2, 1), command(1), turn(3, 2), turn(1, 3), command(2)] {
            inbox.put(arrival);
        }
        assert_eq!(all(&inbox), [command(1), turn(1, 3), command(2)]);
    }

    #[test]
    fn the_oldest_commands_are_dropped_and_counted_and_states_stay() {
        let inbox = Inbox::default();
        inbox.put(state(0, 1));
        (0..MOST_COMMANDS + 2).for_each(|number| inbox.put(command(number)));
        assert_eq!(inbox.dropped_commands(), 2);
        let kept: Vec<_> = std::iter::once(state(0, 1)).chain((2..MOST_COMMANDS + 2).map(command)).collect();
        assert_eq!(all(&inbox), kept);
        (0..MOST_COMMANDS).for_each(|number| inbox.put(command(number)));
        assert_eq!(inbox.dropped_commands(), 2, "what was taken makes room");
    }

    #[tokio::test]
    async fn a_task_waits_for_what_another_thread_puts_in_and_for_the_end() {
        let inbox = Arc::new(Inbox::default());
        let sender = Arc::clone(&inbox);
        let putting = thread::spawn(move || {
            (0..100).for_each(|number| sender.put(command(number)));
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
