//! Packets under the identity of another: numbers far ahead of a writer, and thousands of participants.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::delivery::TURN;
use super::isolation::{network_process, signal, status_if_there};
use super::session::{Gateway, Role};
use crate::support::json_process::{JsonProcess, Mark};
use crate::support::peer::{Cyclone, Writing, domain};
use crate::support::prerequisite::require;
use crate::support::rtps::{FarAhead, Target, crowd};
use crate::support::waiting::{Bystander, Pace, wait_until};

/// The period of a commander.
const PERIOD: Duration = Duration::from_millis(100);
/// Time within which a writer is followed again.
const FOLLOWED: Duration = Duration::from_secs(2);

/// A topic that is read: its position among the subscriptions, and how it is written.
struct Topic<'a> {
    subscription: usize,
    writing: Writing<'a>,
    /// A message with this number, as `writer.py` takes it.
    message: fn(u32) -> String,
    /// The number of a message that has arrived.
    number: fn(&Value) -> Option<u64>,
    /// A sample that can be read, in CDR.
    content: &'a [u8],
}

const COMMANDS: Topic<'_> = Topic {
    subscription: 1,
    writing: Writing { kind: "text", topic: "rt/commands", reliability: "reliable", durability: "volatile" },
    message: |number| number.to_string(),
    number: |what| what["text"].as_str()?.parse().ok(),
    content: b"\0\x01\0\0\x07\0\0\0forged\0\0",
};

const LOSSY_GROUPS: Topic<'_> = Topic {
    subscription: 2,
    writing: Writing {
        kind: "groups",
        topic: "rt/lossy_groups",
        reliability: "best_effort",
        durability: "volatile",
    },
    message: |number| format!("{number} 34806 1 5 3 0.25"),
    number: |what| what["sec"].as_u64(),
    content: b"\0\x01\0\0\0\0\0\0\0\0\0\0\0\0\0\0",
};

/// A gateway, and a writer that sends ten messages a second to it.
struct Scene<'a> {
    gateway: Gateway,
    topic: Topic<'a>,
    writer: JsonProcess,
    pace: Pace,
    sent: u32,
}

impl<'a> Scene<'a> {
    fn new(cyclone: &Cyclone, domain: u16, topic: Topic<'a>) -> Self {
        let gateway = Role::new(domain).with_lights().only_on("127.0.0.1").isolated().start();
        let writer = cyclone.writer(domain, &[topic.writing]);
        let is_there = |status: &Value| status["incoming"][topic.subscription]["writers"] == 1;
        gateway.wait_until("a writer", is_there);
        Self { gateway, topic, writer, pace: Pace::every(PERIOD), sent: 0 }
    }

    /// The writer's GUID.
    fn guid(&self) -> [u8; 16] {
        let matched = self.writer.lines(Mark::START);
        let guid = matched.iter().find_map(|(_, line)| line["guid"].as_str().map(str::to_owned)).unwrap();
        std::array::from_fn(|byte| u8::from_str_radix(&guid[2 * byte..2 * byte + 2], 16).unwrap())
    }

    fn send(&mut self) {
        self.sent += 1;
        self.writer.send(&(self.topic.message)(self.sent));
        self.pace.wait();
    }

    /// Numbers of the messages that have arrived.
    fn arrived(&self) -> Vec<u64> {
        let lines = self.gateway.lines().into_iter();
        let arrived = lines
            .filter(|line| line["event"] == "arrived" && line["subscription"] == self.topic.subscription);
        arrived.filter_map(|line| (self.topic.number)(&line["what"])).collect()
    }

    /// Sends until a message arrives that was sent from now on and `count` after it; gives the time to it.
    fn follow(&mut self, count: usize) -> Duration {
        let (begun, first) = (Instant::now(), u64::from(self.sent));
        let mut took = None;
        for _ in 0..600 {
            self.send();
            let arrived = self.arrived().into_iter().filter(|number| *number > first).count();
            took = took.or_else(|| (arrived > 0).then(|| begun.elapsed()));
            if arrived > count {
                break;
            }
        }
        took.unwrap_or_else(|| panic!("not followed in a minute: {}", self.gateway.status()))
    }
}

