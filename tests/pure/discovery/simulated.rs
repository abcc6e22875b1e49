//! Every shipped vehicle, simulated from its profile, as one that nobody knows.

use std::fmt::Write as _;
use std::time::Duration;

use can_signal::can::mark::DriverMark;
use gateway_base::time::{MonoTime, WallStamp};
use gateway_core::command::Turn;
use gateway_core::vehicle_lights::binding::TurnBinding;
use signal_gateway::config::Settings;
use signal_gateway::report::vehicle::CandumpLog;
use vehicle_bringup::discovery::findings::DiscoveryFindings;
use vehicle_bringup::discovery::machine::{Discovery, DiscoveryEvent};
use vehicle_bringup::discovery::session::{DriverRequest, SessionSettings};
use vehicle_bringup::simulated_vehicle::request::SimulationRequest;
use vehicle_bringup::simulated_vehicle::{SimulatedVehicle, SimulationSettings, VehicleOutput};

use super::{proven, settings};
use crate::pure::vehicles::playback::play_log;
use crate::pure::vehicles::profile;

/// Time from a request to the driver's action.
const REACTION: Duration = Duration::from_millis(600);

/// A discovery of a simulated vehicle, with its log and the times of the driver's actions.
fn discover(known: &Settings) -> (Discovery, DiscoveryFindings, String, Vec<(MonoTime, DriverMark)>) {
    let simulation = SimulationSettings::default();
    let mut vehicle = SimulatedVehicle::new(known.vehicle_plan().unwrap(), simulation, MonoTime::ZERO);
    let interfaces = known.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
    let candump = CandumpLog { interfaces, start: WallStamp::from_nanos(1_700_000_000_000_000_000) };
    let mut discovery = Discovery::new(SessionSettings::default());
    let (mut log, mut marks, mut now, mut before) =
        (String::new(), Vec::new(), MonoTime::ZERO, DriverMark::Quiet);
    loop {
        while let Some(event) = discovery.poll_event(now) {
            match event {
                DiscoveryEvent::Request(DriverRequest { mark, .. }) => {
                    let request = match mark {
                        DriverMark::Quiet => None,
                        DriverMark::Left => Some(SimulationRequest::Stalk(Turn::Left)),
                        DriverMark::Right => Some(SimulationRequest::Stalk(Turn::Right)),
                        DriverMark::Hazard => Some(SimulationRequest::Hazard(Some(true))),
                        DriverMark::Off if before == DriverMark::Hazard => {
                            Some(SimulationRequest::Hazard(Some(false)))
                        }
                        DriverMark::Off => Some(SimulationRequest::Stalk(Turn::Off)),
                    };
                    if let Some(request) = request {
                        vehicle.schedule(now.after(REACTION), request);
                    }
                    marks.push((now, mark));
                    before = mark;
                }
                DiscoveryEvent::Finished(findings) => return (discovery, *findings, log, marks),
                DiscoveryEvent::Seen { .. } | DiscoveryEvent::Repeats(_) => {}
            }
        }
        vehicle.settle(now);
        while let Some(output) = vehicle.poll_output() {
            if let Some(line) = candump.line(&output, now) {
                writeln!(log, "{line}").unwrap();
            }
            if let VehicleOutput::Frame { bus, frame } = output {
                discovery.frame_arrived(bus, &frame, now);
            }
        }
        let next = [vehicle.next_deadline(now), discovery.next_deadline()].into_iter().flatten().min();
        now = next.expect("the session goes on");
    }
}

/// At the end of each action the generated configuration reports it.
fn assert_reported(
    name: &str,
    known: &Settings,
    (discovery, findings, log, marks): &(Discovery, DiscoveryFindings, String, Vec<(MonoTime, DriverMark)>),
) {
    let interfaces: Vec<_> = known.gateway.buses.iter().map(|bus| bus.interface.as_str()).collect();
    let generated = proven(discovery, findings, &interfaces).unwrap_or_else(|why| panic!("{name}: {why}"));
    let playback = play_log(&settings(&generated), log);
    let report = |changes: &[(u64, &'static str)], ms| {
        changes.iter().rev().find(|(since, _)| *since <= ms).map_or("never", |(_, report)| *report)
    };
    for pair in marks.windows(2) {
        let (mark, end_ms) = (pair[0].1, pair[1].0.as_nanos() / 1_000_000);
        let turn = match mark {
            DriverMark::Left => "ENABLE_LEFT",
            DriverMark::Right => "ENABLE_RIGHT",
            DriverMark::Quiet | DriverMark::Hazard | DriverMark::Off => "DISABLE",
        };
        let context = || format!("{name}, {mark} until {end_ms} ms: {:?}, {generated:#?}", playback.turn);
        assert_eq!(report(&playback.turn, end_ms), turn, "{}", context());
        if findings.sure_hazard().is_some() {
            let hazard = if mark == DriverMark::Hazard { "ENABLE" } else { "DISABLE" };
            assert_eq!(report(&playback.hazard, end_ms), hazard, "{:?} {}", playback.hazard, context());
        }
    }
}

fn discover_and_report(names: impl IntoIterator<Item = String>) -> usize {
    let (mut found, mut not_sure) = (0, Vec::new());
    for name in names {
        let known = profile(&name);
        if !matches!(known.gateway.lights.turn, TurnBinding::From(_)) {
            continue;
        }
        let outcome = discover(known);
        if outcome.1.is_usable() {
            assert_reported(&name, known, &outcome);
            found += 1;
        } else {
            not_sure.push(name);
        }
    }
    assert_eq!(not_sure, Vec::<String>::new());
    found
}

#[test]
fn simulated_vehicles_are_discovered_and_their_lights_are_reported() {
    let names = ["mazda_2017", "demo_vehicle", "vw_mqb"];
    assert_eq!(discover_and_report(names.map(str::to_owned)), 3);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn every_shipped_vehicle_is_discovered_and_its_lights_are_reported() {
        assert_eq!(super::discover_and_report(crate::pure::vehicles::profile_names()), 47);
    }
}
