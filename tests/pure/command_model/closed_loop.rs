//! The loop closed on virtual time: commands in, frames to a simulated vehicle, its lights, its report,
//! and the compliance that the gateway reports.

use std::time::Duration;

use can_signal::can::input::CanInput;
use can_signal::can::link::LinkState;
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::command::Turn;
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::vehicle_lights::binding::TurnSource;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::state::TurnCode::{self, Both, Left, Off, Right};
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use proptest::prelude::*;
use proptest::sample;
use signal_gateway::config::Settings;
use vehicle_bringup::simulated_vehicle::request;
use vehicle_bringup::simulated_vehicle::{
    SimulatedVehicle, SimulationSettings, VehicleEvent, VehicleOutput, Who,
};

use crate::pure::command_model::bench::{self, settings as bench_settings};
use crate::pure::vehicles::profile;
use crate::support::clock::{MS, at as time};
use crate::support::command_vehicle::{MODE, PROFILE};
use crate::support::files::MemoryFiles;
use crate::support::vehicle_facts::VEHICLES;

const AUTONOMOUS: u8 = 1;
const VELOCITY_ONLY: u8 = 3;
const MANUAL: u8 = 4;
/// Commands as their messages have them.
const NONE: u8 = 0;
const DISABLE: u8 = 1;
const LEFT: u8 = 2;
const RIGHT: u8 = 3;
const HAZARD_OFF: u8 = 1;
const HAZARD_ON: u8 = 2;
/// Names the shipped profiles with commands.
fn commanding() -> Vec<&'static str> {
    let vehicles = VEHICLES.iter().filter(|(_, vehicle)| vehicle.command.is_some());
    vehicles.map(|(name, _)| name.as_str()).collect()
}

/// The configuration from a text, all else from the project.
pub(crate) fn shipped(name: &str, command: &str) -> Settings {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/config/vehicles");
    let bus = &VEHICLES[name].command.as_ref().unwrap().bus;
    let vehicle = &profile(name).vehicle;
    let text = format!(
        "profile = \"{folder}/{name}.toml\"\nros.topics.control_mode_status = \"\"\ncan.{bus}.interface = \"can0\"\n[command]\ntx = \"on\"\nconsent = {vehicle:?}\n{command}\n"
    );
    MemoryFiles::new([("gateway.toml", text)]).or_disk().settings()
}

/// Gateway and vehicle on one wire, and Autoware, which repeats its command ten times a second.
struct Loop {
    gateway: Gateway,
    vehicle: SimulatedVehicle,
    at: MonoTime,
    spoken: MonoTime,
    /// Turn, hazard, mode; none = silence.
    words: [Option<u8>; 3],
    gateway_lives: bool,
    reports: (Option<&'static str>, Option<&'static str>),
    /// When another turn report came than before.
    turned: MonoTime,
    happened: Vec<(MonoTime, VehicleEvent)>,
    /// When, of which task.
    changes: Vec<(MonoTime, String, Level, String)>,
}

impl Loop {
    fn new(settings: &Settings) -> Self {
        let plan = settings.vehicle_plan().unwrap();
        let mut desk = Self {
            gateway: Gateway::new(settings.gateway.clone(), LinkState::Up, time(MonoTime::ZERO)),
            vehicle: SimulatedVehicle::new(plan, SimulationSettings::default(), MonoTime::ZERO),
            at: MonoTime::ZERO,
            spoken: MonoTime::ZERO,
            words: [None; 3],
            gateway_lives: true,
            reports: (None, None),
            turned: MonoTime::ZERO,
            happened: Vec::new(),
            changes: Vec::new(),
        };
        desk.exchange();
        desk
    }

    fn shipped(name: &str) -> Self {
        Self::new(&shipped(name, ""))
    }

