//! Writers that sent regularly, are still there, and are not heard any more.
//!
//! RustDDS believes what comes under a writer's identity: after one GAP or HEARTBEAT with a number far ahead, its reader
//! takes all samples below it for received, and says nothing of it. A reader of a new participant starts anew. Whether a
//! writer is only silent shows there as well: one that was not heard has gone on in the meantime.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use rustdds::GUID;

/// Samples in a row that make a writer a regular one.
const REGULAR: u32 = 10;
/// The longest pause between these.
const MAX_PAUSE: Duration = Duration::from_millis(300);
/// Silence of a regular writer after which it may not be heard.
const SILENCE: Duration = Duration::from_secs(1);
/// The most that counts of the time between two looks: when this side does not run, nor may the writer.
const MAX_STEP: Duration = Duration::from_millis(150);
/// Samples that a writer has gone on by when it was not heard; fewer may be on their way.
const MISSED: i64 = 3;
/// Time within which these come once it is heard.
const SOON: Duration = Duration::from_millis(50);
/// Shortest time between two suspicions; it doubles with each that was wrong, so often at most.
const INTERVAL: Duration = Duration::from_secs(5);
const MAX_WRONG: u32 = 6;
/// Time after which a suspected writer that was not met is forgotten.
const MAX_SUSPICION: Duration = Duration::from_secs(30);
/// Writers that are remembered; further ones are not watched.
const MAX_WRITERS: usize = 256;

/// A subscription, by its position, and one of its writers.
pub(super) type ReadWriter = (u16, GUID);

/// What is known of all writers.
#[derive(Debug)]
pub(super) struct SilentWriters {
    writers: BTreeMap<ReadWriter, Heard>,
    last_look: Instant,
    last_suspicion: Option<Instant>,
    /// Suspicions in a row that were wrong.
    wrong: u32,
    /// Times a writer was not heard that had gone on.
    unheard: u32,
}

#[derive(Debug, Clone, Copy)]
struct Heard {
    number: i64,
    /// Samples in a row without a longer pause.
    regular: u32,
    /// Time that was seen to pass since the last one.
    silence: Duration,
    /// A new participant is to show whether it is heard there.
    is_suspected: bool,
    /// It was, and is heard again: its number before, and the time since.
    back: Option<(i64, Duration)>,
}

impl SilentWriters {
    /// None yet.
    pub(super) fn new(now: Instant) -> Self {
        Self { writers: BTreeMap::new(), last_look: now, last_suspicion: None, wrong: 0, unheard: 0 }
    }

    /// Notes a sample, which a participant that was replaced may have received: then it was heard all the time.
    pub(super) fn heard(&mut self, writer: ReadWriter, number: i64, by_predecessor: bool) {
        let is_known = self.writers.contains_key(&writer);
        if !is_known && self.writers.len() >= MAX_WRITERS {
            return;
        }
        let new = Heard { number, regular: 0, silence: Duration::ZERO, is_suspected: false, back: None };
        let heard = self.writers.entry(writer).or_insert(new);
        let is_back = std::mem::take(&mut heard.is_suspected);
        if is_back && !by_predecessor {
            heard.back = Some((heard.number, Duration::ZERO));
        } else if is_back {
            self.wrong = (self.wrong + 1).min(MAX_WRONG);
        }
        let has_gone_on = |(before, _): (i64, _)| number.saturating_sub(before) > MISSED;
        if heard.back.take_if(|back| has_gone_on(*back)).is_some() {
            (self.wrong, self.unheard) = (0, self.unheard.saturating_add(1));
        }
        let goes_on = heard.silence <= MAX_PAUSE && !is_back;
        heard.regular = if goes_on { heard.regular.saturating_add(1) } else { 0 };
        (heard.number, heard.silence) = (number, Duration::ZERO);
    }

