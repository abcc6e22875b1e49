//! Packets that take DDS down, while the gateway sends commands and reports a vehicle on a real CAN
//! interface.
//!
//! It prints the table of docs/reliability.md, and writes it there with `UPDATE_DOCS=1`.

use std::fs;
use std::time::{Duration, Instant};

use crate::support::docs_section;
use crate::support::json_process::Mark;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::{Missing, require};
use crate::support::process::{Folder, Process, ros_in};
use crate::support::rtps::{Attack, Mutations, Target, announcement, announcement_of};
use crate::support::vcan::Vcan;
use crate::support::waiting::{Bystander, Pace, let_pass};
use crate::vcan::vcan_commands::car::Car;
use crate::vcan::vcan_commands::commander::{Commander, Durability};
use crate::vcan::vcan_commands::recording::{BusTime, Recording};
use crate::vcan::vcan_commands::vehicles::{Change, NEW_EAGLE, PATIENT};
use crate::vcan::vcan_gateway::reader::Reader;

/// The period of the command message, as shipped.
const PERIOD: Duration = Duration::from_millis(50);
/// What a frame may be later than that, beside what the machine takes from everybody: on one processor the
/// gateway takes turns with the peers.
const MAX_LATE: Duration = Duration::from_millis(250);
/// What the gateway's own process may grow by, kB.
const MAX_GROWTH: u64 = 8 * 1024;

const HEAD: &str = "\
| attack | network processes lost | command frame late by at most | a thread beside it late by at most | reports back after | memory of the gateway |
|---|---|---|---|---|---|
";

/// A gateway between a vehicle and two peers.
struct Scene {
    folder: Folder,
    recording: Recording,
    gateway: Process,
    reader: Reader,
    commander: Commander,
    target: Target,
    _car: Car,
    vcan: Vcan,
}

impl Scene {
    fn new() -> Result<Self, Missing> {
        let vcan = Vcan::new("vcan-attack")?;
        let cyclone = Cyclone::on_loopback()?;
        let domain = domain();
        let folder = NEW_EAGLE.folder(vcan.name, &format!("{PATIENT}{}", ros_in(domain)), &Change::NONE);
        let recording = Recording::of(vcan.name);
        let car = Car::start(&folder, vcan.name, &[]);
        // The first participant, and each that replaces it, so that the peers are not attacked.
        let mut gateway = Process::run(&folder);
        gateway.wait_for_log("ros: joined");
        let reader = Reader::start(&cyclone, domain);
        let commander = Commander::start(&cyclone, domain, Durability::Volatile);
        commander.wait_for_readers(Mark::START, true);
        commander.send("mode 1 10; turn 2 10; hazard 1 10");
        car.wait_for_lights(Mark::START, "left", "command");
        reader.report(Mark::START, "turn", 2);
        Ok(Self {
            target: Target::of_first(1, domain),
            folder,
            recording,
            gateway,
            reader,
            commander,
            _car: car,
            vcan,
        })
    }

    /// Lets an attack happen, and waits until reports come again. A row of the table.
    fn attack(&mut self, name: &str, attack: impl FnOnce(&Target)) -> String {
        let memory = self.memory_kb();
        let (from, lost) = (BusTime::now(), self.network_processes_lost());
        // One frame before the attack and one after it: the gaps between cover all of it, however short it
        // is.
        self.recording
            .wait(from, NEW_EAGLE.command(), "a frame before the attack", |frames| !frames.is_empty());
        let beside = Bystander::start();
        attack(&self.target);
        let (ended, mark) = (Instant::now(), self.reader.mark());
        let (came, _) = self.reader.sample(mark, "turn", |_| true);
        let to = BusTime::now();
        self.recording.wait(to, NEW_EAGLE.command(), "a frame after the attack", |frames| !frames.is_empty());
        let beside = beside.finish();
        let frames = self.recording.since(from, NEW_EAGLE.command());
        let gaps = frames.windows(2).map(|pair| pair[1].at.saturating_sub(pair[0].at));
        let gap = gaps.max().unwrap();
        let (lost, after) = (self.network_processes_lost() - lost, self.memory_kb());
        let ms = |time: Duration| time.as_secs_f64() * 1e3;
        let row = format!(
            "| {name} | {lost} | {:.0} ms | {:.0} ms | {:.1} s | {} to {} kB |\n",
            ms(gap.saturating_sub(PERIOD)),
            ms(beside.worst),
            came.saturating_duration_since(ended).as_secs_f64(),
            memory,
            after,
        );
        print!("{row}");
        assert!(self.gateway.is_running());
        beside.assert_gap(format!("{name}: command frames"), gap, PERIOD + MAX_LATE);
        assert!(after <= memory + MAX_GROWTH, "{name}: from {memory} to {after} kB");
        row
    }

