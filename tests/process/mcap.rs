//! Recordings as MCAP: read back by readers of other makes, after an orderly end, a kill, and a full disk.

use std::fs;
use std::io::{Cursor, Read as _};
use std::path::{Path, PathBuf};

use can_log::{Log, LogRecord};
use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng as _;
use serde_json::{Value, json};

use crate::support::mcap::McapReaders;
use crate::support::prerequisite::require;
use crate::support::program::run;
use crate::support::sources::project;

/// The first lines of the demo's recording.
fn demo_lines(count: usize) -> Vec<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
    let mut text = String::new();
    flate2::read::MultiGzDecoder::new(fs::File::open(path).unwrap()).read_to_string(&mut text).unwrap();
    text.lines().take(count).map(str::to_owned).collect()
}

fn of_topic<'a>(messages: &'a [Value], topic: &'a str) -> impl Iterator<Item = &'a Value> {
    messages.iter().filter(move |message| message["topic"] == topic)
}

/// A frame as candump writes it.
fn candump(message: &Value) -> String {
    let fields = &message["fields"];
    let length = usize::try_from(fields["dlc"].as_u64().unwrap()).unwrap();
    let bytes = fields["data"].as_array().unwrap().iter().take(length);
    let data: String = bytes.map(|byte| format!("{:02X}", byte.as_u64().unwrap())).collect();
    let nanos = message["publish_time"].as_u64().unwrap();
    let (sec, micros) = (nanos / 1_000_000_000, nanos / 1_000 % 1_000_000);
    let id = fields["id"].as_u64().unwrap();
    format!("({sec}.{micros:06}) {} {id:03X}#{data}", fields["header"]["frame_id"].as_str().unwrap())
}

fn replay(log: &Path, arguments: &[&str]) -> Vec<Value> {
    let replay = ["replay", log.to_str().unwrap(), "--profile", "demo_vehicle", "--json"];
    let replayed = run(project(), &[&replay, arguments].concat());
    replayed.assert(0, "");
    replayed.json()
}

#[test]
fn two_readers_find_every_frame_of_the_log_and_every_message_of_the_replay() {
    let readers = require!(McapReaders::find());
    let folder = tempfile::tempdir().unwrap();
    let (log, bag) = (folder.path().join("drive.log"), folder.path().join("bag"));
    let lines = demo_lines(6_000);
    fs::write(&log, lines.join("\n")).unwrap();
    let published = replay(&log, &["--mcap", bag.to_str().unwrap()]);
    let messages = readers.messages(&bag);

    let frames: Vec<_> = of_topic(&messages, "/body/from_can_bus").map(candump).collect();
    assert_eq!(frames, lines);
    let start: f64 = lines[0][1..18].parse().unwrap();
    let mut compared = 0;
    for topic in ["/vehicle/status/turn_indicators_status", "/vehicle/status/hazard_lights_status"] {
        let recorded: Vec<_> = of_topic(&messages, topic).collect();
        let expected: Vec<_> = published.iter().filter(|line| line["topic"] == topic).collect();
        assert_eq!(recorded.len(), expected.len(), "{topic}");
        for (recorded, expected) in recorded.iter().zip(expected) {
            assert_eq!(recorded["fields"], expected["data"]);
            #[allow(clippy::cast_precision_loss)] // to the microsecond
            let at = recorded["log_time"].as_u64().unwrap() as f64 / 1e9 - start;
            assert!((at - expected["t"].as_f64().unwrap()).abs() < 1e-5, "{recorded}");
            compared += 1;
        }
    }
    assert!(compared > 50, "{compared}");
    let changes = published.iter().filter(|line| line["topic"] == "/diagnostics").map(|line| &line["data"]);
    let recorded: Vec<_> = of_topic(&messages, "/diagnostics").map(|message| &message["fields"]).collect();
    assert!(recorded.len() > 3 && changes.clone().count() > 1);
    assert!(changes.into_iter().all(|change| recorded.contains(&change)));
}

