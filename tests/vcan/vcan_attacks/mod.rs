//! What the network does to the network process, and what the vehicle notices of it: command frames go out on time, the
//! gateway goes on and does not grow, and reports are soon back at an independent reader. It prints a table of
//! docs/reliability.md, and writes it there with `UPDATE_DOCS=1`.
//!
//! A frame is late beyond its period and beyond the time for which the whole computer stood still meanwhile. What is left
//! is compared with the same on the same computer without an attack.

mod stalls;

use std::net::UdpSocket;
use std::process::Command;
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::vcan_commands::car::Car;
use super::vcan_commands::commander::{Commander, Durability};
use super::vcan_commands::recording::{BusTime, Recording};
use super::vcan_commands::vehicles::{Change, NEW_EAGLE, PATIENT};
use super::vcan_gateway::reader::Reader;
use crate::support::docs_section;
use crate::support::json_process::Mark;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::Missing;
use crate::support::process::{self, Process};
use crate::support::rtps::{Attack, Mutations, Target, announcement};
use crate::support::vcan::{Vcan, wall};
use stalls::Stalls;

/// The period of the command message.
const PERIOD: Duration = Duration::from_millis(50);
/// What an attack may add to the lateness of frames.
const MAX_LATE: Duration = Duration::from_millis(50);
/// What the gateway may grow by, kB.
const MAX_GROWTH: u64 = 8 * 1024;
/// Longest time until reports are back on a slow computer that does other things as well.
const MAX_ABSENCE: Duration = Duration::from_secs(20);
/// A longer time without a report counts as an absence; they are 0.1 s apart.
const ABSENCE: Duration = Duration::from_millis(500);
/// How long a packet each 50 ms is sent.
const PACKETS: u32 = 60;
/// Time after an attack for what it leaves behind.
const AFTERWARDS: Duration = Duration::from_secs(4);

struct Bench {
    vcan: Vcan,
    recording: Recording,
    reader: Reader,
    _car: Car,
    _commander: Commander,
    gateway: Process,
    stalls: Stalls,
    domain: u16,
}

/// What came of an attack.
struct Row {
    name: String,
    lost: u64,
    back: Duration,
    late: Duration,
    memory_kb: u64,
}

impl Bench {
    fn new() -> Result<Self, Missing> {
        let vcan = Vcan::new("vcan-attack")?;
        let cyclone = Cyclone::on_loopback()?;
        let domain = domain();
        let folder =
            NEW_EAGLE.folder(vcan.name, &format!("{PATIENT}{}", process::ros_in(domain)), &Change::NONE);
        let recording = Recording::of(vcan.name);
        let car = Car::start(&folder, vcan.name, &[]);
        let gateway = Process::run(&folder);
        let commander = Commander::start(&cyclone, domain, Durability::Volatile);
        commander.wait_for_readers(Mark::START, true);
        commander.send("mode 1 10; turn 2 10; hazard 1 10");
        car.wait_for_lights(Mark::START, "left", "command");
        let reader = Reader::start(&cyclone, domain);
        reader.report(Mark::START, "turn", 2);
        let stalls = Stalls::watch();
        Ok(Self { vcan, recording, reader, _car: car, _commander: commander, gateway, stalls, domain })
    }

    /// Times of replacements of the network process.
    fn restarts(&self) -> u64 {
        let refresh = self.reader.refreshes(self.reader.mark(), 1).remove(0);
        let statuses = refresh["data"]["status"].as_array().unwrap();
        let ros = statuses.iter().find(|status| status["name"] == "signal_gateway: ros").unwrap();
        let values = ros["values"].as_array().unwrap();
        let value = values.iter().find(|value| value["key"] == "restarts").unwrap();
        value["value"].as_str().unwrap().parse().unwrap()
    }

    fn memory_kb(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.gateway.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
        line.trim().strip_suffix(" kB").unwrap().parse().unwrap()
    }

    /// Packets hit where the network process of this moment listens.
    fn aim(&self, target: &mut Target) {
        let children = Command::new("pgrep").args(["-P", &self.gateway.id().to_string()]).output().unwrap();
        if let Ok(child) = String::from_utf8_lossy(&children.stdout).trim().parse() {
            target.aim_at(child);
        }
    }

    fn try_out(&mut self, name: &str, attack: &dyn Fn(&Self, &mut Target)) -> Row {
        let mut target = Target::new(self.domain);
        let restarts = self.restarts();
        let (mark, since) = (self.reader.mark(), BusTime::now());
        attack(self, &mut target);
        let ended = wall();
        sleep(AFTERWARDS);
        self.reader.sample(self.reader.mark(), "turn", |_| true);
        let samples = self.reader.samples(mark, "turn");
        let sent = samples.iter().filter_map(|sample| sample["sent"].as_i64()).filter(|sent| *sent > ended);
        let row = Row {
            name: name.to_owned(),
            back: last_absence(ended, sent),
            late: self.latest_frame(since),
            lost: self.restarts() - restarts,
            memory_kb: self.memory_kb(),
        };
        println!("{}", row.markdown());
        assert!(self.gateway.is_running(), "{name}");
        row
    }

