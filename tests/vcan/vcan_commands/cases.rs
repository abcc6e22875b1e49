//! The cases that the commands must pass, on a real bus: the shipped vehicles, an independent sender of
//! commands, and diagnostics as that sender's DDS receives them. Every frame of the day is made again by
//! `cantools` from what it should hold.

use super::bytes;
use super::car::Car;
use super::commander::{Commander, Durability, ERROR, HAZARD, OK, TRANSMISSION, TURN, WARN};
use super::recording::{BusTime, Recording};
use super::vehicles::{Change, HYUNDAI, NEW_EAGLE, PACMOD, TESLA, Vehicle};
use crate::support::json_process::Mark;
use crate::support::peer::{Cyclone, domain};
use crate::support::prerequisite::require;
use crate::support::process::{self, Process};
use crate::support::vcan::Vcan;

/// The message of [`KIT_STATE`].
const KIT_STATE_ID: u32 = 561;

/// `ControlModeReport.mode`, and the same in the message the test adds to `pacmod`.
const AUTONOMOUS: u8 = 1;
const STEER_ONLY: u8 = 2;
const VELOCITY_ONLY: u8 = 3;
const MANUAL: u8 = 4;
const UNDEFINED: u8 = 9;

/// How a vehicle's day is set up, and what differs from the others'.
struct Setup {
    vehicle: &'static Vehicle,
    interface: &'static str,
    durability: Durability,
    /// The control mode comes by a signal of the vehicle, not over ROS.
    by_signal: bool,
    on_turn_timeout: &'static str,
    on_hazard_timeout: &'static str,
    /// The request then to a vehicle that was to turn left.
    both_silent: &'static str,
    /// Off is requested of the hazard lights, and nothing of the turn indicators.
    only_hazard_off: &'static str,
    change: Change,
}

/// Limits: long enough for a busy machine to be in time, short enough to be waited for.
const KEYS: &str = "[command]\ntx = \"on\"\nturn_timeout_ms = 12000\nhazard_timeout_ms = 12000\n\
    warn_after_ms = 60000\nerror_after_ms = 90000\n";