/// Followed before, after one packet within two seconds, and each message once.
fn is_harmless(topic: Topic<'_>, attacks: &[FarAhead]) {
    let cyclone = require!(Cyclone::on_loopback());
    let domain = domain();
    let mut scene = Scene::new(&cyclone, domain, topic);
    let target = Target::of_first(4, domain);
    for (number, attack) in attacks.iter().enumerate() {
        scene.follow(15);
        target.send(&attack.packet(scene.guid(), scene.topic.content));
        let beside = Bystander::start();
        let took = scene.follow(10);
        println!("{attack:?}: followed again after {took:?}");
        beside.finish().assert_gap(format!("followed again after {attack:?}"), took, FOLLOWED);
        let least = u64::try_from(number).unwrap() + 1;
        let is_said = |status: &Value| status["taken_anew"].as_u64() >= Some(least);
        scene.gateway.wait_until("that it was taken anew", is_said);
        // The next suspicion may come after 5 s.
        scene.follow(50);
    }
    let mut arrived = scene.arrived();
    arrived.retain(|number| *number > 0); // but for the forged sample
    let all = arrived.len();
    arrived.dedup();
    assert!(arrived.is_sorted() && arrived.len() == all, "{arrived:?}");
    assert_eq!(scene.gateway.status()["restarts"], 0);
}

/// A gateway that reports ten times a second, and a reader of that.
struct Reporting {
    gateway: Gateway,
    reader: JsonProcess,
    pace: Pace,
    sent: u32,
}

impl Reporting {
    fn new(cyclone: &Cyclone, domain: u16, role: &Role) -> Self {
        let gateway = role.clone().only_on("127.0.0.1").isolated().start();
        let reader = cyclone.topic_reader(domain, "turn", TURN, "transient_local");
        let mut reporting = Self { gateway, reader, pace: Pace::every(PERIOD), sent: 0 };
        let mark = reporting.reader.mark();
        reporting.gateway.send("turn left 0");
        reporting.reader.wait_for(mark, "a report", |line| line["event"] == "sample");
        reporting.send_for(Duration::from_secs(3));
        reporting
    }

    fn send(&mut self) {
        self.sent += 1;
        self.gateway.send(&format!("turn left {}", self.sent));
        self.pace.wait();
    }

    fn send_for(&mut self, time: Duration) {
        let until = Instant::now() + time;
        while Instant::now() < until {
            self.send();
        }
    }

    /// Times at which reports arrived after a mark.
    fn reports(&self, mark: Mark) -> Vec<Instant> {
        let lines = self.reader.lines(mark).into_iter();
        lines.filter(|(_, line)| line["event"] == "sample").map(|(at, _)| at).collect()
    }

    /// Sends on for a time that begins now; the longest time without a report from now on.
    fn longest_gap(&mut self, time: Duration) -> Duration {
        let (since, mark) = (Instant::now(), self.reader.mark());
        self.send_for(time);
        self.longest_gap_since(since, mark)
    }

    /// The longest time without a report since a time and its mark.
    fn longest_gap_since(&self, since: Instant, mark: Mark) -> Duration {
        let (mut last, mut longest) = (since, Duration::ZERO);
        for at in self.reports(mark) {
            longest = longest.max(at.saturating_duration_since(last));
            last = at;
        }
        longest.max(last.elapsed())
    }
}

