//! The path of a frame through the gateway allocates no memory: nothing can grow, fragment or wait
//! for the allocator however long and busy the drive.

use std::collections::BTreeSet;
use std::hint::black_box;
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use can_log::Log;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use can_signal::dbc::codec::{ByteOrder, Layout as SignalLayout, SignalCodec};
use can_signal::validation::integrity::checksum::{Checksum, ChecksumRule, CrcRule};
use can_signal::validation::integrity::counter::{Counter, CounterRule, IncrementsOn};
use can_signal::validation::integrity::e2e::{E2e, E2eProfile};
use can_signal::validation::integrity::window::{Window, WindowLimits};
use can_signal::validation::integrity::{IntegrityChecker, MessageIntegrity, Protection};
use can_signal::validation::requirement::{Condition, Requirement};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::vehicle_lights::binding::TurnBinding;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_report::Step;
use lanelet2_map::light_map::{GroupEntry, LightMap};
use signal_gateway::config::files::Disk;
use signal_gateway::config::{Settings, load_profile};
use traffic_lights::arbiter::ArbiterSettings;
use traffic_lights::compat::Compat;
use traffic_lights::emission::{LightsContent, LightsTopic};
use traffic_lights::engine::LightsSettings;
use traffic_lights::flow::LightsFlowSettings;
use traffic_lights::output::TrafficLightOutput;
use traffic_lights::scenario::{Action, Phase, PhaseEntry, Scenario, StateText, TrafficSignalController};
use traffic_lights::target::{LightChannel, SignalTarget, StoreId, StoreLayer};

use crate::counting_allocator::allocations;
use crate::pure::vehicle_status::car as status_car;

const TURN: CanId = CanId::Standard(0x2A5);
const HAZARD: CanId = CanId::Standard(0x2C1);
const WHEEL_SPEEDS: CanId = CanId::Standard(0x0B2);
const UNBOUND: CanId = CanId::Standard(0x0F0);
const VARIANT: CanId = CanId::Standard(0x0F1);

const OFF: [u8; 8] = [0; 8];
const LEFT: [u8; 8] = [0, 0, 0b0010, 0, 0, 0, 0, 0];

fn demo() -> Settings {
    let lights = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/support/lights_vehicle.toml");
    load_profile(&Disk, Path::new(lights)).unwrap()
}

/// A gateway of the lights of the demo vehicle and the time, which stands still but for [`Car::passes`].
struct Car {
    gateway: Gateway,
    now: Now,
}

impl Car {
    /// Both reports have been published and the diagnostics refreshed.
    fn in_steady_state() -> Self {
        let now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
        let mut settings = demo().gateway;
        let (bus, observation) = (BusIndex(0), Duration::from_millis(100));
        let conditions = [(HAZARD, Condition::Seen), (VARIANT, Condition::Unseen { observation })];
        settings.lights.requirements = conditions
            .map(|(id, condition)| Requirement {
                bus,
                ids: id.into(),
                name: "M".into(),
                condition,
                otherwise: String::new(),
            })
            .to_vec();
        let mut car = Self { gateway: Gateway::new(settings, LinkState::Up, now), now };
        for _ in 0..10 {
            for (id, data) in [(TURN, LEFT), (HAZARD, OFF), (TURN, OFF)] {
                car.receive(id, data);
            }
            car.passes(Duration::from_millis(50));
        }
        while car.gateway.poll_output().is_some() {}
        car
    }

    fn receive(&mut self, id: CanId, data: [u8; 8]) {
        let frame = Frame::classic(id, &data).unwrap();
        self.gateway.handle(CanInput::Frame { bus: BusIndex(0), frame, stamp: self.now.wall }, self.now);
    }

    fn passes(&mut self, time: Duration) {
        self.now = Now { mono: self.now.mono.after(time), wall: self.now.wall.after(time) };
        self.gateway.handle(Input::Tick, self.now);
    }

    fn outputs(&mut self) -> Vec<Output> {
        std::iter::from_fn(|| self.gateway.poll_output()).collect()
    }
}

