//! A gateway goes on with another configuration: what does not change is not interrupted, what changes takes
//! effect.

use std::path::Path;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::{Gateway, GatewaySettings};
use gateway_core::vehicle_lights::Task;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::verdict::TurnIndicators;
use gateway_core::vehicle_report::Step;
use signal_gateway::config::files::{DEMO_CONFIG, Embedded, Files};
use signal_gateway::config::{Overrides, Settings, load};
use signal_gateway::process_status::configuration::{self, changes_text};
use signal_gateway::process_status::snapshot::Snapshot;
use traffic_lights::snapshot::TrafficLightsSnapshot;

use crate::support::clock::at;
use crate::support::files::MemoryFiles;

/// Files of the demo with replacements.
struct Edited<'a>(&'a [(&'a str, &'a str)]);

impl Files for Edited<'_> {
    fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        let text = String::from_utf8(Embedded.read(path)?).unwrap();
        let edited = self.0.iter().fold(text, |text, (from, to)| text.replace(from, to));
        Ok(edited.into_bytes())
    }
}

fn settings(edits: &[(&str, &str)]) -> Settings {
    load(&Edited(edits), Path::new(DEMO_CONFIG), &Overrides::default()).unwrap()
}

fn ms(millis: u64) -> MonoTime {
    MonoTime::from_millis(millis)
}

/// A turn frame of the demo vehicle: the state in bits 1 to 3 of byte 2.
fn turn(state: u8) -> CanInput {
    frame(0x2A5, [0, 0, state << 1, 0, 0, 0, 0, 0])
}

fn hazard_off() -> CanInput {
    frame(0x2C1, [0; 8])
}

fn frame(id: u16, data: [u8; 8]) -> CanInput {
    let frame = Frame::classic(CanId::Standard(id), &data).unwrap();
    CanInput::Frame { bus: BusIndex(0), frame, stamp: at(MonoTime::ZERO).wall }
}

/// A gateway that reports left since 0 ms, and everything it gives out.
struct Car(Gateway);

impl Car {
    fn left() -> Self {
        let mut gateway = Gateway::new(settings(&[]).gateway, LinkState::Up, at(MonoTime::ZERO));
        gateway.handle(turn(1), at(MonoTime::ZERO));
        gateway.handle(hazard_off(), at(MonoTime::ZERO));
        let mut car = Self(gateway);
        assert_eq!(car.turn_steps().last(), Some(&Some(TurnIndicators::EnableLeft)));
        car
    }

    /// The turn reports given out since the last call; `None` where one was withdrawn.
    fn turn_steps(&mut self) -> Vec<Option<TurnIndicators>> {
        let outputs = std::iter::from_fn(|| self.0.poll_output());
        outputs
            .filter_map(|output| {
                let Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) = output else {
                    return None;
                };
                Some(Step::value(step))
            })
            .collect()
    }

    /// Time passes without a frame, from deadline to deadline.
    fn pass_until(&mut self, end: MonoTime) {
        while self.0.next_deadline() <= end {
            let due = self.0.next_deadline();
            self.0.handle(Input::Tick, at(due));
        }
    }
}

/// The key before which sections of a profile are inserted.
const TURN: &str = "[turn]";

/// The timeout of the turn message is 250 ms without.
fn with_timeout(millis: u32) -> Settings {
    settings(&[(TURN, &format!("[message.BCM_TurnIndicators]\ntimeout_ms = {millis}\n{TURN}"))])
}

#[test]
fn same_settings_change_nothing() {
    let (mut with, mut without) = (Car::left(), Car::left());
    for step in 1..20 {
        with.0.reconfigure(settings(&[]).gateway, at(ms(step * 20)));
        for car in [&mut with, &mut without] {
            car.0.handle(turn(1), at(ms(step * 20)));
        }
        assert_eq!(with.turn_steps(), without.turn_steps(), "at {} ms", step * 20);
    }
    let [one, other]: [Snapshot; 2] = [&with, &without].map(|car| car.0.snapshot(at(ms(380))));
    assert_eq!(
        (one.turn_indicators, one.signals, one.messages),
        (other.turn_indicators, other.signals, other.messages)
    );
    assert_eq!(one.buses, other.buses);
}

