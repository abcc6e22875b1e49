//! Random days: the flow requests the same as the model, and the rules of sending hold for every frame.

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::time::{MonoTime, WallStamp};
use gateway_core::command::Reported;
use gateway_core::command::Turn;
use gateway_core::command::input::CommandInput;
use gateway_core::command::origin::{CommandOrigin, SampleId, WriterId};
use gateway_core::command::sender::SendFailure;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestCaseError};

use crate::pure::command_model::bench::{Bench, config, mode};
use crate::pure::command_model::model::{Command, Event, Requested, Rules, Silence, requested};
use crate::support::clock::MS;
use crate::support::command_vehicle::{PROFILE, request_text};

const PERIOD_NS: u64 = 100 * MS;
const MIN_GAP_NS: u64 = 10 * MS;

const ELEVEN_DAYS_MS: i64 = 11 * 86_400_000;

fn any_command(raw: std::ops::Range<u8>) -> impl Strategy<Value = Command> {
    let clock = prop_oneof![
        8 => Just(0_i64),
        1 => -400..400_i64,
        1 => prop_oneof![Just(-ELEVEN_DAYS_MS), Just(ELEVEN_DAYS_MS)],
    ];
    let is_overtaken = prop_oneof![9 => Just(false), 1 => Just(true)];
    (0_u8..2, raw, clock, is_overtaken).prop_map(|(writer, raw, ahead_ms, is_overtaken)| Command {
        writer,
        raw,
        ahead_ms,
        is_overtaken,
    })
}

fn any_event() -> impl Strategy<Value = Event> {
    let turn =
        prop_oneof![Just(None), Just(Some(Turn::Off)), Just(Some(Turn::Left)), Just(Some(Turn::Right))];
    prop_oneof![
        6 => any_command(0..6).prop_map(Event::Turn),
        6 => any_command(0..5).prop_map(Event::Hazard),
        1 => (-5_000..5_000_i64).prop_map(Event::ClockStep),
        6 => prop_oneof![4 => 1_u8..4, 1 => 0_u8..9].prop_map(Event::Mode),
        1 => any::<bool>().prop_map(Event::Link),
        2 => (turn, any::<Option<bool>>()).prop_map(|(turn, hazard)| Event::Report(turn, hazard)),
        1 => Just(Event::Full),
    ]
}

fn any_rules() -> impl Strategy<Value = Rules> {
    let silence = || prop_oneof![Just(Silence::Off), Just(Silence::Hold), Just(Silence::Hazard)];
    (200_u64..900, 200_u64..900, 200_u64..900, silence(), silence()).prop_map(
        |(turn, hazard, mode, on_turn_timeout, on_hazard_timeout)| Rules {
            turn_ns: turn * MS,
            hazard_ns: hazard * MS,
            mode_ns: mode * MS,
            on_turn_timeout,
            on_hazard_timeout,
        },
    )
}

fn section(rules: Rules) -> String {
    let word = |silence: Silence| format!("{silence:?}").to_lowercase();
    format!(
        "tx = \"on\"\nturn_timeout_ms = {}\nhazard_timeout_ms = {}\ncontrol_mode_timeout_ms = {}\n\
         on_turn_timeout = \"{}\"\non_hazard_timeout = \"{}\"",
        rules.turn_ns / MS,
        rules.hazard_ns / MS,
        rules.mode_ns / MS,
        word(rules.on_turn_timeout),
        word(rules.on_hazard_timeout),
    )
}

/// The text of a frame with this request.
fn words((turn, hazard): Requested) -> &'static str {
    match (turn, hazard) {
        (None, None) => "-",
        (_, Some(true)) if turn.is_some() => "hazard",
        (_, Some(true)) => "hazard, any turn",
        (None, Some(false)) => "any turn",
        (Some(Turn::Off), Some(false)) => "off",
        (Some(Turn::Left), Some(false)) => "left",
        (Some(Turn::Right), Some(false)) => "right",
        (Some(Turn::Off), None) => "off, any hazard",
        (Some(Turn::Left), None) => "left, any hazard",
        (Some(Turn::Right), None) => "right, any hazard",
    }
}

struct Day {
    bench: Bench,
    rules: Rules,
    history: Vec<(u64, Event)>,
    up: bool,
    full: bool,
    /// Frames that were really sent.
    wire: Vec<(u64, Frame)>,
    /// True if hazard lights were ever requested.
    hazard_requested: bool,
    /// Time since which hazard lights are requested without a break.
    hazard_since: Option<u64>,
}