fn replay_text(log: &Path) -> String {
    let replayed = run(project(), &["replay", log.to_str().unwrap(), "--profile", "demo_vehicle", "--json"]);
    replayed.assert(0, "");
    replayed.out
}

#[test]
fn bags_of_other_writers_and_its_own_replay_as_the_log_that_they_were_made_of() {
    let writers = require!(McapReaders::find());
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("drive.log");
    fs::write(&log, demo_lines(6_000).join("\n")).unwrap();
    let of_log = replay_text(&log);
    let bags = folder.path().join("bags");
    fs::create_dir(&bags).unwrap();
    let mut names = writers.write_bags(&log, &bags);
    for own in ["own", "own.mcap"] {
        replay(&log, &["--mcap", bags.join(own).to_str().unwrap()]);
        names.push(own.to_owned());
    }
    assert_eq!(names.len(), 8);
    for name in names {
        assert!(replay_text(&bags.join(&name)) == of_log, "{name}");
    }
}

/// The records of a file as far as they can be read, and whether it broke off.
fn records(bytes: Vec<u8>) -> (Vec<LogRecord>, bool) {
    let mut records = Vec::new();
    let Ok(mut log) = Log::new(Box::new(Cursor::new(bytes))) else { return (records, true) };
    loop {
        match log.next_record() {
            Ok(Some(record)) => records.push(record),
            Ok(None) => return (records, log.breakage().is_some()),
            Err(_) => return (records, true),
        }
    }
}

#[test]
fn a_bag_of_other_writers_that_was_cut_gives_the_frames_before_its_end() {
    let writers = require!(McapReaders::find());
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("drive.log");
    fs::write(&log, demo_lines(3_000).join("\n")).unwrap();
    let mut random = Pcg32::new(39, 0);
    for name in writers.write_bags(&log, folder.path()) {
        let path = folder.path().join(&name);
        let path = if path.is_dir() {
            let is_data = |path: &PathBuf| path.extension().is_some_and(|ending| ending != "yaml");
            fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).find(is_data).unwrap()
        } else {
            path
        };
        let bytes = fs::read(path).unwrap();
        let (whole, is_broken) = records(bytes.clone());
        assert_eq!((whole.len(), is_broken), (3_000, false), "{name}");
        for _ in 0..20 {
            // The end of an MCAP file, without messages, is an index of at most some kB.
            let length = random.next_u32() as usize % (bytes.len() - bytes.len() / 20);
            let (part, is_broken) = records(bytes[..length].to_vec());
            assert!(is_broken || part.len() == whole.len(), "{name}: {length} of {}", bytes.len());
            assert!(whole.starts_with(&part), "{name}: {length}");
        }
        let (part, _) = records(bytes[..bytes.len() * 3 / 4].to_vec());
        assert!(part.len() > 1_000, "{name}: {}", part.len());
    }
}

#[test]
fn file_and_bag_have_the_same_messages_and_a_bag_that_exists_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (log, bag, file) =
        (folder.path().join("drive.log"), folder.path().join("bag"), folder.path().join("drive.mcap"));
    fs::write(&log, demo_lines(500).join("\n")).unwrap();
    for path in [&bag, &file] {
        replay(&log, &["--mcap", path.to_str().unwrap()]);
    }
    assert_eq!(fs::read(bag.join("bag_0.mcap")).unwrap(), fs::read(&file).unwrap());
    let metadata = fs::read_to_string(bag.join("metadata.yaml")).unwrap();
    assert!(metadata.contains("    - bag_0.mcap\n") && metadata.contains("storage_identifier: mcap\n"));
    let replay = ["replay", "drive.log", "--profile", "demo_vehicle", "--mcap", "bag"];
    run(&folder, &replay).assert(1, "bag: cannot write it: it exists already");
}

