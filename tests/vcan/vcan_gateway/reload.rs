//! A reload keeps no frame waiting, and under load no frame, no report and no writer is lost.

use std::fs::{self, OpenOptions};
use std::io::{BufRead as _, BufReader, Write as _};
use std::os::unix::net::{UnixDatagram, UnixStream};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::{Bench, DISABLE, ENABLE_LEFT, LEFT, OFF, TURN};
use crate::support::prerequisite::require;
use crate::support::process::Process;
use crate::support::waiting::{DEADLINE, wait_for};

/// What every test needs of the configuration.
const STATUS: &str = "[status]\nsocket = \"status.sock\"\n";

/// The service manager, which is notified when a reload is over.
struct Manager(UnixDatagram);

impl Manager {
    /// The gateway of a bench, once it is ready, and the manager that it notifies.
    fn start(bench: &Bench) -> (Self, Process) {
        let notify = bench.folder.path().join("notify");
        let socket = UnixDatagram::bind(&notify).unwrap();
        socket.set_read_timeout(Some(DEADLINE)).unwrap();
        let gateway = Process::run_with(&bench.folder, |command| {
            command.env("NOTIFY_SOCKET", &notify);
        });
        let manager = Self(socket);
        manager.wait_until_ready();
        (manager, gateway)
    }

    fn wait_until_ready(&self) {
        let mut buffer = [0; 4096];
        wait_for("the end of a start or a reload", || {
            let length = self.0.recv(&mut buffer).unwrap();
            buffer[..length].starts_with(b"READY=1").then_some(())
        });
    }
}

/// The present snapshot of the gateway in this folder, which a busy gateway does not hand out for some
/// seconds.
fn status(folder: &Path) -> Value {
    wait_for("a snapshot", || {
        let mut line = String::new();
        let stream = UnixStream::connect(folder.join("status.sock")).unwrap();
        BufReader::new(stream).read_line(&mut line).unwrap();
        serde_json::from_str(&line).ok()
    })
}

/// A file that is slow to read, such as one on a network, keeps a reload waiting and nothing else.
#[test]
fn a_reload_that_waits_for_a_file_keeps_no_report_waiting() {
    let bench = require!(Bench::new("vcan-waiting", STATUS));
    let reader = bench.reader();
    let (manager, mut gateway) = Manager::start(&bench);
    let path = bench.folder.path().join("demo_vehicle.toml");
    let profile = fs::read_to_string(&path).unwrap();
    bench.vcan.send(TURN, OFF);
    reader.report(reader.mark(), "turn", DISABLE);

    fs::remove_file(&path).unwrap();
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    gateway.signal("HUP");
    // Opened once the gateway has opened the other end, and now waits for what it is given to read.
    let mut pipe = OpenOptions::new().write(true).open(&path).unwrap();
    fs::remove_file(&path).unwrap();
    bench.folder.write("demo_vehicle.toml", &profile);
    let mark = reader.mark();
    bench.vcan.send(TURN, LEFT);
    reader.report(mark, "turn", ENABLE_LEFT);
    let configuration = &status(bench.folder.path())["process"]["configuration"];
    assert_eq!(configuration["reloads"], 0, "it waits");

    pipe.write_all(profile.as_bytes()).unwrap();
    drop(pipe);
    manager.wait_until_ready();
    let configuration = &status(bench.folder.path())["process"]["configuration"];
    assert_eq!(configuration["reloads"], 1);
    gateway.stop("TERM");
}

mod slow {
    use std::path::PathBuf;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
    use std::time::{Duration, Instant};