#[test]
fn the_counter_counts() {
    assert_eq!(allocations(|| drop(black_box(Box::new(1)))), 1);
    assert_eq!(allocations(|| drop(black_box(vec![1; 9]))), 1);
    assert_eq!(allocations(|| ()), 0);
}

#[test]
fn a_frame_that_changes_nothing_allocates_nothing() {
    let mut car = Car::in_steady_state();
    for id in [TURN, HAZARD, WHEEL_SPEEDS, UNBOUND] {
        assert_eq!(allocations(|| car.receive(id, OFF)), 0, "{id}");
        assert_eq!(allocations(|| _ = black_box(car.gateway.next_deadline())), 0, "{id}");
    }
    assert_eq!(car.outputs(), []);
}

#[test]
fn a_frame_that_changes_a_report_allocates_nothing() {
    let mut car = Car::in_steady_state();
    let mut report = None;
    let allocated = allocations(|| {
        car.receive(TURN, LEFT);
        report = car.gateway.poll_output();
    });
    assert!(
        matches!(report, Some(Output::VehicleLights(VehicleLightsOutput::TurnIndicators(Step::Publish(..))))),
        "{report:?}"
    );
    assert_eq!(allocated, 0);
}

#[test]
fn frames_with_faults_and_of_any_length_allocate_nothing_once_they_were_reported() {
    let mut car = Car::in_steady_state();
    car.receive(TURN, [0xFF; 8]);
    assert!(!car.outputs().is_empty(), "a fault is news");
    assert_eq!(allocations(|| car.receive(TURN, [0xFF; 8])), 0);
    let short = Frame::classic(TURN, &[0xFF]).unwrap();
    let input = CanInput::Frame { bus: BusIndex(0), frame: short, stamp: car.now.wall };
    assert_eq!(allocations(|| car.gateway.handle(input, car.now)), 0);
    assert_eq!(car.outputs(), []);
}

#[test]
fn frames_of_two_j1939_senders_allocate_nothing_once_they_were_reported() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles/j1939_truck.toml");
    let now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
    let gateway = Gateway::new(load_profile(&Disk, &path).unwrap().gateway, LinkState::Up, now);
    let mut car = Car { gateway, now };
    let [one, other] = [0x0CFD_CC27, 0x18FD_CC21].map(CanId::Extended);
    for id in [one, one, other, one] {
        car.receive(id, OFF);
    }
    assert!(!car.outputs().is_empty(), "a second sender is news");
    for id in [one, other, CanId::Extended(0x18FD_CD21)] {
        assert_eq!(allocations(|| car.receive(id, OFF)), 0, "{id}");
    }
    assert_eq!(car.outputs(), []);
}

#[test]
fn flashing_lamps_of_several_sources_allocate_nothing() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles/subaru_outback_2015.toml");
    let mut settings = load_profile(&Disk, &path).unwrap().gateway;
    let TurnBinding::From(sources) = &mut settings.lights.turn else { panic!("it has lamps") };
    let lamps = sources.list[0].clone();
    sources.list.push(lamps);
    let mut now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
    let mut gateway = Gateway::new(settings, LinkState::Up, now);
    let mut frame = |gateway: &mut Gateway, lamps: u8| {
        now.mono = now.mono.after(Duration::from_millis(10));
        let frame = Frame::classic(CanId::Standard(0x282), &[0, 0, 0, 0, 0, lamps, 0, 0]).unwrap();
        gateway.handle(CanInput::Frame { bus: BusIndex(0), frame, stamp: now.wall }, now);
    };
    let drained = |gateway: &mut Gateway| {
        let outputs = std::iter::from_fn(|| gateway.poll_output());
        outputs.filter(|output| matches!(output, Output::Diagnostics { .. })).count()
    };
    // Left is on, and the diagnostics were refreshed just now.
    (0..100).for_each(|_| frame(&mut gateway, 0));
    frame(&mut gateway, 0b1_0000);
    drained(&mut gateway);
    while drained(&mut gateway) == 0 {
        frame(&mut gateway, 0b1_0000);
    }
    let allocated = allocations(|| {
        for lamps in [0, 0b1_0000, 0b11_0000, 0b10_0000, 0] {
            (0..4).for_each(|_| frame(&mut gateway, lamps));
            black_box(gateway.next_deadline());
        }
    });
    assert_eq!((allocated, drained(&mut gateway)), (0, 0), "no refresh meanwhile");
}

