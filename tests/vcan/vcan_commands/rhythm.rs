//! How regular cyclic frames are, by the kernel's stamps. Printed, not judged: it is a matter of the
//! machine.

use std::time::Duration;

use super::recording::{BusTime, RecordedFrame, Recording};
use super::vehicles::{Change, NEW_EAGLE, PACMOD, Vehicle};
use crate::support::prerequisite::require;
use crate::support::process::{self, Process};
use crate::support::vcan::Vcan;

/// A message as fast as it may be. A least distance as long as the period would make every delay last.
const FAST: Change = Change {
    profile: &[("period_ms = 50", "period_ms = 10\nmin_send_interval_ms = 5")],
    profile_end: "",
    dbc_end: "",
};

/// A message, and how many frames of it are measured.
type Measurement = (&'static Vehicle, &'static str, Change, usize);

#[test]
fn cyclic_frames_come_in_their_rhythm_with_jitter_as_printed() {
    let vcan = require!(Vcan::new("vcan-rhythm"));
    measure(&vcan, (&NEW_EAGLE, "10 ms", FAST, 300));
}

mod slow {
    use super::{Change, Measurement, NEW_EAGLE, PACMOD, Vcan, measure, require};

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn cyclic_frames_as_shipped_come_in_their_rhythm_with_jitter_as_printed() {
        let vcan = require!(Vcan::new("vcan-rhythms"));
        let messages: [Measurement; 2] = [
            (&NEW_EAGLE, "50 ms, as shipped", Change::NONE, 60),
            (&PACMOD, "100 ms, as shipped", Change::NONE, 40),
        ];
        for message in messages {
            measure(&vcan, message);
        }
    }
}

fn measure(vcan: &Vcan, (vehicle, name, change, count): Measurement) {
    let ros = process::ros();
    let folder = vehicle.folder(vcan.name, &format!("[command]\ntx = \"on\"\n{ros}"), &change);
    let mut recording = Recording::of(vcan.name);
    let mut gateway = Process::run(&folder);
    // Nobody commands anything, and the frames that request nothing go out all the same.
    recording.wait(BusTime::START, vehicle.command(), name, |frames| frames.len() > count);
    gateway.stop("TERM");
    recording.finish();
    let frames = recording.since(BusTime::START, vehicle.command());
    assert_eq!(vehicle.runs(&frames), [vehicle.nothing()]);
    // The last one announces the end, outside the period.
    measured(name, &frames[..frames.len() - 1]);
}

/// Prints the distances from frame to frame.
pub(crate) fn measured(what: &str, frames: &[RecordedFrame]) {
    let mut gaps: Vec<_> = frames.windows(2).map(|pair| pair[1].at.saturating_sub(pair[0].at)).collect();
    gaps.sort();
    let at = |share: usize| ms(gaps[(gaps.len() - 1) * share / 100]);
    let mean = gaps.iter().sum::<Duration>() / u32::try_from(gaps.len()).unwrap();
    println!(
        "measured: {what}: {} distances, mean {} min {} median {} p99 {} max {} ms, {}",
        gaps.len(),
        ms(mean),
        at(0),
        at(50),
        at(99),
        at(100),
        kernel()
    );
}

pub(crate) fn ms(time: Duration) -> String {
    format!("{:.2}", time.as_secs_f64() * 1e3)
}

/// Where this was measured.
fn kernel() -> &'static str {
    let is_guest =
        std::fs::read_to_string("/proc/cpuinfo").is_ok_and(|text| text.contains("User Mode Linux"));
    if is_guest {
        "in the guest of tests/with-vcan (one CPU, not the real machine)"
    } else {
        "on this kernel"
    }
}
