//! All frames of an interface, as the kernel counts them, and the load of the bus.
//!
//! The gateway's own sockets let only frames of the vehicle profile through, so the counts are taken from the interface
//! (`/sys/class/net/…/statistics`).

use std::fs;
use std::time::{Duration, Instant};

use super::controller::bitrate;
use crate::core::can::snapshot::TrafficSnapshot;

const MIN_WINDOW: Duration = Duration::from_millis(900);
/// Bits of a classic frame with an 11-bit identifier, without data: 44, and 3 between frames.
const FRAME_BITS: f64 = 47.0;

/// Measures the traffic of one interface.
#[derive(Debug)]
pub struct TrafficMeter {
    interface: String,
    before: Option<(Instant, FrameCounts)>,
    last: Option<TrafficSnapshot>,
}

/// Received and sent frames and data bytes since the interface came up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FrameCounts {
    frames: u64,
    bytes: u64,
}

impl TrafficMeter {
    /// Creates a meter for an interface.
    pub fn new(interface: &str) -> Self {
        Self { interface: interface.to_owned(), before: None, last: None }
    }

    /// Returns the traffic of about the last second; `None` before that, or without the interface.
    pub fn measure(&mut self) -> Option<TrafficSnapshot> {
        let now = Instant::now();
        let elapsed = self.before.map(|(before, _)| now - before);
        if elapsed.is_some_and(|elapsed| elapsed < MIN_WINDOW) {
            return self.last;
        }
        let counts = counts(&self.interface);
        let before = std::mem::replace(&mut self.before, counts.map(|counts| (now, counts)));
        let (counts, (_, before)) = counts.zip(before)?;
        self.last = Some(traffic(before, counts, elapsed?, bitrate(&self.interface)));
        self.last
    }
}

fn counts(interface: &str) -> Option<FrameCounts> {
    let count = |name: &str| -> Option<u64> {
        let text = fs::read_to_string(format!("/sys/class/net/{interface}/statistics/{name}")).ok()?;
        text.trim().parse().ok()
    };
    Some(FrameCounts {
        frames: count("rx_packets")?.saturating_add(count("tx_packets")?),
        bytes: count("rx_bytes")?.saturating_add(count("tx_bytes")?),
    })
}

#[allow(clippy::cast_precision_loss)] // counts of a second are far below 2^52
fn traffic(
    before: FrameCounts,
    now: FrameCounts,
    elapsed: Duration,
    bitrate_bps: Option<u32>,
) -> TrafficSnapshot {
    let per_second = |count: u64| count as f64 / elapsed.as_secs_f64();
    let (frames, bytes) = (now.frames.saturating_sub(before.frames), now.bytes.saturating_sub(before.bytes));
    let bits = per_second(frames) * FRAME_BITS + per_second(bytes) * 8.0;
    let tenths = |number: f64| (number * 10.0).round() / 10.0;
    TrafficSnapshot {
        rate_hz: tenths(per_second(frames)),
        load_percent: bitrate_bps.filter(|rate| *rate > 0).map(|rate| tenths(bits * 100.0 / f64::from(rate))),
        bitrate_bps,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn load_is_the_bits_of_frames_and_data_over_the_bit_rate() {
        let (before, now) =
            (FrameCounts { frames: 100, bytes: 800 }, FrameCounts { frames: 2_100, bytes: 16_800 });
        let two_seconds = Duration::from_secs(2);
        let on_wire = traffic(before, now, two_seconds, Some(500_000));
        // 1000 frames of 111 bits a second.
        let expected =
            TrafficSnapshot { rate_hz: 1000.0, load_percent: Some(22.2), bitrate_bps: Some(500_000) };
        assert_eq!(on_wire, expected);
        assert_eq!(traffic(before, now, two_seconds, None).load_percent, None);
        let restarted = traffic(now, before, two_seconds, None);
        assert!(restarted.rate_hz.abs() < 1e-9, "the counts started again: {restarted:?}");
    }

    #[test]
    fn interface_that_does_not_exist_has_no_traffic() {
        let mut meter = TrafficMeter::new("nosuchcan7");
        assert_eq!((meter.measure(), meter.measure()), (None, None));
    }
}
