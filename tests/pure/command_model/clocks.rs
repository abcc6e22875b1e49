//! No clock keeps a command from the vehicle: clocks of senders and of this host that are ahead, behind, or
//! step, and several writers of one topic.

use gateway_base::time::WallStamp;
use gateway_core::command::Reported;
use gateway_core::command::input::CommandInput;
use gateway_core::command::origin::{CommandOrigin, SampleId, WriterId};
use proptest::prelude::*;
use proptest::test_runner::Config;

use crate::pure::command_model::bench::{Bench, config};
use crate::support::clock::MS;
use crate::support::command_vehicle::{PROFILE, request_text};

/// The senders' rhythm, and the period of the frames.
const CYCLE_MS: u64 = 100;
const SECOND: i64 = 1_000;
const DAY: i64 = 86_400 * SECOND;

/// How far a clock is ahead at a time, both in ms.
type Ahead = fn(u64) -> i64;

struct Case {
    id: &'static str,
    sender: Ahead,
    host: Ahead,
    /// A second writer commands hazard lights off every 800 ms, its clock 11 days ahead.
    has_rival: bool,
}

const CASES: [Case; 9] = [
    Case { id: "all clocks agree", sender: |_| 0, host: |_| 0, has_rival: false },
    Case { id: "the sender is 11 days ahead", sender: |_| 11 * DAY, host: |_| 0, has_rival: false },
    Case { id: "the sender is 11 days behind", sender: |_| -11 * DAY, host: |_| 0, has_rival: false },
    Case { id: "the host steps back 2 s", sender: |_| 0, host: step_back, has_rival: false },
    Case { id: "host and sender step back 2 s", sender: step_back, host: step_back, has_rival: false },
    Case { id: "the host steps ahead an hour", sender: |_| 0, host: step_ahead, has_rival: false },
    Case { id: "the sender steps to and fro", sender: to_and_fro, host: |_| 0, has_rival: false },
    Case { id: "a second writer, 11 days ahead", sender: |_| 0, host: |_| 0, has_rival: true },
    Case {
        id: "a second writer, and the host steps",
        sender: |_| -5 * SECOND,
        host: to_and_fro,
        has_rival: true,
    },
];

fn step_back(ms: u64) -> i64 {
    if ms < 1_550 { 0 } else { -2 * SECOND }
}

fn step_ahead(ms: u64) -> i64 {
    if ms < 1_550 { 0 } else { 3_600 * SECOND }
}

fn to_and_fro(ms: u64) -> i64 {
    if ms % 600 < 300 { 0 } else { -10 * SECOND }
}

/// The vehicle's bus between writers whose clocks differ.
struct Clocks {
    bench: Bench,
    sequence: i64,
}

impl Clocks {
    fn new() -> Self {
        let mut bench = Bench::new(config("tx = \"on\"\ncontrol_mode_timeout_ms = 60000", PROFILE));
        bench.report(Reported { turn: None, hazard: Some(false) });
        Self { bench, sequence: 0 }
    }

    /// The next message of a writer, whose clock is ahead of true time.
    fn sent(&mut self, writer: u8, ahead_ms: i64) -> (SampleId, WallStamp) {
        self.sequence += 1;
        let true_ns = self.bench.now().wall.as_nanos() - self.bench.clock_ahead_ns;
        let stamp = WallStamp::from_nanos(true_ns.saturating_add(ahead_ms * 1_000_000));
        (SampleId { writer: WriterId([writer; 16]), sequence: self.sequence }, stamp)
    }

    fn hazard(&mut self, writer: u8, raw: u8, ahead_ms: i64) {
        let (sample, stamp) = self.sent(writer, ahead_ms);
        let origin = CommandOrigin::Topic(sample);
        self.bench.take(CommandInput::Hazard { origin, command: raw.into(), stamp });
        self.bench.settle();
    }

    fn mode_and_left(&mut self, ahead_ms: i64) {
        let (sample, stamp) = self.sent(1, ahead_ms);
        self.bench.take(CommandInput::ControlMode { sample, mode: 1.into(), stamp });
        let (sample, stamp) = self.sent(1, ahead_ms);
        let origin = CommandOrigin::Topic(sample);
        self.bench.take(CommandInput::Turn { origin, command: 2.into(), stamp });
        self.bench.settle();
    }

    fn set_host_clock(&mut self, ahead_ms: i64) {
        self.bench.clock_ahead_ns = ahead_ms * 1_000_000;
    }

