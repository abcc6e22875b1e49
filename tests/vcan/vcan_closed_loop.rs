//! A simulated vehicle drives on a real interface, and each report that the gateway publishes is compared
//! with what it did.

use std::ops::RangeInclusive;
use std::time::Duration;

use can_signal::can::{CanId, Frame};
use gateway_base::time::MonoTime;
use serde_json::Value;
use signal_gateway::config::files::Disk;
use signal_gateway::config::load_profile;
use signal_gateway::io::clock::Clock;
use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame as _, ExtendedId, Socket as _, StandardId};

use crate::support::driving_vehicle::{DrivingVehicle, END, geometry};
use crate::support::mcap::{McapReaders, only_entry};
use crate::support::prerequisite::require;
use crate::support::process::{Folder, Process};
use crate::support::vcan::{Vcan, wall};
use crate::support::waiting::Pace;

const VELOCITY: &str = "/vehicle/status/velocity_status";
const STEERING: &str = "/vehicle/status/steering_status";

/// A time of the vehicle, and the wall clock around the sending of its frames.
type Sent = (MonoTime, RangeInclusive<i64>);

fn send(socket: &CanSocket, frame: &Frame) {
    let data = frame.data();
    let frame = match frame.id() {
        CanId::Standard(id) => CanDataFrame::new(StandardId::new(id).unwrap(), data),
        CanId::Extended(id) => CanDataFrame::new(ExtendedId::new(id).unwrap(), data),
    };
    socket.write_frame(&frame.unwrap()).unwrap();
}

/// Drives in real time.
fn drive(car: &mut DrivingVehicle, vcan: &Vcan) -> Vec<Sent> {
    let socket = CanSocket::open(vcan.name).unwrap();
    let (clock, mut pace) = (Clock::start(), Pace::every(Duration::from_millis(1)));
    let mut sent = Vec::new();
    loop {
        let now = clock.now().mono;
        for (_, frame) in car.frames(now) {
            let before = wall();
            send(&socket, &frame);
            sent.push((now, before..=wall()));
        }
        if now >= END {
            return sent;
        }
        pace.wait();
    }
}

/// The stamp of a message, nanoseconds.
fn stamp(fields: &Value) -> i64 {
    let stamp = fields.get("stamp").unwrap_or(&fields["header"]["stamp"]);
    stamp["sec"].as_i64().unwrap() * 1_000_000_000 + stamp["nanosec"].as_i64().unwrap()
}

#[test]
fn reports_on_a_real_interface_are_what_the_simulated_vehicle_did() {
    let readers = require!(McapReaders::find());
    let vcan = require!(Vcan::new("vcan-drive"));
    let mut vehicle = load_profile(&Disk, "vw_mqb".as_ref()).unwrap();
    vehicle.gateway.status_settings.geometry = geometry();
    let bus = &vehicle.gateway.buses[0].name;
    let folder = Folder::with_configuration(&format!(
        "profile = \"vw_mqb\"\n[can.{bus}]\ninterface = \"vcan-drive\"\n[ros]\nenabled = false\n\
         [vehicle_geometry]\nwheel_base_m = 2.7\nwheel_tread_m = 1.6\nwheel_radius_m = 0.33\nsteering_ratio = 16.0\n"
    ));
    let mut gateway = Process::run_with(&folder, |command| _ = command.args(["--record", "bags"]));
    gateway.wait_for_log("vcan-drive");
    let mut car = DrivingVehicle::new(vehicle, true);
    let sent = drive(&mut car, &vcan);
    gateway.stop("TERM");

    let messages = readers.messages(&only_entry(&folder.path().join("bags")));
    let mut counts = [0; 2];
    let mut worst = [0.0_f64; 3];
    // When the frame behind a report was sent.
    let sent_at = |message: &Value| {
        let stamp_ns = stamp(&message["fields"]);
        sent.iter().find(|(_, window)| window.contains(&stamp_ns)).unwrap().0
    };
    for (topic, index) in [(VELOCITY, 0), (STEERING, 1)] {
        let reports: Vec<_> = messages.iter().filter(|message| message["topic"] == topic).collect();
        for pair in reports.windows(2) {
            let [at, next] = [pair[0], pair[1]].map(sent_at);
            if at < MonoTime::from_millis(1_000) {
                continue;
            }
            // Which other frames of the same moment came before it is not known.
            let known = at.before(Duration::from_nanos(1));
            let number = |field: &str| pair[0]["fields"][field].as_f64().unwrap();
            if topic == VELOCITY {
                let reported = [number("longitudinal_velocity"), number("heading_rate")];
                let [speed, _] = car.velocity_deviations(reported, (known, at));
                // The stamp is that of the speed, and a gateway that is late has read later yaw rates with
                // it.
                let [_, rate] = car.velocity_deviations(reported, (known, next));
                (worst[0], worst[1]) = (worst[0].max(speed), worst[1].max(rate));
            } else {
                worst[2] = worst[2].max(car.tire_deviation(number("steering_tire_angle"), (known, at)));
            }
            counts[index] += 1;
        }
    }
    println!("{counts:?} reports on velocity and steering, off by {worst:?} of the resolution");
    // Messages have numbers of 32 bits.
    assert!(worst.iter().all(|share| *share < 1.01), "{worst:?}");
    assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
}
