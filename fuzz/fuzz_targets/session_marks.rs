//! Any bytes are read as marks of a session, or refused with the number of a line; and what a session of them
//! comes to, with frames made of the same bytes, is found without a panic.

#![no_main]

use libfuzzer_sys::fuzz_target;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::link::BusIndex;
use vehicle_bringup::discovery::capture::Capture;
use vehicle_bringup::discovery::findings::DiscoveryFindings;
use vehicle_bringup::discovery::timeline::ActionTimeline;
use gateway_base::time::MonoTime;
use signal_gateway::desk::recorded_session::marks;

fuzz_target!(|bytes: &[u8]| {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let marks = match marks(text) {
        Ok(marks) => marks,
        Err(why) => return assert!(why.number > 0),
    };
    assert!(marks.iter().all(|(time, _)| time.is_finite() && *time >= 0.0));
    let at = |seconds: f64| MonoTime::from_millis((seconds.min(1e9) * 1000.0) as u64);
    let mut marks: Vec<_> = marks.iter().map(|(time, mark)| (at(*time), *mark)).collect();
    marks.sort_by_key(|(time, _)| *time);
    let mut capture = Capture::default();
    for (index, data) in bytes.chunks(4).enumerate() {
        let id = CanId::Standard(u16::from(data[0] % 3));
        let Some(frame) = Frame::classic(id, data) else { return };
        capture.add(BusIndex(0), &frame, MonoTime::from_millis(index as u64 * 300));
    }
    let Some((start, end)) = capture.span() else { return };
    let findings = DiscoveryFindings::new(&capture, &ActionTimeline::new(&marks, start..end));
    assert!(!findings.is_usable() || !findings.turn.is_empty());
});
