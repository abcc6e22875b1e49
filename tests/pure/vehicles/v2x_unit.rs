//! The profile of a V2X unit: frames written bit by bit, and the traffic-light states that are used.

use can_signal::can::bus::Bus;
use can_signal::can::frame::{CanId, Frame};
use can_signal::can::id_match::IdMatch;
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use can_signal::validation::observation::Interruption;
use can_signal::validation::table::MessageIndex;
use gateway_base::diagnostics::{Level, Status};
use gateway_base::time::MonoTime;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::Output;
use gateway_core::v2i_reception::{Settled, V2iReception};

use crate::pure::vehicles::payload::frame;
use crate::pure::vehicles::profile;
use crate::support::clock::at_ms;
use crate::support::vehicle_facts::VEHICLES;

/// All that receives, and the counter of each message.
struct Bench {
    reception: V2iReception,
    buses: Vec<Bus>,
    counters: [u8; 2],
}

/// Counter in the low nibble of byte 6, J1850's CRC over all before it in byte 7.
fn sealed(text: &str, counter: u8) -> Frame {
    let plain = frame(text);
    let mut data = plain.data().to_vec();
    data[6] = counter % 16;
    let crc = data[..7].iter().fold(0xFF_u8, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc, _| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0x1D })
    });
    data[7] = !crc;
    Frame::classic(plain.id(), &data).unwrap()
}

impl Bench {
    fn new() -> Self {
        let settings = profile("v2x_unit").gateway.clone();
        let buses = settings.buses.into_iter().map(|bus| Bus::new(bus, LinkState::Up)).collect();
        Self { reception: V2iReception::new(settings.v2i), buses, counters: [0; 2] }
    }

    /// Frames with the next counter of their message; the radio's status has none.
    fn frame(&mut self, ms: u64, text: &str) -> Vec<String> {
        let counter = match &text[..3] {
            "5A0" => &mut self.counters[0],
            "5A1" => &mut self.counters[1],
            _ => return self.raw_frame(ms, &frame(text)),
        };
        *counter += 1;
        let sealed = sealed(text, *counter);
        self.raw_frame(ms, &sealed)
    }

    fn raw_frame(&mut self, ms: u64, frame: &Frame) -> Vec<String> {
        let messages = &self.reception.binding().table.messages;
        let message = messages.iter().position(|message| message.ids.contains(frame.id())).unwrap();
        if self.buses[0].frame_arrived(at_ms(ms).mono) {
            let (message, now) = (MessageIndex(message), at_ms(ms));
            self.reception.frame_arrived(message, frame, now.wall, &self.buses, now);
        }
        self.settle(ms)
    }

    /// What is to be done now: `34806 red solidOn circle`, or `-34806` for a removal.
    fn settle(&mut self, ms: u64) -> Vec<String> {
        let Settled { changes, .. } = self.reception.settle(&self.buses, at_ms(ms));
        let changes = changes.into_iter().map(|(id, state)| match state {
            None => format!("-{id}"),
            Some(state) if state.confidence < 1.0 => format!("{id} {} at {}", state.bulbs, state.confidence),
            Some(state) => format!("{id} {}", state.bulbs),
        });
        changes.collect()
    }

    /// Sends the radio's good state and two frames of the message, of which the first proves nothing.
    fn started(next: &str) -> Self {
        let mut bench = Self::new();
        bench.frame(0, "5A2 2 0|3@1=1");
        bench.frame(1, next);
        bench.frame(2, next);
        bench
    }

    fn status(&self, ms: u64) -> Status {
        self.reception.status(&self.buses, at_ms(ms).mono)
    }

    fn status_value(&self, key: &str, ms: u64) -> String {
        let mut values = self.status(ms).values.into_iter();
        values.find(|(name, _)| *name == key).unwrap_or_else(|| panic!("{key}")).1
    }

    /// What comes of a step, as the facts explain them.
    fn step(&mut self, ms: u64, what: &str) -> String {
        match what.split_once(' ').unwrap_or((what, "")) {
            ("settle", _) => self.settle(ms).join("; "),
            ("deadline", _) => {
                let deadline = self.reception.next_deadline(at_ms(ms).mono);
                deadline.unwrap().as_nanos().to_string()
            }
            ("finding", id) => {
                let groups = self.status_value("groups", ms);
                groups.split("; ").find(|text| text.starts_with(&format!("{id}: "))).unwrap().to_owned()
            }
            ("status", _) => {
                let status = self.status(ms);
                format!("{}, {} {}", status.task, status.level, status.message)
            }
            (key, "") => self.status_value(key, ms),
            _ => self.frame(ms, what).join("; "),
        }
    }
}

/// Both groups with a signal of their own: red, and protected green.
const BOTH: &str = "5A0 8 0|4@1=1 4|4@1=3";
/// Group 1 of intersection 1201 is red; with another state instead of the 3.
const RED: &str = "5A1 8 0|16@1=1201 16|8@1=1 24|4@1=3 28|1@1=1 32|7@1=100";
/// Group 2 has protected green.
const GREEN: &str = "5A1 8 0|16@1=1201 16|8@1=2 24|4@1=6 28|1@1=1 32|7@1=50";

