//! Diagnostics of a real link: of a controller with states, without hardware (the kernel's
//! serial-line CAN on a pseudo-terminal), of a reader that stalls, of a bus that falls asleep.

use std::time::{Duration, Instant};

use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_report::Step;
use signal_gateway::io::can::bus::{BusSocketSettings, receive};
use signal_gateway::io::can::id_filter::IdFilter;
use signal_gateway::io::can::transmit::Transmitter;
use socketcan::nl::CanState;
use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame as _, Socket as _, StandardId};
use tokio::sync::mpsc::{Receiver, channel};
use tokio::time::timeout;

use crate::support::files::MemoryFiles;
use crate::support::prerequisite::require;
use crate::support::slcan::Adapter;
use crate::support::vcan::Vcan;
use crate::support::waiting::{DEADLINE, wait_until};

const BUS: BusIndex = BusIndex(0);

/// The gateway, fed by the receiver of one interface as the daemon does it.
struct Desk {
    gateway: Gateway,
    inputs: Receiver<Vec<CanInput>>,
    started: Instant,
    /// Time that has passed on its clock beside that of the machine.
    skipped: Duration,
    /// Level and message of the interface whenever they changed, newest last.
    changes: Vec<(Level, String)>,
    /// Number of changes that were waited for, or were before one that was.
    passed: usize,
    turn: Vec<String>,
    reports: usize,
}

impl Desk {
    fn open(interface: &str, receive_buffer_bytes: usize) -> Self {
        let gateway = format!("profile = \"car.toml\"\n[can.body]\ninterface = \"{interface}\"\n");
        let settings = MemoryFiles::vehicle(PROFILE, DBC).with("gateway.toml", gateway).settings().gateway;
        let ids = settings.relevant_ids(BUS);
        let (sender, inputs) = channel(64);
        let interface = interface.to_owned();
        let transmitter = Transmitter::default();
        let receiver = BusSocketSettings {
            bus: BUS,
            interface,
            ids: IdFilter::new(Some(ids)),
            receive_buffer_bytes,
            transmitter,
        };
        tokio::spawn(receive(receiver, sender));
        let started = Instant::now();
        let (skipped, passed) = (Duration::ZERO, 0);
        let gateway = Gateway::new(settings, LinkState::Missing, now(Duration::ZERO));
        Self { gateway, inputs, started, skipped, changes: vec![], passed, turn: vec![], reports: 0 }
    }

    fn now(&self) -> Now {
        now(self.started.elapsed() + self.skipped)
    }

    /// Runs until `is_over`.
    async fn until(&mut self, is_over: impl Fn(&Self) -> bool) {
        let run = async {
            loop {
                self.take_outputs();
                if is_over(self) {
                    return;
                }
                let deadline = self.gateway.next_deadline().as_nanos();
                let wait = deadline.saturating_sub(self.now().mono.as_nanos());
                let batch = timeout(Duration::from_nanos(wait), self.inputs.recv()).await;
                self.handle(batch.map_or_else(|_| vec![], |batch| batch.expect("the receiver goes on")));
            }
        };
        let is_in_time = timeout(DEADLINE, run).await.is_ok();
        assert!(is_in_time, "only {:#?} {:#?}", self.changes, self.turn);
    }

    fn handle(&mut self, inputs: Vec<CanInput>) {
        let now = self.now();
        self.gateway.handle(Input::Tick, now);
        for input in inputs {
            self.gateway.handle(input, now);
        }
    }

    /// Runs until the interface changes to that, after what was waited for before.
    async fn until_change(&mut self, level: Level, message: &str) {
        let (passed, change) = (self.passed, (level, message.to_owned()));
        self.until(|desk| desk.changes[passed..].contains(&change)).await;
        self.passed += self.changes[passed..].iter().position(|one| *one == change).unwrap() + 1;
    }

    /// Skips to one deadline after the other, in silence, until the interface changes to that.
    fn skip_until_change(&mut self, level: Level, message: &str) {
        let change = (level, message.to_owned());
        while self.changes.last() != Some(&change) {
            let deadline = Duration::from_nanos(self.gateway.next_deadline().as_nanos());
            self.skipped += deadline.saturating_sub(Duration::from_nanos(self.now().mono.as_nanos()));
            self.handle(vec![]);
            self.take_outputs();
            assert!(self.skipped < 10 * DEADLINE, "only {:#?} {:#?}", self.changes, self.turn);
        }
        self.passed = self.changes.len();
    }

