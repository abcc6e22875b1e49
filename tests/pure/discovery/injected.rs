//! Recordings of real cars with the frames of an invented stalk among them.

use std::path::{Path, PathBuf};

use can_log::EntryContent;
use can_log::Log;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::link::BusIndex;
use can_signal::can::mark::DriverMark;
use gateway_base::time::MonoTime;
use vehicle_bringup::discovery::capture::Capture;
use vehicle_bringup::discovery::findings::{Certainty, DiscoveryFindings};
use vehicle_bringup::discovery::timeline::{ActionTimeline, DriverAction};

use crate::support::prerequisite::{require, shared_data};

/// Length of a session, ms; a shorter recording is repeated.
const END_MS: u64 = 91_000;
/// An identifier that none of the recordings has.
const STALK: u16 = 0x7E1;

/// The data frames of a recording with their times, ms; none of one that cannot be read.
fn frames(path: &Path) -> Vec<(u64, Frame)> {
    let Ok(mut log) = Log::open(path) else { return Vec::new() };
    let (mut frames, mut first, mut last) = (Vec::new(), None, 0);
    while let Ok(Some(record)) = log.next_record() {
        let stamp = record.stamp.as_nanos() / 1_000_000;
        let since = u64::try_from(stamp - *first.get_or_insert(stamp)).unwrap_or(0);
        if let EntryContent::Data(frame) = record.content {
            last = since.max(last);
            frames.push((last, frame));
        }
    }
    frames
}

/// The stalk's frame: the state in three bits, a counter, and a sum.
fn stalk(state: u8, at: u64) -> Frame {
    let counter = u8::try_from(at % 16).unwrap();
    let (first, second) = (0x40 | counter, state << 3);
    let sum = first.wrapping_add(second).wrapping_add(0x11);
    Frame::classic(CanId::Standard(STALK), &[first, second, 0x11, sum]).unwrap()
}

/// Number of recordings in which the injected stalk is found; it has to be in all of them.
fn find_in(paths: &[PathBuf]) -> usize {
    let (mut found, mut others) = (0, Vec::new());
    for path in paths {
        let recorded = frames(path);
        let length = recorded.last().map_or(0, |(at, _)| at + 10);
        if recorded.len() < 1000 || length < 5000 {
            continue;
        }
        let actions = [DriverMark::Left, DriverMark::Right, DriverMark::Hazard].repeat(3);
        let on = |index: u64| 10_000 + 9_000 * index;
        let marks = actions.iter().zip(0..).flat_map(|(mark, index)| {
            [
                (MonoTime::from_millis(on(index)), *mark),
                (MonoTime::from_millis(on(index) + 5000), DriverMark::Off),
            ]
        });
        let marks: Vec<_> = marks.collect();
        let state = |ms: u64| {
            let late = ms.saturating_sub(10_700);
            let is_on = ms >= 10_700 && late % 9_000 < 5_000;
            if is_on { [1, 2, 3][usize::try_from(late / 9_000 % 3).unwrap()] } else { 0 }
        };
        let mut all: Vec<_> = (0..END_MS / 50).map(|at| (at * 50, stalk(state(at * 50), at))).collect();
        for start in (0..END_MS).step_by(usize::try_from(length).unwrap()) {
            let repeated = recorded.iter().map(|(at, frame)| (start + at, *frame));
            all.extend(repeated.filter(|(at, _)| *at < END_MS));
        }
        all.sort_by_key(|(at, _)| *at);
        let mut capture = Capture::default();
        for (at, frame) in &all {
            capture.add(BusIndex(0), frame, MonoTime::from_millis(*at));
        }
        let timeline = ActionTimeline::new(&marks, MonoTime::ZERO..MonoTime::from_millis(END_MS));
        let findings = DiscoveryFindings::new(&capture, &timeline);
        let first = findings.turn.first();
        let is_stalk = first.is_some_and(|turn| {
            turn.form.signals().iter().all(|signal| signal.message.id == CanId::Standard(STALK))
        });
        if is_stalk
            && DriverAction::ALL.into_iter().all(|action| findings.certainty(action) == Certainty::Sure)
        {
            found += 1;
        } else {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            others.push((name, first.map(|turn| turn.form.to_string()), findings.certainty));
        }
    }
    println!("found in {found} recordings");
    assert!(others.is_empty(), "{found} found, not in {others:#?}");
    found
}

#[test]
fn an_injected_stalk_is_found_among_the_frames_of_a_real_car() {
    let folder = require!(shared_data()).join("can-logs");
    assert_eq!(find_in(&[folder.join("eld-subaru-va-cruise.log")]), 1);
}

mod slow {
    use super::{find_in, require, shared_data};

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn an_injected_stalk_is_found_among_the_frames_of_real_cars() {
        let folder = require!(shared_data()).join("can-logs");
        let mut paths: Vec<_> =
            std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        assert!(find_in(&paths) >= 15);
    }
}
