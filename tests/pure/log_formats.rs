//! Recordings of real vehicles in every format they were written in, and random frames written by
//! an independent program (python-can).

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, RngSeed, TestRunner};

use can_log::EntryContent;
use can_log::{Log, LogRecord};
use can_signal::can::frame::Frame;
use can_signal::can::input::CanInput;
use can_signal::can::link::BusIndex;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_report::Step;
use signal_gateway::replay::{Replay, Routes};

use crate::pure::recording_variants::variants;
use crate::support::files::MemoryFiles;
use crate::support::prerequisite::{peer_python, require, shared_data};

/// A whole recording.
struct Recording {
    log: Log,
    records: Vec<LogRecord>,
}

impl Recording {
    fn read(path: &Path) -> Self {
        let mut log = Log::open(path).unwrap();
        let mut records = Vec::new();
        while let Some(record) = log.next_record().unwrap() {
            records.push(record);
        }
        Self { log, records }
    }

    fn contents(&self) -> Vec<EntryContent> {
        self.records.iter().map(|record| record.content).collect()
    }

    fn frames(&self, interface: &str) -> Vec<Frame> {
        let index = self.log.interfaces().iter().position(|name| name == interface).unwrap();
        let of_interface = self.records.iter().filter(|record| record.interface.0 == index);
        of_interface.filter_map(|record| frame(record.content)).collect()
    }

    /// Interface names in the order of the records.
    fn names(&self) -> Vec<&str> {
        self.records.iter().map(|record| self.log.interfaces()[record.interface.0].as_str()).collect()
    }

    fn nanos(&self) -> Vec<i64> {
        self.records.iter().map(|record| record.stamp.as_nanos()).collect()
    }

    /// Times of the data frames since the first of them, ns.
    fn frame_offsets(&self) -> Vec<i64> {
        let frames = self.records.iter().filter(|record| frame(record.content).is_some());
        let nanos: Vec<_> = frames.map(|record| record.stamp.as_nanos()).collect();
        nanos.iter().map(|stamp| stamp - nanos[0]).collect()
    }

    /// Records, bad lines, and seconds from the first to the last.
    fn size(&self) -> (usize, u64, f64) {
        let nanos = self.nanos();
        #[allow(clippy::cast_precision_loss)]
        let seconds = (nanos.last().unwrap() - nanos[0]) as f64 / 1e9;
        (self.records.len(), self.log.bad_lines(), (seconds * 10.0).round() / 10.0)
    }
}

fn frame(content: EntryContent) -> Option<Frame> {
    if let EntryContent::Data(frame) = content { Some(frame) } else { None }
}

#[test]
fn one_recording_in_three_formats_has_the_same_frames() {
    let folder = require!(shared_data()).join("can-logs");
    let candump = Recording::read(&folder.join("savvycan-candump.log"));
    let gvret = Recording::read(&folder.join("savvycan-GVRET_Log.csv"));
    let busmaster = Recording::read(&folder.join("savvycan-BusMasterLog.log"));
    for recording in [&candump, &gvret, &busmaster] {
        assert_eq!((recording.records.len(), recording.log.bad_lines()), (12_974, 0));
        assert!(recording.contents() == candump.contents(), "other frames");
    }
    // candump was written in whole seconds, GVRET in 2 ms steps, BUSMASTER by the wall clock.
    let (candump, gvret, busmaster) = (candump.nanos(), gvret.nanos(), busmaster.nanos());
    assert!(
        candump.iter().zip(&gvret).all(|(candump, gvret)| gvret / 1_000_000_000 == candump / 1_000_000_000)
    );
    let offset = busmaster[0] - gvret[0];
    assert!(busmaster.iter().zip(&gvret).all(|(busmaster, gvret)| busmaster - gvret == offset));
    assert_eq!(busmaster[0], 1_443_046_814_992_000_000, "2015-09-23 22:20:14.992");
}

