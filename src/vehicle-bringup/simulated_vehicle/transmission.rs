//! Transmission of one message of the vehicle, with simulated faults.

use std::time::Duration;

use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng;

use super::encoder::ReportedState;
use super::faults::FrameFaults;
use super::plan::PlannedMessage;
use can_signal::can::{Frame, MAX_DATA};
use can_signal::validation::integrity::Protection;
use gateway_base::time::MonoTime;

/// Minimum time between two frames that are sent on change.
const MIN_SEND_INTERVAL: Duration = Duration::from_millis(10);

#[derive(Debug, Clone)]
pub(super) struct Transmission {
    /// Due time of the next periodic frame; `None` if sent on change only.
    due: Option<MonoTime>,
    last_sent: Option<MonoTime>,
    counter: u32,
    contents: Vec<[u8; MAX_DATA]>,
    /// True if the contents have changed since the last frame.
    is_waiting: bool,
}

impl Transmission {
    /// Creates the state of a message whose first frame is due at `start`.
    pub(super) fn new(message: &PlannedMessage, start: MonoTime) -> Self {
        let counter = message.protection.as_ref().map_or(0, Protection::first_counter);
        Self { due: Some(start), last_sent: None, counter, contents: Vec::new(), is_waiting: false }
    }

    /// Returns the frames that are due.
    pub(super) fn settle(
        &mut self,
        message: &PlannedMessage,
        state: &ReportedState,
        faults: FrameFaults,
        random: &mut Pcg32,
        now: MonoTime,
    ) -> Vec<Frame> {
        let pages: Vec<_> = message
            .pages
            .iter()
            .map(|page| {
                let mut data = page.background;
                for encoder in &page.encoders {
                    // Raw values are chosen from the signal's range.
                    let _ = encoder.raw(state).map(|raw| encoder.codec.write(raw, &mut data));
                }
                data
            })
            .collect();
        if !faults.freezes_contents || self.contents.is_empty() {
            self.is_waiting |= message.on_change && self.contents != pages;
            self.contents = pages;
        }
        let may_change =
            self.is_waiting && self.last_sent.is_none_or(|last| now >= last.after(MIN_SEND_INTERVAL));
        let is_due = self.due.is_some_and(|due| now >= due);
        if !may_change && !is_due {
            return Vec::new();
        }
        self.is_waiting = false;
        if is_due {
            let next = |due: MonoTime, period| {
                let next = due.after(period);
                if next > now { next } else { now.after(period) }
            };
            self.due = self.due.zip(message.period).map(|(due, period)| next(due, period));
        }
        self.last_sent = Some(now);
        let contents = std::mem::take(&mut self.contents);
        let frames = contents.iter().filter_map(|data| self.frame(message, *data, faults, random)).collect();
        self.contents = contents;
        frames
    }

    /// Builds a frame; `None` when it is lost or cannot carry its protection.
    fn frame(
        &mut self,
        message: &PlannedMessage,
        mut data: [u8; MAX_DATA],
        faults: FrameFaults,
        random: &mut Pcg32,
    ) -> Option<Frame> {
        if let Some(protection) = &message.protection {
            protection.protect(message.id, self.counter, &mut data, message.length).then_some(())?;
            if !faults.freezes_counter {
                self.counter = protection.next_counter(self.counter);
            }
        }
        // Both are drawn for each frame, so that one fault does not affect the random numbers of the other.
        let (is_lost, is_wrong) = (random_share(random) < faults.drop, random_share(random) < faults.corrupt);
        let bits = u32::try_from(message.length * 8).unwrap_or(0);
        let bit = usize::try_from(random.next_u32().checked_rem(bits).unwrap_or(0)).unwrap_or(0);
        if let Some(byte) = data.get_mut(bit / 8).filter(|_| is_wrong) {
            *byte ^= 1 << (bit % 8);
        }
        let data = data.get(..message.length).filter(|_| !is_lost);
        data.and_then(|data| Frame::with_format(message.id, message.format, data))
    }

    pub(super) fn next_deadline(&self) -> Option<MonoTime> {
        let change = self.last_sent.filter(|_| self.is_waiting).map(|last| last.after(MIN_SEND_INTERVAL));
        self.due.into_iter().chain(change).min()
    }
}

/// Returns a random number from 0 up to but excluding 1.
fn random_share(random: &mut Pcg32) -> f64 {
    f64::from(random.next_u32()) / 4_294_967_296.0
}
