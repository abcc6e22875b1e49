//! Counts and texts of a status.

use std::time::Duration;

use super::super::binding::{HazardBinding, Sources, TurnBinding, TurnSource};
use super::super::state::TurnCode;
use super::*;
use crate::vehicle_lights::binding::{FaultBinding, LightsBinding};
use crate::vehicle_report::Publish;
use can_signal::can::{BusIndex, BusSettings, CanId, Frame, LinkState};
use can_signal::dbc::codec::{Layout, SignalCodec};
use can_signal::validation::meaning::{Meaning, RawRange, ValueMap};
use can_signal::validation::table::{
    BoundMessage, BoundSignal, MessageIndex, Role, SignalIndex, SignalTable, Timing,
};
use gateway_base::diagnostics::Level;
use gateway_base::time::{Now, WallStamp};

const TURN: Task = Task::TurnIndicators;

/// A byte with 0 = off, 1 = left, 15 = not available, 14 = fault; no signal shows the hazard lights.
fn binding() -> LightsBinding {
    let byte = Layout::unsigned(0, 8);
    let values = [
        (0, Meaning::Defined(TurnCode::Off)),
        (1, Meaning::Defined(TurnCode::Left)),
        (14, Meaning::Fault),
        (15, Meaning::NotAvailable),
    ];
    let values = values.map(|(raw, meaning)| (RawRange::single(raw), meaning)).to_vec();
    LightsBinding {
        table: SignalTable {
            messages: vec![BoundMessage {
                name: "BLINK".into(),
                bus: BusIndex(0),
                ids: CanId::Standard(0x123).into(),
                format: None,
                timing: Timing::Cyclic { timeout: Duration::from_millis(500) },
                integrity: None,
            }],
            signals: vec![BoundSignal {
                name: "BLINK.TURN".into(),
                message: MessageIndex(0),
                codec: SignalCodec::new(byte, 1).unwrap(),
            }],
        },
        requirements: vec![],
        turn: TurnBinding::From(Sources::only(TurnSource::Enumerated {
            tap_hold: None,
            role: Role { signal: SignalIndex(0), values: ValueMap::new(values).unwrap() },
        })),
        turn_faults: FaultBinding::default(),
        hazard: HazardBinding::NotVisible { is_acknowledged: false },
        hazard_faults: FaultBinding::default(),
        turn_while_hazard: super::super::binding::TurnWhileHazard::default(),
    }
}

struct Bench {
    lights: VehicleLights,
    buses: [Bus; 1],
}

impl Bench {
    fn new() -> Self {
        let settings = BusSettings {
            name: "body".into(),
            interface: "can0".into(),
            heartbeat_messages: vec![],
            alive_timeout: Duration::from_secs(1),
            wake_up_timeout: Duration::from_secs(1),
            start_timeout: Duration::from_secs(2),
            may_sleep: false,
        };
        let lights = VehicleLights::new(binding(), Publish::OnChange);
        Self { lights, buses: [Bus::new(settings, LinkState::Up)] }
    }

    /// Passes a frame, if any, and returns the status.
    fn at(&mut self, millis: u64, data: Option<&[u8]>) -> Status {
        let now = Now { mono: MonoTime::from_millis(millis), wall: WallStamp::default() };
        if let Some(data) = data {
            let frame = Frame::classic(CanId::Standard(0x123), data).unwrap();
            self.lights.frame_arrived(MessageIndex(0), &frame, now.wall, now);
        }
        self.lights.settle(&self.buses, now, |_| {}, |_| {});
        self.lights.status(TURN, &self.buses, now.mono)
    }
}

fn value<'a>(status: &'a Status, key: &str) -> &'a str {
    &status.values.iter().find(|(name, _)| *name == key).unwrap().1
}

#[test]
fn each_failure_is_counted_once() {
    let mut bench = Bench::new();
    bench.at(0, None);
    for (millis, raw) in [(10, 0), (20, 150), (30, 151), (40, 1), (50, 15), (60, 15), (70, 14), (80, 0)] {
        bench.at(millis, Some(&[raw]));
    }
    let status = bench.at(90, Some(&[150]));
    assert_eq!(value(&status, "unknown_count"), "2", "before the first frame, and not available");
    assert_eq!(value(&status, "invalid_count"), "2", "150 and 151 are one failure");
    assert_eq!(value(&status, "hardware_fault_count"), "1");
}

#[test]
fn last_error_is_shown_with_age_after_recovery() {
    let mut bench = Bench::new();
    assert_eq!(value(&bench.at(0, Some(&[0])), "last_error"), "none");
    let text = "invalid: BLINK.TURN = 150 (0x96) is not a defined value";
    let status = bench.at(100, Some(&[150]));
    assert_eq!((status.level, status.message.as_str()), (Level::Error, text));
    assert_eq!(value(&status, "last_error"), text);
    assert_eq!(value(&status, "report"), "not published");
    bench.at(400, Some(&[1]));
    let status = bench.at(3_200, Some(&[1]));
    assert_eq!((status.level, status.message.as_str()), (Level::Ok, "publishing"));
    assert_eq!(value(&status, "last_error"), format!("{text} (3 s ago)"));
    assert_eq!(value(&status, "report"), "ENABLE_LEFT");
}

#[test]
fn short_frames_are_counted_and_change_nothing() {
    let mut bench = Bench::new();
    bench.at(0, Some(&[1]));
    let status = bench.at(200, Some(&[]));
    assert_eq!(value(&status, "too_short_frames"), "1");
    assert_eq!(value(&status, "frames"), "1");
    assert_eq!((value(&status, "age_ms"), value(&status, "raw_value")), ("200", "1"));
    assert_eq!(bench.at(501, None).message, "unknown: BLINK (123) is received, but too short");
    assert_eq!(bench.at(701, None).message, "unknown: BLINK is stale, silent for more than 500 ms");
}