#[test]
fn frames_that_a_replay_would_send_are_not_recorded_as_sent() {
    use crate::support::command_vehicle::{DBC, MODE, PROFILE};
    let readers = require!(McapReaders::find());
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("bench.toml", &format!("{PROFILE}{MODE}"));
    write("bench.dbc", DBC);
    write(
        "drive.log",
        &(0..200).map(|tenth| format!("(17.{tenth:03}000) can0 230#20000000\n")).collect::<String>(),
    );
    write(
        "gateway.toml",
        "profile = \"bench.toml\"\n[can.body]\ninterface = \"can0\"\n[command]\ntx = \"on\"\ncontrol_mode = \"signal\"\n",
    );
    let replayed =
        run(&folder, &["replay", "drive.log", "--config", "gateway.toml", "--json", "--mcap", "bag"]);
    replayed.assert(0, "");
    let mut sent = replayed.json();
    sent.retain(|line| line["topic"] == "command_frame");
    let messages = readers.messages(&folder.path().join("bag"));
    let dry: Vec<_> =
        messages.iter().filter(|message| message["topic"] == "/body/to_can_bus_dry_run").collect();
    assert_eq!(dry.len(), sent.len());
    assert_eq!(messages.iter().filter(|message| message["topic"] == "/body/to_can_bus").count(), 0);
    assert!(sent.iter().all(|line| line["data"]["sent"] == json!(false)));
}

mod slow {
    use std::path::PathBuf;
    use std::time::Duration;

    use super::*;
    use crate::support::mcap::only_entry;
    use crate::support::process::{Folder, Process};
    use crate::support::waiting::{described, let_pass, wait_until};

    /// A log that is played five times as fast, and recorded in this folder.
    fn recorded(bags: &str, log: &Path, repeat: bool, keys: &str) -> (Folder, Process) {
        let keys = format!(
            "source = \"recording\"\n[recording]\nfile = \"{}\"\nspeed = 2\nrepeat = {repeat}\nstamps = \"recorded\"\n\
             [ros]\nenabled = false\n[mcap]\nfolder = \"{bags}\"\n{keys}",
            log.display()
        );
        let folder = Folder::with_demo_vehicle("can0", &keys);
        let gateway = Process::run(&folder);
        (folder, gateway)
    }

    /// The demo's recording again and again.
    fn demo_recorded(keys: &str) -> (Folder, Process) {
        let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/demo.log.gz");
        recorded("bags", &log, true, keys)
    }

    /// The number in the metadata of a bag behind this text; `None` before it is there.
    fn written(bags: &Path, text: &str) -> Option<usize> {
        let bag = fs::read_dir(bags).ok()?.next()?.unwrap().path();
        let metadata = fs::read_to_string(bag.join("metadata.yaml")).ok()?;
        let (_, number) = metadata.split_once(text)?.1.split_once("message_count: ")?;
        number.lines().next()?.parse().ok()
    }