#[test]
fn real_recordings_are_read_whole() {
    let folder = require!(shared_data()).join("can-logs");
    for (file, expected, interfaces) in [
        ("eld-gt350-2reverselog.trc", (3_740, 0, 2.5), &["can0"][..]),
        // NOTES.md has 39,476 and 152 identifiers: it leaves out the 70 frames of one byte.
        ("hyundai-kona-ev-2019-pcan-ccan-power-cycle.csv.gz", (39_546, 0, 10.8), &["can0", "can1"]),
        ("volvo-s60-2002-key-steering.csv", (21_437, 0, 17.6), &["can1", "can0"]),
        ("ford-mustang-s550.txt.gz", (87_212, 0, 70.4), &["can0"]),
        // No time at all. 52 lines were cut or joined; NOTES.md counts short frames among them.
        ("hyundai-i30-serial.txt.gz", (51_280, 52, 0.0), &["can0"]),
    ] {
        let recording = Recording::read(&folder.join(file));
        assert_eq!(recording.size(), expected, "{file}");
        assert_eq!(recording.log.interfaces(), interfaces, "{file}");
    }
    let pcan = Recording::read(&folder.join("eld-gt350-2reverselog.trc"));
    assert_eq!(pcan.nanos()[0] / 1_000_000, 1_753_203_273_550, "2025-07-22 16:54:33.549 and 1.2 ms");
    let volvo = Recording::read(&folder.join("volvo-s60-2002-key-steering.csv"));
    let stalk = volvo.records.iter().filter_map(|record| frame(record.content));
    assert_eq!(stalk.filter(|frame| frame.id().number() == 0x0261_300A).count(), 585);
    let i30 = Recording::read(&folder.join("hyundai-i30-serial.txt.gz"));
    assert_eq!(i30.frames("can0").iter().filter(|frame| frame.id().number() == 0x690).count(), 570);
}

#[test]
fn two_buses_of_one_file_do_not_mix() {
    let folder = require!(shared_data()).join("can-logs");
    let path = folder.join("hyundai-kona-ev-2019-pcan-ccan-power-cycle.csv.gz");
    let recording = Recording::read(&path);
    let turn = |interface| {
        let frames = recording.frames(interface);
        let mut contents = BTreeMap::new();
        for frame in frames.iter().filter(|frame| frame.id().number() == 0x541) {
            *contents.entry(frame.data().to_vec()).or_insert(0) += 1;
        }
        (contents.values().sum::<i32>(), contents)
    };
    let ((powertrain, powertrain_data), (chassis, chassis_data)) = (turn("can0"), turn("can1"));
    assert_eq!((powertrain, chassis), (115, 114));
    assert!(powertrain_data.keys().all(|data| !chassis_data.contains_key(data)), "other layouts");

    for interface in ["can0", "can1"] {
        let mut replay = hyundai(&path, interface);
        let mut frames = Vec::new();
        while let Some(input) = replay.skim().unwrap() {
            frames.extend(if let Some(CanInput::Frame { frame, .. }) = input.can() {
                Some(*frame)
            } else {
                None
            });
        }
        assert!(frames == recording.frames(interface), "{interface}: frames of the other bus came in");
        let mut replay = hyundai(&path, interface);
        let mut reports = 0;
        while replay.step().unwrap() {
            while let Some(output) = replay.poll_output() {
                reports += usize::from(matches!(
                    output,
                    Output::VehicleLights(VehicleLightsOutput::TurnIndicators(Step::Publish(..)))
                ));
            }
        }
        assert!((100..=115).contains(&reports), "{interface}: {reports} reports, one a frame at most");
    }
}

/// The recording with one of its buses bound to the Hyundai profile.
fn hyundai(recording: &Path, interface: &str) -> Replay {
    let profile = concat!(env!("CARGO_MANIFEST_DIR"), "/config/vehicles/hyundai_kia.toml");
    let gateway = format!("profile = \"{profile}\"\n[can.powertrain]\ninterface = \"{interface}\"\n");
    let settings = MemoryFiles::new([("gateway.toml", gateway)]).or_disk().settings();
    let routes = Routes(vec![(interface.to_owned(), BusIndex(0))]);
    Replay::new(settings.gateway, Log::open(recording).unwrap(), routes).unwrap()
}

#[test]
fn mf4_has_the_frames_that_asammdf_counts() {
    let folder = require!(shared_data()).join("can-logs");
    let recording = Recording::read(&folder.join("css-truck-j1939-00000001.MF4"));
    let (frames, bad_lines, _) = recording.size();
    assert_eq!((frames, bad_lines, recording.log.breakage()), (150_411, 0, None));
    assert_eq!(recording.log.interfaces(), ["can1", "can9"]);
}

