//! Traffic lights from a scenario, from topics and from a V2X unit.

use can_signal::can::error_frame::ErrorFrame;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::LinkState;
use gateway_base::time::WallStamp;
use traffic_lights::compat::Compat;
use traffic_lights::engine::{LightObservation, LightsSettings};
use traffic_lights::flow::{LightsFlowSettings, TrafficLightFlow};
use traffic_lights::input::TrafficLightInput;
use traffic_lights::scenario::{Act, Scenario};
use traffic_lights::text::parse_bulbs;

use super::{BUS, Desk, LOSSES, Reported};
use crate::pure::traffic_light_cases::scene::{controller, script, set, small_map, target};
use crate::support::clock::at_ms;
use crate::support::files::MemoryFiles;

pub(super) fn drive(reported: &mut Reported) {
    scenarios(reported);
    simulated_time(reported);
    channels(reported);
    unit(reported);
}

/// A flow of its own, for scenarios that a file cannot have.
fn flow(acts: Vec<Act>, compat: Compat) -> TrafficLightFlow {
    let scenario = Scenario {
        acts,
        controllers: vec![controller("A", &[("p1", "1", "11=green")])],
        ..Scenario::default()
    };
    let lights = LightsSettings::new(small_map(), scenario, compat);
    TrafficLightFlow::new(LightsFlowSettings::new(lights), at_ms(0))
}

fn scenarios(reported: &mut Reported) {
    let mut failing = flow(script(&[(1, set("5", "red"))]), Compat::Upstream);
    failing.settle(at_ms(2_000));
    reported.take(failing.statuses(at_ms(2_000).mono));
    for command in ["exitSuccess()", "exitFailure()"] {
        let mut desk = lights(
            "[[controller]]\nname = \"A\"\nphase = [{ name = \"p1\", duration_s = 1, states = {} }]\n",
            reported,
        );
        desk.pass(500);
        desk.input(TrafficLightInput::Command("nonsense".to_owned()));
        desk.input(TrafficLightInput::Command(command.to_owned()));
        desk.pass(500);
    }
    lights("stop_at_s = 1\n", reported).pass(2_000);
}

fn lights<'a>(scenario: &str, reported: &'a mut Reported) -> Desk<'a> {
    let gateway = "[traffic_lights]\nscenario = \"s.toml\"\nv2i_timeout_ms = 500\n[traffic_lights.inputs]\nv2i = \"/v2i\"\n";
    let scenario = format!("{scenario}[groups]\n100 = [11]\n");
    Desk::of(&MemoryFiles::new([("gateway.toml", gateway), ("s.toml", &scenario)]), reported)
}

fn simulated_time(reported: &mut Reported) {
    let gateway = "[traffic_lights]\nscenario = \"s.toml\"\nuse_sim_time = true\n";
    let scenario = "[groups]\n100 = [11]\n[[controller]]\nname = \"A\"\n\
                    phase = [{ name = \"p1\", duration_s = 9, states = { \"11\" = \"red, green\" } }]\n";
    let mut desk = Desk::of(&MemoryFiles::new([("gateway.toml", gateway), ("s.toml", scenario)]), reported);
    desk.pass(500);
    for ms in [100, 200] {
        desk.input(TrafficLightInput::Clock(WallStamp::from_nanos(ms * 1_000_000)));
    }
    desk.pass(6_000);
}

fn channels(reported: &mut Reported) {
    let mut desk = lights("", reported);
    let red = LightObservation { bulbs: parse_bulbs("red").unwrap(), confidence: 1.0 };
    for (store, id, rejected) in [("v2i", 11, 0), ("conventional", 5, 0), ("conventional", 11, 1)] {
        let store = target(&format!("1 {store}")).store;
        let states = vec![(id, Some(red.into()))];
        let stamp = desk.gateway.now.wall;
        desk.input(TrafficLightInput::States { store, stamp, states, rejected });
        desk.pass(11_000);
    }
    let store = target("1 conventional").store;
    let stamp = desk.gateway.now.wall;
    desk.input(TrafficLightInput::States { store, stamp, states: Vec::new(), rejected: 1 });
}

/// A unit on CAN that sends the states of two groups, each in a message of its own.
struct Unit {
    bus: &'static str,
    message: &'static str,
    dbc: &'static str,
    frame_format: &'static str,
    /// Identifiers of both, as a DBC writes them.
    ids: [u32; 2],
}

const PLAIN: &str = " SG_ STATE : 0|4@1+ (1,0) [0|15] \"\" X\n SG_ GOOD : 4|1@1+ (1,0) [0|1] \"\" X\n";
const COUNTED: &str = " SG_ STATE : 0|4@1+ (1,0) [0|15] \"\" X\n SG_ GOOD : 4|1@1+ (1,0) [0|1] \"\" X\n\
    \x20SG_ COUNT : 8|4@1+ (1,0) [0|15] \"\" X\n";
