//! The decider with the vehicle's own signals: hazard lights by gear and doors, and its speed.

use can_signal::can::frame::CanId;
use gateway_base::time::MonoTime;
use turn_signal::light_command::{HazardCommand, TurnCommand};

use super::bench::route;
use crate::support::files::MemoryFiles;
use crate::support::status_vehicle;
use crate::support::two_lanes;
use crate::support::virtual_gateway::VirtualGateway;

/// State of the vehicle, as raw values; without a speed it is not available.
#[derive(Clone, Copy)]
struct State {
    gear: u8,
    mode: u8,
    door: u8,
    speed: Option<u16>,
}

const PARK: u8 = 0;
const DRIVE: u8 = 1;
const REVERSE: u8 = 2;
const BETWEEN: u8 = 15;
const OPEN: u8 = 1;
const OPENING: u8 = 2;
const NOT_AVAILABLE: u8 = 3;
/// At a stop of Autoware, a door is open.
const STOP: State = State { gear: DRIVE, mode: 1, door: OPEN, speed: Some(0) };
/// 36 km/h.
const TEN_MPS: Option<u16> = Some(3_600);

pub(crate) fn decider(keys: &str) -> VirtualGateway {
    let gateway = format!(
        "profile = \"car.toml\"\ncan.body.interface = \"can0\"\n[turn_signal]\nmap = \"map.osm\"\nenabled = true\n{keys}\n"
    );
    let files = MemoryFiles::new([("gateway.toml", gateway), ("map.osm", two_lanes::osm([0, 60, 80, 200]))]);
    let files = files.with("car.toml", status_vehicle::PROFILE).with("bench.dbc", status_vehicle::DBC);
    let mut desk = VirtualGateway::starting_at(MonoTime::from_millis(10_000), files.settings().gateway);
    desk.handle(route(1, &[1, 2, 3]));
    desk
}

impl VirtualGateway {
    /// The vehicle in a state for 500 ms, 46 m before the turn to the left, where the odometry says that it
    /// stands.
    fn show(&mut self, State { gear, mode, door, speed }: State) -> HazardCommand {
        for _ in 0..5 {
            let [low, high] = speed.unwrap_or(65_535).to_le_bytes();
            self.receive(CanId::Standard(768), &[low, high, 0, 0, 0, 0, 0, 0]);
            self.receive(CanId::Standard(769), &[gear | mode << 4, door, 0, 0, 0, 0, 0, 0]);
            self.odometry(10.0, 0.0);
            self.pass_without_end(100);
        }
        self.hazard_commands().last().unwrap().1
    }

    fn findings(&self) -> String {
        self.value("turn_signal_decider", "findings")
    }
}

#[test]
fn an_open_door_at_a_stop_is_a_hazard_where_that_is_configured() {
    use HazardCommand::{Disable, Enable, NoCommand};
    let cases = [
        (STOP, Enable, "hazard lights: a door is open at standstill"),
        (State { door: OPENING, ..STOP }, Enable, "hazard lights: a door is open at standstill"),
        (State { door: 0, ..STOP }, Disable, "none"),
        (State { gear: PARK, ..STOP }, Disable, "none"),
        (State { mode: 0, ..STOP }, Disable, "none"),
        (State { speed: TEN_MPS, ..STOP }, Disable, "none"),
        // The odometry says that it stands.
        (State { speed: None, ..STOP }, Enable, "hazard lights: a door is open at standstill"),
        (State { gear: BETWEEN, ..STOP }, NoCommand, "unknown whether a door is open at standstill"),
        (State { door: NOT_AVAILABLE, ..STOP }, NoCommand, "unknown whether a door is open at standstill"),
        (State { door: NOT_AVAILABLE, gear: PARK, ..STOP }, Disable, "none"),
        (State { gear: REVERSE, ..STOP }, Enable, "hazard lights: a door is open at standstill"),
    ];
    for (number, (state, hazard, finding)) in cases.into_iter().enumerate() {
        let mut desk = decider("hazard_at_open_door = true");
        assert_eq!((desk.show(state), desk.findings().as_str()), (hazard, finding), "{number}");
        assert_eq!(decider("").show(state), Disable, "{number}, not configured");
    }
    let mut desk = decider("hazard_at_open_door = true");
    desk.show(State { gear: BETWEEN, ..STOP });
    let warning = "WARN DISABLE: unknown whether a door is open at standstill";
    assert_eq!(desk.status_text("turn_signal_decider"), warning);
    assert_eq!([STOP, State { door: 0, ..STOP }].map(|state| desk.show(state)), [Enable, Disable]);
}

#[test]
fn reverse_gear_is_a_hazard_where_that_is_configured() {
    let mut desk = decider("hazard_in_reverse = true");
    let gears = [DRIVE, REVERSE, BETWEEN, PARK].map(|gear| desk.show(State { gear, door: 0, ..STOP }));
    let [drive, reverse, between, park] = gears;
    assert_eq!([drive, park], [HazardCommand::Disable; 2]);
    assert_eq!([reverse, between], [HazardCommand::Enable, HazardCommand::NoCommand]);
    desk.show(State { gear: REVERSE, ..STOP });
    assert_eq!(desk.findings(), "hazard lights: reverse gear is engaged");
    let driver = State { gear: REVERSE, mode: 0, ..STOP };
    assert_eq!(desk.show(driver), HazardCommand::Disable);
}

/// The turn is announced 30 m before it, and 3 s more.
#[test]
fn the_speed_of_the_vehicle_announces_a_turn_earlier() {
    let driving = State { speed: TEN_MPS, door: 0, ..STOP };
    for (keys, turn) in [("", TurnCommand::Disable), ("speed = \"vehicle\"", TurnCommand::Left)] {
        let mut desk = decider(keys);
        desk.show(driving);
        assert_eq!(desk.turn(), Some(turn), "{keys}");
    }
    let mut desk = decider("speed = \"vehicle\"");
    desk.show(State { speed: None, ..driving });
    assert_eq!(desk.turn(), Some(TurnCommand::Disable));
    let warning = "WARN DISABLE: the vehicle's signals give no speed";
    assert_eq!(desk.status_text("turn_signal_decider"), warning);
}