#[test]
fn stamps_are_taken_in_another_unit_where_the_format_leaves_it_open() {
    let first_two = |text: &str, unit_ns| {
        let mut log = Log::new(Box::new(std::io::Cursor::new(text.to_owned())))?;
        if let Some(unit_ns) = unit_ns {
            log = log.in_time_unit(unit_ns)?;
        }
        let mut stamp = || Ok::<_, std::io::Error>(log.next_record()?.map(|record| record.stamp.as_nanos()));
        Ok::<_, std::io::Error>([stamp()?, stamp()?].map(Option::unwrap_or_default))
    };
    for (text, usual, in_ms) in [
        (
            "Time Stamp,ID,Extended,Bus,LEN\n5,123,0,0,0\n7,123,0,0,0\n",
            [5_000, 7_000],
            [5_000_000, 7_000_000],
        ),
        ("5.5,0123,0,R\n7,0123,0,R\n", [5_500_000_000, 7_000_000_000], [5_500_000, 7_000_000]),
        ("time,addr,bus,data\n5,1,0,00\n7,1,0,00\n", [5_000_000_000, 7_000_000_000], [5_000_000, 7_000_000]),
        ("1R11 1\n5 1R11 1A0 00\n7 1R11 1A0 00\n", [5_000_000_000, 7_000_000_000], [5_000_000, 7_000_000]),
        ("5 0x085: 7C\n7 0x085: 7C\n", [5_000_000, 7_000_000], [5_000_000, 7_000_000]),
    ] {
        assert_eq!(first_two(text, None).unwrap(), usual, "{text}");
        assert_eq!(first_two(text, Some(1_000_000)).unwrap(), in_ms, "{text}");
    }
    // Milliseconds since 1970, as a format of seconds cannot have them.
    let far = "timestamp,arbitration_id,extended,remote,error,dlc,data\n1700000000000,0x1,0,0,0,0,\n1700000000001.5,0x1,0,0,0,0,\n";
    let expected = [1_700_000_000_000_000_000, 1_700_000_000_001_500_000];
    assert_eq!(first_two(far, Some(1_000_000)).unwrap(), expected);
    let refused = first_two("(1.0) can0 123#01\n", Some(1_000_000)).unwrap_err().to_string();
    assert!(refused.contains("leave out --time-unit"), "{refused}");
}

/// Number of frames in a random recording.
const RANDOM_FRAMES: usize = 10_000;

/// Random frames as candump writes them, in an order of time.
fn random_candump(kinds: &'static [&'static str]) -> String {
    let id = prop_oneof![
        (0..0x800_u32).prop_map(|id| format!("{id:03X}")),
        (0..0x2000_0000_u32).prop_map(|id| format!("{id:08X}")),
    ];
    let line = (id, prop::sample::select(kinds), any::<[u8; 64]>(), 0..16_usize, 0..2, 0..3_000_000_u64);
    let mut runner = TestRunner::new(Config { rng_seed: RngSeed::Fixed(7), ..Config::default() });
    let (mut text, mut micros) = (String::new(), 1_709_649_000_000_000_u64);
    for _ in 0..RANDOM_FRAMES {
        let (id, kind, bytes, dlc, bus, step) = line.new_tree(&mut runner).unwrap().current();
        let hex = |length: usize| {
            bytes[..length].iter().fold(String::new(), |hex, byte| format!("{hex}{byte:02X}"))
        };
        let frame = match kind {
            "classic" => format!("{id}#{}", hex(dlc.min(8))),
            "fd" => format!("{id}##1{}", hex([0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64][dlc])),
            "remote" => format!("{id}#R"),
            "error" => "20000088#0000000000000000".to_owned(),
            other => panic!("{other}"),
        };
        writeln!(text, "({}.{:06}) can{bus} {frame}", micros / 1_000_000, micros % 1_000_000).unwrap();
        micros += step;
    }
    text
}

const ALL: &[&str] = &["classic", "fd", "remote", "error"];