    /// A command that was received over the network processes that are gone is carried out by the next one's.
    fn end(mut self) {
        let mark = self.commander.mark();
        self.commander.send("mode 1 10; turn 3 10; hazard 1 10");
        self.commander.report(mark, "turn", 3);
        self.gateway.stop("TERM");
        drop((self.folder, self.vcan));
    }

    fn network_processes_lost(&self) -> usize {
        self.gateway.log().iter().filter(|line| line.contains("the network side of ROS 2 has ended")).count()
    }

    fn memory_kb(&self) -> u64 {
        let status = fs::read_to_string(format!("/proc/{}/status", self.gateway.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
        line.split_whitespace().next().unwrap().parse().unwrap()
    }
}

/// A packet every 50 ms for 2 s.
fn repeat(target: &Target, attack: Attack, is_announced: bool) {
    let mut pace = Pace::every(Duration::from_millis(50));
    for count in 1..=40 {
        if is_announced {
            target.send(&announcement(target.own_port(), count));
        }
        target.send(&attack.packet(count));
        pace.wait();
    }
}

/// 200 participants, once each.
fn announce_participants(target: &Target) {
    for participant in 0..200 {
        target.send(&announcement_of(participant, target.own_port()));
    }
}

/// Packets in which some bytes are others, as fast as they go.
fn mutate(target: &Target, count: u32) {
    let mut mutations = Mutations::of(target.capture());
    for _ in 0..count {
        target.send(&mutations.next(target.own_port()));
    }
}

mod slow {
    use super::*;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn attacks_on_the_network_process_leave_the_bus_and_the_gateway_alone_and_reports_come_back() {
        let mut scene = require!(Scene::new());
        let mut table = HEAD.to_owned();
        table += &scene.attack("none, for 2 s", |_| let_pass(Duration::from_secs(2), "without an attack"));
        for (name, attack, is_announced) in [
            ("HEARTBEAT of 2⁶² samples, announced", Attack::Heartbeat, true),
            ("GAP of 2⁶² samples, announced", Attack::Gap, true),
            ("DATA_FRAG of a 4 GiB sample, announced", Attack::Fragment, true),
            ("the same from nobody known", Attack::Fragment, false),
        ] {
            table += &scene.attack(name, |target| repeat(target, attack, is_announced));
        }
        table += &scene.attack("200 participants announce themselves", announce_participants);
        table += &scene.attack("100,000 mutated packets", |target| mutate(target, 100_000));
        docs_section::update("attacks", &table);
        scene.end();
    }
    mod exhaustive {
        use std::time::Instant;

        use super::*;
        use crate::vcan::vcan_faults::Chance;

        /// Memory may grow until then.
        const SETTLING: Duration = Duration::from_secs(60);

        /// One after another, in a row of their own, for as long as is asked for.
        #[test]
        #[ignore = "exhaustive: tests/run --release"]
        fn mixed_attacks_leave_the_bus_and_the_gateway_alone() {
            let mut scene = require!(Scene::new());
            let mut chance = Chance::default();
            let (begin, mut settled_kb) = (Instant::now(), None);
            print!("{HEAD}");
            while begin.elapsed() < Chance::minutes() {
                let (kind, count) = (chance.below(6), chance.below(20_000));
                let _row = match kind {
                    0 => scene.attack("HEARTBEAT", |target| repeat(target, Attack::Heartbeat, true)),
                    1 => scene.attack("GAP", |target| repeat(target, Attack::Gap, true)),
                    2 => scene.attack("DATA_FRAG", |target| repeat(target, Attack::Fragment, true)),
                    3 => scene.attack("participants", announce_participants),
                    4 => scene.attack("mutated packets", |target| {
                        mutate(target, u32::try_from(count).unwrap());
                    }),
                    _ => scene.attack("none", |_| let_pass(Duration::from_secs(1), "without an attack")),
                };
                if begin.elapsed() > SETTLING {
                    let memory_kb = scene.memory_kb();
                    let settled_kb = *settled_kb.get_or_insert(memory_kb);
                    assert!(memory_kb <= settled_kb + MAX_GROWTH, "from {settled_kb} to {memory_kb} kB");
                }
            }
            scene.end();
        }
    }
}