    /// Exchanges everything that is due at this instant, until neither side has anything left.
    fn exchange(&mut self) {
        let now = time(self.at);
        loop {
            let mut is_quiet = true;
            while let Some(output) = self.vehicle.poll_output() {
                match output {
                    VehicleOutput::Frame { bus, frame } if self.gateway_lives => {
                        self.gateway.handle(CanInput::Frame { bus, frame, stamp: now.wall }, now);
                        is_quiet = false;
                    }
                    VehicleOutput::Error { bus, error } if self.gateway_lives => {
                        self.gateway.handle(CanInput::ErrorFrame { bus, error }, now);
                    }
                    VehicleOutput::Frame { .. } | VehicleOutput::Error { .. } => {}
                    VehicleOutput::Happened(happening) => {
                        self.happened.push((self.at, happening));
                    }
                }
            }
            while let Some(output) = self.gateway.poll_output() {
                match output {
                    Output::Command(CommandOutput::Transmit { frame, .. }) => {
                        self.vehicle.frame_arrived(frame.bus(), frame.frame(), self.at);
                        is_quiet = false;
                    }
                    Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) => {
                        let report = step.value().map(TurnIndicators::name);
                        if report.is_some() && report != self.reports.0 {
                            self.turned = self.at;
                        }
                        self.reports.0 = report;
                    }
                    Output::VehicleLights(VehicleLightsOutput::HazardLights(step)) => {
                        self.reports.1 = step.value().map(HazardLights::name);
                    }
                    Output::Diagnostics { diagnostics, .. } if !diagnostics.refresh => {
                        for status in diagnostics.statuses.into_iter().filter(|s| s.task.contains("_command"))
                        {
                            self.changes.push((self.at, status.task, status.level, status.message));
                        }
                    }
                    Output::Diagnostics { .. }
                    | Output::Command(CommandOutput::WouldTransmit { .. })
                    | Output::VehicleStatus(_)
                    | Output::TrafficLights(_)
                    | Output::TurnSignal(_) => {}
                }
            }
            if is_quiet {
                return;
            }
        }
    }

    fn pass(&mut self, ms: u64) {
        let end = self.at.after(Duration::from_millis(ms));
        loop {
            let deadlines = [self.vehicle.next_deadline(self.at), Some(self.spoken), Some(end)];
            let gateway = self.gateway_lives.then(|| self.gateway.next_deadline());
            let next = deadlines.into_iter().chain([gateway]).flatten().min().unwrap();
            self.at = next.max(self.at);
            let now = time(self.at);
            if self.at >= self.spoken {
                self.spoken = self.at.after(Duration::from_millis(100));
                let [turn, hazard, mode] = self.words;
                let stamp = now.wall;
                let words = [
                    turn.map(|raw| bench::turn(raw, stamp)),
                    hazard.map(|raw| bench::hazard(raw, stamp)),
                    mode.map(|raw| bench::mode(raw, stamp)),
                ];
                for word in words.into_iter().flatten().filter(|_| self.gateway_lives) {
                    self.gateway.handle(word, now);
                }
            }
            if self.gateway_lives {
                self.gateway.handle(Input::Tick, now);
            }
            self.vehicle.settle(self.at);
            self.exchange();
            if self.at >= end {
                return;
            }
        }
    }

    fn command(&mut self, turn: u8, hazard: u8, ms: u64) {
        (self.words[0], self.words[1]) = (Some(turn), Some(hazard));
        self.pass(ms);
    }

    fn request(&mut self, text: &str, ms: u64) {
        let (_, request) = request::line(text).unwrap().unwrap();
        self.vehicle.request(request, self.at);
        self.pass(ms);
    }

    fn mode(&mut self, mode: u8) {
        self.words[2] = Some(mode);
    }

    /// Changes of the turn command's status since a time.
    fn news_since(&self, since: MonoTime) -> Vec<(Level, &str)> {
        let news =
            self.changes.iter().filter(|(at, task, ..)| *at >= since && task == "turn_indicators_command");
        news.map(|(_, _, level, message)| (*level, message.as_str())).collect()
    }

    fn lights_since(&self, since: MonoTime) -> Vec<(u64, TurnCode, Who)> {
        let lights = self.happened.iter().filter_map(|(at, happening)| {
            let VehicleEvent::Lights { code, who } = happening else { return None };
            (*at >= since).then(|| (at.since(since).as_nanos(), *code, *who))
        });
        lights.map(|(nanos, code, who)| (u64::try_from(nanos).unwrap() / MS, code, who)).collect()
    }
}