/// A message that gives `pacmod` a control mode in place of the bits of its axes, and what the profile makes
/// of it.
const KIT_STATE: Change = Change {
    profile: &[
        (
            "steering = { signal = \"STEERING_RPT.ENABLED\", on = [1], off = [0] }
accelerator = { signal = \"ACCEL_RPT.ENABLED\", on = [1], off = [0] }
brake = { signal = \"BRAKE_RPT.ENABLED\", on = [1], off = [0] }

[[control_mode.override]]
signal = \"GLOBAL_RPT.PACMOD_SYSTEM_OVERRIDE_ACTIVE\"
on = [1]
off = [0]

[[control_mode.fault]]
signal = \"GLOBAL_RPT.PACMOD_SYSTEM_FAULT_ACTIVE\"
on = [1]
off = [0]
",
            "signal = \"KIT_STATE.MODE\"
autonomous = [1]
steer_only = [2]
velocity_only = [3]
manual = [4]
",
        ),
        ("[message.ACCEL_RPT]\n", "[message.KIT_STATE]\n"),
        ("\n[message.GLOBAL_RPT]\ntimeout_ms = 200\n", ""),
        ("\n[message.BRAKE_RPT]\ntimeout_ms = 200\n", ""),
        (", \"message.GLOBAL_RPT\", \"message.ACCEL_RPT\", \"message.BRAKE_RPT\"", ""),
    ],
    profile_end: "",
    dbc_end: "\nBO_ 561 KIT_STATE: 1 PACMOD\n SG_ MODE : 0|8@1+ (1,0) [0|255] \"\" PC\n",
};

static PACMOD_DAY: Setup = Setup {
    vehicle: &PACMOD,
    interface: "vcan-pacmod",
    durability: Durability::Volatile,
    by_signal: true,
    on_turn_timeout: "off",
    on_hazard_timeout: "off",
    both_silent: "off",
    only_hazard_off: "none",
    change: KIT_STATE,
};

static NEW_EAGLE_DAY: Setup = Setup {
    vehicle: &NEW_EAGLE,
    interface: "vcan-eagle",
    durability: Durability::TransientLocal,
    by_signal: false,
    on_turn_timeout: "hazard",
    on_hazard_timeout: "hold",
    both_silent: "hazard",
    only_hazard_off: "off",
    change: Change::NONE,
};

static TESLA_DAY: Setup = Setup {
    vehicle: &TESLA,
    interface: "vcan-tesla",
    durability: Durability::TransientLocal,
    by_signal: false,
    on_turn_timeout: "hold",
    on_hazard_timeout: "hazard",
    both_silent: "hazard",
    only_hazard_off: "off",
    change: Change::NONE,
};

static HYUNDAI_DAY: Setup = Setup {
    vehicle: &HYUNDAI,
    interface: "vcan-hyundai",
    durability: Durability::Volatile,
    by_signal: false,
    on_turn_timeout: "off",
    on_hazard_timeout: "off",
    both_silent: "off",
    only_hazard_off: "off",
    change: Change::NONE,
};

#[test]
fn tesla_passes_the_cases_and_every_byte_of_it_is_right() {
    let cyclone = require!(Cyclone::on_loopback());
    let vcan = require!(Vcan::new(TESLA_DAY.interface));
    day(&TESLA_DAY, &vcan, &cyclone);
}

mod slow {
    use super::{Cyclone, HYUNDAI_DAY, NEW_EAGLE_DAY, PACMOD_DAY, Vcan, day, require};

    /// By frames of CAN FD.
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn hyundai_passes_the_cases_and_every_byte_of_it_is_right() {
        let cyclone = require!(Cyclone::on_loopback());
        let vcan = require!(Vcan::new(HYUNDAI_DAY.interface));
        day(&HYUNDAI_DAY, &vcan, &cyclone);
    }

    /// At once, since each waits most of the time.
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn pacmod_and_new_eagle_pass_the_cases_and_every_byte_of_them_is_right() {
        let cyclone = require!(Cyclone::on_loopback());
        let setups = [&PACMOD_DAY, &NEW_EAGLE_DAY];
        let vcans = require!(
            setups.into_iter().map(|setup| Vcan::new(setup.interface)).collect::<Result<Vec<_>, _>>()
        );
        std::thread::scope(|scope| {
            for (setup, vcan) in setups.into_iter().zip(&vcans) {
                let cyclone = &cyclone;
                scope.spawn(move || day(setup, vcan, cyclone));
            }
        });
    }
}

type Case = (&'static str, fn(&Day));

/// In the order of a day: each begins as the one before has left it.
const CASES: [Case; 11] = [
    ("NO_COMMAND at 10 Hz, never engaged: no error, lamps untouched", no_command_never_engaged),
    ("MANUAL: no frame with authority, both commands ignored", manual),
    ("AUTONOMOUS: both heeded, off, right, left", autonomous),
    ("hazard ENABLE during turn LEFT, then DISABLE: hazard frames, then left again", hazard_during_left),
    ("value 7: ignored, diagnostic error, lamps untouched", undefined_value),
    ("stamps 11 days ahead and behind: followed", stamps_ahead_and_behind),
    ("AUTONOMOUS_STEER_ONLY: as AUTONOMOUS", steer_only),
    ("AUTONOMOUS_VELOCITY_ONLY: hazard carried out, turn ignored", velocity_only),
    ("undefined control mode: nothing requested, diagnostic error", undefined_mode),
    ("control mode silent for the limit: nothing requested, diagnostic", silent_mode),
    ("command topics silent for the limit: defined lamp state, diagnostic", silent_commands),
];

/// Everything of a running day.
struct Day<'a> {
    setup: &'static Setup,
    vcan: &'a Vcan,
    car: Car,
    commander: Commander,
    recording: Recording,
}

fn day(setup: &'static Setup, vcan: &Vcan, cyclone: &Cyclone) {
    let domain = domain();
    let ros = process::ros_in(domain);
    let vehicle = setup.vehicle;
    let mode = if setup.by_signal { "\"signal\"" } else { "\"topic\"\ncontrol_mode_timeout_ms = 12000" };
    let keys = format!(
        "{KEYS}control_mode = {mode}\non_turn_timeout = \"{}\"\non_hazard_timeout = \"{}\"\n{ros}",
        setup.on_turn_timeout, setup.on_hazard_timeout
    );
    let folder = vehicle.folder(vcan.name, &keys, &setup.change);
    let recording = Recording::of(vcan.name);
    // It believes a command for as long as a busy machine may need.
    let car = Car::start(&folder, vcan.name, &["--command-timeout-ms", "20000"]);
    let commander = Commander::start(cyclone, domain, setup.durability);
    let mut gateway = Process::run(&folder);
    commander.wait_for_readers(Mark::START, !setup.by_signal);
    let mut day = Day { setup, vcan, car, commander, recording };
    for (name, case) in CASES {
        let begun = std::time::Instant::now();
        println!("{}: {name} …", vehicle.name);
        case(&day);
        println!("{}: … holds, {:.1} s", vehicle.name, begun.elapsed().as_secs_f64());
    }
    gateway.stop("TERM");
    day.recording.finish();
    let frames = day.recording.since(BusTime::START, vehicle.command());
    assert_eq!(vehicle.request(&frames.last().unwrap().data), vehicle.nothing(), "the last frame");
    assert!(!gateway.log().iter().any(|line| line.contains("somebody else")), "own frames are not foreign");
    bytes::check(&folder, vehicle, &frames, &["off", "left", "right", "hazard", vehicle.nothing()]);
}

impl Day<'_> {
    fn mode(&self, mode: u8) {
        if !self.setup.by_signal {
            self.commander.send(&format!("mode {mode} 10"));
            return;
        }
        self.car.request("clear");
        match mode {
            AUTONOMOUS => self.car.request("mode autonomous"),
            STEER_ONLY => self.car.request("mode steer_only"),
            VELOCITY_ONLY => self.car.request("mode velocity_only"),
            MANUAL => self.car.request("mode manual"),
            raw => {
                self.no_mode();
                self.vcan.send(KIT_STATE_ID, [raw, 0, 0, 0, 0, 0, 0, 0]);
            }
        }
    }

    /// The control mode is no longer sent.
    fn no_mode(&self) {
        if !self.setup.by_signal {
            self.commander.send("mode silent");
            return;
        }
        self.car.request("fault drop KIT_STATE");
        let last = BusTime::now();
        // Once a report comes without it, it is no longer received.
        self.recording.wait(last, self.setup.vehicle.report(), "a report", |frames| frames.len() > 5);
    }

    /// Its lights have done nothing since then.
    fn lamps_untouched(&self, lights: Mark) {
        assert_eq!(self.car.lights_since(lights), []);
    }

    fn nothing(&self) -> &'static str {
        self.setup.vehicle.nothing()
    }

    /// What was requested since then, one for each run of frames.
    fn requests(&self, mark: BusTime) -> Vec<&'static str> {
        let vehicle = self.setup.vehicle;
        vehicle.runs(&self.recording.since(mark, vehicle.command()))
    }

    /// Waits until the newest frame since then requests this.
    fn wait(&self, mark: BusTime, request: &str) {
        self.setup.vehicle.wait_for(&self.recording, mark, request);
    }

    /// Sends commands, waits until they are on the bus, and gives the requests meanwhile.
    fn send(&self, line: &str, request: &str) -> Vec<&'static str> {
        let mark = BusTime::now();
        self.commander.send(line);
        self.wait(mark, request);
        self.requests(mark)
    }

    /// Nothing but this was requested since then, and it was.
    fn only(&self, mark: BusTime, request: &str) {
        let begun = BusTime::now();
        self.recording.wait(begun, self.setup.vehicle.command(), "a frame", |frames| !frames.is_empty());
        assert_eq!(self.requests(mark), [request]);
    }
}