/// Speed, steering, gear, doors and mode, with all checks, while the car drives off, turns and stops.
#[test]
fn a_drive_with_the_status_of_the_vehicle_allocates_nothing_per_frame() {
    let at = |ms: u32| Now {
        mono: MonoTime::from_millis(ms.into()),
        wall: WallStamp::from_nanos(i64::from(ms) * 1_000_000),
    };
    let mut gateway = Gateway::new(status_car::settings(&[], &[]).gateway, LinkState::Up, at(0));
    let mut car = status_car::Car::default();
    let (mut frames, mut reports, mut allocated) = (0, 0, 0);
    for ms in (0..20_000).step_by(10) {
        car.gear = if ms < 2_000 { 0 } else { 3 };
        let goal = if (3_000..15_000).contains(&ms) { 12.0 } else { 0.0 };
        car.speed_mps += (goal - car.speed_mps).clamp(-0.04, 0.03);
        car.tire_rad = 0.05 * (f64::from(ms) / 2_000.0).sin();
        let now = at(ms);
        for (id, cycle) in status_car::CYCLES {
            if u64::from(ms) % cycle != 0 {
                continue;
            }
            // What is due by the clock comes first, as in the daemon; diagnostics are refreshed there.
            gateway.handle(Input::Tick, now);
            while gateway.poll_output().is_some() {}
            let frame = Frame::classic(CanId::Standard(id), &car.frame(id).data).unwrap();
            let input = CanInput::Frame { bus: BusIndex(0), frame, stamp: now.wall };
            let mut is_status_changed = false;
            let of_frame = allocations(|| {
                gateway.handle(input, now);
                while let Some(output) = gateway.poll_output() {
                    is_status_changed |= matches!(output, Output::Diagnostics { .. });
                    reports += u32::from(matches!(output, Output::VehicleStatus(_)));
                }
            });
            frames += 1;
            if !is_status_changed && ms >= 1_000 {
                allocated += of_frame;
            }
        }
    }
    assert!(frames > 7_000 && reports > 1_900, "{frames} frames, {reports} reports");
    assert_eq!(allocated, 0);
}

/// A controller for each ten lights, all copied to V2I with what is predicted.
fn ten_thousand_lights() -> LightsSettings {
    let group = |id| GroupEntry::new(1_000_000 + id, [id]);
    let groups: Vec<_> = (0..10_000).map(group).collect();
    let store = StoreId { channel: LightChannel::Conventional, layer: StoreLayer::GroundTruth };
    let entry = |id| PhaseEntry { target: SignalTarget { id, store }, state: StateText::new("red") };
    let controller = |first: i64| TrafficSignalController {
        name: first.to_string(),
        reference: None,
        phases: vec![Phase {
            name: "red".to_owned(),
            duration: Some(Duration::from_secs(3_600)),
            entries: (first..first + 10).map(entry).collect(),
        }],
    };
    let scenario = Scenario {
        controllers: (0..1_000).map(|crossing| controller(crossing * 10)).collect(),
        init: vec![Action::EnableV2i((0..10_000).collect())],
        ..Scenario::default()
    };
    let topics = [LightsTopic::GroundTruth, LightsTopic::Camera, LightsTopic::V2i, LightsTopic::Markers];
    LightsSettings {
        topics: BTreeSet::from(topics),
        ..LightsSettings::new(Arc::new(LightMap::new([], &groups)), scenario, Compat::Improved)
    }
}

