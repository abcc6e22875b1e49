//! The kernel's counts of all frames on an interface, and the bus load.
//!
//! The gateway's own sockets receive only frames of the vehicle profile, so the counts come from the
//! interface (`/sys/class/net/…/statistics`).

use std::collections::VecDeque;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use super::controller::bitrate;
use can_signal::can::TrafficSnapshot;
use gateway_base::diagnostics::RateMeter;

/// Minimum time between two readings of the counts.
const MIN_INTERVAL: Duration = Duration::from_millis(900);
/// Bits of a classical frame with an 11-bit identifier, without its data: 44, plus 3 between frames.
const FRAME_BITS: f64 = 47.0;

/// Measures the traffic of one interface over [`RateMeter::WINDOW`], like the rates of the profile's
/// messages.
#[derive(Debug)]
pub struct TrafficMeter {
    interface: String,
    /// Readings within the window and the last one before it, oldest first.
    readings: VecDeque<(Instant, FrameCounts)>,
    last: Option<TrafficSnapshot>,
}

/// Frames and data bytes since the interface came up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FrameCounts {
    frames: u64,
    bytes: u64,
}

impl TrafficMeter {
    /// Creates a meter for an interface.
    pub fn new(interface: &str) -> Self {
        Self { interface: interface.to_owned(), readings: VecDeque::new(), last: None }
    }

    /// Returns the traffic up to now; `None` within the first second, or if the interface does not exist.
    pub fn measure(&mut self) -> Option<TrafficSnapshot> {
        let now = Instant::now();
        if self.readings.back().is_some_and(|(before, _)| now - *before < MIN_INTERVAL) {
            return self.last;
        }
        let bitrate = bitrate(&self.interface);
        let before = self.take(now, counts(&self.interface, bitrate.is_none()));
        let newest = self.readings.back().map(|(_, counts)| *counts);
        self.last =
            before.zip(newest).map(|((at, before), counts)| traffic(before, counts, now - at, bitrate));
        self.last
    }

    /// Adds a reading, and returns the earlier reading from which rates are computed.
    fn take(&mut self, now: Instant, counts: Option<FrameCounts>) -> Option<(Instant, FrameCounts)> {
        let Some(counts) = counts else {
            self.readings.clear();
            return None;
        };
        if self.readings.back().is_some_and(|(_, before)| counts.frames < before.frames) {
            // The interface was recreated.
            self.readings.clear();
        }
        // After a pause, rates start from the newest reading instead of averaging over the pause.
        while self.readings.len() > 1
            && self.readings.front().is_some_and(|(at, _)| now - *at > RateMeter::WINDOW)
        {
            self.readings.pop_front();
        }
        let before = self.readings.front().copied();
        self.readings.push_back((now, counts));
        before
    }
}

/// Returns true for an interface without hardware.
pub fn is_virtual(interface: &str) -> bool {
    Path::new("/sys/devices/virtual/net").join(interface).exists()
}

fn counts(interface: &str, has_no_bitrate: bool) -> Option<FrameCounts> {
    let read = |name: &str| -> Option<u64> {
        let text = fs::read_to_string(format!("/sys/class/net/{interface}/statistics/{name}")).ok()?;
        text.trim().parse().ok()
    };
    counted(has_no_bitrate && is_looped(interface), read)
}

/// Returns true for `vcan`, whose driver returns each sent frame to the same interface; `vxcan` passes it to
/// a peer. `slcan` has no peer, but it has a bit rate.
fn is_looped(interface: &str) -> bool {
    let index = |name: &str| fs::read_to_string(format!("/sys/class/net/{interface}/{name}")).ok();
    let has_no_peer = index("iflink") == index("ifindex");
    is_virtual(interface) && has_no_peer
}

/// Returns received and sent frames. The kernel also counts a frame sent on a looped interface as received.
fn counted(is_looped: bool, read: impl Fn(&str) -> Option<u64>) -> Option<FrameCounts> {
    let sum = |received: &str, sent: &str| {
        let sent = if is_looped { Some(0) } else { read(sent) };
        Some(read(received)?.saturating_add(sent?))
    };
    Some(FrameCounts { frames: sum("rx_packets", "tx_packets")?, bytes: sum("rx_bytes", "tx_bytes")? })
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
        // 1000 frames of 111 bits per second.
        let expected =
            TrafficSnapshot { rate_hz: 1000.0, load_percent: Some(22.2), bitrate_bps: Some(500_000) };
        assert_eq!(on_wire, expected);
        assert_eq!(traffic(before, now, two_seconds, None).load_percent, None);
        let restarted = traffic(now, before, two_seconds, None);
        assert!(restarted.rate_hz.abs() < 1e-9, "the counts started again: {restarted:?}");
    }

    #[test]
    fn frame_that_a_virtual_interface_loops_is_counted_once() {
        // 100 frames were sent, and the kernel received each of them again.
        let read = |name: &str| Some(if name.ends_with("packets") { 100 } else { 800 });
        assert_eq!(counted(true, read), Some(FrameCounts { frames: 100, bytes: 800 }));
        assert_eq!(counted(false, read), Some(FrameCounts { frames: 200, bytes: 1_600 }));
    }

    #[test]
    fn rate_is_counted_over_the_window_of_the_other_rates() {
        let (mut meter, start) = (TrafficMeter::new("can0"), Instant::now());
        let mut taken = |second: u64, frames| {
            let now = start + Duration::from_secs(second);
            meter.take(now, Some(FrameCounts { frames, bytes: 0 })).map(|(at, _)| (now - at).as_secs())
        };
        let spans: Vec<_> = (0..8).map(|second| taken(second, second * 100)).collect();
        assert_eq!(spans, [None, Some(1), Some(2), Some(3), Some(4), Some(5), Some(5), Some(5)]);
        assert_eq!(meter.take(start + Duration::from_secs(9), None), None);
    }

    #[test]
    fn interface_that_does_not_exist_has_no_traffic() {
        let mut meter = TrafficMeter::new("nosuchcan7");
        assert_eq!((meter.measure(), meter.measure()), (None, None));
    }
}