fn no_command_never_engaged(day: &Day) {
    // The driver indicates, and it is no business of ours.
    day.car.request("stalk left");
    day.car.wait_for_lights(Mark::START, "left", "driver");
    let (mark, lights) = (BusTime::now(), day.car.mark());
    for (mode, name) in [(MANUAL, "MANUAL"), (AUTONOMOUS, "AUTONOMOUS")] {
        day.mode(mode);
        let sent = day.commander.send("turn 0 10; hazard 0 10");
        // The vehicle begins in a mode of its own, in which no command has been received yet.
        day.commander.status(sent, TRANSMISSION, OK, &format!("control mode {name}"));
        let since = day.commander.mark();
        for task in [TURN, HAZARD] {
            let why = if mode == MANUAL { "not allowed in this control mode" } else { "nothing requested" };
            day.commander.status(since, task, OK, why);
            let levels = day.commander.levels_during(day.commander.mark(), task, "no_command", 10);
            assert!(levels.iter().all(|level| *level == u64::from(OK)), "{levels:?}");
        }
    }
    day.commander.report(Mark::START, "turn", 2);
    day.only(mark, day.nothing());
    day.lamps_untouched(lights);
}

fn manual(day: &Day) {
    let (since, lights) = (day.commander.mark(), day.car.mark());
    day.car.request("stalk off");
    day.car.wait_for_lights(lights, "off", "nobody");
    day.mode(MANUAL);
    day.commander.status(since, TRANSMISSION, OK, "control mode MANUAL");
    day.commander.report(since, "turn", 1);
    let (mark, lights) = (BusTime::now(), day.car.mark());
    let since = day.commander.send("turn 2 10; hazard 2 10");
    for task in [TURN, HAZARD] {
        day.commander.levels_during(since, task, "commands", 10);
        day.commander.status(since, task, OK, "left to the vehicle, not allowed in this control mode");
    }
    day.only(mark, day.nothing());
    day.lamps_untouched(lights);
}