impl Day {
    fn check(&mut self) -> Result<(), TestCaseError> {
        let given = self.bench.settle();
        let at = self.bench.now_ns;
        let expected = requested(self.rules, &self.history, at);
        let request = self.bench.flow.decision().request;
        let reported = self.history.iter().any(|(_, event)| matches!(event, Event::Report(..)));
        // The driver may take from what is requested, but nothing else, and never an "on" of the hazard
        // lights.
        self.hazard_requested |= expected.1 == Some(true);
        if !reported {
            // Without a report only what was switched on is switched off.
            let hazard = expected.1.filter(|on| *on || self.hazard_requested);
            prop_assert_eq!((request.turn, request.hazard), (expected.0, hazard), "at {} ms", at / MS);
        }
        let hazard_shown =
            self.history.iter().rev().find_map(|(_, event)| {
                if let Event::Report(_, hazard) = event { Some(*hazard) } else { None }
            });
        let is_known_off = hazard_shown == Some(Some(false));
        prop_assert!(request.hazard != Some(false) || is_known_off || self.hazard_requested, "the driver's");
        prop_assert!(request.turn == expected.0 || request.turn.is_none());
        prop_assert!(request.hazard == expected.1 || (request.hazard.is_none() && expected.1 == Some(false)));
        self.hazard_since =
            if expected.1 == Some(true) && self.up { self.hazard_since.or(Some(at)) } else { None };
        prop_assert!(given.len() <= 1 && (self.up || given.is_empty()));
        for frame in given {
            prop_assert_eq!(frame.bus(), BusIndex(0));
            prop_assert_eq!(frame.frame().id(), CanId::Standard(304), "only what is in the allow-list");
            prop_assert_eq!(request_text(frame.frame().data()), words((request.turn, request.hazard)));
            if std::mem::take(&mut self.full) {
                self.bench.take(CommandInput::SendFailed { frame, failure: SendFailure::QueueFull });
            } else {
                self.wire.push((at, *frame.frame()));
            }
        }
        if let Some(since) = self.hazard_since.filter(|since| at - since > PERIOD_NS) {
            let last = self.wire.last().map(|(_, frame)| request_text(frame.data()));
            prop_assert!(
                last.is_some_and(|requested| requested.starts_with("hazard")),
                "since {}",
                since / MS
            );
        }
        Ok(())
    }

    fn pass(&mut self, pause_ns: u64) -> Result<(), TestCaseError> {
        let until = self.bench.now_ns + pause_ns;
        loop {
            let at = self.bench.now_ns;
            let due = self.bench.flow.next_deadline().map(MonoTime::as_nanos);
            prop_assert!(due.is_none_or(|due| due > at), "a deadline that does not move");
            let next = due.unwrap_or(u64::MAX).min(until);
            let same =
                requested(self.rules, &self.history, at) == requested(self.rules, &self.history, next - 1);
            prop_assert!(same, "nothing changes before the deadline");
            self.bench.now_ns = next;
            if due.is_none_or(|due| due > until) {
                return Ok(());
            }
            self.check()?;
        }
    }

    /// Origin and stamp of a command that is sent now.
    fn sent(&self, command: Command) -> (CommandOrigin, WallStamp) {
        let sequence = if command.is_overtaken { 0 } else { i64::try_from(self.history.len()).unwrap() };
        let sample = SampleId { writer: WriterId([command.writer; 16]), sequence };
        let wall_ns = self.bench.now().wall.as_nanos();
        (CommandOrigin::Topic(sample), WallStamp::from_nanos(wall_ns + command.ahead_ms * 1_000_000))
    }

    fn happen(&mut self, event: Event) -> Result<(), TestCaseError> {
        self.history.push((self.bench.now_ns, event));
        match event {
            Event::Turn(command) => {
                let (origin, stamp) = self.sent(command);
                self.bench.take(CommandInput::Turn { origin, command: command.raw.into(), stamp });
            }
            Event::Hazard(command) => {
                let (origin, stamp) = self.sent(command);
                self.bench.take(CommandInput::Hazard { origin, command: command.raw.into(), stamp });
            }
            Event::ClockStep(by_ms) => self.bench.clock_ahead_ns += by_ms * 1_000_000,
            Event::Mode(raw) => self.bench.take(mode(raw, WallStamp::default())),
            Event::Link(up) => {
                let state = if up { LinkState::Up } else { LinkState::Down };
                self.bench.buses[0].set_link(state);
                self.up = up;
            }
            Event::Report(turn, hazard) => self.bench.report(Reported { turn, hazard }),
            Event::Full => self.full = true,
        }
        self.check()
    }
}

proptest! {
    #![proptest_config(Config { cases: 200, failure_persistence: None, ..Config::default() })]

    #[test]
    fn the_flow_requests_what_the_model_requests(
        rules in any_rules(),
        events in proptest::collection::vec((1..260_000_000_u64, any_event()), 1..80),
        reports: bool,
    ) {
        let bench = Bench::new(config(&section(rules), PROFILE));
        let mut day = Day {
            bench,
            rules,
            history: Vec::new(),
            up: true,
            full: false,
            wire: Vec::new(),
            hazard_requested: false,
            hazard_since: None,
        };
        day.check()?;
        for (pause, event) in events {
            day.pass(pause)?;
            if reports || !matches!(event, Event::Report(..)) {
                day.happen(event)?;
            }
        }
        day.pass(2_000 * MS)?;
        for pair in day.wire.windows(2) {
            let ((before, one), (after, other)) = (pair[0], pair[1]);
            prop_assert!(after - before >= MIN_GAP_NS, "{before} {after}");
            prop_assert_eq!(other.data()[6] & 15, ((one.data()[6] & 15) + 1) & 15, "the counter is unbroken");
        }
        let silence = day.wire.last().map_or(u64::MAX, |(at, _)| day.bench.now_ns - at);
        prop_assert!(!day.up || silence <= PERIOD_NS + MIN_GAP_NS, "the rhythm is kept");
    }
}
