//! What goes wrong around a running gateway, one fault after the other, and what an independent reader of its
//! topics sees meanwhile. It prints the table of docs/reliability.md, and writes it there with
//! `UPDATE_DOCS=1`.
//!
//! Counted as wrong is a report whose state no sound frame had at the report's stamp, and one that was sent
//! much later than its message is believed, beside what the machine takes from everybody. How long things
//! take else is measured, and not judged.

mod attacks;
mod clock;
mod unit;

use std::cell::{Cell, RefCell};
use std::io::Write as _;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rand_pcg::Pcg32;
use rand_pcg::rand_core::Rng as _;
use serde_json::Value;
use socketcan::{CanErrorFrame, CanFrame, CanSocket, Socket as _};

use super::vcan_gateway::reader::{Reader, stamp};
use crate::support::docs_section;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::Missing;
use crate::support::process::{self, Folder, Process};
use crate::support::processor::waited;
use crate::support::vcan::Vcan;
use crate::support::waiting::{Bystander, let_pass, wait_for};
use unit::{DBC, LEFT, Manner, PROFILE, RIGHT, TURN, UNDEFINED, Unit, send};

/// How old a frame may be when its report is sent: the timeout, and a little more.
const MAX_AGE: Duration = Duration::from_secs(2);

const BLACK_BOX: &str = "[black_box]\nfolder = \"box\"\nbefore_s = 1\nafter_s = 1\n";

/// How long a fault lasts that the gateway need not notice.
const WHILE: Duration = Duration::from_secs(3);

/// What comes in a long test, in the same order in each run.
struct Chance(Pcg32);

impl Default for Chance {
    fn default() -> Self {
        Self(Pcg32::new(1, 0x5EED))
    }
}

impl Chance {
    /// How long it goes on: `SIGNAL_GATEWAY_MINUTES`, ten without.
    fn minutes() -> Duration {
        let minutes = std::env::var("SIGNAL_GATEWAY_MINUTES").map_or(10, |minutes| minutes.parse().unwrap());
        Duration::from_secs(60 * minutes)
    }

    /// From 0 to below `limit`.
    fn below(&mut self, limit: u32) -> i64 {
        i64::from(self.0.next_u32() % limit)
    }
}

struct Bench {
    vcan: Vcan,
    unit: Unit,
    reader: Reader,
    gateway: RefCell<Option<Process>>,
    folder: Folder,
    cyclone: Cyclone,
    domain: u16,
    /// True if a report may be sent later than its message is believed, since the clock is set.
    may_be_late: Cell<bool>,
    /// True while a flood of frames lasts.
    is_flooded: Arc<AtomicBool>,
}

/// What came of a fault.
struct Row {
    name: String,
    wrong: usize,
    noticed: Option<Duration>,
    back: Duration,
    /// Of reports that are not withheld, in seconds.
    longest_gap: Option<f64>,
    /// Age of the frame of the report that was sent latest, in seconds.
    oldest_s: f64,
}

impl Bench {
    fn new() -> Result<Self, Missing> {
        let vcan = Vcan::new("vcan-faults")?;
        let cyclone = Cyclone::on_loopback()?;
        let domain = domain();
        let ros = process::ros_in(domain);
        let text =
            format!("profile = \"bench.toml\"\n[can.body]\ninterface = \"{}\"\n{BLACK_BOX}{ros}", vcan.name);
        let folder = Folder::with_configuration(&text);
        folder.write("bench.toml", PROFILE);
        folder.write("bench.dbc", DBC);
        let reader = Reader::start(&cyclone, domain);
        let gateway = RefCell::new(Some(Process::run(&folder)));
        let unit = Unit::start(vcan.name);
        let (may_be_late, is_flooded) = (Cell::new(false), Arc::default());
        Ok(Self { vcan, unit, reader, gateway, folder, cyclone, domain, may_be_late, is_flooded })
    }

