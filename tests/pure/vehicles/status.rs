//! The status of the shipped vehicles: steering, gear, control mode, doors and velocity from frames written
//! bit by bit.

use std::collections::BTreeMap;
use std::time::Duration;

use can_signal::can::frame::{Frame, MAX_DATA};
use can_signal::can::link::BusIndex;
use can_signal::validation::table::BoundMessage;
use gateway_base::time::MonoTime;
use gateway_core::gateway::GatewaySettings;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_status::binding::StatusBinding;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use gateway_core::vehicle_status::settings::{VehicleGeometry, WheelToTire};

use crate::pure::vehicles::payload::frame;
use crate::pure::vehicles::{profile, profile_names};
use crate::support::clock::at_ms;
use crate::support::vehicle_facts::VEHICLES;
use crate::support::virtual_gateway::VirtualGateway;

/// A profile in a car whose front wheels turn as far as its steering wheel, and that reports each frame.
pub(super) fn settings(name: &str) -> GatewaySettings {
    let mut settings = profile(name).gateway.clone();
    settings.lights.requirements.clear();
    settings.status_settings.min_period = Duration::ZERO;
    settings.status_settings.geometry = VehicleGeometry {
        wheel_base_m: Some(2.7),
        wheel_tread_m: Some(1.6),
        wheel_radius_m: Some(0.3),
        wheel_to_tire: Some(WheelToTire::Ratio(1.0)),
        max_tire_rad: 20.0,
        ..VehicleGeometry::default()
    };
    if let Some(velocity) = &mut settings.status.velocity {
        velocity.is_unknown_heading_rate_zero = true;
    }
    settings
}

/// The reports that an output makes, by name; `-` for one that is withdrawn.
pub(super) fn texts(output: VehicleStatusOutput) -> Vec<(&'static str, String)> {
    let number = |value: Option<f64>, digits: usize| {
        // No sign before zero.
        value.map_or("-".to_owned(), |value| format!("{:.digits$}", value + 0.0))
    };
    match output {
        VehicleStatusOutput::Velocity(step) => {
            let velocity = step.value();
            let [speed, heading] = [
                velocity.map(|velocity| velocity.longitudinal_mps),
                velocity.map(|velocity| velocity.heading_rate_radps),
            ];
            vec![("velocity", number(speed, 3)), ("heading", number(heading, 4))]
        }
        VehicleStatusOutput::Steering(step) => {
            vec![("steering", number(step.value().map(|angle| angle.0.to_degrees()), 2))]
        }
        VehicleStatusOutput::Gear(step) => {
            vec![("gear", step.value().map_or("-", |gear| gear.name()).to_owned())]
        }
        VehicleStatusOutput::ControlMode(step) => {
            vec![("control_mode", step.value().map_or("-", |mode| mode.name()).to_owned())]
        }
        VehicleStatusOutput::Doors(step) => {
            let states = step
                .value()
                .map(|doors| doors.as_slice().iter().map(|door| door.name()).collect::<Vec<_>>().join(" "));
            vec![("doors", states.unwrap_or("-".to_owned()))]
        }
    }
}

/// The frame as its sender would send it with this count.
fn protected(settings: &GatewaySettings, frame: &Frame, count: u32) -> Frame {
    let mut messages = settings.lights.table.messages.iter().chain(&settings.status.table.messages);
    let is_checked =
        |message: &&BoundMessage| message.ids.contains(frame.id()) && message.integrity.is_some();
    let Some(protection) = messages.find(is_checked).and_then(|message| message.integrity.as_ref()) else {
        return *frame;
    };
    let protection = &protection.protection;
    let counter = (0..count).fold(protection.first_counter(), |value, _| protection.next_counter(value));
    let (mut data, length) = ([0; MAX_DATA], frame.data().len());
    data[..length].copy_from_slice(frame.data());
    assert!(protection.protect(frame.id(), counter, &mut data, length), "{frame}");
    Frame::with_format(frame.id(), None, &data[..length]).unwrap()
}

/// The last report of each kind after the frames; one that never came is missing.
fn reports(name: &str, frames: &str) -> BTreeMap<&'static str, String> {
    let settings = settings(name);
    let mut gateway = VirtualGateway::starting_at(MonoTime::from_millis(5), settings.clone());
    for count in 0..3 {
        for text in frames.split(';') {
            let frame = protected(&settings, &frame(text), count);
            gateway.receive(frame.id(), frame.data());
        }
        gateway.now = at_ms(gateway.ms() + 10);
    }
    let outputs =
        gateway.select(
            |output| {
                if let Output::VehicleStatus(output) = output { Some(texts(*output)) } else { None }
            },
        );
    outputs.into_iter().flat_map(|(_, texts)| texts).collect()
}

#[test]
fn each_payload_gives_the_status_that_public_facts_demand() {
    let mut wrong = Vec::new();
    for (name, vehicle) in &*VEHICLES {
        for [frames, expected] in &vehicle.status {
            let reports = reports(name, frames);
            for wanted in expected.split("; ") {
                let (report, value) = wanted.split_once(' ').unwrap();
                let given = reports.get(report).map_or("-", String::as_str);
                if given != value {
                    wrong.push(format!("{name} {frames}: {report} {given}, not {value}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn every_part_of_a_status_is_tried() {
    for name in profile_names() {
        let status = &profile(&name).gateway.status;
        let sections = [
            ("velocity", status.velocity.is_some()),
            ("steering", !status.steering.is_empty()),
            ("gear", status.gear.is_some()),
            ("control_mode", status.control_mode.is_some()),
            ("doors", !status.doors.is_empty()),
        ];
        let rows = &VEHICLES[&name].status;
        for (section, is_described) in sections {
            let values = rows.iter().flat_map(|[_, expected]| expected.split("; "));
            let tried = values.filter(|wanted| {
                wanted.split_once(' ').is_some_and(|(name, value)| name == section && value != "-")
            });
            assert_eq!(tried.count() > 0, is_described, "{name} {section}");
        }
    }
}

/// A message that the status alone binds must not keep what a dead body computer said last.
#[test]
fn frames_of_the_status_do_not_keep_event_messages_of_the_lights_valid() {
    let mut gateway = VirtualGateway::starting_at(MonoTime::from_millis(5), settings("toyota_nodsu"));
    let [alive, left, angle] = ["620 8", "614 8 29|2@0=1", "025 8 3|12@0=4"].map(frame);
    gateway.receive(alive.id(), alive.data());
    gateway.receive(left.id(), left.data());
    for _ in 0..200 {
        gateway.receive(angle.id(), angle.data());
        gateway.pass(10);
    }
    assert_eq!(
        gateway.turn_reports().last(),
        Some(&(1505, "stops")),
        "the lights, with their alive_timeout_ms"
    );
    let steering = gateway.outputs.iter().filter(|(_, output)| {
        matches!(output, Output::VehicleStatus(VehicleStatusOutput::Steering(step)) if step.value().is_some())
    });
    assert_eq!(steering.count(), 200, "the steering is reported throughout");
}

/// The settings of each bus are what the messages of the lights alone give.
#[test]
fn the_status_changes_no_bus_that_carries_lights() {
    for name in profile_names() {
        let settings = &profile(&name).gateway;
        let without = GatewaySettings { status: StatusBinding::default(), ..settings.clone() };
        for bus in (0..).take(settings.buses.len()).map(BusIndex) {
            let lights = without.life_signs(bus);
            assert!(!lights.is_empty(), "{name}");
            assert_eq!(settings.life_signs(bus), lights, "{name}");
        }
    }
}