    use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};

    use super::super::reader::stamp;
    use super::super::{ENABLE_RIGHT, HAZARD, HAZARD_OFF, turn};
    use super::{Bench, ENABLE_LEFT, Manager, STATUS, TURN, Value, require, status, wait_for};
    use crate::support::json_process::Mark;
    use crate::support::processor::waited;
    use crate::support::waiting::{Bystander, Pace, let_pass};

    /// Reloads of a good configuration; each eighth is followed by one of a bad configuration.
    const RELOADS: u64 = 1_000;
    /// A machine that is too slow for all of them does what it can in this time, and these at least.
    const LONGEST: Duration = Duration::from_secs(150);
    const LEAST: u64 = 40;
    /// Frames that may be unread: half of what the receive buffer holds, which is 9,300. A machine that is so
    /// busy that neither is read nor sent for a while catches up in steps that fit.
    const UNREAD: u64 = 4_000;
    /// A gateway that stood still for so long has its peers meet it anew, with other writers and some reports
    /// twice.
    const STANDSTILL: Duration = Duration::from_secs(2);

    /// Sends the frames of a vehicle, two in each millisecond as far as they are read, and counts them.
    struct Traffic {
        turn: Arc<AtomicU8>,
        sent: Arc<AtomicU64>,
        over: Arc<AtomicBool>,
        thread: std::thread::JoinHandle<()>,
        started: Instant,
    }

    impl Traffic {
        /// Begins on the interface of the gateway in this folder.
        fn start(interface: &'static str, folder: PathBuf) -> Self {
            let (state, sent, over) =
                (Arc::<AtomicU8>::default(), Arc::<AtomicU64>::default(), Arc::<AtomicBool>::default());
            state.store(1, Ordering::Relaxed);
            let shared = (Arc::clone(&state), Arc::clone(&sent), Arc::clone(&over));
            let started = Instant::now();
            let thread = std::thread::spawn(move || {
                let (state, sent, over) = shared;
                let socket = CanSocket::open(interface).unwrap();
                let id = |id: u32| StandardId::new(u16::try_from(id).unwrap()).unwrap();
                let (mut read, mut pace) = (0, Pace::every(Duration::from_millis(1)));
                while !over.load(Ordering::Relaxed) {
                    pace.wait();
                    if sent.load(Ordering::Relaxed) >= read + UNREAD {
                        let bus = status(&folder)["buses"][0].take();
                        // Those that are lost are not waited for.
                        read = ["frames", "drops"].map(|key| bus[key].as_u64().unwrap()).iter().sum();
                        continue;
                    }
                    let turn = turn(state.load(Ordering::Relaxed));
                    for (id, data) in [(id(TURN), turn), (id(HAZARD), HAZARD_OFF)] {
                        socket.write_frame(&CanDataFrame::new(id, &data).unwrap()).unwrap();
                        sent.fetch_add(1, Ordering::Relaxed);
                    }
                }
            });
            Self { turn: state, sent, over, thread, started }
        }

        /// Ends it; gives the number of frames, and their mean rate.
        fn end(self) -> (u64, u64) {
            self.over.store(true, Ordering::Relaxed);
            self.thread.join().unwrap();
            let sent = self.sent.load(Ordering::Relaxed);
            (sent, sent * 1_000 / u64::try_from(self.started.elapsed().as_millis()).unwrap())
        }
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn reloads_under_2000_frames_a_second_lose_no_frame_and_no_report() {
        let bench = require!(Bench::new("vcan-reload", STATUS));
        let folder = bench.folder.path();
        let configuration = std::fs::read_to_string(folder.join("gateway.toml")).unwrap();
        let profile = std::fs::read_to_string(folder.join("demo_vehicle.toml")).unwrap();
        let thresholds = [profile.clone(), profile.replace("timeout_ms = 60000", "timeout_ms = 50000")];
        assert_ne!(thresholds[0], thresholds[1]);
        let bad = [
            format!("{configuration}\n[reports]\nrate_hz = 0\n"),
            configuration.replace("domain_id = ", "domain_id = 1"),
        ];
        let reader = bench.reader();
        let (manager, gateway) = Manager::start(&bench);
        while status(folder)["buses"][0]["link"] != "up" {}

        let beside = Bystander::start();
        let is_late = Arc::<AtomicBool>::default();
        let clock = Arc::clone(&is_late);
        std::thread::spawn(move || {
            let_pass(LONGEST, "in which there are as many reloads as go");
            clock.store(true, Ordering::Relaxed);
        });
        let traffic = Traffic::start(bench.vcan.name, folder.to_owned());
        reader.report(Mark::START, "turn", ENABLE_LEFT);
        reader.sample(Mark::START, "hazard", |_| true);
        let (begun, before) = (reader.mark(), status(folder));
        let reload = || {
            gateway.signal("HUP");
            manager.wait_until_ready();
        };
        let mut expected = vec![ENABLE_LEFT];
        let (mut number, mut refused) = (0, 0);
        while number < RELOADS && (number < LEAST || !is_late.load(Ordering::Relaxed)) {
            bench.folder.write("demo_vehicle.toml", &thresholds[usize::from(number % 2 == 0)]);
            reload();
            if number % 8 == 7 {
                bench.folder.write("gateway.toml", &bad[usize::from(number % 16 == 7)]);
                reload();
                refused += 1;
                bench.folder.write("gateway.toml", &configuration);
            }
            if number % 20 == 19 {
                let (state, report) =
                    if expected.len() % 2 == 1 { (2, ENABLE_RIGHT) } else { (1, ENABLE_LEFT) };
                let mark = reader.mark();
                traffic.turn.store(state, Ordering::Relaxed);
                reader.report(mark, "turn", report);
                expected.push(report);
            }
            number += 1;
        }
        let (sent, rate) = traffic.end();
        let lateness = beside.finish();
        let shown = wait_for(format!("{sent} frames that are read or lost"), || {
            let shown = status(folder);
            let bus = &shown["buses"][0];
            let counts = ["frames", "drops"].map(|key| bus[key].as_u64().unwrap());
            (counts.iter().sum::<u64>() == sent).then_some(shown)
        });
        let bus = &shown["buses"][0];
        assert_eq!((&bus["frames"], &bus["drops"]), (&sent.into(), &0.into()), "{bus}");
        let configuration = &shown["process"]["configuration"];
        assert_eq!((&configuration["reloads"], &configuration["refused"]), (&number.into(), &refused.into()));
        let failed = [&shown, &before].map(|status| {
            ["turn_indicators", "hazard_lights"].map(|report| status[report]["failures"].clone())
        });
        assert_eq!(failed[0], failed[1], "none was withdrawn");

        let samples = reader.samples(begun, "turn");
        println!(
            "{number} reloads, {refused} refused, {sent} frames, {rate} a second, {} turn reports",
            samples.len()
        );
        let log = gateway.log();
        let is_anew = |line: &&String| line.contains("StoodStill") || line.contains("has ended (no answer)");
        if let Some(line) = log.iter().find(is_anew) {
            lateness.assert_gap(line, STANDSTILL, STANDSTILL / 2 + waited(gateway.id()));
            println!("peers have met the gateway anew: {line}");
            return;
        }
        let mut changes: Vec<_> =
            samples.iter().map(|line| line["data"]["report"].as_u64().unwrap()).collect();
        changes.dedup();
        assert_eq!(changes, expected.iter().map(|report| u64::from(*report)).collect::<Vec<_>>());
        for kind in ["turn", "hazard"] {
            let samples = reader.samples(begun, kind);
            assert!(samples.is_sorted_by_key(stamp), "no report is of an earlier frame than the one before");
            let is_of_the_past = |line: &Value| stamp(line) <= line["sent"].as_i64().unwrap();
            assert!(samples.iter().all(is_of_the_past), "{samples:?}");
            assert_eq!(reader.unmatched(begun, kind), 0, "the writer of {kind} stays");
        }
    }
}