    fn take_outputs(&mut self) {
        while let Some(output) = self.gateway.poll_output() {
            match output {
                Output::Diagnostics { diagnostics, .. } if !diagnostics.refresh => {
                    for status in diagnostics.statuses {
                        if status.task == "turn_indicators" {
                            self.turn.push(status.message);
                        } else if status.task != "hazard_lights" {
                            self.changes.push((status.level, status.message));
                        }
                    }
                }
                Output::VehicleLights(VehicleLightsOutput::TurnIndicators(Step::Publish(..))) => {
                    self.reports += 1;
                }
                Output::VehicleStatus(_)
                | Output::TrafficLights(_)
                | Output::TurnSignal(_)
                | Output::Command(_) => {
                    panic!("nothing but reports here")
                }
                Output::VehicleLights(_) | Output::Diagnostics { .. } => {}
            }
        }
    }

    fn value(&self, key: &str) -> Option<String> {
        let statuses = self.gateway.statuses(self.now().mono);
        let values = statuses.into_iter().last().unwrap().values;
        values.into_iter().find(|(name, _)| *name == key).map(|(_, value)| value)
    }
}

fn now(elapsed: Duration) -> Now {
    let elapsed = u64::try_from(elapsed.as_nanos()).unwrap();
    Now { mono: MonoTime::from_nanos(elapsed), wall: WallStamp::from_nanos(0) }
}

const DBC: &str = "BO_ 291 TURN: 2 X\n SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X\n";

/// Long limits: a pause of the machine must not become a silence.
const PROFILE: &str = r#"
name = "test car"
[bus.body]
dbc = "car.dbc"
alive_timeout_ms = 60000
may_sleep = true
[message.TURN]
timeout_ms = 60000
[turn]
signal = "TURN.CODE"
off = [0]
left = [1]
right = [2]
[hazard]
from = "not_visible"
"#;

#[tokio::test]
async fn a_controller_that_goes_to_bus_off_and_back_is_reported_state_by_state() {
    let adapter = require!(Adapter::plug_in());
    let interface = adapter.name.clone();
    let mut desk = Desk::open(&interface, 65_536);
    desk.until_change(Level::Warn, "up, but no frame of the vehicle profile yet").await;
    desk.until(|desk| desk.value("controller").as_deref() == Some("error-active")).await; // the kernel's state
    adapter.send_lines("t1232AABB\r");
    desk.until_change(Level::Ok, "receiving").await;

    adapter.send_lines("sw100096\rt1232AABB\r");
    desk.until_change(Level::Warn, "error-warning: the bus is disturbed").await;
    assert_eq!(desk.value("rx_errors").as_deref(), Some("100"));
    assert_eq!(desk.value("tx_errors").as_deref(), Some("96"));
    let last_error = desk.value("last_error").unwrap();
    assert!(last_error.starts_with("controller (rx warning), tx 96, rx 100 ("), "{last_error}");

    adapter.send_lines("sp130020\rt1232AABB\r");
    desk.until_change(Level::Warn, "error-passive: the bus is heavily disturbed").await;

    adapter.send_lines("sb000256\r");
    let off = format!(
        "bus-off: receives nothing, needs a manual restart: ip link set {interface} type can restart"
    );
    desk.until_change(Level::Error, &off).await;
    desk.until(|desk| desk.turn.last().is_some_and(|message| message.ends_with(" is bus-off"))).await;
    assert_eq!(desk.value("bus_off_count").as_deref(), Some("1"));
    assert_eq!(desk.value("controller").as_deref(), Some("bus-off"));

    let reports = desk.reports;
    adapter.send_lines("sa000000\rt1232AABB\r");
    desk.until_change(Level::Ok, "receiving").await;
    desk.until(|desk| desk.reports > reports).await;
    assert_eq!(desk.turn.last().unwrap(), "publishing");
    assert_eq!(desk.value("bus_off_count").as_deref(), Some("1"));

    adapter.send_lines("e2bc\rt1232AABB\r");
    desk.until_change(Level::Warn, "receiving, with recent drops, error frames or bad lines").await;
    drop(adapter);
    desk.until_change(Level::Error, &format!("{interface} is missing")).await;
    println!("interface: {:#?}\nturn: {:#?}", desk.changes, desk.turn);
    let levels: Vec<_> = desk.changes.iter().map(|(level, _)| *level).collect();
    let (ok, warn, error) = (Level::Ok, Level::Warn, Level::Error);
    // Between bus-off and the first frame the bus is silent for a moment.
    let expected = [error, warn, ok, warn, warn, error, warn, ok, warn, error];
    assert_eq!(levels, expected, "each reported once: {:#?}", desk.changes);
}