#[test]
fn each_shipped_vehicle_follows_commands_and_its_report_shows_it() {
    for name in commanding() {
        let mut car = Loop::shipped(name);
        car.mode(AUTONOMOUS);
        car.command(DISABLE, HAZARD_OFF, 1000);
        let steps = [
            (LEFT, HAZARD_OFF, Left, "ENABLE_LEFT", "DISABLE"),
            (LEFT, HAZARD_ON, Both, "DISABLE", "ENABLE"),
            (LEFT, HAZARD_OFF, Left, "ENABLE_LEFT", "DISABLE"),
            (RIGHT, HAZARD_OFF, Right, "ENABLE_RIGHT", "DISABLE"),
            (DISABLE, HAZARD_OFF, Off, "DISABLE", "DISABLE"),
            (DISABLE, HAZARD_ON, Both, "DISABLE", "ENABLE"),
        ];
        for (turn, hazard, code, turn_report, hazard_report) in steps {
            car.command(turn, hazard, 5000);
            let who = if code == Off { Who::Nobody } else { Who::Command };
            assert_eq!(car.vehicle.lights(), (code, who), "{name}");
            assert_eq!(car.reports, (Some(turn_report), Some(hazard_report)), "{name}");
        }
        let bad: Vec<_> = car
            .changes
            .iter()
            .filter(|(at, _, level, _)| *level != Level::Ok && *at > MonoTime::from_millis(1000))
            .collect();
        assert!(bad.is_empty(), "{name}: {bad:?}");
    }
}

#[test]
fn in_manual_mode_nothing_reaches_the_lights_and_with_velocity_only_the_hazard_lights_do() {
    for name in commanding() {
        let mut car = Loop::shipped(name);
        car.mode(MANUAL);
        car.command(LEFT, HAZARD_ON, 5000);
        assert_eq!(car.vehicle.lights(), (Off, Who::Nobody), "{name}");
        let requested = car.happened.iter().any(|(_, what)| {
            matches!(
                what,
                VehicleEvent::Commanded { turn: Some(Turn::Left | Turn::Right), .. }
                    | VehicleEvent::Commanded { hazard: Some(true), .. }
            )
        });
        assert!(!requested, "{name}");
        car.mode(VELOCITY_ONLY);
        car.command(LEFT, HAZARD_OFF, 5000);
        assert_eq!(car.vehicle.lights(), (Off, Who::Nobody), "{name}");
        car.command(LEFT, HAZARD_ON, 5000);
        assert_eq!(car.vehicle.lights(), (Both, Who::Command), "{name}");
    }
}

#[test]
fn the_driver_is_left_alone_and_the_command_comes_back() {
    let mut car = Loop::shipped("pacmod");
    car.mode(AUTONOMOUS);
    car.command(LEFT, HAZARD_OFF, 5000);
    let since = car.at;
    car.request("stalk right", 5000);
    assert_eq!(car.vehicle.lights(), (Right, Who::Driver));
    assert_eq!(car.news_since(since), [(Level::Warn, "commanded left, left to the driver: right")]);
    let since = car.at;
    car.request("stalk off", 5000);
    assert_eq!(car.vehicle.lights(), (Left, Who::Command));
    assert_eq!(car.news_since(since).last().unwrap().0, Level::Ok);
    // A driver who switches the hazard lights on keeps them, whatever is commanded.
    car.request("hazard on", 5000);
    assert_eq!(car.vehicle.lights(), (Both, Who::Driver));
    car.request("hazard off", 5000);
    assert_eq!(car.vehicle.lights(), (Left, Who::Command));
}

#[test]
fn a_vehicle_that_ignores_commands_or_reports_falsely_is_detected() {
    let warning = (Level::Warn, "commanded left, but the vehicle still reports off");
    let error = (Level::Error, "commanded left, but the vehicle reports off");
    for name in commanding() {
        for fault in ["fault ignore-commands", "fault false-report off"] {
            let mut car = Loop::shipped(name);
            car.mode(AUTONOMOUS);
            car.command(DISABLE, HAZARD_OFF, 2000);
            let since = car.at;
            car.request(fault, 0);
            car.command(LEFT, HAZARD_OFF, 5000);
            let news = car.news_since(since);
            let at = |expected: (Level, &str)| news.iter().position(|news| *news == expected);
            let (warned, failed) = (at(warning), at(error));
            assert!(warned.is_some() && warned < failed, "{name} {fault}: {news:?}");
            let since = car.at;
            car.request("clear", 5000);
            assert_eq!(car.reports.0, Some("ENABLE_LEFT"), "{name} {fault}");
            assert_eq!(car.news_since(since).last().unwrap().0, Level::Ok, "{name} {fault}");
        }
    }
}

/// True if the vehicle reports a state, not lamps, of which "off" is known a flash later.
fn reports_its_state(name: &str) -> bool {
    let sources = profile(name).gateway.lights.turn.sources();
    sources.iter().all(|named| !matches!(named.source, TurnSource::Lamps { .. }))
}

