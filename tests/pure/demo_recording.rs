//! The shipped recording of the demo vehicle is what its generator makes, and shows each kind of report.

#[path = "../../examples/demo_recording/mod.rs"]
mod generator;

use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::read::GzDecoder;
use signal_gateway::report::story;

use generator::story::{LENGTH_MS, STORY, Scene};
use generator::{START_S, write_recording, write_story};

/// A message with what a scene switches.
struct Switched {
    id: &'static str,
    /// What is switched, in the payload.
    bits: fn(u64) -> u64,
    /// The same in a scene; `None` where the message is not sent.
    expected: fn(&Scene) -> Option<u64>,
}

const SWITCHED: [Switched; 5] = [
    Switched {
        id: "2A5",
        bits: |data| data >> 17 & 7 | (data >> 24 & 1) << 3,
        expected: |scene| Some(u64::from(scene.turn?) | u64::from(scene.lamp_fault) << 3),
    },
    Switched { id: "2C1", bits: |data| data >> 8 & 3, expected: |scene| Some(scene.hazard.into()) },
    Switched { id: "1A0", bits: |data| data & 15, expected: |scene| Some(scene.gear.into()) },
    Switched { id: "1E6", bits: |data| data & 7, expected: |scene| Some(scene.mode.into()) },
    Switched { id: "2E0", bits: |data| data & 31, expected: |scene| Some(scene.doors.into()) },
];

struct Line {
    /// Microseconds after the start.
    us: u64,
    id: String,
    data: u64,
}

fn generated() -> String {
    let mut bytes = Vec::new();
    write_recording(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

fn lines(recording: &str) -> Vec<Line> {
    recording.lines().map(parse).collect()
}

fn parse(line: &str) -> Line {
    let [stamp, "can0", frame] = line.split(' ').collect::<Vec<_>>()[..] else { panic!("{line}") };
    let stamp = stamp.strip_prefix('(').and_then(|stamp| stamp.strip_suffix(')')).unwrap();
    let (sec, usec) = stamp.split_once('.').unwrap();
    let (id, data) = frame.split_once('#').unwrap();
    assert_eq!((usec.len(), data.len()), (6, 16), "{line}");
    Line {
        us: (sec.parse::<u64>().unwrap() - START_S) * 1_000_000 + usec.parse::<u64>().unwrap(),
        id: id.to_owned(),
        data: u64::from_str_radix(data, 16).unwrap().swap_bytes(),
    }
}

#[test]
fn the_shipped_recording_is_what_the_generator_makes() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
    let mut shipped = String::new();
    GzDecoder::new(File::open(path).unwrap()).read_to_string(&mut shipped).unwrap();
    assert!(shipped == generated(), "run: cargo run --example make_demo_recording -- config/demo.log.gz");
}

#[test]
fn the_bus_is_as_busy_as_a_real_one_and_its_stamps_never_go_back() {
    let lines = lines(&generated());
    assert!(lines.windows(2).all(|pair| pair[0].us <= pair[1].us));
    let last_ms = lines.last().unwrap().us / 1000;
    assert!((LENGTH_MS - 100..LENGTH_MS + 100).contains(&last_ms), "{last_ms}");
    let per_second = lines.len() as u64 * 1000 / LENGTH_MS;
    assert!((1400..=1600).contains(&per_second), "{per_second}");
    let ids: BTreeSet<_> = lines.iter().map(|line| line.id.as_str()).collect();
    assert_eq!(ids.len(), 30);
    assert!(ids.contains("18FF5A21"), "a 29-bit identifier has eight digits");
}

#[test]
fn each_scene_is_on_the_bus_from_its_first_moment_to_its_last() {
    let lines = lines(&generated());
    let ends = STORY.iter().skip(1).map(|scene| scene.from_ms).chain([LENGTH_MS]);
    for (scene, end_ms) in STORY.iter().zip(ends) {
        for Switched { id, bits, expected } in SWITCHED {
            // A frame may wait a moment for the bus.
            let times = scene.from_ms * 1000 + 5_000..end_ms * 1000;
            let frames = lines.iter().filter(|line| line.id == id && times.contains(&line.us));
            let values: BTreeSet<_> = frames.map(|line| bits(line.data)).collect();
            assert_eq!(values, expected(scene).into_iter().collect(), "{id}: {}", scene.text);
        }
    }
}

#[test]
fn the_gearbox_and_the_wheels_report_one_speed_unless_a_scene_halves_it() {
    let lines = lines(&generated());
    let big_endian = |data: u64, byte: u32| (data >> (8 * byte)).swap_bytes() >> 48;
    let (mut rear, mut has_driven, mut is_halved) = (0, false, false);
    for line in &lines {
        match line.id.as_str() {
            "0B2" => rear = u64::midpoint(big_endian(line.data, 4), big_endian(line.data, 6)),
            "158" => {
                let scene = STORY.iter().rfind(|scene| scene.from_ms * 1000 + 25_000 <= line.us);
                let is_half = scene.is_some_and(|scene| scene.half_speed);
                let expected = if is_half { rear / 2 } else { rear };
                // 0.5 km/h, since the messages are up to 20 ms apart.
                let is_near = (line.data & 0xFFFF).abs_diff(expected) < 50;
                let is_switched = STORY.iter().any(|scene| line.us.abs_diff(scene.from_ms * 1000) < 25_000);
                assert!(is_near || is_switched, "{expected} at {} us", line.us);
                (has_driven, is_halved) = (has_driven || rear > 3_000, is_halved || is_half);
            }
            _ => {}
        }
    }
    assert!(has_driven && is_halved);
}

#[test]
fn the_story_has_a_line_for_each_scene() {
    let mut text = Vec::new();
    write_story(&mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    assert_eq!(text.lines().count(), STORY.len());
    assert!(text.contains("  43.5 s  turn message silent, bus alive"), "{text}");
}

#[test]
fn each_scene_has_a_caption_from_its_first_moment_on() {
    let captions: Vec<_> = story::DEMO.iter().map(|caption| caption.from.as_nanos() / 1_000_000).collect();
    assert_eq!(captions, STORY.map(|scene| scene.from_ms));
}