#[tokio::test]
async fn the_kernel_is_polled_for_a_state_that_no_error_frame_announced() {
    let adapter = require!(Adapter::plug_in());
    let can = adapter.interface();
    adapter.send_lines("sp130020\r"); // before anybody listens
    let passive = |state: Option<CanState>| state == Some(CanState::ErrorPassive);
    wait_until("error-passive", || passive(can.state().unwrap()));
    let mut desk = Desk::open(&adapter.name, 65_536);
    let text = "error-passive: the bus is heavily disturbed; up, but no frame of the vehicle profile yet";
    desk.until_change(Level::Warn, text).await;
    assert_eq!(desk.value("error_frames").as_deref(), Some("0"));
    // Nor must recovery be announced: after down and up the driver is active without a notice.
    can.bring_down().unwrap();
    can.bring_up().unwrap();
    desk.until(|desk| desk.value("controller").as_deref() == Some("error-active")).await;
    adapter.send_lines("t1232AABB\r");
    desk.until_change(Level::Ok, "receiving").await;
}

#[tokio::test]
async fn frames_lost_while_the_reader_stalls_are_counted_in_diagnostics() {
    let vcan = require!(Vcan::new("vcan-stall"));
    let mut desk = Desk::open(vcan.name, 1); // the smallest buffer there is
    desk.until_change(Level::Warn, "up, but no frame of the vehicle profile yet").await;
    let socket = CanSocket::open(vcan.name).unwrap();
    let frame = CanDataFrame::new(StandardId::new(0x123).unwrap(), &[0, 0]).unwrap();
    for _ in 0..2000 {
        socket.write_frame(&frame).unwrap(); // one thread: the reader stands still meanwhile
    }
    desk.until_change(Level::Ok, "receiving").await;
    let queued = |desk: &Desk| desk.value("frames").unwrap().parse::<u64>().unwrap();
    let received = queued(&desk);
    desk.until(|desk| {
        // The kernel reports a loss with the next frame it has room for.
        socket.write_frame(&frame).unwrap();
        desk.value("drops").unwrap() != "0" && queued(desk) > received
    })
    .await;
    let text = "receiving, with recent drops, error frames or bad lines";
    desk.until_change(Level::Warn, text).await;
    let drops: u64 = desk.value("drops").unwrap().parse().unwrap();
    assert!((1000..2000).contains(&drops), "{drops}");
}

#[tokio::test]
async fn a_bus_that_may_sleep_falls_asleep_and_wakes_up_with_one_word_each() {
    let vcan = require!(Vcan::new("vcan-sleep"));
    let mut desk = Desk::open(vcan.name, 65_536);
    desk.until_change(Level::Warn, "up, but no frame of the vehicle profile yet").await;
    let socket = CanSocket::open(vcan.name).unwrap();
    let frame = CanDataFrame::new(StandardId::new(0x123).unwrap(), &[1, 0]).unwrap();
    let first = desk.turn.len();
    for _ in 0..2 {
        socket.write_frame(&frame).unwrap();
        desk.until_change(Level::Ok, "receiving").await;
        desk.skip_until_change(Level::Ok, "asleep");
    }
    vcan.delete();
    desk.until_change(Level::Error, "vcan-sleep is missing").await;
    let asleep = "asleep: no frame of TURN since bus vcan-sleep fell asleep";
    assert_eq!(desk.turn[first..first + 4], ["publishing", asleep, "publishing", asleep]);
}