/// How long the loop takes by its construction, at any phase of its rhythms: what a process and a machine
/// add is measured on a real bus.
fn commands_are_reported_in_time(commands: u64) {
    // The gateway's least distance between two frames, the reaction, the report's period.
    let most_ms = 10 + u64::try_from(SimulationSettings::default().reaction.as_millis()).unwrap() + 100;
    for name in commanding().into_iter().filter(|name| reports_its_state(name)) {
        let mut car = Loop::shipped(name);
        car.mode(AUTONOMOUS);
        car.command(DISABLE, HAZARD_OFF, 1000);
        let mut spans = Vec::new();
        for (step, raw) in (0..commands).zip([LEFT, DISABLE, RIGHT, DISABLE].into_iter().cycle()) {
            // All phases come, in an order without pattern.
            car.pass(300 + step * 37 % 100);
            let commanded = time(car.at);
            car.words[0] = Some(raw);
            car.gateway.handle(bench::turn(raw, commanded.wall), commanded);
            car.exchange();
            car.pass(most_ms);
            let report = ["DISABLE", "ENABLE_LEFT", "ENABLE_RIGHT"][usize::from(raw - 1)];
            assert_eq!(car.reports.0, Some(report), "{name}, step {step}");
            spans.push(car.turned.since(commanded.mono).as_secs_f64() * 1000.0);
        }
        spans.sort_by(f64::total_cmp);
        let at = |percent: usize| spans[(spans.len() - 1) * percent / 100];
        println!(
            "{name}: command to report, {commands} commands: least {:.1} ms, median {:.1}, 90 % {:.1}, 99 % {:.1}, most {:.1}",
            spans[0],
            at(50),
            at(90),
            at(99),
            at(100)
        );
    }
}

/// Each command at each phase of 1 ms.
#[test]
fn a_command_is_reported_within_the_vehicles_reaction_and_one_period_of_its_report() {
    commands_are_reported_in_time(100);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_command_is_reported_within_the_vehicles_reaction_and_one_period_of_its_report() {
        super::commands_are_reported_in_time(1000);
    }
}

/// What the bus and the lights do when the process is killed in mid-turn, and one second later a new one
/// begins.
#[test]
fn a_killed_gateway_ends_the_command_and_the_next_one_begins_it_again() {
    for name in commanding() {
        let command = shipped(name, "").command.unwrap();
        let period: u64 = command.binding.messages[0].timing.period.as_millis().try_into().unwrap();
        let mut car = Loop::shipped(name);
        car.mode(AUTONOMOUS);
        car.command(LEFT, HAZARD_OFF, 5000);
        let killed = car.at;
        car.gateway_lives = false;
        car.pass(1000);
        let lights = car.lights_since(killed);
        let [(ms, Off, Who::Nobody)] = lights[..] else { panic!("{name}: {lights:?}") };
        // Five periods without a frame, and the vehicle's own reaction.
        assert!((4 * period + 50..=5 * period + 51).contains(&ms), "{name}: {ms} ms");
        let restarted = car.at;
        car.gateway = Gateway::new(shipped(name, "").gateway, LinkState::Up, time(car.at));
        car.gateway_lives = true;
        car.pass(1000);
        let lights = car.lights_since(restarted);
        let [(ms, Left, Who::Command)] = lights[..] else { panic!("{name}: {lights:?}") };
        // The next command and mode, and with a counter one frame that is not believed.
        assert!(ms <= 100 + period + 50 + 1, "{name}: {ms} ms");
        assert_eq!(car.reports.0, Some("ENABLE_LEFT"));
    }
}

#[test]
fn an_orderly_stop_leaves_the_lights_as_configured() {
    for (on_shutdown, expected) in [("release", Off), ("off", Off), ("hazard", Both)] {
        let mut car = Loop::new(&shipped("pacmod", &format!("on_shutdown = \"{on_shutdown}\"")));
        car.mode(AUTONOMOUS);
        car.command(LEFT, HAZARD_OFF, 5000);
        let stopped = car.at;
        car.gateway.handle(CommandInput::Stop, time(car.at));
        car.words = [None; 3];
        car.pass(400);
        let lights = car.lights_since(stopped);
        assert_eq!(lights.first().map(|(_, code, _)| *code), Some(expected), "{on_shutdown}: {lights:?}");
    }
}

