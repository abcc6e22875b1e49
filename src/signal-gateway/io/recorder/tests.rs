//! Tests the recorder in writable and unwritable folders.

use std::fs::File;
use std::process::Command;
use std::thread;

use super::*;
use crate::io::mcap::encoder::RecordedBus;
use crate::io::ros::topics::{Durability, Topics};
use crate::waiting::{DEADLINE, described, wait_until};
use gateway_base::time::{Now, WallStamp};
use gateway_core::gateway::black_box::{BlackBox, BlackBoxSettings};

/// Creates a recording of a fault at `seconds` since 1970.
fn recording(seconds: i64) -> Recording {
    let limits = BlackBoxSettings { before: RETRY, after: RETRY, most_inputs: 10, most_outputs: 10 };
    let mut black_box = BlackBox::new(limits, vec!["can0".to_owned()], Vec::new());
    let wall = WallStamp::from_nanos(seconds * 1_000_000_000);
    black_box.decided("ERROR".to_owned(), true, Now { mono: MonoTime::ZERO, wall });
    black_box.flush().unwrap()
}

fn start(folder: &Path, keep: usize) -> BlackBoxRecorder {
    let bus = RecordedBus { name: "body".to_owned(), interface: "can0".to_owned() };
    let encoder = Encoder::new(&Topics::default(), Durability::Volatile, "car", &[bus], &[]);
    BlackBoxRecorder::start(folder, keep, |_, text| text.to_owned(), encoder).unwrap()
}

/// Writes the recordings in sequence and waits for the last.
fn save(recorder: &BlackBoxRecorder, recordings: impl IntoIterator<Item = Recording>) -> RecorderState {
    for recording in recordings {
        let before = recorder.state();
        recorder.save(recording);
        wait_for(recorder, |state| state.written + state.failures > before.written + before.failures);
    }
    recorder.state()
}

fn wait_for(recorder: &BlackBoxRecorder, is_there: impl Fn(&RecorderState) -> bool) {
    let what = described(|| format!("another state than {:?}", recorder.state()));
    wait_until(what, || is_there(&recorder.state()));
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn counters(folder: &Path) -> Vec<String> {
    let names = names(folder).into_iter();
    let logs =
        names.filter(|name| name.starts_with(PREFIX) && Path::new(name).extension() == Some("log".as_ref()));
    logs.map(|name| name.split('-').nth(1).unwrap().to_owned()).collect()
}

#[test]
fn newest_recordings_are_kept_and_other_files_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("notes.log"), "mine").unwrap();
    let recorder = start(folder.path(), 2);
    let state = save(&recorder, [1, 2, 3].map(recording));
    let name = |counter: u32| format!("fault-{counter:06}-{}-19700101T00000{counter}Z", boot());
    let [second, third] = [2, 3].map(name);
    let files_of = |stem| ["decisions", "log", "mcap"].map(|extension| format!("{stem}.{extension}"));
    let mut expected: Vec<_> = [&second, &third].into_iter().flat_map(files_of).collect();
    expected.push("notes.log".to_owned());
    assert_eq!(names(folder.path()), expected);
    assert_eq!((state.newest, state.recordings), (Some(format!("{third}.log")), 2));
    assert_eq!((state.written, state.failures, state.is_failing), (3, 0, false));
    assert_eq!(fs::read_to_string(folder.path().join(format!("{third}.decisions"))).unwrap(), "ERROR\n");
}

#[test]
fn clock_behind_does_not_make_the_newest_recording_the_oldest() {
    let folder = tempfile::tempdir().unwrap();
    save(&start(folder.path(), 2), [1_767_225_600, 1_767_225_700].map(recording));
    // The next boot begins in 1970. A recording named only by its time is older than all recordings with a
    // counter.
    fs::write(folder.path().join("fault-1999999999.000.log"), "").unwrap();
    let state = save(&start(folder.path(), 2), [recording(5)]);
    assert_eq!(counters(folder.path()), ["000002", "000003"]);
    assert!(state.newest.unwrap().ends_with("-19700101T000005Z.log"));
}

