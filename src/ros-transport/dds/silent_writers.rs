//! Detects writers that sent regularly, still exist, and are no longer received.
//!
//! RustDDS trusts everything under a writer's identity: after one GAP or HEARTBEAT with a number far ahead,
//! its reader treats all samples below it as received, without any report. A reader of another participant
//! starts afresh. So that reader shows whether a writer is really silent: if it receives later samples, the
//! writer was not silent but not received.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use rustdds::GUID;

/// Number of samples in a row that make a writer regular.
const REGULAR: u32 = 10;
/// Maximum pause between these samples.
const MAX_PAUSE: Duration = Duration::from_millis(1200);
/// Silence of a regular writer before suspicion, also as a multiple of its usual pause; the longer of the two
/// counts.
const SILENCE: Duration = Duration::from_secs(1);
const PAUSES: f64 = 2.5;
/// Factor by which a sooner sample reduces the usual pause.
const FADING: f64 = 0.9;
/// Maximum time counted between two checks: if this side was not running, the writer may not have been
/// either.
const MAX_STEP: Duration = Duration::from_millis(150);
/// Minimum time between two checks: samples may wake this side thousands of times a second.
const MIN_STEP: Duration = Duration::from_millis(20);
/// Number of samples by which an unreceived writer must have advanced; fewer may be in transit.
const MISSED: i64 = 3;
/// Minimum time between two suspicions; it doubles with each wrong suspicion, at most this many times.
const INTERVAL: Duration = Duration::from_secs(5);
const MAX_WRONG: u32 = 6;
/// Maximum number of observed writers; further writers are ignored.
const MAX_WRITERS: usize = 256;

/// A subscription, by its position, and one of its writers.
pub(super) type ReadWriter = (u16, GUID);

#[derive(Debug)]
pub(super) struct SilentWriters {
    writers: BTreeMap<ReadWriter, Heard>,
    last_look: Instant,
    last_suspicion: Option<Instant>,
    /// Number of wrong suspicions in a row.
    wrong: u32,
    /// Number of times that a writer was sending but not received.
    pub(super) unheard: u32,
}

#[derive(Debug, Default)]
struct Heard {
    number: i64,
    /// Number of samples in a row without a longer pause.
    regular: u32,
    /// The longest recent pause.
    usual: Duration,
    /// Observed time since the last sample.
    silence: Duration,
    is_suspected: bool,
}

impl SilentWriters {
    pub(super) fn new(now: Instant) -> Self {
        Self { writers: BTreeMap::new(), last_look: now, last_suspicion: None, wrong: 0, unheard: 0 }
    }

    /// Records a sample, which ends a suspicion.
    pub(super) fn heard(&mut self, writer: ReadWriter, number: i64) {
        if !self.writers.contains_key(&writer) && self.writers.len() >= MAX_WRITERS {
            return;
        }
        let heard = self.writers.entry(writer).or_default();
        let (regular, usual) = if heard.silence <= MAX_PAUSE {
            (heard.regular.saturating_add(1), heard.silence.max(heard.usual.mul_f64(FADING)))
        } else {
            Default::default()
        };
        *heard = Heard { number, regular, usual, ..Heard::default() };
    }

    /// Records a sample received by another participant; returns true if it shows that a suspected writer has
    /// advanced without being received.
    pub(super) fn heard_elsewhere(&mut self, writer: &ReadWriter, number: i64) -> bool {
        let Some(heard) = self.writers.get_mut(writer).filter(|heard| heard.is_suspected) else {
            return false;
        };
        // A lower number shows that the earlier sample had a forged number.
        let has_gone_on = number.saturating_sub(heard.number) > MISSED || number < heard.number;
        if has_gone_on {
            heard.is_suspected = false;
            (self.wrong, self.unheard) = (0, self.unheard.saturating_add(1));
        }
        has_gone_on
    }

    pub(super) fn acquit(&mut self) {
        self.writers.values_mut().for_each(|heard| (heard.is_suspected, heard.regular) = (false, 0));
        self.wrong = (self.wrong + 1).min(MAX_WRONG);
    }

    pub(super) fn is_any_suspected(&self) -> bool {
        self.writers.values().any(|heard| heard.is_suspected)
    }