mod slow {
    use super::*;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_gap_or_a_heartbeat_far_ahead_costs_a_reliable_writer_two_seconds_of_commands() {
        is_harmless(COMMANDS, &[FarAhead::Heartbeat, FarAhead::Gap]);
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_sample_far_ahead_costs_a_reliable_writer_two_seconds_of_commands() {
        is_harmless(COMMANDS, &[FarAhead::DataAfterGap]);
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_sample_far_ahead_costs_a_best_effort_writer_two_seconds() {
        is_harmless(LOSSY_GROUPS, &[FarAhead::Data]);
    }

    /// How long a network process is killed on each return, unless `SIGNAL_GATEWAY_STORM_S` names another
    /// number of seconds.
    const STORM: Duration = Duration::from_secs(10);
    /// The longest time without a report from then on.
    const AFTER_STORM: Duration = Duration::from_secs(1);

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn after_a_restart_storm_reports_are_back_within_a_second_and_a_kept_command_is_carried_out_once() {
        let cyclone = require!(Cyclone::on_loopback());
        let domain = domain();
        let mut reporting = Reporting::new(&cyclone, domain, &Role::new(domain).with_lights());
        let kept = Writing {
            kind: "text",
            topic: "rt/kept_commands",
            reliability: "reliable",
            durability: "transient_local",
        };
        let commander = cyclone.writer(domain, &[kept]);
        let texts = |gateway: &Gateway| {
            let arrived = gateway.lines().into_iter().filter(|line| line["event"] == "arrived");
            arrived.filter_map(|line| line["what"]["text"].as_str().map(str::to_owned)).collect::<Vec<_>>()
        };
        commander.send("before");
        wait_until("the command", || texts(&reporting.gateway) == ["before"]);
        let storm = std::env::var("SIGNAL_GATEWAY_STORM_S")
            .map_or(STORM, |seconds| Duration::from_secs(seconds.parse().unwrap()));
        let until = Instant::now() + storm;
        let (mut process, mut kills) = (None, 0);
        commander.send("during");
        let mut is_over = false;
        while !is_over {
            if let Some(next) = network_process(reporting.gateway.id()).filter(|next| Some(*next) != process)
                && reporting.gateway.status()["up"] == true
            {
                signal("-KILL", next);
                (process, kills) = (Some(next), kills + 1);
                is_over = Instant::now() >= until;
            }
            if !is_over {
                reporting.send();
            }
        }
        let beside = Bystander::start();
        let longest = reporting.longest_gap(Duration::from_secs(10));
        println!("{kills} kills in {storm:?}, longest time without a report from then on {longest:?}");
        beside.finish().assert_gap("reports after a restart storm", longest, AFTER_STORM);
        reporting.gateway.wait_until("that it is said", |status| status["recent_ends"].as_u64() > Some(1));
        wait_until("both commands", || texts(&reporting.gateway) == ["before", "during"]);
        commander.send("after");
        wait_until("the last command", || texts(&reporting.gateway).contains(&"after".to_owned()));
        assert_eq!(texts(&reporting.gateway), ["before", "during", "after"]);
    }

    /// Participants of the flood, unless `SIGNAL_GATEWAY_CROWD` names another number, of which nothing but
    /// its end is asserted.
    const CROWD: u32 = 5_000;
    /// Packets of each, and of all in a second.
    const PACKETS: [u32; 2] = [8, 4_444];
    /// Time after which reports come again, and time after which the memory is free.
    const AFTER_FLOOD: [Duration; 2] = [Duration::from_secs(5), Duration::from_secs(10)];
    /// What a network process needs beside its program, and some reserve, kB.
    const MEMORY_KB: u64 = 32 * 1024;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_flood_of_participants_for_68_years_is_said_and_forgotten() {
        let cyclone = require!(Cyclone::on_loopback());
        let domain = domain();
        let mut reporting = Reporting::new(&cyclone, domain, &Role::new(domain));
        let first = network_process(reporting.gateway.id()).unwrap();
        let target = Target::of_first(1, domain);
        let participants =
            std::env::var("SIGNAL_GATEWAY_CROWD").map_or(CROWD, |number| number.parse().unwrap());
        let packets = participants * PACKETS[0];
        let topic = (TURN, "autoware_vehicle_msgs::msg::dds_::TurnIndicatorsReport_");
        let (began, before) = (Instant::now(), reporting.reader.mark());
        let flood = std::thread::spawn(move || {
            let mut pace = Pace::every(Duration::from_secs(20) / PACKETS[1]);
            for number in 0..packets {
                target.send(&crowd(number % participants, number / participants, target.own_port(), topic));
                if number % 20 == 19 {
                    pace.wait();
                }
            }
        });
        let mut burdens = BTreeSet::new();
        while !flood.is_finished() {
            reporting.send();
            burdens.extend(reporting.gateway.status()["burden"].as_str().map(str::to_owned));
        }
        let (ended, beside, mark) = (Instant::now(), Bystander::start(), reporting.reader.mark());
        wait_until("a report after the flood", || {
            reporting.send();
            !reporting.reports(mark).is_empty()
        });
        let back = ended.elapsed();
        let longest = reporting.longest_gap_since(began, before);
        wait_until("another network process, without the crowd", || {
            reporting.send();
            let status = reporting.gateway.status();
            burdens.extend(status["burden"].as_str().map(str::to_owned));
            let process = network_process(reporting.gateway.id()).filter(|process| *process != first);
            let memory = process.and_then(|process| status_if_there(process, "RssAnon"));
            status["up"] == true
                && status["peers"].as_u64() < Some(100)
                && memory.is_some_and(|memory| memory < MEMORY_KB || participants != CROWD)
        });
        let forgotten = ended.elapsed();
        println!(
            "{participants} participants, {packets} packets in {:?}: {burdens:?}, at most {longest:?} without a report, \
             one {back:?} after the end, forgotten after {forgotten:?}, {:?} kB: {}",
            ended - began,
            network_process(reporting.gateway.id()).and_then(|process| status_if_there(process, "RssAnon")),
            reporting.gateway.status()
        );
        if participants != CROWD {
            return;
        }
        assert!(burdens.contains("Crowd"), "{burdens:?}");
        let lateness = beside.finish();
        lateness.assert_gap("a report after a flood", back, AFTER_FLOOD[0]);
        lateness.assert_gap("the end of a crowd", forgotten, AFTER_FLOOD[1]);
        let longest = reporting.longest_gap(Duration::from_secs(20));
        println!("longest time without a report in the 20 s after that: {longest:?}");
        lateness.assert_gap("reports after a flood", longest, AFTER_STORM);
    }
}