#[test]
fn what_an_interrupted_write_left_is_removed_at_start() {
    let folder = tempfile::tempdir().unwrap();
    save(&start(folder.path(), 5), [recording(1)]);
    for left in
        ["fault-000002-x.draft", "fault-000002-x.decisions", "fault-000003-x.mcap", "fault-test.draft"]
    {
        fs::write(folder.path().join(left), "").unwrap();
    }
    let recorder = start(folder.path(), 5);
    wait_for(&recorder, |state| state.newest.is_some());
    assert_eq!(names(folder.path()).len(), 3, "{:?}", names(folder.path()));
    assert_eq!(recorder.state().recordings, 1);
}

#[test]
fn removed_folder_is_made_again_and_the_counter_continues() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("a/box");
    let recorder = start(&folder, 5);
    save(&recorder, [recording(1)]);
    fs::remove_dir_all(parent.path().join("a")).unwrap();
    let state = save(&recorder, [recording(2)]);
    assert_eq!(counters(&folder), ["000002"]);
    assert_eq!((state.recordings, state.failures), (1, 0));
}

#[test]
fn folder_that_is_a_file_is_reported_and_used_once_it_is_a_folder() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("box");
    fs::write(&folder, "").unwrap();
    let recorder = start(&folder, 5);
    wait_for(&recorder, |state| state.is_failing);
    let state = save(&recorder, [recording(1)]);
    assert_eq!((state.written, state.newest), (0, None));
    assert!(state.last_error.unwrap().contains("File exists"));
    fs::remove_file(&folder).unwrap();
    let state = save(&recorder, [recording(2)]);
    assert_eq!((state.written, state.is_failing), (1, false));
}

#[test]
fn slow_disk_never_blocks_and_what_it_loses_is_counted() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("box");
    fs::create_dir(&folder).unwrap();
    // The first write blocks until this pipe has a reader.
    let pipe = folder.join("fault-test.draft");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut recorder = start(&folder, 5);
    for second in 0..4 {
        recorder.save(recording(second));
    }
    let state = recorder.state();
    assert_eq!((state.failures, state.is_failing), (3, true), "one waits, three are lost");
    assert!(state.last_error.unwrap().contains("too slow"));
    let stopping = thread::spawn(move || {
        recorder.stop(Duration::from_millis(20));
        recorder
    });
    wait_until("a stop that leaves the disk alone", || stopping.is_finished());
    let recorder = stopping.join().unwrap();
    // The thread continues when the disk accepts data again.
    drop(File::open(&pipe).unwrap());
    wait_for(&recorder, |state| state.written == 1);
}

#[test]
fn stop_waits_for_what_was_handed_over() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = start(folder.path(), 5);
    recorder.save(recording(1));
    recorder.stop(DEADLINE);
    assert_eq!(counters(folder.path()), ["000001"]);
}

#[test]
fn disk_without_room_for_the_mcap_file_keeps_the_log_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_owned();
    let mut black_box = Folder { path: path.clone(), keep: 9, boot: "0".repeat(8), last_counter: 0 };
    let saved = black_box
        .save("20260101T000000Z", "log", "decisions", |draft| {
            fs::write(draft, "a part of it")?;
            Err(io::ErrorKind::StorageFull.into())
        })
        .unwrap();
    assert_eq!(fs::read_to_string(&saved.path).unwrap(), "log");
    assert!(saved.mcap.unwrap_err().to_string().starts_with("without its MCAP file"), "the cause is lost");
    let stem = "fault-000001-00000000-20260101T000000Z";
    assert_eq!(names(&path), [format!("{stem}.decisions"), format!("{stem}.log")]);
    assert_eq!(black_box.prune().unwrap(), Kept { newest: Some(format!("{stem}.log")), recordings: 1 });
}