#[test]
fn ten_thousand_lights_that_do_not_change_are_sent_without_allocating() {
    let mut settings = demo().gateway;
    settings.traffic_lights = Some(LightsFlowSettings {
        arbiter: Some(ArbiterSettings::default()),
        ..LightsFlowSettings::new(ten_thousand_lights())
    });
    let period = settings.diagnostics_period;
    let now = |mono| Now { mono, wall: WallStamp::default() };
    let mut gateway = Gateway::new(settings, LinkState::Up, now(MonoTime::ZERO));
    let mut due = MonoTime::ZERO;
    // Until the first frames are overdue, and on until the diagnostics are refreshed, which allocates.
    let mut refreshed = false;
    while due < MonoTime::from_millis(4_000) || !refreshed {
        due = gateway.next_deadline();
        gateway.handle(Input::Tick, now(due));
        refreshed = false;
        while let Some(output) = gateway.poll_output() {
            refreshed |= matches!(output, Output::Diagnostics { .. });
        }
    }
    let (mut groups, mut messages) = (0, 0);
    let until = due.after(period);
    let allocated = allocations(|| {
        while gateway.next_deadline() < until {
            due = gateway.next_deadline();
            gateway.handle(Input::Tick, now(due));
            while let Some(output) = gateway.poll_output() {
                let Output::TrafficLights(TrafficLightOutput::Publish(emission)) = output else { continue };
                messages += 1;
                if let LightsContent::Groups(list) = &emission.content {
                    groups += list.len();
                }
            }
        }
    });
    assert!(messages >= 15 && groups >= 50_000, "{messages} messages, {groups} groups");
    assert_eq!(allocated, 0);
}

#[test]
fn decoding_allocates_nothing() {
    let binding = demo().gateway.lights;
    let frame = Frame::classic(TURN, &LEFT).unwrap();
    for signal in &binding.table.signals {
        let allocated = allocations(|| {
            let read = (signal.codec.is_present(frame.padded()), signal.codec.value(frame.padded()));
            black_box((read, signal.codec.needed_length()));
        });
        assert_eq!(allocated, 0, "{}", signal.name);
    }
}

#[test]
fn judging_a_frame_allocates_nothing_good_or_bad() {
    let byte = |start| SignalLayout { start, length: 8, order: ByteOrder::Intel, signed: false };
    let checksum = SignalCodec::new(byte(56), 8).unwrap();
    let checksum = Checksum::new(ChecksumRule::Crc(CrcRule::j1850()), checksum).unwrap();
    let counter = SignalCodec::new(byte(0), 8).unwrap();
    let mut rule = CounterRule::new(0, 255).unwrap();
    rule.increments_on = IncrementsOn::Changes;
    let limits = WindowLimits { size: 3, min_ok: 2, max_error: 0 };
    let own = Protection::Fields {
        checksum: Some(checksum.clone()),
        counter: Some(Counter::new(rule, counter).unwrap()),
    };
    let e2e = E2e::new(E2eProfile::P05 { data_id: 1 }, 0, 8).unwrap();
    for protection in [own, Protection::e2e(e2e.clone(), 1).unwrap()] {
        let mut checker = IntegrityChecker::new(MessageIntegrity {
            length: None,
            protection,
            window: Some(Window::new(limits, limits, limits, false).unwrap()),
            forget_after: Some(Duration::from_secs(1)),
        });
        let mut trusted = 0;
        let allocated = allocations(|| {
            for counter in 0..100_u8 {
                let mut data = [counter; 8];
                match &checker.rules().protection {
                    Protection::Fields { .. } => assert!(checksum.protect(TURN, &mut data)),
                    Protection::E2e { .. } => assert!(e2e.protect(counter.into(), &mut data)),
                }
                let damaged = Frame::classic(TURN, &data[..usize::from(counter % 9).min(7)]).unwrap();
                let frame = Frame::classic(TURN, &data).unwrap();
                let verdict = checker.check(if counter > 80 { &damaged } else { &frame }, MonoTime::ZERO);
                trusted += u32::from(verdict.is_ok());
            }
        });
        assert_eq!((trusted, allocated), (79, 0));
    }
}

#[test]
fn reading_a_recording_allocates_nothing_after_its_first_line() {
    let lines = "(1767225600.013289) can0 2A5#0000000000000000\nnot a line\n".repeat(100);
    let mut log = Log::new(Box::new(Cursor::new(lines.into_bytes()))).unwrap();
    assert!(log.next_record().unwrap().is_some());
    let mut records = 1;
    let allocated = allocations(|| {
        while log.next_record().unwrap().is_some() {
            records += 1;
        }
    });
    assert_eq!((records, log.bad_lines(), allocated), (100, 100, 0));
}
