//! A reload under load: no frame, no report and no writer is lost.

mod slow {
    use std::os::unix::net::UnixDatagram;
    use std::path::{Path, PathBuf};
    use std::process::Command;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU64, Ordering};
    use std::time::{Duration, Instant};

    use serde_json::Value;
    use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};

    use super::super::reader::stamp;
    use super::super::{Bench, ENABLE_LEFT, ENABLE_RIGHT, HAZARD, HAZARD_OFF, TURN, turn};
    use crate::support::json_process::Mark;
    use crate::support::prerequisite::require;
    use crate::support::process::{DEADLINE, Process};

    /// Reloads of a good configuration; each eighth is followed by one of a bad configuration.
    const RELOADS: u64 = 1_000;
    /// A machine that is too slow for all of them does what it can in this time; the last line says how many.
    const LONGEST: Duration = Duration::from_secs(150);
    /// Frames in one millisecond, half of them of each message.
    const FRAMES_PER_MS: u64 = 2;
    /// A report may come so long after its frame on a machine that stands still for a while.
    const LATEST: i64 = 5_000_000_000;

    /// Sends the frames of a vehicle, 2,000 in each second as far as the machine keeps up, and counts them.
    struct Traffic {
        turn: Arc<AtomicU8>,
        sent: Arc<AtomicU64>,
        over: Arc<AtomicBool>,
        thread: std::thread::JoinHandle<()>,
        started: Instant,
    }

    impl Traffic {
        fn start(interface: &'static str) -> Self {
            let (state, sent, over) =
                (Arc::<AtomicU8>::default(), Arc::<AtomicU64>::default(), Arc::<AtomicBool>::default());
            state.store(1, Ordering::Relaxed);
            let shared = (Arc::clone(&state), Arc::clone(&sent), Arc::clone(&over));
            let started = Instant::now();
            let thread = std::thread::spawn(move || {
                let (state, sent, over) = shared;
                let socket = CanSocket::open(interface).unwrap();
                let id = |id: u32| StandardId::new(u16::try_from(id).unwrap()).unwrap();
                while !over.load(Ordering::Relaxed) {
                    let due = u64::try_from(started.elapsed().as_millis()).unwrap() * FRAMES_PER_MS;
                    while sent.load(Ordering::Relaxed) < due {
                        let turn = turn(state.load(Ordering::Relaxed));
                        for (id, data) in [(id(TURN), turn), (id(HAZARD), HAZARD_OFF)] {
                            socket.write_frame(&CanDataFrame::new(id, &data).unwrap()).unwrap();
                            sent.fetch_add(1, Ordering::Relaxed);
                        }
                    }
                    std::thread::sleep(Duration::from_millis(1));
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

    /// The service manager, which is notified when a reload is over.
    struct Manager(UnixDatagram);

    impl Manager {
        fn bind(path: &Path) -> Self {
            let socket = UnixDatagram::bind(path).unwrap();
            socket.set_read_timeout(Some(DEADLINE)).unwrap();
            Self(socket)
        }

        fn wait_until_ready(&self) {
            let mut buffer = [0; 4096];
            let end = Instant::now() + DEADLINE;
            loop {
                let length = self.0.recv(&mut buffer).unwrap();
                if buffer[..length].starts_with(b"READY=1") {
                    return;
                }
                assert!(Instant::now() < end);
            }
        }
    }

    fn status(socket: &PathBuf) -> Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
        let output = command.args(["status", "--json", "--socket"]).arg(socket).output().unwrap();
        serde_json::from_slice(&output.stdout).unwrap()
    }

    #[test]
    fn reloads_under_2000_frames_a_second_lose_no_frame_and_no_report() {
        let bench = require!(Bench::new("vcan-reload", "[status]\nsocket = \"status.sock\"\n"));
        let folder = bench.folder.path();
        let configuration = std::fs::read_to_string(folder.join("gateway.toml")).unwrap();
        let profile = std::fs::read_to_string(folder.join("demo_vehicle.toml")).unwrap();
        let thresholds = [profile.clone(), profile.replace("timeout_ms = 60000", "timeout_ms = 50000")];
        assert_ne!(thresholds[0], thresholds[1]);
        let bad = [
            format!("{configuration}\n[reports]\nrate_hz = 0\n"),
            configuration.replace("domain_id = ", "domain_id = 1"),
        ];
        let notify = folder.join("notify");
        let manager = Manager::bind(&notify);
        let reader = bench.reader();
        let gateway = Process::run_with(&bench.folder, |command| {
            command.env("NOTIFY_SOCKET", &notify);
        });
        manager.wait_until_ready();
        let socket = folder.join("status.sock");
        while status(&socket)["buses"][0]["link"] != "up" {}

        let traffic = Traffic::start(bench.vcan.name);
        reader.report(Mark::START, "turn", ENABLE_LEFT);
        reader.sample(Mark::START, "hazard", |_| true);
        let (begun, before) = (reader.mark(), status(&socket));
        let reload = || {
            gateway.signal("HUP");
            manager.wait_until_ready();
        };
        let mut expected = vec![ENABLE_LEFT];
        let (mut number, mut refused) = (0, 0);
        while number < RELOADS && traffic.started.elapsed() < LONGEST {
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
        assert!(number >= 40, "{number} reloads");
        let (sent, rate) = traffic.end();
        let end = Instant::now() + DEADLINE;
        let shown = loop {
            let shown = status(&socket);
            if shown["buses"][0]["frames"] == sent || Instant::now() > end {
                break shown;
            }
        };
        let bus = &shown["buses"][0];
        assert_eq!((&bus["frames"], &bus["drops"]), (&sent.into(), &0.into()), "{bus}");
        let configuration = &shown["process"]["configuration"];
        assert_eq!((&configuration["reloads"], &configuration["refused"]), (&number.into(), &refused.into()));
        let failed = [&shown, &before].map(|status| {
            ["turn_indicators", "hazard_lights"].map(|report| status[report]["failures"].clone())
        });
        assert_eq!(failed[0], failed[1], "none was withdrawn");

        let samples = reader.samples(begun, "turn");
        let mut changes: Vec<_> =
            samples.iter().map(|line| line["data"]["report"].as_u64().unwrap()).collect();
        changes.dedup();
        assert_eq!(changes, expected.iter().map(|report| u64::from(*report)).collect::<Vec<_>>());
        for kind in ["turn", "hazard"] {
            for line in reader.samples(begun, kind) {
                let age = line["sent"].as_i64().unwrap() - stamp(&line);
                assert!((0..LATEST).contains(&age), "{age} ns old: {line}");
            }
            assert_eq!(reader.unmatched(begun, kind), 0, "the writer of {kind} stays");
        }
        println!(
            "{number} reloads, {refused} refused, {sent} frames, {rate} a second, {} turn reports",
            samples.len()
        );
    }
}