    /// By how much a command frame was later than its period, but for what the computer stood still.
    fn latest_frame(&self, since: BusTime) -> Duration {
        let frames = self.recording.since(since, NEW_EAGLE.command);
        assert!(frames.len() > 20, "{} command frames", frames.len());
        let late = |from: Duration, to: Duration| {
            to.saturating_sub(from).saturating_sub(PERIOD).saturating_sub(self.stalls.between(from, to))
        };
        frames.windows(2).map(|pair| late(pair[0].at, pair[1].at)).max().unwrap()
    }
}

/// Time from the end of an attack to the report that ended the last absence, or to the first report.
fn last_absence(ended: i64, sent: impl Iterator<Item = i64>) -> Duration {
    let (mut before, mut back) = (ended, None);
    for at in sent {
        let pause = Duration::from_nanos((at - before).max(0).cast_unsigned());
        if back.is_none() || pause > ABSENCE {
            back = Some(Duration::from_nanos((at - ended).cast_unsigned()));
        }
        before = at;
    }
    back.expect("no report after the attack")
}

impl Row {
    fn markdown(&self) -> String {
        let Self { name, lost, back, late, memory_kb } = self;
        let (back, late) = (back.as_secs_f64(), late.as_secs_f64() * 1e3);
        let memory = f64::from(u32::try_from(*memory_kb).unwrap()) / 1024.0;
        format!("| {name} | {lost} | {back:.1} s | {late:.0} ms | {memory:.1} MB |")
    }
}

const HEAD: &str = "\
| on the network | network processes lost | reports back after | latest command frame | memory of the gateway |
|---|---|---|---|---|
";

/// A packet each 50 ms, from a participant that announces itself before each, or from nobody known.
fn repeat(attack: Attack, is_announced: bool) -> impl Fn(&Bench, &mut Target) {
    move |bench, target| {
        for count in 1..=PACKETS {
            bench.aim(target);
            if is_announced {
                target.send(&announcement(0, target.own_port(), count));
            }
            target.send(&attack.packet(count));
            sleep(Duration::from_millis(50));
        }
    }
}

fn announce_many(bench: &Bench, target: &mut Target) {
    for round in 1..=3 {
        bench.aim(target);
        (1..=200).for_each(|participant| target.send(&announcement(participant, target.own_port(), round)));
        sleep(Duration::from_secs(1));
    }
}

/// In bursts of a hundred, to the network process or, with `nobody`, to a port where they are not read.
fn mutate(count: u32, nobody: Option<&UdpSocket>) -> impl Fn(&Bench, &mut Target) {
    move |bench, target| {
        bench.aim(target);
        let mut mutations = Mutations::of(target.capture());
        let begun = Instant::now();
        for number in 1..=count {
            if number % 100 == 1 {
                bench.aim(target);
                if let Some(nobody) = nobody {
                    target.aim_at_nobody(nobody);
                }
                sleep(Duration::from_millis(5));
            }
            target.send(&mutations.next(target.own_port()));
        }
        println!("{count} packets in {:?}", begun.elapsed());
    }
}

mod slow {
    use std::net::UdpSocket;

    use super::{Attack, Bench, Duration, HEAD, MAX_ABSENCE, MAX_GROWTH, MAX_LATE, Row};
    use super::{announce_many, docs_section, mutate, repeat, sleep};
    use crate::support::prerequisite::require;

    #[test]
    fn attacks_on_the_network_process_leave_the_bus_and_the_gateway_alone_and_reports_come_back() {
        let mut bench = require!(Bench::new());
        let nobody = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
        println!("{HEAD}");
        let calm = [
            bench.try_out("nothing, for 3 s", &|_, _| sleep(Duration::from_secs(3))),
            bench.try_out("20,000 packets to nobody", &mutate(20_000, Some(&nobody))),
        ];
        let attacks = [
            bench.try_out("HEARTBEAT of 2⁶² samples, announced", &repeat(Attack::Heartbeat, true)),
            bench.try_out("GAP of 2⁶² samples, announced", &repeat(Attack::Gap, true)),
            bench.try_out("DATA_FRAG of a 4 GiB sample, announced", &repeat(Attack::Fragment, true)),
            bench.try_out("the same from nobody known", &repeat(Attack::Fragment, false)),
            bench.try_out("200 participants, announced three times", &announce_many),
            bench.try_out("100,000 mutated packets", &mutate(100_000, None)),
        ];
        let end = bench.gateway.stop("TERM");
        println!("SIGTERM on {}: {end:?}", bench.vcan.name);
        let table: String = calm.iter().chain(&attacks).map(|row| row.markdown() + "\n").collect();
        docs_section::update("attacks", &format!("{HEAD}{table}"));
        let in_calm = calm.iter().map(|row| row.late).max().unwrap();
        for Row { name, late, back, memory_kb, .. } in &attacks {
            assert!(
                *late <= in_calm + MAX_LATE,
                "{name}: a command frame was {late:?} late, in calm {in_calm:?}"
            );
            assert!(*back <= MAX_ABSENCE, "{name}: no report for {back:?}");
            let before = calm[0].memory_kb;
            assert!(*memory_kb <= before + MAX_GROWTH, "{name}: {before} kB, then {memory_kb} kB");
        }
        assert!(attacks.iter().any(|row| row.lost > 0), "the attacks do nothing any more");
    }
}