    /// Number of all messages.
    fn messages_written(bags: &Path) -> Option<usize> {
        written(bags, "")
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn recording_of_a_killed_process_is_readable_to_its_last_chunk() {
        let readers = require!(McapReaders::find());
        let killed: Vec<(Folder, PathBuf, usize)> = (0..20)
            .map(|trial| {
                let (folder, gateway) = demo_recorded("");
                let bags = folder.path().join("bags");
                wait_until("messages", || messages_written(&bags).is_some_and(|messages| messages > 0));
                let until_kill = Duration::from_millis(trial * 7919 % 3_000);
                let_pass(until_kill, "the kills come all over three intervals of a second");
                drop(gateway); // SIGKILL
                let told = messages_written(&bags).unwrap();
                let bag = only_entry(&bags);
                let name = format!("{}_0.mcap", bag.file_name().unwrap().to_str().unwrap());
                (folder, bag.join(name), told)
            })
            .collect();
        let files: Vec<_> = killed.iter().map(|(_, file, _)| file.as_path()).collect();
        let prefixes = readers.prefixes(&files);
        assert_eq!(prefixes.len(), 20);
        for ((_, file, told), prefix) in killed.iter().zip(prefixes) {
            println!("{} bytes, {told} in the metadata: {prefix}", fs::metadata(file).unwrap().len());
            assert_eq!(prefix["is_complete"], false);
            assert_eq!(prefix["rosbags"], prefix["messages"]);
            assert!(prefix["messages"].as_u64().unwrap() >= *told as u64, "{told}: {prefix}");
        }
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn files_are_rotated_and_the_oldest_removed() {
        let readers = require!(McapReaders::find());
        let (folder, mut gateway) = demo_recorded("file_mb = 1\ntotal_mb = 3\n");
        let bags = folder.path().join("bags");
        let file = |number| {
            let bag = only_entry(&bags);
            bag.join(format!("{}_{number}.mcap", bag.file_name().unwrap().display()))
        };
        wait_until("the removal of the first file", || {
            messages_written(&bags).is_some() && !file(0).exists()
        });
        gateway.stop("TERM");
        // The newest file takes what comes after the last look at the sizes.
        let sizes: Vec<_> = (0..)
            .map(file)
            .skip_while(|file| !file.exists())
            .map_while(|file| fs::metadata(file).ok())
            .collect();
        let (_newest, older) = sizes.split_last().unwrap();
        let older: u64 = older.iter().map(fs::Metadata::len).sum();
        assert!((1_000_000..=3_000_000).contains(&older), "{sizes:?}");
        let messages = readers.messages(&only_entry(&bags));
        assert_eq!(Some(messages.len()), messages_written(&bags));
    }

    /// A frame each minute: most of the time is filled with reports.
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn an_export_that_is_out_of_proportion_ends_in_time_and_is_closed() {
        let folder = tempfile::tempdir().unwrap();
        let (log, exported) = (folder.path().join("drive.log"), folder.path().join("drive.mcap"));
        let line = |number: u32| format!("({}.0) can0 2A5#0000020000000000\n", 60 * number);
        fs::write(&log, (1..250).map(line).collect::<String>()).unwrap();
        let paths = [&log, &exported].map(|path| path.to_str().unwrap());
        let ran = run(project(), &["replay", paths[0], "--profile", "demo_vehicle", "--mcap", paths[1]]);
        ran.assert(1, "drive.mcap: it ends at ");
        ran.assert(1, " entries may become 64 MiB and 8 kB for each entry; replay its parts one by one");
        let bytes = fs::metadata(&exported).unwrap().len();
        assert!((50_000_000..75_000_000).contains(&bytes), "{bytes}");
        let mut written = Log::open(&exported).unwrap();
        let frames = std::iter::from_fn(|| written.next_record().unwrap()).count();
        assert!((40..249).contains(&frames), "{frames}");
        assert_eq!(written.breakage(), None);
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn full_disk_loses_nothing_that_fits_in_memory_and_the_gateway_goes_on() {
        use crate::support::tmpfs::Tmpfs;
        let readers = require!(McapReaders::find());
        let folder = tempfile::tempdir().unwrap();
        let bags = folder.path().join("bags");
        let tmpfs = require!(Tmpfs::new(&bags, "size=1m"));
        // More than the disk takes, and far less than the memory.
        let (lines, log) = (demo_lines(20_000), folder.path().join("drive.log"));
        fs::write(&log, lines.join("\n")).unwrap();
        let (_configuration, mut gateway) = recorded(bags.to_str().unwrap(), &log, false, "");
        gateway.wait_for_log("recording not written in");
        let_pass(Duration::from_secs(2), "the disk stays full");
        assert!(gateway.is_running());
        tmpfs.remount("size=100m");
        let frames_written = || written(&bags, "name: /body/from_can_bus\n");
        wait_until(described(|| format!("all frames; there are {:?}", frames_written())), || {
            frames_written() == Some(lines.len())
        });
        gateway.stop("TERM");
        let messages = readers.messages(&only_entry(&bags));
        let frames: Vec<_> = of_topic(&messages, "/body/from_can_bus").map(candump).collect();
        assert_eq!(frames.len(), lines.len());
        for (number, (frame, line)) in frames.iter().zip(&lines).enumerate() {
            assert_eq!(frame, line, "frame {number}");
        }
    }
}