/// The bench vehicle with a button that springs back, and a stalk that does.
fn invented(hazard: &str, turn: &str) -> Settings {
    let profile = PROFILE
        .replace("signal = \"STATE.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n", turn)
        .replace("from = \"signal\"\nsignal = \"STATE.HAZARD\"\non = [1]\noff = [0]\n", hazard)
        .replace("message.STATE.timeout_ms = 500", "message.STATE.timeout_ms = 500\nmessage.SEALED.timeout_ms = 500\nmessage.BUTTON.timeout_ms = 500");
    bench_settings("tx = \"on\"\ncontrol_mode = \"signal\"", &(profile + MODE))
}

#[test]
fn a_stalk_and_a_button_that_spring_back_are_pressed_as_a_driver_would() {
    let stalk = "kind = \"stalk\"\nsignal = \"SEALED.SEALED_REQ\"\nidle = [0]\nleft_half = [1]\nleft_full = [2]\n\
                 right_half = [3]\nright_full = [4]\n";
    let button = "from = \"button\"\nsignal = \"BUTTON.PRESSED\"\non = [1]\noff = [0]\n";
    let mut car = Loop::new(&invented(button, stalk));
    car.pass(6000);
    assert_eq!(car.reports, (Some("DISABLE"), Some("DISABLE")));
    for (request, report) in [
        ("stalk left", "ENABLE_LEFT"),
        ("stalk off", "DISABLE"),
        ("stalk right", "ENABLE_RIGHT"),
        ("stalk left", "ENABLE_LEFT"),
        ("stalk off", "DISABLE"),
        ("tap right", "DISABLE"),
    ] {
        car.request(request, 3000);
        assert_eq!(car.reports.0, Some(report), "{request}");
    }
    for (request, report) in [("hazard on", "ENABLE"), ("hazard on", "ENABLE"), ("hazard press", "DISABLE")] {
        car.request(request, 3000);
        assert_eq!(car.reports.1, Some(report), "{request}");
    }
}

/// Some of what can happen to a vehicle, and how long it lasts.
fn days() -> impl Strategy<Value = Vec<(usize, u64)>> {
    prop::collection::vec((0_usize..20, 10_u64..3000), 1..20)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever happened: once all is whole and the driver's hands are off, the lights are as commanded, and
    /// all statuses report that the vehicle complies.
    #[test]
    fn after_any_day_the_lights_are_as_commanded(name in sample::select(commanding()), day in days()) {
        let mut car = Loop::shipped(name);
        car.mode(AUTONOMOUS);
        for (what, ms) in day {
            match what {
                0 => car.request("stalk left", ms),
                1 => car.request("stalk right", ms),
                2 => car.request("stalk off", ms),
                3 => car.request("tap left", ms),
                4 => car.request("hazard press", ms),
                5 => car.request("fault drop 0.5", ms),
                6 => car.request("fault corrupt 0.5", ms),
                7 => car.request("fault freeze-counter", ms),
                8 => car.request("fault false-report right", ms),
                9 => car.request("fault ignore-commands", ms),
                10 => car.request("fault bus-off 0.7", ms),
                11 => car.request("fault report undefined", ms),
                12 => car.request("clear", ms),
                13 => { car.mode(MANUAL); car.pass(ms); }
                14 => { car.mode(AUTONOMOUS); car.pass(ms); }
                15 => car.command(LEFT, HAZARD_OFF, ms),
                16 => car.command(RIGHT, HAZARD_ON, ms),
                17 => car.command(DISABLE, HAZARD_OFF, ms),
                18 => car.command(NONE, NONE, ms),
                _ => { car.words = [None; 3]; car.pass(ms); }
            }
        }
        car.mode(AUTONOMOUS);
        car.request("clear", 0);
        car.request("stalk off", 0);
        car.request("hazard off", 0);
        car.command(DISABLE, HAZARD_OFF, 8000);
        car.command(LEFT, HAZARD_OFF, 8000);
        prop_assert_eq!(car.vehicle.lights(), (Left, Who::Command));
        prop_assert_eq!(car.reports, (Some("ENABLE_LEFT"), Some("DISABLE")));
        let worst = car.gateway.statuses(car.at).iter().filter(|s| s.task.contains("_command")).map(|s| s.level).max();
        prop_assert_eq!(worst, Some(Level::Ok));
    }
}