#[test]
fn what_python_can_writes_is_read_back() {
    let python = require!(peer_python());
    let folder = tempfile::tempdir().unwrap();
    // python-can writes nothing but classic data frames in TRC.
    for (ending, kinds) in [("asc", ALL), ("blf", ALL), ("trc", &["classic"])] {
        let (source, written) =
            (folder.path().join("source.log"), folder.path().join(format!("written.{ending}")));
        std::fs::write(&source, random_candump(kinds)).unwrap();
        // It writes dates in ASC in local time, which we take for UTC.
        let mut command = Command::new(&python);
        command.args(["-m", "can.logconvert"]).arg(&source).arg(&written).env("TZ", "UTC");
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

        let (source, written) = (Recording::read(&source), Recording::read(&written));
        assert_eq!((written.records.len(), written.log.bad_lines()), (RANDOM_FRAMES, 0), "{ending}");
        assert!(written.contents() == source.contents(), "{ending}: other frames");
        // python-can counts from 0, these formats from 1. It does not state on which bus an error was.
        for ((written, content), source) in
            written.names().into_iter().zip(written.contents()).zip(source.names())
        {
            let expected = if source == "can0" { "can1" } else { "can2" };
            assert!(
                written == expected || matches!(content, EntryContent::Error(_)),
                "{ending}: {source} is {written}"
            );
        }
        for (written, source) in written.nanos().iter().zip(source.nanos()) {
            assert!((written - source).abs() <= 2_000, "{ending}: {written} instead of {source}");
        }
    }
}

/// Writes a database with python-can's writer, which loses what waits when it is stopped, and variants of it:
/// pages of every size, deleted rows, pages that moved, and a statement that does not fit on its page.
const SQLITE_VARIANTS: &str = "
import can, sqlite3, sys, time
writer = can.SqliteWriter(sys.argv[2])
for message in can.LogReader(sys.argv[1]):
    writer(message)
while not writer.buffer.empty():
    time.sleep(0.01)
writer.stop()
for size, vacuum in [(512, 0), (1024, 1), (4096, 2), (65536, 0)]:
    source = sqlite3.connect(sys.argv[2])
    target = sqlite3.connect(f'{sys.argv[2]}.{size}', isolation_level=None)
    target.execute(f'PRAGMA page_size={size}')
    target.execute(f'PRAGMA auto_vacuum={vacuum}')
    target.execute('CREATE TABLE blobs (data BLOB /*' + 2000 * 'x' + '*/)')
    target.executescript('BEGIN;' + ''.join(line for line in source.iterdump() if line[:5] not in ('BEGIN', 'COMMI')) + ';COMMIT')
    target.execute('INSERT INTO blobs VALUES (zeroblob(200000))')
    target.execute('INSERT INTO messages SELECT * FROM messages WHERE rowid % 2')
    target.execute('DELETE FROM messages WHERE rowid > 10000 OR rowid % 3 = 0')
    target.close()
";

#[test]
fn what_python_can_writes_in_sqlite_is_read_back() {
    let python = require!(peer_python());
    let folder = tempfile::tempdir().unwrap();
    let (source, written) = (folder.path().join("source.log"), folder.path().join("written.db"));
    std::fs::write(&source, random_candump(&["classic", "remote", "error"])).unwrap();
    let output =
        Command::new(&python).args(["-c", SQLITE_VARIANTS]).args([&source, &written]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let source = Recording::read(&source);
    let read = Recording::read(&written);
    assert_eq!((read.records.len(), read.log.bad_lines()), (10_000, 0));
    assert!(read.contents() == source.contents(), "other frames");
    assert!(read.nanos().iter().zip(source.nanos()).all(|(read, source)| (read - source).abs() < 1_000));
    let left: Vec<_> = (1..).zip(source.contents()).filter(|(row, _)| row % 3 != 0).collect();
    for size in [512, 1024, 4096, 65536] {
        let read = Recording::read(&folder.path().join(format!("written.db.{size}")));
        assert_eq!((read.records.len(), read.log.bad_lines()), (left.len(), 0), "{size}");
        assert!(read.contents().iter().eq(left.iter().map(|(_, content)| content)), "{size}: other frames");
    }
}

/// Entries of each kind that a reader of another make counts in each file: data frames, remote requests,
/// error frames.
fn counted_by_peer(python: &Path, files: &[(&str, std::path::PathBuf)]) -> Vec<[usize; 3]> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/peer/recordings.py");
    let mut command = Command::new(python);
    command
        .arg(script)
        .env("TZ", "UTC")
        .args(files.iter().flat_map(|(reader, path)| [reader.into(), path.clone()]));
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let counts = |line: &str| {
        let numbers: Vec<usize> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        numbers.try_into().unwrap()
    };
    String::from_utf8(output.stdout).unwrap().lines().map(counts).collect()
}

