//! Buses that fall asleep and wake up, and buses that share identifiers.

use std::fmt::Write;

use gateway_base::diagnostics::Level;

use crate::pure::vehicles::payload::frame;
use crate::pure::vehicles::playback::{HAZARD, Playback, TURN, play_text};
use crate::pure::vehicles::profile;

/// A candump log in the making.
#[derive(Default)]
struct Recording {
    /// Millisecond, interface and frame.
    lines: Vec<(u64, &'static str, String)>,
}

impl Recording {
    /// A frame every `period` ms within the times.
    fn every(
        mut self,
        period: u64,
        times: std::ops::Range<u64>,
        interface: &'static str,
        text: &str,
    ) -> Self {
        let frame = frame(text).to_string();
        for ms in times.step_by(usize::try_from(period).unwrap()) {
            self.lines.push((ms, interface, frame.clone()));
        }
        self
    }

    fn once(self, ms: u64, interface: &'static str, text: &str) -> Self {
        self.every(1, ms..ms + 1, interface, text)
    }

    fn text(mut self) -> String {
        self.lines.sort_by_key(|(ms, ..)| *ms);
        self.lines.iter().fold(String::new(), |mut text, (ms, interface, frame)| {
            writeln!(text, "({}.{:03}000) {interface} {frame}", 1_700_000_000 + ms / 1000, ms % 1000)
                .unwrap();
            text
        })
    }

    fn play(self, profile_name: &str) -> Playback {
        play_text(profile(profile_name), &self.text(), "can0")
    }
}

fn levels(playback: &Playback, task: &str) -> Vec<(u64, Level)> {
    playback.changes_of(task).map(|change| (change.ms(), change.level)).collect()
}

#[test]
fn a_bus_that_sleeps_and_wakes_is_reported_once_by_each_task() {
    let turn = "2A5 8 19|3@0=1";
    let hazard = "2C1 8 8|2@1=0";
    let playback = Recording::default()
        .every(50, 0..2_000, "can0", turn)
        .every(100, 0..2_000, "can0", hazard)
        .every(50, 17_000..19_000, "can0", turn)
        .every(100, 17_000..19_000, "can0", hazard)
        .play("demo_vehicle");
    assert_eq!(playback.turn, [(0, "ENABLE_LEFT"), (2_200, "stops"), (17_000, "ENABLE_LEFT")]);
    assert_eq!(playback.hazard, [(0, "DISABLE"), (2_400, "stops"), (17_000, "DISABLE")]);
    let (ok, warn, error) = (Level::Ok, Level::Warn, Level::Error);
    assert_eq!(levels(&playback, TURN), [(0, warn), (0, ok), (2_200, error), (17_000, ok)]);
    assert_eq!(levels(&playback, HAZARD), [(0, warn), (0, ok), (2_400, error), (17_000, ok)]);
    assert_eq!(levels(&playback, "can0"), [(0, warn), (0, ok), (2_950, warn), (17_000, ok)]);
}

#[test]
fn an_event_message_must_be_received_again_after_its_bus_was_silent() {
    let (alive, left, none) = ("620 8", "614 8 29|2@0=1", "614 8 29|2@0=3");
    let playback = Recording::default()
        .every(300, 0..3_000, "can0", alive)
        .once(1_000, "can0", left)
        .every(300, 18_000..30_000, "can0", alive)
        .once(25_000, "can0", none)
        .play("toyota_nodsu");
    assert_eq!(playback.turn, [(1_000, "ENABLE_LEFT"), (4_200, "stops"), (25_000, "DISABLE")]);
    assert_eq!(playback.hazard, [(1_000, "DISABLE"), (4_200, "stops"), (25_000, "DISABLE")]);
    for task in [TURN, HAZARD] {
        let messages: Vec<_> = playback.statuses_of(task).into_iter().map(|(_, message)| message).collect();
        let (start, messages) = messages.split_first().unwrap();
        assert!(start.starts_with("starting: "), "{start}");
        let expected = [
            "publishing",
            "unknown: BLINKERS_STATE may have changed: no frame of the vehicle profile on can0",
            "unknown: no new frame of BLINKERS_STATE (614) on can0 yet",
            "publishing",
        ];
        assert_eq!(messages, expected, "{task}");
    }
    let (ok, warn) = (Level::Ok, Level::Warn);
    assert_eq!(levels(&playback, "can0"), [(0, warn), (0, ok), (4_200, warn), (18_000, ok)]);
}

#[test]
fn an_event_message_holds_for_as_long_as_its_bus_is_awake() {
    let playback = Recording::default()
        .every(300, 0..120_000, "can0", "620 8")
        .once(1_000, "can0", "614 8 29|2@0=2 27|1@0=0")
        .play("toyota_nodsu");
    assert_eq!(playback.turn, [(1_000, "ENABLE_RIGHT")]);
    assert_eq!(levels(&playback, TURN), [(0, Level::Warn), (1_000, Level::Ok)]);
}

#[test]
fn the_same_identifier_on_another_bus_is_another_message() {
    // Left on one bus; on the other the same bits are a counter of something else.
    let text = Recording::default()
        .every(100, 0..1_000, "can0", "541 8 42|1@1=1 19|2@1=1")
        .every(100, 1_000..5_000, "can0", "541 8 42|1@1=1")
        .every(20, 7..5_000, "can1", "541 8 40|8@1=171")
        .text();
    let settings = profile("hyundai_kia");
    let bound = play_text(settings, &text, "can0");
    assert_eq!(
        bound.turn,
        [(0, "ENABLE_LEFT"), (1_930, "DISABLE")],
        "by the lamps, a hold after the last flash"
    );
    assert_eq!(bound.value(TURN, "frames"), "50");
    assert_eq!(levels(&bound, TURN), [(0, Level::Warn), (0, Level::Ok)]);
    let other = play_text(settings, &text, "can1");
    assert_eq!(other.turn, [(7, "ENABLE_RIGHT"), (1_037, "DISABLE")], "171 has bit 41 and not bit 42");
}

#[test]
fn one_lost_frame_is_not_a_silence() {
    let frames = Recording::default().every(100, 0..1_000, "can0", "128 8 16|8@1=8");
    let playback = frames.every(100, 1_400..2_000, "can0", "128 8 16|8@1=8").play("ford_falcon_fg");
    assert_eq!(playback.turn, [(0, "ENABLE_LEFT")]);
}
