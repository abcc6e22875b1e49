//! Any inputs at any times: no panic, deadlines move forward, nothing is published while it is unknown.
//!
//! The first byte picks a vehicle, the rest are inputs: kind, pause, and what the kind needs.

#![no_main]

use std::io;
use std::path::Path;
use std::sync::LazyLock;
use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use signal_gateway::config::files::Files;
use signal_gateway::config::load_profile;
use can_signal::can::controller::ControllerReport;
use can_signal::can::error_frame::{ControllerState, ErrorCounters, ErrorFrame};
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::{Gateway, GatewaySettings};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::vehicle_lights::Task;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_report::{ReportState, Step};
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use gateway_core::vehicle_status::settings::{VehicleGeometry, WheelToTire};

macro_rules! shipped {
    ($($name:literal),+) => {
        [$((
            concat!($name, ".toml"),
            include_bytes!(concat!("../../config/vehicles/", $name, ".toml")).as_slice(),
            concat!("../../dbc/", $name, ".dbc"),
            include_bytes!(concat!("../../dbc/", $name, ".dbc")).as_slice(),
        )),+]
    };
}

/// One of each kind of binding: enumerated, pair with reasons, event, both sides, two messages; and of each
/// kind of quantity: in parts, with a sign of its own, with flags, as a speed of rotation, and control modes.
static FILES: [(&str, &[u8], &str, &[u8]); 7] = shipped!(
    "demo_vehicle",
    "tesla_model3",
    "toyota_nodsu",
    "bmw_e9x",
    "vw_meb",
    "ford_lincoln",
    "new_eagle_dbw"
);

/// Limits of what may be published, m/s and rad.
const SPEEDS_MPS: std::ops::RangeInclusive<f64> = -20.0..=90.0;
const MAX_TIRE_RAD: f64 = 0.7;

struct Shipped;

impl Files for Shipped {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let texts = FILES.iter().flat_map(|(profile, toml, dbc, text)| [(profile, toml), (dbc, text)]);
        let found = texts.into_iter().find(|(name, _)| Path::new(name) == path);
        found.map(|(_, text)| text.to_vec()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

static VEHICLES: LazyLock<Vec<GatewaySettings>> = LazyLock::new(|| {
    let load = |(profile, ..): &(&str, &[u8], &str, &[u8])| {
        let mut settings = load_profile(&Shipped, Path::new(profile)).expect("shipped").gateway;
        settings.status_settings.geometry = VehicleGeometry {
            wheel_base_m: Some(2.7),
            wheel_tread_m: Some(1.6),
            wheel_radius_m: Some(0.3),
            wheel_to_tire: Some(WheelToTire::Ratio(16.0)),
            max_tire_rad: MAX_TIRE_RAD,
            ..VehicleGeometry::default()
        };
        settings
    };
    FILES.iter().map(load).collect()
});

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.iter().copied();
    let mut next = || bytes.next();
    let Some(vehicle) = next() else { return };
    let settings = &VEHICLES[usize::from(vehicle) % VEHICLES.len()];
    let ids = settings.relevant_ids(BusIndex(0));
    let mut now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
    let mut gateway = Gateway::new(settings.clone(), LinkState::Up, now);
    let mut shown = [false; 2];
    let statuses = gateway.statuses(now.mono).len();
    while let (Some(kind), Some(pause)) = (next(), next()) {
        // From nanoseconds to days, and no further than a century in all.
        let pause = Duration::from_nanos(u64::from(pause & 15) << (pause >> 4) << 2 * (pause >> 4));
        if now.mono.after(pause) < MonoTime::from_nanos(u64::MAX / 8) {
            now.mono = now.mono.after(pause);
            now.wall = now.wall.after(pause);
        }
        let input: Input = match (kind & 7, next().unwrap_or(0)) {
            (0..=3, choice) => {
                let id = match ids.get(usize::from(choice & 15)) {
                    Some(ids) => ids.described(),
                    None => CanId::Standard(u16::from(choice)),
                };
                let data: Vec<u8> = (0..kind >> 3 & 15).map_while(|_| next()).collect();
                let frame = if kind & 0x80 == 0 { Frame::classic(id, &data) } else { Frame::fd(id, &data) };
                let Some(frame) = frame else { continue };
                CanInput::Frame { bus: BusIndex(choice >> 6 & 1), frame, stamp: now.wall }.into()
            }
            (4, choice) => {
                let states = [LinkState::Up, LinkState::Down, LinkState::Missing, LinkState::Failed(13)];
                let state = states.get(usize::from(choice >> 1)).copied().unwrap_or(LinkState::Ended);
                CanInput::Link { bus: BusIndex(choice & 1), state }.into()
            }
            (5, choice) if kind & 8 == 0 => {
                let states =
                    [ControllerState::ErrorActive, ControllerState::Passive, ControllerState::BusOff];
                let state =
                    states.get(usize::from(choice >> 1 & 3)).copied().unwrap_or(ControllerState::Stopped);
                let counters = next().map(|count| ErrorCounters { tx: count.into(), rx: choice.into() });
                let report = ControllerReport { state, counters, restart_ms: Some(choice.into()) };
                CanInput::Controller { bus: BusIndex(choice & 1), report }.into()
            }
            (5, choice) => CanInput::Drops { bus: BusIndex(choice & 1), lost: u32::MAX }.into(),
            (6, choice) if kind & 8 == 0 => {
                CanInput::BadRecords { bus: BusIndex(choice & 1), count: 1 }.into()
            }
            (6, choice) => {
                let data: Vec<u8> = (0..8).map_while(|_| next()).collect();
                let error = ErrorFrame::new(u32::from(choice) << (kind >> 3), &data);
                CanInput::ErrorFrame { bus: BusIndex(0), error }.into()
            }
            (_, choice) => {
                // As a caller does who has nothing else to do.
                for _ in 0..choice & 7 {
                    let deadline = gateway.next_deadline().max(now.mono);
                    now.wall = now.wall.after(deadline.since(now.mono));
                    now.mono = deadline;
                    gateway.handle(Input::Tick, now);
                    assert!(gateway.next_deadline() > now.mono, "a deadline that does not move");
                    drain(&mut gateway, &mut shown);
                }
                Input::Tick
            }
        };
        gateway.handle(input, now);
        drain(&mut gateway, &mut shown);
        assert_eq!(gateway.statuses(now.mono).len(), statuses);
    }
});