#[test]
fn shorter_timeout_holds_for_the_frames_that_were_received() {
    let mut car = Car::left();
    car.0.reconfigure(with_timeout(100).gateway, at(ms(50)));
    car.pass_until(ms(100));
    assert!(car.turn_steps().iter().all(Option::is_some), "not withdrawn by the reload");
    car.pass_until(ms(101));
    assert_eq!(car.turn_steps(), [None], "stale under the new timeout");
    let mut car = Car::left();
    car.0.reconfigure(with_timeout(100).gateway, at(ms(150)));
    assert_eq!(car.turn_steps(), [None], "too old at once");
}

#[test]
fn longer_timeout_brings_no_report_back_that_was_withdrawn() {
    let mut car = Car::left();
    car.pass_until(ms(2_000));
    assert_eq!(car.turn_steps().last(), Some(&None));
    car.0.reconfigure(with_timeout(1000).gateway, at(ms(2_000)));
    assert_eq!(car.turn_steps(), [], "the frame is too old for this one, too");
}

#[test]
fn other_meaning_of_the_last_value_is_reported_at_once_and_an_undefined_one_withdrawn() {
    let swapped = [("left = [1]", "left = [2]"), ("right = [2]", "right = [1]")];
    let mut car = Car::left();
    car.0.reconfigure(settings(&swapped).gateway, at(ms(50)));
    assert_eq!(car.turn_steps(), [Some(TurnIndicators::EnableRight)]);
    let mut car = Car::left();
    car.0.reconfigure(settings(&[("left = [1]", "left = [4]")]).gateway, at(ms(50)));
    assert_eq!(car.turn_steps(), [None]);
}

#[test]
fn counters_and_history_stay_and_the_rate_changes() {
    let mut car = Car::left();
    car.pass_until(ms(1_000));
    let before = car.0.snapshot(at(ms(1_000)));
    let publish = ("[can.body]", "[reports]\nrate_hz = 50.0\n[can.body]");
    car.0.reconfigure(settings(&[publish]).gateway, at(ms(1_000)));
    let after = car.0.snapshot(at(ms(1_000)));
    let frames = |snapshot: &Snapshot| snapshot.buses[0].frames;
    assert_eq!((frames(&before), frames(&after)), (2, 2));
    let failures = |snapshot: &Snapshot| snapshot.turn_indicators.as_ref().unwrap().failures;
    assert_eq!(failures(&before), failures(&after));
    car.turn_steps();
    for step in 0..50 {
        let now = ms(1_000 + step * 20);
        car.pass_until(now);
        car.0.handle(turn(1), at(now));
    }
    assert!(car.turn_steps().len() >= 45, "50 Hz");
}

/// Status `hazard_lights` of a car whose hazard lights are not visible, with the published report and the key
/// `hazard`.
fn hazard_status(gateway: &Gateway) -> (Level, String, String) {
    let mut statuses = gateway.statuses(ms(100)).into_iter();
    let status = statuses.find(|status| status.task == "hazard_lights").unwrap();
    let value = |key: &str| status.values.iter().find(|(name, _)| *name == key).unwrap().1.clone();
    assert_eq!(value("unknown_count"), "0");
    (status.level, value("report"), value("hazard"))
}

