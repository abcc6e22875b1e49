//! Senders of a J1939 message that several control units may send.

use std::time::Duration;

use gateway_base::time::{MonoTime, deadline_after};

/// Time for which a sender counts after its last frame.
pub const SENDER_MEMORY: Duration = Duration::from_secs(10);

/// Senders heard within [`SENDER_MEMORY`], at most two: a third changes nothing, since two already contradict
/// each other.
#[derive(Debug, Clone, Copy, Default)]
pub struct Senders([Option<HeardSender>; 2]);

#[derive(Debug, Clone, Copy)]
struct HeardSender {
    address: u8,
    at: MonoTime,
}

/// Two senders of one message, by their source addresses, ascending.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SenderConflict(pub [u8; 2]);

impl Senders {
    /// Records a frame of a sender. Returns whether the sender has changed.
    ///
    /// # Errors
    /// Fails with both senders if there are two; neither is then trusted.
    pub fn frame_arrived(&mut self, address: u8, now: MonoTime) -> Result<bool, SenderConflict> {
        for heard in &mut self.0 {
            *heard = heard.filter(|heard| now.is_within(SENDER_MEMORY, heard.at));
        }
        let of_sender = |heard: &Option<HeardSender>| heard.is_some_and(|heard| heard.address == address);
        let known = self.0.iter().position(of_sender);
        let place = known.or_else(|| self.0.iter().position(Option::is_none));
        if let Some(place) = place {
            self.0[place] = Some(HeardSender { address, at: now });
        }
        self.conflict(now).map_or(Ok(known.is_none()), Err)
    }

    /// Returns the senders if there are two.
    pub fn conflict(&self, now: MonoTime) -> Option<SenderConflict> {
        let [Some(one), Some(other)] = self.0 else { return None };
        let are_heard = [one, other].iter().all(|heard| now.is_within(SENDER_MEMORY, heard.at));
        let (low, high) = (one.address.min(other.address), one.address.max(other.address));
        are_heard.then_some(SenderConflict([low, high]))
    }

    /// Returns the next instant at which a sender no longer counts; `None` while there is at most one.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        self.conflict(now)?;
        self.0.iter().flatten().map(|heard| deadline_after(heard.at, SENDER_MEMORY)).min()
    }

    /// Forgets all senders.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64) -> MonoTime {
        MonoTime::from_millis(1000 * seconds)
    }

    #[test]
    fn first_sender_is_believed_until_a_second_is_heard_and_again_when_it_is_silent() {
        let mut senders = Senders::default();
        assert_eq!(senders.frame_arrived(0x27, at(0)), Ok(true));
        assert_eq!(senders.frame_arrived(0x27, at(1)), Ok(false));
        let conflict = SenderConflict([0x21, 0x27]);
        assert_eq!(senders.frame_arrived(0x21, at(2)), Err(conflict));
        assert_eq!(senders.frame_arrived(0x30, at(3)), Err(conflict), "a third changes nothing");
        assert_eq!(senders.frame_arrived(0x27, at(12)), Err(conflict));
        assert_eq!(senders.next_deadline(at(12)), Some(deadline_after(at(2), SENDER_MEMORY)));
        assert_eq!(senders.conflict(deadline_after(at(12), Duration::ZERO)), None, "one is silent");
        assert_eq!(senders.frame_arrived(0x27, at(13)), Ok(false));
        assert_eq!(senders.frame_arrived(0x30, at(14)), Err(SenderConflict([0x27, 0x30])));
        senders.forget();
        assert_eq!(senders.frame_arrived(0x30, at(15)), Ok(true));
    }

    #[test]
    fn sender_that_replaces_a_silent_one_is_new() {
        let mut senders = Senders::default();
        assert_eq!(senders.frame_arrived(0x27, at(0)), Ok(true));
        assert_eq!(senders.frame_arrived(0x21, at(11)), Ok(true));
        assert_eq!(senders.next_deadline(at(11)), None);
    }
}