fn autonomous(day: &Day) {
    let (mark, lights) = (BusTime::now(), day.car.mark());
    day.mode(AUTONOMOUS);
    // Commands from before count from now on.
    day.wait(mark, "hazard");
    day.car.wait_for_lights(lights, "hazard", "command");
    day.send("turn 1 10; hazard 1 10", "off");
    day.car.wait_for_lights(lights, "off", "nobody");
    day.send("turn 3 10", "right");
    day.car.wait_for_lights(lights, "right", "command");
    let since = day.commander.mark();
    let requests = day.send("turn 2 10", "left");
    assert!(["right", "left"].ends_with(&requests), "{requests:?}");
    day.car.wait_for_lights(lights, "left", "command");
    day.commander.status(since, TURN, OK, "left, as commanded");
    day.commander.report(since, "turn", 2);
}

fn hazard_during_left(day: &Day) {
    let (mark, lights) = (BusTime::now(), day.car.mark());
    let since = day.commander.mark();
    day.send("hazard 2 10", "hazard");
    day.car.wait_for_lights(lights, "hazard", "command");
    day.commander.status(since, HAZARD, OK, "on, as commanded");
    day.commander.report(since, "hazard", 2);
    day.send("hazard 1 10", "left");
    let states = day.car.wait_for_lights(lights, "left", "command");
    assert_eq!(states.len(), 2, "hazard, then left, and nothing between: {states:?}");
    let requests = day.requests(mark);
    assert!(requests.len() > 1 && ["left", "hazard", "left"].ends_with(&requests), "{requests:?}");
}

fn undefined_value(day: &Day) {
    let (mark, lights) = (BusTime::now(), day.car.mark());
    for (topic, task) in [("turn", TURN), ("hazard", HAZARD)] {
        let since = day.commander.mark();
        let line = format!("{topic} once 7");
        day.commander.send_until(&line, task, ERROR, "undefined command 7 is ignored");
        day.commander.count(since, task, "undefined", 1);
    }
    // The error passes, and the command from before is still requested.
    let since = day.commander.mark();
    day.commander.status(since, TURN, OK, "left, as commanded");
    day.only(mark, "left");
    day.lamps_untouched(lights);
}