#[test]
fn acknowledged_hazard_lights_are_no_warning_until_it_is_taken_back_and_never_reported() {
    let hidden = (
        "from = \"signal\"\nsignal = \"BCM_Hazard.HazardLightsState\"\noff = [0]\non = [1]\nfault = [2]\n\
                   not_available = [3]",
        "from = \"not_visible\"",
    );
    let facts = ("facts = [\"turn\", \"hazard\"", "facts = [\"turn\"");
    let acknowledged = ("[can.body]", "[reports]\nhazard_not_visible = \"acknowledged\"\n[can.body]");
    let [warns, accepts] =
        [vec![hidden, facts], vec![hidden, facts, acknowledged]].map(|edits| settings(&edits));
    let parts = configuration::plan(&warns.in_effect, &accepts.in_effect);
    assert_eq!(changes_text(&parts.reloadable), "[reports] hazard_not_visible: warn → acknowledged");
    assert!(parts.restart.is_empty(), "{parts:?}");
    let mut gateway = Gateway::new(warns.gateway.clone(), LinkState::Up, at(MonoTime::ZERO));
    for (settings, level, hazard) in [
        (&warns, Level::Warn, "not visible"),
        (&accepts, Level::Ok, "not visible, acknowledged"),
        (&warns, Level::Warn, "not visible"),
    ] {
        gateway.reconfigure(settings.gateway.clone(), at(ms(50)));
        let expected = (level, "not published".to_owned(), hazard.to_owned());
        assert_eq!(hazard_status(&gateway), expected);
        assert_eq!(gateway.lights().failure(Task::HazardLights), (None, false));
    }
}

fn written(text: &str) -> GatewaySettings {
    MemoryFiles::new([("gateway.toml", text)]).or_disk().settings().gateway
}

/// The traffic lights that are shown at each 100 ms of 20 s; at 10 s `other` comes into effect.
fn lights_through(other: Option<&str>) -> Vec<TrafficLightsSnapshot> {
    let mut gateway = Gateway::new(written(BENCH), LinkState::Up, at(MonoTime::ZERO));
    let mut shown = Vec::new();
    for step in 1..=200 {
        let now = ms(step * 100);
        while gateway.next_deadline() <= now {
            let due = gateway.next_deadline();
            gateway.handle(Input::Tick, at(due));
        }
        gateway.handle(Input::Tick, at(now));
        if let (100, Some(other)) = (step, other) {
            gateway.reconfigure(written(other), at(now));
        }
        let snapshot: Snapshot = gateway.snapshot(at(now));
        shown.extend(snapshot.traffic_lights);
    }
    shown
}

const BENCH: &str = "[traffic_lights]\nscenario = \"config/scenarios/bench.toml\"\n";

#[test]
fn phases_of_traffic_lights_go_on_with_other_rates_and_begin_anew_with_another_scenario() {
    let without = lights_through(None);
    let phases: Vec<_> = without.iter().map(|shown| &shown.controllers).collect();
    assert!(phases.windows(2).filter(|pair| pair[0] != pair[1]).count() > 2, "something happens in 20 s");
    let rates = lights_through(Some(&format!("{BENCH}v2i_rate_hz = 5.0\nground_truth_rate_hz = 7.0\n")));
    assert_eq!(rates.iter().map(|shown| &shown.controllers).collect::<Vec<_>>(), phases);
    let anew = lights_through(Some(&format!("{BENCH}frame_rate_hz = 10.0\n")));
    assert_ne!(
        anew.iter().map(|shown| &shown.controllers).collect::<Vec<_>>(),
        phases,
        "another rate of frames"
    );
}

#[test]
fn decider_goes_on_in_its_cycles_with_other_parameters() {
    let decider = "[turn_signal]\nmap = \"config/maps/crossing/lanelet2_map.osm\"\nenabled = true\n";
    let mut gateway = Gateway::new(written(decider), LinkState::Up, at(MonoTime::ZERO));
    let pass_until = |gateway: &mut Gateway, end: MonoTime| {
        while gateway.next_deadline() <= end {
            let due = gateway.next_deadline();
            gateway.handle(Input::Tick, at(due));
        }
        let snapshot: Snapshot = gateway.snapshot(at(end));
        snapshot.decider.unwrap()
    };
    assert_eq!(pass_until(&mut gateway, ms(950)).cycles, 10);
    gateway.reconfigure(written(&format!("{decider}planning_hz = 20.0\n")), at(ms(950)));
    assert_eq!(pass_until(&mut gateway, ms(1_950)).cycles, 30, "from the next cycle on, twice as often");
}