const PAGED: &str = " SG_ PAGE M : 8|4@1+ (1,0) [0|15] \"\" X\n SG_ STATE m3 : 0|4@1+ (1,0) [0|15] \"\" X\n\
    \x20SG_ GOOD m3 : 4|1@1+ (1,0) [0|1] \"\" X\n";

impl Unit {
    const CYCLIC: Self = Self {
        bus: "",
        message: "timeout_ms = 300",
        dbc: PLAIN,
        frame_format: "StandardCAN",
        ids: [256, 257],
    };

    fn desk(self, reported: &mut Reported) -> Desk<'_> {
        let Self { bus, message, dbc, frame_format, ids: [first, second] } = self;
        let group = |name: &str, id: u8| {
            format!(
                "[[v2i]]\nid = {id}\nsignal = \"{name}.STATE\"\nstates = {{ \"red\" = [1] }}\nnot_available = [0]\n\
                 fault = [2]\n[[v2i.status]]\nsignal = \"{name}.GOOD\"\ngood = [1]\nbad = [0]\n"
            )
        };
        let (one, two) = (group("ONE", 11), group("TWO", 12));
        let profile = format!(
            "name = \"unit\"\n[bus.body]\ndbc = \"car.dbc\"\nheartbeat_messages = [\"ALIVE\"]\n{bus}\n[message.ONE]\n\
             {message}\n[message.TWO]\n{message}\n{one}{two}"
        );
        let gateway = "profile = \"car.toml\"\n[can.body]\ninterface = \"can0\"\n[traffic_lights]\nscenario = \"s.toml\"\n";
        let dbc = format!(
            "BO_ {first} ONE: 2 X\n{dbc}BO_ {second} TWO: 2 X\n{dbc}BO_ 258 ALIVE: 1 X\n\
             BA_DEF_DEF_ \"VFrameFormat\" \"{frame_format}\";\n"
        );
        let files = MemoryFiles::new([("gateway.toml", gateway), ("s.toml", "[groups]\n100 = [11, 12]\n")]);
        Desk::of(&files.with("car.toml", profile).with("car.dbc", dbc), reported)
    }
}

fn unit(reported: &mut Reported) {
    let send = |desk: &mut Desk<'_>, data: &[u8]| [256, 257].iter().for_each(|id| desk.frame(*id, data));
    let mut desk = Unit::CYCLIC.desk(reported);
    for state in [0x10, 0x11, 0x12, 0x13, 0x01, 0x11] {
        send(&mut desk, &[state, 0]);
    }
    desk.pass(5_000);
    for state in LOSSES.into_iter().chain([LinkState::Up]) {
        desk.link(state);
    }
    send(&mut desk, &[0x11, 0]);
    desk.input(CanInput::ErrorFrame { bus: BUS, error: ErrorFrame::new(0x40, &[]) });
    desk.pass(5_000);
    for id in [256, 257] {
        let frame = Frame::fd(CanId::Standard(id), &[0x11, 0]).unwrap();
        let stamp = desk.gateway.now.wall;
        desk.input(CanInput::Frame { bus: BUS, frame, stamp });
    }
    // Two senders of each.
    let message = "timeout_ms = 300\nsource_addresses = \"any\"";
    let senders = Unit { message, ids: [0x8CFD_CC27, 0x8CFD_CD27], ..Unit::CYCLIC };
    let mut desk = senders.desk(desk.reported);
    for id in [0x0CFD_CC27, 0x0CFD_CC21, 0x0CFD_CD27, 0x0CFD_CD21].map(CanId::Extended) {
        let (frame, stamp) = (Frame::classic(id, &[0x11, 0]).unwrap(), desk.gateway.now.wall);
        desk.input(CanInput::Frame { bus: BUS, frame, stamp });
    }
    // Too short; a page without the states; a counter that stands still; a bus that falls silent, and one
    // that may.
    for (unit, data) in [
        (Unit::CYCLIC, &[][..]),
        (Unit { dbc: PAGED, ..Unit::CYCLIC }, &[0x11, 5]),
        (
            Unit {
                message: "timeout_ms = 300\ncounter = { signal = \"COUNT\" }",
                dbc: COUNTED,
                ..Unit::CYCLIC
            },
            &[0x11, 1],
        ),
        (Unit { message: "timing = \"event\"", ..Unit::CYCLIC }, &[0x11, 0]),
        (Unit { message: "timing = \"event\"", bus: "may_sleep = true", ..Unit::CYCLIC }, &[0x11, 0]),
        (Unit { bus: "may_sleep = true", ..Unit::CYCLIC }, &[0x11, 0]),
        (Unit { frame_format: "StandardCAN_FD", ..Unit::CYCLIC }, &[0x11, 0]),
    ] {
        let mut desk = unit.desk(desk.reported);
        desk.each_50_ms(500, |desk, _| {
            send(desk, data);
            desk.frame(258, &[0]);
        });
        desk.pass(500); // stale, the bus not yet asleep
        desk.pass(20_000);
    }
}