/// The same of ours.
fn counted(recording: &Recording) -> [usize; 3] {
    recording.contents().into_iter().fold([0; 3], |[data, remote, error], content| match content {
        EntryContent::Data(_) => [data + 1, remote, error],
        EntryContent::Remote => [data, remote + 1, error],
        EntryContent::Error(_) => [data, remote, error + 1],
        // A chip status of ASC is a state of the controller, which readers of frames pass over.
        EntryContent::Note(_) => [data, remote, error],
    })
}

/// The table of formats and variants: every one has the frames of the same recording, and as many as a reader
/// of another make counts, plain and compressed.
#[test]
fn every_variant_has_the_frames_that_another_reader_counts() {
    let python = require!(peer_python());
    let folder = tempfile::tempdir().unwrap();
    let candump = random_candump(&["classic"]);
    let source = folder.path().join("source.log");
    std::fs::write(&source, &candump).unwrap();
    let variants = variants(&candump);
    let recorded = Recording::read(&source);
    let (expected, offsets) = (recorded.contents(), recorded.frame_offsets());
    let paths: Vec<_> = variants.iter().map(|variant| folder.path().join(&variant.file)).collect();
    for (variant, path) in variants.iter().zip(&paths) {
        std::fs::write(path, &variant.text).unwrap();
    }
    // python-can's own CSV, from its own writer.
    let csv = folder.path().join("python.csv");
    let mut convert = Command::new(&python);
    let output = convert.args(["-m", "can.logconvert"]).arg(&source).arg(&csv).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let untimed = variants.iter().filter(|variant| variant.is_untimed).map(|variant| variant.name.as_str());
    let untimed: Vec<_> = untimed.collect();
    let names = variants.iter().map(|variant| variant.name.as_str()).chain(["python-can CSV"]);
    let readers = variants.iter().map(|variant| variant.reader.as_str()).chain(["can"]);
    let files: Vec<_> = readers.zip(paths.into_iter().chain([csv])).collect();
    let peers = counted_by_peer(&python, &files);
    for ((name, (reader, path)), peer) in names.zip(&files).zip(peers) {
        let recording = Recording::read(path);
        let data: Vec<_> =
            recording.contents().into_iter().filter(|content| frame(*content).is_some()).collect();
        println!("{name:<40} {} by us, {} by {reader}", counted(&recording)[0], peer[0]);
        assert_eq!((counted(&recording), recording.log.bad_lines()), (peer, 0), "{name}");
        assert!(data == expected, "{name}: other frames");
        // Some have milliseconds only.
        let is_near = |(read, source): (i64, &i64)| (read - source).abs() <= 1_000_000;
        let are_near = || recording.frame_offsets().into_iter().zip(&offsets).all(is_near);
        assert!(untimed.contains(&name) || are_near(), "{name}: other times");
        for (tool, ending) in [("gzip", "gz"), ("bzip2", "bz2"), ("xz", "xz"), ("zstd", "zst")] {
            let packed = path.with_extension(ending);
            let output = Command::new(tool).arg("-c").arg(path).output();
            let Ok(output) = output else {
                println!("skipped: {name} with {tool}, which is not here");
                continue;
            };
            std::fs::write(&packed, output.stdout).unwrap();
            assert!(Recording::read(&packed).contents() == recording.contents(), "{name} with {tool}");
        }
    }
}

#[test]
fn public_recordings_have_as_many_frames_as_python_can_counts() {
    let (folder, python) = (require!(shared_data()).join("can-logs"), require!(peer_python()));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        // BUSMASTER's, which python-can does not read, has the same end.
        let is_read = [".log", ".log.gz", ".trc"].iter().any(|end| name.ends_with(end));
        if is_read && !name.contains("BusMaster") {
            files.push(("can", path));
        }
    }
    files.sort();
    let peers = counted_by_peer(&python, &files);
    assert!(files.len() >= 12, "{files:?}");
    for ((_, path), peer) in files.iter().zip(peers) {
        let recording = Recording::read(path);
        assert_eq!((counted(&recording), recording.log.bad_lines()), (peer, 0), "{}", path.display());
    }
}