    /// Requests of the frames between two times, ms, both included.
    fn requested(&self, from_ms: u64, to_ms: u64) -> Vec<&'static str> {
        let frames = self.bench.sent.iter().filter(|(at, _)| (from_ms * MS..=to_ms * MS).contains(at));
        frames.map(|(_, frame)| request_text(frame.data())).collect()
    }
}

#[test]
fn hazard_lights_on_are_on_the_bus_within_one_cycle_and_left_stays_left_whatever_the_clocks_show() {
    const ON_FROM_MS: u64 = 3_000;
    const END_MS: u64 = 6_000;
    for Case { id, sender, host, has_rival } in CASES {
        let mut clocks = Clocks::new();
        for ms in (0..END_MS).step_by(50) {
            clocks.bench.pass_until(ms * MS);
            clocks.set_host_clock(host(ms));
            if ms % CYCLE_MS == 0 {
                clocks.mode_and_left(sender(ms));
                clocks.hazard(1, if ms < ON_FROM_MS { 1 } else { 2 }, sender(ms));
            }
            if has_rival && ms % 800 == 250 {
                clocks.hazard(2, 1, 11 * DAY);
            }
        }
        clocks.bench.pass_until(END_MS * MS);
        // The first message of a sender whose clock is behind may be an old one that was kept.
        let steady = clocks.requested(2 * CYCLE_MS, ON_FROM_MS - 1);
        assert!(steady.iter().all(|requested| *requested == "left"), "{id}: {steady:?}");
        for ms in (ON_FROM_MS..END_MS).step_by(100) {
            let cycle = clocks.requested(ms, ms + CYCLE_MS);
            assert!(cycle.contains(&"hazard"), "{id} at {ms} ms: {cycle:?}");
        }
        let lit = clocks.requested(ON_FROM_MS + CYCLE_MS, END_MS);
        assert!(has_rival || lit.iter().all(|requested| *requested == "hazard"), "{id}: {lit:?}");
    }
}

/// What happens next: after so many ms the host's clock steps by so many ms, or somebody sends.
#[derive(Debug, Clone, Copy)]
enum Happens {
    HostSteps(i64),
    /// The true sender commands left and hazard lights on, its clock ahead by so much.
    On(i64),
    /// Another writer commands hazard lights off.
    RivalOff(u8, i64),
}

fn any_clock() -> impl Strategy<Value = i64> {
    prop_oneof![Just(0), -3 * SECOND..3 * SECOND, -11 * DAY..11 * DAY]
}

proptest! {
    #![proptest_config(Config { cases: 200, failure_persistence: None, ..Config::default() })]

    #[test]
    fn each_hazard_on_is_on_the_bus_within_one_cycle_unless_an_off_follows_at_once(
        happenings in proptest::collection::vec(
            (1_u64..90, prop_oneof![
                1 => any_clock().prop_map(Happens::HostSteps),
                3 => any_clock().prop_map(Happens::On),
                1 => (2_u8..5, any_clock()).prop_map(|(writer, ahead)| Happens::RivalOff(writer, ahead)),
            ]),
            1..120,
        ),
    ) {
        let mut clocks = Clocks::new();
        // When hazard lights were commanded on and off, ms.
        let (mut on, mut off) = (Vec::new(), Vec::new());
        let mut ms = 0;
        for (pause, happens) in happenings {
            ms += pause;
            clocks.bench.pass_until(ms * MS);
            match happens {
                Happens::HostSteps(ahead) => clocks.set_host_clock(ahead),
                Happens::On(ahead) => {
                    clocks.mode_and_left(ahead);
                    clocks.hazard(1, 2, ahead);
                    on.push(ms);
                }
                Happens::RivalOff(writer, ahead) => {
                    clocks.hazard(writer, 1, ahead);
                    off.push(ms);
                }
            }
        }
        clocks.bench.pass_until((ms + CYCLE_MS) * MS);
        // The second control mode counts whatever its stamp, if it comes soon enough after the first.
        let begun = on.windows(2).find(|pair| pair[1] - pair[0] >= 50).map_or(u64::MAX, |pair| pair[1]);
        let is_followed = |at: u64| off.iter().any(|off| (at..=at + 10).contains(off));
        for at in on.into_iter().filter(|at| *at >= begun && !is_followed(*at)) {
            // They may have been on before.
            let before = clocks.requested(0, at).last().copied();
            let cycle = clocks.requested(at, at + CYCLE_MS);
            prop_assert!(before == Some("hazard") || cycle.contains(&"hazard"), "{at} ms: {cycle:?}");
        }
    }
}