#[test]
fn each_drive_of_the_unit_gives_its_states() {
    for drive in &VEHICLES["v2x_unit"].v2i {
        let mut bench = drive.start.as_ref().map_or_else(Bench::new, |frame| Bench::started(frame));
        for step in &drive.steps {
            let (times, step) = step.split_once(' ').unwrap();
            let (what, expected) = step.split_once(" -> ").unwrap_or((step, ""));
            let numbers: Vec<u64> = times.split(['-', '/']).map(|number| number.parse().unwrap()).collect();
            let (first, last, period) = match numbers[..] {
                [at] => (at, at, 1),
                [first, last, period] => (first, last, period),
                _ => panic!("{times}"),
            };
            for ms in (first..=last).step_by(usize::try_from(period).unwrap()) {
                assert_eq!(bench.step(ms, what), expected, "{}: {step} at {ms} ms", drive.name);
            }
        }
    }
}

#[test]
fn states_are_as_old_as_the_last_frame_with_them() {
    let mut bench = Bench::started(BOTH);
    bench.frame(200, BOTH);
    let received: Vec<_> = bench.reception.valid_states().map(|(_, state)| state.received.at).collect();
    assert_eq!(received, [MonoTime::from_millis(200); 2]);
}

#[test]
fn a_lost_link_removes_everything_and_brings_nothing_back() {
    let mut bench = Bench::started(RED);
    assert_eq!(bench.reception.valid_states().count(), 1);
    bench.buses[0].set_link(LinkState::Down);
    bench.reception.forget(BusIndex(0), Interruption::LinkLost);
    assert_eq!(bench.settle(10), ["-35101"]);
    bench.buses[0].set_link(LinkState::Up);
    bench.frame(20, "5A2 2 0|3@1=1");
    for ms in [30, 40] {
        assert_eq!(bench.frame(ms, GREEN), [""; 0], "the counter is not in sequence yet");
    }
    assert_eq!(
        bench.frame(50, GREEN),
        ["35102 green solidOn left at 0.5"],
        "and 35101 is not received again"
    );
}

#[test]
fn a_frame_that_does_not_prove_itself_moves_nothing() {
    let mut bench = Bench::started(BOTH);
    let green = sealed("5A0 8 0|4@1=3 4|4@1=3", 3);
    for bit in 0..64 {
        let mut data = green.data().to_vec();
        data[bit / 8] ^= 1 << (bit % 8);
        let damaged = Frame::classic(green.id(), &data).unwrap();
        assert_eq!(bench.raw_frame(50, &damaged), [""; 0], "bit {bit}");
    }
    assert_eq!(bench.raw_frame(60, &sealed("5A0 8 0|4@1=3 4|4@1=3", 2)), [""; 0], "the counter stands");
    assert_eq!(bench.status_value("rejected_frames", 60), "66", "the very first frame as well");
    assert_eq!(bench.raw_frame(100, &green), [""; 0], "one more is needed after a break");
    let next = sealed("5A0 8 0|4@1=3 4|4@1=3", 4);
    assert_eq!(bench.raw_frame(105, &next), ["34806 green solidOn circle"]);
    let short = Frame::classic(CanId::standard(0x5A0).unwrap(), &green.data()[..4]).unwrap();
    assert_eq!(bench.raw_frame(110, &short), [""; 0]);
    let settled = bench.settle(700);
    assert_eq!(settled, ["-34806", "-34807"], "wrong frames keep nothing alive");
}

#[test]
fn every_state_of_the_standard_is_read() {
    for [raw, state] in &VEHICLES["v2x_unit"].v2i_states {
        let bench = Bench::started(&GREEN.replace("24|4@1=6", &format!("24|4@1={raw}")));
        let valid_states: Vec<_> =
            bench.reception.valid_states().map(|(_, state)| state.bulbs.to_string()).collect();
        let expected: Vec<_> = Some(state.clone()).into_iter().filter(|state| !state.is_empty()).collect();
        assert_eq!(valid_states, expected, "state {raw}");
    }
}

#[test]
fn a_unit_alone_reports_no_lights_and_its_frames_prove_the_bus_alive() {
    let settings = profile("v2x_unit").gateway.clone();
    let ids: Vec<_> = settings.relevant_ids(BusIndex(0)).iter().map(IdMatch::to_string).collect();
    assert_eq!(ids, ["5A0", "5A1", "5A2"]);
    let mut gateway = Gateway::new(settings, LinkState::Up, at_ms(0));
    let status = CanInput::Frame { bus: BusIndex(0), frame: frame("5A2 2 0|3@1=1"), stamp: at_ms(5).wall };
    gateway.handle(status, at_ms(5));
    let mut statuses = Vec::new();
    while let Some(output) = gateway.poll_output() {
        let Output::Diagnostics { diagnostics, .. } = output else { panic!("{output:?}") };
        statuses.extend(diagnostics.statuses);
    }
    let tasks: Vec<_> = statuses.iter().map(|status| status.task.as_str()).collect();
    assert!(!tasks.is_empty() && tasks.iter().all(|task| task.contains("can")), "{tasks:?}");
    assert_eq!(statuses.last().unwrap().level, Level::Ok);
}
