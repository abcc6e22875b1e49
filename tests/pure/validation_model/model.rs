//! The values that may be used, as simply as possible: everything that came is kept, and each
//! question is answered by looking back at it.

use crate::pure::validation_model::sender::{ALIVE_MS, Protection, TIMEOUT_MS, right_crc, values};

/// A frame of the message that came.
#[derive(Debug, Clone)]
struct Received {
    ms: u64,
    /// Its counter, if it is whole.
    counter: Option<u8>,
    value: u8,
    /// True if everything restarts with it.
    fresh: bool,
    trusted: bool,
    /// True if the message as a whole is not valid after it.
    invalid: bool,
}

/// Results of a frame as the window counts them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CheckStatus {
    Ok,
    Error,
    Other,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum E2eState {
    NoData,
    Init,
    Valid,
    Invalid,
}

#[derive(Debug)]
pub(crate) struct Model {
    protection: Protection,
    received: Vec<Received>,
    /// When anything at all came over the bus since its link was lost.
    life: Vec<u64>,
    link_lost: bool,
}

impl Model {
    pub(crate) fn new(protection: Protection) -> Self {
        Self { protection, received: vec![], life: vec![], link_lost: false }
    }

    pub(crate) fn link_was_lost(&mut self) {
        self.link_lost = true;
        self.life.clear();
    }

    /// Something came that is not the message.
    pub(crate) fn sign_of_life(&mut self, ms: u64) {
        self.life.push(ms);
    }

    pub(crate) fn frame(&mut self, ms: u64, data: &[u8]) {
        self.life.push(ms);
        if data.len() < 3 {
            // Without the value: nothing that could be judged.
            return;
        }
        let stored = if self.protection == Protection::E2e { data[0] } else { data[data.len() - 1] };
        let whole = data.len() == 8 && stored == right_crc(self.protection, data);
        let counter = Some(data[1] & 0xF).filter(|counter| whole && *counter < values(self.protection));
        let last_whole =
            self.session().rfind(|received| received.counter.is_some()).map(|received| received.ms);
        let too_old = |last: u64| self.protection != Protection::EventFields && ms > last + TIMEOUT_MS;
        let fresh = self.link_lost || last_whole.is_some_and(too_old);
        self.link_lost = false;
        self.received.push(Received {
            ms,
            counter,
            value: data[2] & 3,
            fresh,
            trusted: false,
            invalid: false,
        });
        let outcomes: Vec<_> = (self.start()..self.received.len()).map(|at| self.outcome(at)).collect();
        let alone = self.is_in_order(self.received.len() - 1);
        let (trusted, invalid) = match self.protection {
            Protection::Fields | Protection::EventFields => (alone, false),
            Protection::E2e => {
                let phase = phase(&outcomes);
                (alone && phase == E2eState::Valid, phase == E2eState::Invalid)
            }
        };
        let newest = self.received.last_mut().unwrap();
        (newest.trusted, newest.invalid) = (trusted, invalid);
    }

    /// The value that may be published, and must be.
    pub(crate) fn valid_value(&self, now: u64) -> Option<u8> {
        if self.link_lost {
            return None;
        }
        // A link that was lost begins a session, but not every session begins with one: what was
        // trusted before a session is too old for the limit below.
        let newest = self.received.iter().rposition(|received| received.trusted)?;
        let Received { ms, value, .. } = self.received[newest];
        let invalid = self.received[newest + 1..].iter().any(|received| received.invalid);
        let in_time = match self.protection {
            Protection::Fields | Protection::E2e => now <= ms + TIMEOUT_MS,
            Protection::EventFields => {
                let since = self.life.iter().skip_while(|life| **life < ms).copied().chain([now]);
                let since: Vec<_> = since.collect();
                since.windows(2).all(|pair| pair[1] <= pair[0] + ALIVE_MS)
            }
        };
        // A frame from before the link was lost is not among the signs of life since.
        let same_link = self.life.first().is_some_and(|first| *first <= ms);
        (!invalid && in_time && same_link).then_some(value)
    }

    /// Where the newest session starts.
    fn start(&self) -> usize {
        self.received.iter().rposition(|received| received.fresh).unwrap_or(0)
    }

    fn session(&self) -> impl DoubleEndedIterator<Item = &Received> {
        self.received[self.start()..].iter()
    }

    /// The whole frame before this one in its session.
    fn before(&self, at: usize) -> Option<usize> {
        let fresh = self.received[..=at].iter().rposition(|received| received.fresh).unwrap_or(0);
        (fresh..at).rev().find(|other| self.received[*other].counter.is_some())
    }

    /// How far the counter of a whole frame moved since the one before.
    fn step(&self, at: usize) -> Option<u8> {
        let (new, old) = (self.received[at].counter?, self.received[self.before(at)?].counter?);
        Some((new + values(self.protection) - old) % values(self.protection))
    }

    /// In sequence, and after nothing that was not.
    fn is_in_order(&self, at: usize) -> bool {
        let moved = self.step(at).is_some_and(|step| step == 1 || step == 2);
        let Some(mut before) = self.before(at).filter(|_| moved) else { return false };
        let mut repeats = 0;
        while self.step(before) == Some(0) {
            repeats += 1;
            before = self.before(before).unwrap();
        }
        let tolerated = i32::from(self.protection == Protection::E2e);
        // The first frame of all proves as much as one in sequence; the first after a silence does not.
        let is_first = || !self.received[..before].iter().any(|received| received.counter.is_some());
        repeats <= tolerated && self.step(before).map_or_else(is_first, |step| step <= 2)
    }

    fn outcome(&self, at: usize) -> CheckStatus {
        match (self.received[at].counter, self.step(at)) {
            (None, _) => CheckStatus::Error,
            (Some(_), Some(1 | 2)) => CheckStatus::Ok,
            (Some(_), _) => CheckStatus::Other,
        }
    }
}

/// The state machine after all outcomes of a session: newest results within the state's size, good
/// ones needed, errors allowed.
fn phase(outcomes: &[CheckStatus]) -> E2eState {
    let mut phase = E2eState::NoData;
    // From which outcome on the state looks.
    let mut from = 0;
    for (at, outcome) in outcomes.iter().enumerate() {
        let (size, min_ok, max_error) = match phase {
            E2eState::NoData => {
                if *outcome != CheckStatus::Error {
                    (phase, from) = (E2eState::Init, at + 1);
                }
                continue;
            }
            E2eState::Init => (3, 2, 1),
            E2eState::Valid => (5, 2, 2),
            E2eState::Invalid => (4, 3, 0),
        };
        let newest = &outcomes[from.max((at + 1).saturating_sub(size))..=at];
        let count = |status| newest.iter().filter(|outcome| **outcome == status).count();
        let (good, invalid) = (count(CheckStatus::Ok) >= min_ok, count(CheckStatus::Error) > max_error);
        let next = match phase {
            E2eState::Init if invalid => E2eState::Invalid,
            E2eState::Init if !good => E2eState::Init,
            E2eState::NoData | E2eState::Init | E2eState::Valid | E2eState::Invalid if good && !invalid => {
                E2eState::Valid
            }
            E2eState::NoData | E2eState::Init | E2eState::Valid | E2eState::Invalid => E2eState::Invalid,
        };
        if next != phase {
            // Results that this state no longer counted do not count in the next one.
            from = from.max((at + 1).saturating_sub(size));
            phase = next;
        }
    }
    phase
}
