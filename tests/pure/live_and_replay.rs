//! A gateway on live inputs decides as a replay of their recording.

use std::path::Path;

use can_log::Log;
use can_signal::can::LinkState;
use can_signal::can::{BusIndex, CanId, CanInput, Frame};
use gateway_base::time::WallStamp;
use gateway_base::time::{MonoTime, Now};
use gateway_core::gateway::GatewaySettings;
use gateway_core::gateway::live::Live;
use signal_gateway::config::files::{DEMO_CONFIG, Embedded};
use signal_gateway::config::{Overrides, load};
use signal_gateway::replay::{Replay, Routes};
use signal_gateway::report::gateway::Changes;

const WALL_MS: i64 = 1_700_000_000_000;

fn read_at(ms: i64) -> Now {
    let mono = MonoTime::from_millis(u64::try_from(ms).unwrap());
    Now { mono, wall: WallStamp::from_nanos((WALL_MS + ms) * 1_000_000) }
}

fn settings() -> GatewaySettings {
    load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap().gateway
}

/// Turn frames of the demo vehicle (0x2A5, state in bits 1 to 3 of byte 2) as received at, value,
/// and read at, ms.
const FRAMES: [(i64, u8, i64); 8] = [
    (0, 0, 4),
    (50, 0, 54),
    (100, 1, 104),
    (349, 1, 362),
    (352, 1, 362),
    (700, 2, 705),
    (710, 5, 715),
    (720, 0, 725),
];

/// Changes of reports and statuses, with their times since the first frame, µs.
type TimedChanges = Vec<(u64, String)>;

fn live_changes() -> TimedChanges {
    let mut live = Live::new(settings(), &[LinkState::Up], read_at(0));
    let mut changes = Changes::default();
    let mut timed = TimedChanges::new();
    for ms in 0..1_200 {
        let frames =
            FRAMES.iter().filter(|(_, _, read)| *read == ms).map(|(received, value, _)| CanInput::Frame {
                bus: BusIndex(0),
                frame: Frame::classic(CanId::Standard(0x2A5), &[0, 0, *value << 1, 0, 0, 0, 0, 0]).unwrap(),
                stamp: read_at(*received).wall,
            });
        live.take(frames, read_at(ms), |_, _| ());
        let mut now = Some(read_at(0));
        while let Some(at) = now {
            while let Some(output) = live.poll_output() {
                let events = changes.of(&output);
                timed.extend(events.iter().map(|event| (at.mono.as_nanos() / 1000, event.to_string())));
            }
            now = live.step(read_at(ms).mono, |_, _| ());
        }
    }
    timed
}

fn replayed_changes() -> TimedChanges {
    let lines = FRAMES.iter().map(|(received, value, _)| {
        let stamp = WALL_MS + received;
        format!("({}.{:03}000) can0 2A5#0000{:02X}0000000000\n", stamp / 1000, stamp % 1000, value << 1)
    });
    let text: String = lines.collect();
    let log = Log::new(Box::new(std::io::Cursor::new(text))).unwrap();
    let routes = Routes::by_interface(&settings());
    let mut replay = Replay::new(settings(), log, routes).unwrap();
    let mut changes = Changes::default();
    let mut timed = TimedChanges::new();
    loop {
        while let Some(output) = replay.poll_output() {
            let at = replay.now().mono.as_nanos() / 1000;
            timed.extend(changes.of(&output).iter().map(|event| (at, event.to_string())));
        }
        if !replay.step().unwrap() {
            return timed;
        }
    }
}

#[test]
fn a_drive_and_its_recording_decide_alike_at_the_same_times() {
    let recorded = replayed_changes();
    let mut lived = live_changes();
    // The recording ends with its last frame, the drive continues.
    lived.retain(|(at, _)| *at <= 720_000);
    assert_eq!(lived, recorded);
    let texts: Vec<_> = recorded.iter().map(|(_, text)| text.as_str()).collect();
    assert!(texts.iter().any(|text| text.ends_with("left")));
    assert!(texts.iter().any(|text| text.contains("stale")), "{texts:?}");
    assert!(texts.iter().any(|text| text.contains("invalid")));
}

#[test]
fn a_frame_received_in_time_but_read_late_is_in_time() {
    // Received 249 ms after the one before, read 262 ms after it; the limit is 250 ms.
    assert!(!live_changes().iter().any(|(at, text)| *at < 362_000 && text.contains("stale")));
}