fn stamps_ahead_and_behind(day: &Day) {
    let mark = BusTime::now();
    for ahead_s in [950_400, -950_400, 0] {
        day.commander.send(&format!("turn stamps {ahead_s}; hazard stamps {ahead_s}"));
        day.send("hazard 2 10", "hazard");
        day.send("hazard 1 10", "left");
    }
    let requests = day.requests(mark);
    assert!(requests.iter().all(|request| ["left", "hazard"].contains(request)), "{requests:?}");
}

fn steer_only(day: &Day) {
    let (since, lights) = (day.commander.mark(), day.car.mark());
    day.mode(STEER_ONLY);
    day.commander.status(since, TRANSMISSION, OK, "control mode AUTONOMOUS_STEER_ONLY");
    day.send("hazard 2 10", "hazard");
    day.car.wait_for_lights(lights, "hazard", "command");
    day.send("hazard 1 10", "left");
    day.car.wait_for_lights(lights, "left", "command");
}

fn velocity_only(day: &Day) {
    let (mark, since, lights) = (BusTime::now(), day.commander.mark(), day.car.mark());
    day.mode(VELOCITY_ONLY);
    day.wait(mark, day.setup.only_hazard_off);
    day.commander.status(since, TURN, OK, "left to the vehicle, not allowed in this control mode");
    day.car.wait_for_lights(lights, "off", "nobody");
    let (mark, lights) = (BusTime::now(), day.car.mark());
    day.send("hazard 2 10; turn 3 10", "hazard");
    day.commander.value(since, TURN, "command", "right");
    day.car.wait_for_lights(lights, "hazard", "command");
    day.send("hazard 1 10", day.setup.only_hazard_off);
    let states = day.car.wait_for_lights(lights, "off", "nobody");
    assert_eq!(states.len(), 2, "never right: {states:?}");
    let requests = day.requests(mark);
    assert!(
        requests.iter().all(|request| ["hazard", day.setup.only_hazard_off].contains(request)),
        "{requests:?}"
    );
    let since = day.commander.send("turn 2 10");
    day.commander.value(since, TURN, "command", "left");
    autonomous_again(day);
}

fn undefined_mode(day: &Day) {
    let (mark, since, lights) = (BusTime::now(), day.commander.mark(), day.car.mark());
    day.mode(UNDEFINED);
    day.wait(mark, day.nothing());
    let text = if day.setup.by_signal { "is not a defined value" } else { "undefined control mode 9" };
    day.commander.status(since, TRANSMISSION, ERROR, text);
    day.car.wait_for_lights(lights, "off", "nobody");
    autonomous_again(day);
}

fn silent_mode(day: &Day) {
    let (mark, since, lights) = (BusTime::now(), day.commander.mark(), day.car.mark());
    day.no_mode();
    day.wait(mark, day.nothing());
    day.commander.status(
        since,
        TRANSMISSION,
        WARN,
        "control mode unknown: nothing is requested of the vehicle",
    );
    day.car.wait_for_lights(lights, "off", "nobody");
    autonomous_again(day);
}

/// The command that has come all the time is requested at once.
fn autonomous_again(day: &Day) {
    let (mark, lights) = (BusTime::now(), day.car.mark());
    day.mode(AUTONOMOUS);
    day.wait(mark, "left");
    day.car.wait_for_lights(lights, "left", "command");
}

fn silent_commands(day: &Day) {
    let (mark, lights) = (BusTime::now(), day.car.mark());
    let since = day.commander.send("turn silent; hazard silent");
    for task in [TURN, HAZARD] {
        day.commander.status(since, task, ERROR, "the command has timed out: ");
    }
    day.wait(mark, day.setup.both_silent);
    let requests = day.requests(mark);
    assert!(["left", day.setup.both_silent].ends_with(&requests), "{requests:?}");
    let who = if day.setup.both_silent == "off" { "nobody" } else { "command" };
    day.car.wait_for_lights(lights, day.setup.both_silent, who);
}