    /// Lets a fault happen while the indicators are left; before it ends they are right. `noticed` is what
    /// the gateway must report of the turn indicators meanwhile; `None` where reports go on, or it cannot
    /// report anything.
    fn try_out(&self, name: &str, noticed: Option<&str>, begin: &dyn Fn(), end: &dyn Fn()) -> Row {
        self.unit.set(LEFT, Manner::Sound);
        let start = self.reader.mark();
        self.reader.report(start, "turn", LEFT + 1);
        let (mark, beside, waited) = (self.reader.mark(), Bystander::start(), self.waited());
        let begun = Instant::now();
        begin();
        let noticed = noticed.map(|part| {
            self.reader.status(mark, "turn_indicators", 2, part);
            let took = begun.elapsed();
            self.reader.expect_silence(&["turn"]);
            took
        });
        if noticed.is_none() {
            let_pass(WHILE / 2, "in which the fault lasts");
            self.unit.set(RIGHT, Manner::Sound);
            let_pass(WHILE / 2, "in which the fault lasts");
        }
        let back = self.reader.mark();
        let ended = Instant::now();
        self.unit.set(RIGHT, Manner::Sound);
        end();
        let (came, _) = self.reader.sample(back, "turn", |line| line["data"]["report"] == RIGHT + 1);
        let samples = self.reader.samples(start, "turn");
        let wrong = samples.iter().filter(|sample| !self.is_right(sample));
        let wrong = wrong.inspect(|sample| println!("wrong: {name}: {sample}")).count();
        let oldest = Duration::from_nanos(samples.iter().map(age).max().unwrap_or(0).max(0).cast_unsigned());
        let beside = beside.finish();
        if !self.may_be_late.get() {
            let waited = self.waited().saturating_sub(waited);
            beside.assert_gap(
                format!("{name}: the age of a report when it was sent"),
                oldest,
                MAX_AGE + waited,
            );
        }
        let times = samples.iter().filter_map(|sample| sample["at"].as_f64()).collect::<Vec<_>>();
        let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
        let row = Row {
            name: name.to_owned(),
            wrong,
            noticed,
            back: came.saturating_duration_since(ended),
            longest_gap: noticed.is_none().then(|| gaps.fold(0.0, f64::max)),
            oldest_s: oldest.as_secs_f64(),
        };
        println!("{}", row.markdown());
        row
    }

    /// The time for which the gateway has waited for a processor.
    fn waited(&self) -> Duration {
        self.gateway.borrow().as_ref().map_or(Duration::ZERO, |gateway| waited(gateway.id()))
    }

    fn is_right(&self, sample: &Value) -> bool {
        let report = u8::try_from(sample["data"]["report"].as_u64().unwrap()).unwrap();
        self.unit.has_sent(report - 1, stamp(sample))
    }

    /// Sends frames as fast as they go, for as long as a fault lasts.
    fn flood(&self, id: u16) {
        let (interface, is_flooded) = (self.vcan.name, Arc::clone(&self.is_flooded));
        is_flooded.store(true, Ordering::Relaxed);
        std::thread::spawn(move || {
            while is_flooded.load(Ordering::Relaxed) {
                send(interface, id, &[0; 4]);
            }
        });
    }

    fn end_flood(&self) {
        self.is_flooded.store(false, Ordering::Relaxed);
    }

    fn signal(&self, signal: &str) {
        let id = self.gateway.borrow().as_ref().unwrap().id();
        assert!(Command::new("sh").args(["-c", &format!("kill -{signal} {id}")]).status().unwrap().success());
    }

    /// Sends a signal to the process that the gateway has started for its network side.
    fn signal_network_process(&self, signal: &str) {
        let id = self.gateway.borrow().as_ref().unwrap().id();
        let kill = format!("kill -{signal} $(pgrep -P {id})");
        // There is none for a moment when the one before was replaced.
        wait_for("a network process", || {
            Command::new("sh").args(["-c", &kill]).status().unwrap().success().then_some(())
        });
    }

    /// A file stands where the black box writes, and there is something to write.
    fn spoil_black_box(&self) {
        let folder = self.folder.path().join("box");
        // The gateway makes the folder again if it writes between the two.
        wait_for("a file in place of the folder", || {
            let _absent = std::fs::remove_dir_all(&folder);
            std::fs::write(&folder, "").ok()
        });
        self.unit.set(UNDEFINED, Manner::Sound);
    }

    /// Starts a gateway whose standard error is a full pipe.
    fn start_with_blocked_log(&self) {
        let (reader, mut writer) = std::io::pipe().unwrap();
        writer.write_all(&vec![b'\n'; 65536]).unwrap();
        drop(self.gateway.replace(None));
        let process = Process::run_with(&self.folder, |command| {
            command.stderr(writer);
        });
        self.gateway.replace(Some(process));
        // For as long as the test runs.
        std::mem::forget(reader);
    }

    /// The controller leaves the bus: it reports so once, and receives nothing.
    fn bus_off(&self) {
        self.unit.set(LEFT, Manner::Dead);
        let error = CanErrorFrame::new_error(0x40, &[0; 8]).unwrap();
        CanSocket::open(self.vcan.name).unwrap().write_frame(&CanFrame::from(error)).unwrap();
    }
}