/// Takes all outputs, a handful at most, and checks whether they may be published.
fn drain(gateway: &mut Gateway, shown: &mut [bool; 2]) {
    let mut count = 0;
    while let Some(output) = gateway.poll_output() {
        count += 1;
        match output {
            Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) => show(&mut shown[0], step),
            Output::VehicleLights(VehicleLightsOutput::HazardLights(step)) => show(&mut shown[1], step),
            Output::VehicleStatus(output) => check_status(output),
            Output::TrafficLights(_) | Output::TurnSignal(_) | Output::Command(_) => {
                panic!("nothing but reports here")
            }
            Output::Diagnostics { diagnostics, .. } => assert!(!diagnostics.statuses.is_empty()),
        }
    }
    assert!(count <= 11, "{count} outputs of one input");
    for (task, shown) in [Task::TurnIndicators, Task::HazardLights].into_iter().zip(shown) {
        let (state, (_, published)) = (gateway.lights().state(task), gateway.lights().failure(task));
        assert_eq!(published, *shown, "{task:?}");
        if matches!(state, Some(ReportState::Unknown | ReportState::Invalid)) {
            assert!(!published, "{task:?} while unknown");
        }
        assert!(published || state != Some(ReportState::Published), "{task:?} is withheld for no reason");
    }
}

/// No number is published that cannot be.
fn check_status(output: VehicleStatusOutput) {
    match output {
        VehicleStatusOutput::Velocity(Step::Publish(velocity, _)) => {
            assert!(SPEEDS_MPS.contains(&velocity.longitudinal_mps), "{velocity:?}");
            assert!(velocity.heading_rate_radps.abs() <= 2.0, "{velocity:?}");
        }
        VehicleStatusOutput::Steering(Step::Publish(angle, _)) => {
            assert!(angle.0.abs() <= MAX_TIRE_RAD * 1.1, "{angle:?}");
        }
        _ => {}
    }
}

/// A step on a topic: what is withdrawn must have been shown.
fn show<T: Copy>(shown: &mut bool, step: Step<T>) {
    let before = std::mem::replace(shown, step.value().is_some());
    assert!(*shown || before, "withdrawn twice");
}