    /// True when a regular writer that `is_there` has just been silent for too long, and this `may_suspect` it.
    pub(super) fn look(
        &mut self,
        now: Instant,
        may_suspect: bool,
        is_there: impl Fn(&ReadWriter) -> bool,
    ) -> bool {
        let step = now.saturating_duration_since(self.last_look).min(MAX_STEP);
        self.last_look = now;
        // A new participant has not met those that are suspected.
        self.writers
            .retain(|writer, heard| is_there(writer) || heard.is_suspected && heard.silence < MAX_SUSPICION);
        let interval = INTERVAL * 2_u32.pow(self.wrong);
        let may_suspect = may_suspect
            && self.last_suspicion.is_none_or(|last| now.saturating_duration_since(last) >= interval);
        let mut is_suspicious = false;
        for heard in self.writers.values_mut() {
            heard.silence += step;
            if let Some((_, since)) = &mut heard.back {
                *since += step;
            }
            let was_silent = heard.back.take_if(|(_, since)| *since > SOON).is_some();
            self.wrong = (self.wrong + u32::from(was_silent)).min(MAX_WRONG);
            if may_suspect && !heard.is_suspected && heard.regular >= REGULAR && heard.silence >= SILENCE {
                (heard.is_suspected, is_suspicious) = (true, true);
            }
        }
        if is_suspicious {
            self.last_suspicion = Some(now);
        }
        is_suspicious
    }

    /// Times a writer was not heard that had gone on.
    pub(super) fn unheard(&self) -> u32 {
        self.unheard
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_MS: u64 = 20;

    /// What comes of a writer: the milliseconds at which it was suspected, and how often it was not heard although it sent.
    /// Each sample is a time in milliseconds, a number, and whether a predecessor received it.
    fn watch(until_ms: u64, samples: &[(u64, i64, bool)]) -> (Vec<u64>, u32) {
        let (start, writer) = (Instant::now(), (0, GUID::from_bytes([1; 16])));
        let mut writers = SilentWriters::new(start);
        let mut is_suspected = |ms: &u64| {
            let now = samples.iter().filter(|(at, ..)| (*ms..*ms + TICK_MS).contains(at));
            now.for_each(|(_, number, by_predecessor)| writers.heard(writer, *number, *by_predecessor));
            writers.look(start + Duration::from_millis(*ms + TICK_MS), true, |_| true)
        };
        let suspected = (0..until_ms).step_by(20).filter(|ms| is_suspected(ms)).collect();
        (suspected, writers.unheard())
    }

    /// Ten samples a second, with numbers that go on from there.
    fn regular(from_ms: u64, to_ms: u64, number: i64) -> Vec<(u64, i64, bool)> {
        (from_ms..to_ms).step_by(100).zip(number..).map(|(ms, number)| (ms, number, false)).collect()
    }

    #[test]
    fn a_regular_writer_that_is_not_heard_is_suspected_after_a_second_and_proves_it() {
        let missed = [regular(0, 2_000, 1), regular(3_400, 5_000, 35)].concat();
        assert_eq!(watch(5_000, &missed), (vec![2_880], 1));
        // What a reliable writer has kept comes in one go.
        let kept: Vec<_> = (21..=35).map(|number| (3_400, number, false)).collect();
        assert_eq!(
            watch(5_000, &[regular(0, 2_000, 1), kept, regular(3_500, 5_000, 36)].concat()),
            (vec![2_880], 1)
        );
        let not_alone = [regular(0, 2_000, 1), vec![(3_400, 35, true)], regular(3_500, 5_000, 36)].concat();
        assert_eq!(watch(5_000, &not_alone), (vec![2_880], 0), "heard by the one before as well");
    }

    #[test]
    fn a_writer_that_pauses_is_suspected_less_and_less_often() {
        let (mut samples, mut number) = (vec![], 1);
        for burst in 0..100 {
            samples.extend(regular(burst * 4_000, burst * 4_000 + 2_000, number));
            number += 20;
        }
        let (suspected, unheard) = watch(400_000, &samples);
        assert!(suspected.len() < 10, "{suspected:?}");
        assert_eq!((suspected[0], unheard), (2_880, 0));
    }

    #[test]
    fn a_writer_that_seldom_sends_or_is_gone_is_not_suspected() {
        let seldom: Vec<_> =
            (0..50).map(|second| (second * 1_000, i64::try_from(second).unwrap(), false)).collect();
        assert_eq!(watch(100_000, &seldom), (vec![], 0));
        let mut writers = SilentWriters::new(Instant::now());
        (1..30).for_each(|number| writers.heard((0, GUID::from_bytes([1; 16])), number, false));
        let start = Instant::now();
        assert!((0..100).all(|tenth| !writers.look(
            start + Duration::from_millis(100) * tenth,
            true,
            |_| false
        )));
        assert!(writers.writers.is_empty());
    }
}
