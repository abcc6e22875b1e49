//! What the caller hands to the session's thread, and what it sees of it.
//!
//! A report, command or emission waiting to be sent is overtaken by a newer one of the same topic. Diagnostics
//! keep their order; when `MOST_DIAGNOSTICS` wait, the oldest is dropped and counted.

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
const MOST_DIAGNOSTICS: usize = 64;

/// What a report topic is to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wish<M> {
    /// This.
    Publish(M),
    /// Nothing, not even to readers that come later.
    Withdraw,
}

/// One thing to do.
#[derive(Debug)]
pub(super) enum Letter {
    /// Publish, or withdraw.
    Turn(Wish<TurnIndicatorsReport>),
    /// Publish, or withdraw.
    Hazard(Wish<HazardLightsReport>),
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
pub(super) struct Letters {
    /// `None` = nothing new.
    pub(super) turn: Option<Wish<TurnIndicatorsReport>>,
    /// `None` = nothing new.
    pub(super) hazard: Option<Wish<HazardLightsReport>>,
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

impl Letters {
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
    letters: Mutex<Letters>,
    arrived: Condvar,
    status: Mutex<RosStatus>,
}

impl Mailbox {
    /// Puts a letter in.
    pub(super) fn put(&self, letter: Letter) {
        let mut letters = lock(&self.letters);
        match letter {
            Letter::Turn(wish) => letters.turn = Some(wish),
            Letter::Hazard(wish) => letters.hazard = Some(wish),
            Letter::Diagnostics(array) => {
                if letters.diagnostics.len() >= MOST_DIAGNOSTICS {
                    letters.diagnostics.pop_front();
                    lock(&self.status).dropped_diagnostics += 1;
                }
                letters.diagnostics.push_back(array);
            }
            Letter::Lights(emission) => {
                if letters.lights.insert(emission.topic, emission).is_some() {
                    lock(&self.status).overtaken_lights += 1;
                }
            }
            Letter::TurnCommand(command) => letters.turn_command = Some(command),
            Letter::HazardCommand(command) => letters.hazard_command = Some(command),
            Letter::Stop => letters.stop = true,
        }
        self.arrived.notify_one();
    }

    /// Takes everything out; waits at most `patience` for something to arrive.
    pub(super) fn take(&self, patience: Duration) -> Letters {
        let letters = lock(&self.letters);
        let waited = self.arrived.wait_timeout_while(letters, patience, |letters| letters.is_empty());
        let (mut letters, _) = waited.unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut letters)
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
        lock(&self.letters).rung = true;
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

    fn diagnostics(number: i64) -> Letter {
        let nothing = Diagnostics { statuses: vec![], refresh: true };
        Letter::Diagnostics(DiagnosticArray::new(&nothing, WallStamp::from_nanos(number), ""))
    }

    #[test]
    fn the_newest_report_wins_and_a_withdrawal_is_news() {
        let mailbox = Mailbox::default();
        let report = |state| TurnIndicatorsReport::new(state, WallStamp::default());
        mailbox.put(Letter::Turn(Wish::Publish(report(TurnIndicators::EnableLeft))));
        mailbox.put(Letter::Turn(Wish::Publish(report(TurnIndicators::EnableRight))));
        let taken = mailbox.take(Duration::ZERO);
        assert_eq!(taken.turn, Some(Wish::Publish(report(TurnIndicators::EnableRight))));
        assert_eq!(taken.hazard, None);
        mailbox.put(Letter::Turn(Wish::Publish(report(TurnIndicators::EnableLeft))));
        mailbox.put(Letter::Turn(Wish::Withdraw));
        assert_eq!(mailbox.take(Duration::ZERO).turn, Some(Wish::Withdraw));
        assert!(mailbox.take(Duration::ZERO).is_empty());
    }

    #[test]
    fn the_newest_emission_of_each_topic_wins_and_the_others_are_counted() {
        let mailbox = Mailbox::default();
        let emission = |topic, nanos| {
            let content = Arc::new(Content::Groups(vec![]));
            Emission { topic, stamp: WallStamp::from_nanos(nanos), content }
        };
        for (topic, nanos) in [(LightsTopic::V2i, 1), (LightsTopic::Camera, 2), (LightsTopic::V2i, 3)] {
            mailbox.put(Letter::Lights(emission(topic, nanos)));
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
        let most = u32::try_from(MOST_DIAGNOSTICS).unwrap();
        for number in 0..most + 2 {
            mailbox.put(diagnostics(number.into()));
        }
        let taken = mailbox.take(Duration::ZERO).diagnostics;
        let numbers: Vec<u32> = taken.iter().map(|array| array.header.stamp.nanosec).collect();
        assert_eq!(numbers, (2..most + 2).collect::<Vec<_>>());
        assert_eq!(mailbox.status().dropped_diagnostics, 2);
    }
}