    /// Returns the regular writers that exist and have been silent for too long, once there is one and
    /// `may_suspect` allows it.
    pub(super) fn look(
        &mut self,
        now: Instant,
        may_suspect: bool,
        is_there: impl Fn(&ReadWriter) -> bool,
    ) -> Vec<ReadWriter> {
        let step = now.saturating_duration_since(self.last_look).min(MAX_STEP);
        if step < MIN_STEP {
            return Vec::new();
        }
        self.last_look = now;
        self.writers.retain(|writer, _| is_there(writer));
        let interval = INTERVAL * 2_u32.pow(self.wrong);
        let is_due = self.last_suspicion.is_none_or(|last| now.saturating_duration_since(last) >= interval);
        let mut suspected = Vec::new();
        for (writer, heard) in &mut self.writers {
            heard.silence += step;
            let is_silent = heard.silence >= SILENCE.max(heard.usual.mul_f64(PAUSES));
            if may_suspect && is_due && heard.regular >= REGULAR && is_silent {
                heard.is_suspected = true;
                suspected.push(*writer);
            }
        }
        if !suspected.is_empty() {
            self.last_suspicion = Some(now);
        }
        suspected
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_MS: u64 = 20;
    /// Time until a suspicion is dropped, in ticks.
    const PROBE: u32 = 100;

    /// Returns the milliseconds at which a writer was suspected, and those at which it was found to be
    /// sending. Each sample is a time in milliseconds, a number, and whether it is received only elsewhere.
    fn watch(until_ms: u64, samples: &[(u64, i64, bool)]) -> (Vec<u64>, Vec<u64>) {
        let (start, writer) = (Instant::now(), (0, GUID::from_bytes([1; 16])));
        let mut writers = SilentWriters::new(start);
        let (mut suspected, mut unheard, mut probe) = (vec![], vec![], None);
        for ms in (0..until_ms).step_by(20) {
            let now = samples.iter().filter(|(at, ..)| (ms..ms + TICK_MS).contains(at));
            for (_, number, is_elsewhere) in now {
                if !is_elsewhere {
                    writers.heard(writer, *number);
                }
                if probe.is_some() && writers.heard_elsewhere(&writer, *number) {
                    unheard.push(ms);
                    probe = None;
                }
            }
            probe = probe.and_then(|ticks: u32| ticks.checked_sub(1));
            if probe == Some(0) || probe.is_some() && !writers.is_any_suspected() {
                writers.acquit();
                probe = None;
            }
            let at = start + Duration::from_millis(ms + TICK_MS);
            if !writers.look(at, probe.is_none(), |_| true).is_empty() {
                (probe, suspected) = (Some(PROBE), [suspected, vec![ms]].concat());
            }
        }
        assert_eq!(usize::try_from(writers.unheard), Ok(unheard.len()));
        (suspected, unheard)
    }

    /// Returns ten samples a second, with numbers that continue from `number`.
    fn regular(from_ms: u64, to_ms: u64, number: i64, is_elsewhere: bool) -> Vec<(u64, i64, bool)> {
        let samples = (from_ms..to_ms).step_by(100).zip(number..);
        samples.map(|(ms, number)| (ms, number, is_elsewhere)).collect()
    }

    #[test]
    fn a_regular_writer_that_is_not_heard_is_suspected_after_a_second_and_proves_it() {
        let missed = |number| {
            watch(5_000, &[regular(0, 2_000, 1, false), regular(2_000, 5_000, number, true)].concat())
        };
        assert_eq!(missed(21), (vec![2_880], vec![2_900]));
        assert_eq!(missed(-30), (vec![2_880], vec![2_900]), "below a number that is not its own");
    }

    #[test]
    fn a_writer_that_pauses_is_suspected_less_and_less_often_and_never_proves_it() {
        for pause_ms in [1_000, 1_500, 2_000, 6_000] {
            let (mut samples, mut number) = (vec![], 1);
            for burst in 0..100 {
                let begin = burst * (2_000 + pause_ms);
                samples.extend(regular(begin, begin + 2_000, number, false));
                number += 20;
            }
            let (suspected, unheard) = watch(100 * (2_000 + pause_ms), &samples);
            assert!(suspected.len() < 12 && suspected[0] == 2_880, "{pause_ms}: {suspected:?}");
            assert_eq!(unheard, Vec::<u64>::new(), "{pause_ms}");
        }
    }

    #[test]
    fn a_slow_writer_is_suspected_after_some_of_its_periods_and_a_seldom_one_never() {
        let every = |ms: u64, from: u64, to: u64, is_elsewhere: bool| {
            (from..to).map(move |count| (count * ms, i64::try_from(count).unwrap(), is_elsewhere))
        };
        for (period_ms, suspected_ms) in [(500, 1_240), (1_000, 2_480)] {
            let samples: Vec<_> =
                every(period_ms, 1, 31, false).chain(every(period_ms, 31, 60, true)).collect();
            let (suspected, unheard) = watch(60 * period_ms, &samples);
            assert!(suspected[0] == 30 * period_ms + suspected_ms, "{period_ms}: {suspected:?}");
            assert!(!unheard.is_empty(), "{period_ms}");
            let regular: Vec<_> = every(period_ms, 1, 60, false).collect();
            assert_eq!(watch(60 * period_ms, &regular).0, Vec::<u64>::new(), "{period_ms}");
        }
        let seldom: Vec<_> = every(2_000, 0, 50, false).collect();
        assert_eq!(watch(120_000, &seldom).0, Vec::<u64>::new());
    }

    #[test]
    fn a_writer_that_is_gone_is_not_suspected() {
        let start = Instant::now();
        let mut writers = SilentWriters::new(start);
        (1..30).for_each(|number| writers.heard((0, GUID::from_bytes([1; 16])), number));
        let mut looks = (0..100).map(|tenth| start + Duration::from_millis(100) * tenth);
        assert!(looks.all(|now| writers.look(now, true, |_| false).is_empty()));
        assert!(writers.writers.is_empty());
    }
}