impl Row {
    fn markdown(&self) -> String {
        let Self { name, wrong, noticed, back, longest_gap, oldest_s } = self;
        let or_dash =
            |seconds: Option<f64>| seconds.map_or("–".to_owned(), |seconds| format!("{seconds:.2} s"));
        let [noticed, back] =
            [*noticed, Some(*back)].map(|time| or_dash(time.map(|time| time.as_secs_f64())));
        format!("| {name} | {wrong} | {noticed} | {back} | {} | {oldest_s:.2} s |", or_dash(*longest_gap))
    }
}

const HEAD: &str = "\
| fault | wrong publications | noticed after | reported again after | longest time without a report | oldest report when sent |
|---|---|---|---|---|---|
";

/// How old the frame of a report was when the report was sent, by the wall clock, in nanoseconds.
fn age(sample: &Value) -> i64 {
    sample["sent"].as_i64().map_or(0, |sent| sent - stamp(sample))
}

/// Sets the clock of the guest, which is nobody else's.
fn step_clock(seconds: i64) {
    let now = crate::support::vcan::wall() / 1_000_000;
    let stepped = now + seconds * 1000;
    let date = format!("@{}.{:03}", stepped / 1000, stepped % 1000);
    assert!(Command::new("date").args(["-s", &date]).output().unwrap().status.success());
}

fn is_guest() -> bool {
    std::fs::read_to_string("/proc/cpuinfo").is_ok_and(|text| text.contains("User Mode Linux"))
}

mod slow {
    use crate::support::prerequisite::require;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_fault_beside_the_gateway_publishes_nothing_wrong_and_passes() {
        super::try_all(&require!(super::Bench::new()));
    }
}

fn try_all(bench: &Bench) {
    let (vcan, unit) = (&bench.vcan, &bench.unit);
    let sends = |code, manner| move || unit.set(code, manner);
    let gateway = &bench.gateway;
    let start = || drop(gateway.replace(Some(Process::run(&bench.folder))));
    let join = || Reader::start(&bench.cyclone, bench.domain);
    let row = |name, noticed, begin: &dyn Fn(), end: &dyn Fn()| bench.try_out(name, noticed, begin, end);
    let mut rows = vec![
        row("interface down, up again", Some("is down"), &|| vcan.bring_down(), &|| vcan.bring_up()),
        row("interface removed, made again", Some("is missing"), &|| vcan.delete(), &|| vcan.create()),
        row("bus-off: an error frame, then nothing", Some("bus-off"), &|| bench.bus_off(), &|| {}),
        row("the message is no longer sent", Some("stale"), &sends(LEFT, Manner::Silent), &|| {}),
        row(
            "stuck sender: the counter stands still",
            Some("not trusted"),
            &sends(RIGHT, Manner::Stuck),
            &|| {},
        ),
        row("wrong checksums", Some("not trusted"), &sends(RIGHT, Manner::WrongChecksum), &|| {}),
        row("undefined value", Some("invalid"), &sends(UNDEFINED, Manner::Sound), &|| {}),
        row("3 s flood of foreign frames", None, &|| bench.flood(0x7FF), &|| bench.end_flood()),
        row("3 s flood with the message's identifier", None, &|| bench.flood(TURN), &|| bench.end_flood()),
        row("folder of the black box is a file", Some("invalid"), &|| bench.spoil_black_box(), &|| {}),
        row("started with a blocked standard error", None, &|| bench.start_with_blocked_log(), &|| {}),
        row("SIGKILL, restarted after 3 s", None, &|| drop(gateway.take()), &start),
        row("SIGKILL of the network process", None, &|| bench.signal_network_process("KILL"), &|| {}),
        row("SIGSTOP of the network process", None, &|| bench.signal_network_process("STOP"), &|| {}),
        row(
            "interface down and network process killed",
            Some("is down"),
            &|| {
                vcan.bring_down();
                bench.signal_network_process("KILL");
            },
            &|| vcan.bring_up(),
        ),
        row("a second DDS reader is killed", None, &|| join().kill(), &|| {}),
    ];
    rows.push(row("SIGSTOP, SIGCONT after 3 s", None, &|| bench.signal("STOP"), &|| bench.signal("CONT")));
    bench.may_be_late.set(true);
    if is_guest() {
        let step = |seconds| move || unit.between_frames(|| step_clock(seconds));
        rows.push(row("wall clock set 10 s ahead", None, &step(10), &|| {}));
        rows.push(row("wall clock set 10 s back", None, &step(-10), &|| {}));
    }
    let table: String = rows.iter().map(|row| row.markdown() + "\n").collect();
    docs_section::update("faults", &format!("{HEAD}{table}"));
    let wrong: Vec<_> = rows.iter().filter(|row| row.wrong > 0).map(Row::markdown).collect();
    assert_eq!(wrong, Vec::<String>::new());
}
