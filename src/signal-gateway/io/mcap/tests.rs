//! Tests files, bags and the recorder on working and failing disks.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::bag::{Bag, FileLimits};
use super::encoder::{Encoder, RecordedBus, RecordedMessage};
use super::file::McapFile;
use super::recorder::{McapRecorder, RecorderLimits};
use crate::io::ros::topics::{Durability, Topics};
use crate::waiting::{DEADLINE, described, wait_until};
use can_signal::can::{BusIndex, CanId, CanInput, Frame};
use gateway_base::time::WallStamp;
use ros_messages::schema;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";

fn encoder() -> Encoder {
    let bus = RecordedBus { name: "body".to_owned(), interface: "can0".to_owned() };
    Encoder::new(&Topics::default(), Durability::Volatile, "car", &[bus], &[])
}

fn input(second: i64) -> (CanInput, WallStamp) {
    let stamp = WallStamp::from_nanos(second * 1_000_000_000);
    let frame = Frame::classic(CanId::Standard(0x123), &second.to_le_bytes()).unwrap();
    (CanInput::Frame { bus: BusIndex(0), frame, stamp }, stamp)
}

fn message(encoder: &Encoder, second: i64) -> RecordedMessage {
    let (input, at) = input(second);
    encoder.received(&input, at).unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn bytes_that_the_disk_refuses_wait_and_are_written_once_it_takes_them() {
    let encoder = encoder();
    let folder = tempfile::tempdir().unwrap();
    let (full, whole) = (Path::new("/dev/full"), folder.path().join("whole.mcap"));
    let mut files = [full, &whole].map(|path| McapFile::create(path, true).unwrap());
    for file in &mut files {
        file.add(&message(&encoder, 1), encoder.channels()).unwrap();
    }
    let [refused, taken] = &mut files;
    for _ in 0..2 {
        assert_eq!(refused.flush().unwrap_err().kind(), std::io::ErrorKind::StorageFull);
    }
    taken.flush().unwrap();
    assert_eq!(refused.written_bytes(), 0);
    assert_eq!(refused.pending_bytes() as u64, taken.written_bytes());
    assert_eq!(taken.pending_bytes(), 0);
    taken.finish().unwrap();
    let bytes = fs::read(&whole).unwrap();
    assert!(bytes.starts_with(MAGIC) && bytes.ends_with(MAGIC));
}

#[test]
fn bag_goes_on_in_a_new_file_after_its_time_and_loses_its_oldest_on_request() {
    let encoder = encoder();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bag");
    let limits = FileLimits { bytes: u64::MAX, duration: Duration::from_secs(2) };
    let mut bag = Bag::create(&path, limits, encoder.channels()).unwrap();
    for second in 10..17 {
        bag.add(&message(&encoder, second)).unwrap();
        bag.flush().unwrap();
    }
    assert_eq!(names(&path), ["bag_0.mcap", "bag_1.mcap", "bag_2.mcap", "metadata.yaml"]);
    let metadata = || fs::read_to_string(path.join("metadata.yaml")).unwrap();
    assert!(metadata().contains("  message_count: 7\n"), "{}", metadata());
    let size = fs::metadata(path.join("bag_0.mcap")).unwrap().len();
    assert_eq!(bag.remove_oldest().unwrap(), Some(size));
    assert_eq!(names(&path), ["bag_1.mcap", "bag_2.mcap", "metadata.yaml"]);
    bag.finish().unwrap();
    let text = metadata();
    assert!(text.contains("nanoseconds_since_epoch: 13000000000\n  message_count: 4\n"), "{text}");
    assert!(!text.contains("bag_0.mcap") && text.contains("        nanoseconds: 2000000000\n"), "{text}");
    for name in ["bag_1.mcap", "bag_2.mcap"] {
        assert!(fs::read(path.join(name)).unwrap().ends_with(MAGIC), "{name}");
    }
}

fn start(folder: &Path, total_bytes: u64) -> McapRecorder {
    McapRecorder::start(folder, RecorderLimits { file: FileLimits::NONE, total_bytes }, encoder()).unwrap()
}

fn record_one(recorder: &McapRecorder, second: i64) {
    let (input, at) = input(second);
    recorder.received(input, at);
    recorder.stop(DEADLINE);
}

/// Returns the bags of a folder, ordered by the number in their names.
fn bags(folder: &Path) -> Vec<(String, PathBuf)> {
    let number = |name: &String| name.split('_').nth(1).unwrap().to_owned();
    names(folder).iter().map(|name| (number(name), folder.join(name))).collect()
}

#[test]
fn each_start_begins_a_bag_and_the_oldest_make_room() {
    let folder = tempfile::tempdir().unwrap();
    let bags_of = || bags(folder.path()).into_iter().map(|(number, _)| number).collect::<Vec<_>>();
    // The clock of the third is behind.
    for second in [1_767_225_600, 1_767_225_700, 5] {
        record_one(&start(folder.path(), u64::MAX), second);
    }
    assert_eq!(bags_of(), ["000001", "000002", "000003"]);
    let recorder = start(folder.path(), 1);
    let (input, at) = input(9);
    recorder.received(input, at);
    wait_until(described(|| format!("one bag: {:?}", recorder.state())), || bags_of() == ["000004"]);
    recorder.stop(DEADLINE);
    let state = recorder.state();
    assert_eq!((state.messages, state.lost, state.failures, state.is_failing), (1, 0, 0, false));
    assert_eq!(state.files, 1, "the only file of the newest bag stays, whatever its size");
}

#[test]
fn folder_that_cannot_be_made_costs_what_is_recorded_and_is_told_of() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let recorder = start(&file.join("bags"), u64::MAX);
    let record = |second| {
        let (input, at) = input(second);
        recorder.received(input, at);
    };
    record(0);
    wait_until(described(|| format!("a loss: {:?}", recorder.state())), || recorder.state().lost > 0);
    record(1);
    record(2);
    recorder.stop(DEADLINE);
    let state = recorder.state();
    assert_eq!((state.messages, state.lost, state.is_failing), (0, 3, true));
    // Still the first cause, although the folder is not retried for each message.
    let cause = fs::create_dir_all(file.join("bags")).unwrap_err().to_string();
    assert_eq!(state.last_error, Some(cause));
}

#[test]
fn schema_has_constants_and_every_type_in_it_once() {
    let separator = "=".repeat(80);
    let text = schema("diagnostic_msgs/msg/DiagnosticArray").unwrap();
    let parts: Vec<_> = text.split(&separator).collect();
    assert_eq!(parts[0], "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n");
    let names: Vec<_> = parts[1..].iter().map(|part| part.lines().nth(1).unwrap()).collect();
    assert_eq!(
        names,
        [
            "MSG: std_msgs/Header",
            "MSG: diagnostic_msgs/DiagnosticStatus",
            "MSG: builtin_interfaces/Time",
            "MSG: diagnostic_msgs/KeyValue"
        ]
    );
    assert!(parts[2].contains("\nbyte ERROR=2\n") && parts[2].contains("\nbyte level\n"), "{text}");
    assert_eq!(schema("std_msgs/msg/Nothing"), None);
}
