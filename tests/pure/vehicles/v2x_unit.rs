//! The profile of a V2X unit: frames written bit by bit, and the traffic-light states that are used.

use signal_gateway::core::can::bus::Bus;
use signal_gateway::core::can::frame::{CanId, Frame};
use signal_gateway::core::can::input::CanInput;
use signal_gateway::core::can::link::{BusIndex, LinkState};
use signal_gateway::core::diagnostics::Level;
use signal_gateway::core::gateway::Gateway;
use signal_gateway::core::gateway::event::Output;
use signal_gateway::core::time::MonoTime;
use signal_gateway::core::traffic_light::v2i_reception::{Settled, V2iReception};
use signal_gateway::core::validation::table::MessageIndex;

use crate::pure::vehicles::payload::frame;
use crate::pure::vehicles::profile;
use crate::support::clock::at_ms;

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
        let message = messages.iter().position(|message| message.id == frame.id()).unwrap();
        if self.buses[0].frame_arrived(at_ms(ms).mono) {
            let (message, now) = (MessageIndex(message), at_ms(ms));
            self.reception.frame_arrived(message, frame, now.wall, &self.buses, now);
        }
        self.settle(ms)
    }

    /// What is to be done now: `34806 red solidOn circle`, or `-34806` for a removal.
    fn settle(&mut self, ms: u64) -> Vec<String> {
        let Settled { changes, .. } = self.reception.settle(&self.buses, at_ms(ms));
        let text = |id: i64, state: String| format!("{id} {state}");
        let changes = changes.into_iter().map(|change| match change.state {
            None => format!("-{}", change.id),
            Some(state) if state.confidence < 1.0 => {
                text(change.id, format!("{} at {}", state.bulbs, state.confidence))
            }
            Some(state) => text(change.id, state.bulbs.to_string()),
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

    fn finding(&self, id: i64) -> String {
        let finding = self.reception.findings().find(|finding| finding.id == id).unwrap();
        self.reception.finding_text(finding, &self.buses)
    }

    fn status_value(&self, key: &str, ms: u64) -> String {
        let status = self.reception.status("gw", &self.buses, at_ms(ms).mono);
        status.values.into_iter().find(|(name, _)| *name == key).unwrap().1
    }
}

/// Group 1 of intersection 1201 is red; with another state instead of the 3.
const RED: &str = "5A1 8 0|16@1=1201 16|8@1=1 24|4@1=3 28|1@1=1 32|7@1=100";
/// Group 2 has protected green.
const GREEN: &str = "5A1 8 0|16@1=1201 16|8@1=2 24|4@1=6 28|1@1=1 32|7@1=50";

#[test]
fn signals_of_their_own_are_read_each_for_its_group() {
    let mut bench = Bench::new();
    assert_eq!(bench.frame(0, "5A2 2 0|3@1=1"), [""; 0]);
    assert_eq!(bench.frame(1, "5A0 8 0|4@1=1 4|4@1=3"), [""; 0], "its counter has nothing to follow");
    let both = ["34806 red solidOn circle", "34807 green solidOn left"];
    assert_eq!(bench.frame(100, "5A0 8 0|4@1=1 4|4@1=3"), both);
    assert_eq!(bench.frame(200, "5A0 8 0|4@1=1 4|4@1=3"), [""; 0], "nothing new");
    let received: Vec<_> = bench.reception.valid_states().map(|(_, state)| state.received.at).collect();
    assert_eq!(received, [MonoTime::from_millis(200); 2]);
    let state = "34806 yellow solidOn circle, red solidOn circle";
    assert_eq!(bench.frame(300, "5A0 8 0|4@1=2 4|4@1=3"), [state]);
    assert_eq!(bench.frame(400, "5A0 8 0|4@1=5 4|4@1=3"), ["34806 green solidOff circle"]);
}

#[test]
fn what_is_not_known_is_removed_and_not_held() {
    for (raw, finding) in [
        (15, "34806: V2X_NEXT.AHEAD = 15 (0xF) means not available"),
        (14, "34806: V2X_NEXT.AHEAD = 14 (0xE) means fault"),
        (9, "34806: V2X_NEXT.AHEAD = 9 is not a defined value"),
    ] {
        let mut bench = Bench::started("5A0 8 0|4@1=1 4|4@1=3");
        assert_eq!(bench.frame(100, &format!("5A0 8 0|4@1={raw} 4|4@1=3")), ["-34806"], "{raw}");
        assert_eq!(bench.finding(34806), finding);
        assert_eq!(bench.status_value("undefined_count", 100), u8::from(raw == 9).to_string());
        assert_eq!(bench.frame(200, "5A0 8 0|4@1=1 4|4@1=3"), ["34806 red solidOn circle"], "{raw}");
    }
}

#[test]
fn a_silent_message_is_removed_at_its_deadline() {
    let mut bench = Bench::started("5A0 8 0|4@1=1 4|4@1=3");
    bench.frame(400, "5A2 2 0|3@1=1");
    // 5 x 100 ms since the frame at 2 ms.
    let deadline = bench.reception.next_deadline(at_ms(400).mono).unwrap();
    assert_eq!(deadline, MonoTime::from_nanos(502_000_001));
    assert_eq!(bench.settle(502), [""; 0]);
    assert_eq!(bench.settle(503), ["-34806", "-34807"]);
    assert!(bench.finding(34806).ends_with("V2X_NEXT is stale, silent for more than 500 ms"));
    let status = bench.reception.status("gw", &bench.buses, at_ms(503).mono);
    assert_eq!((status.name.as_str(), status.level), ("gw: v2i_traffic_lights", Level::Warn));
}

#[test]
fn a_lost_link_removes_everything_and_brings_nothing_back() {
    let mut bench = Bench::started(RED);
    assert_eq!(bench.reception.valid_states().count(), 1);
    bench.buses[0].set_link(LinkState::Down);
    bench.reception.forget_bus(BusIndex(0));
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
    let mut bench = Bench::started("5A0 8 0|4@1=1 4|4@1=3");
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
fn a_status_that_is_not_good_takes_the_states_with_it() {
    let mut bench = Bench::started("5A0 8 0|4@1=1 4|4@1=3");
    assert_eq!(bench.frame(50, "5A2 2 0|3@1=2"), ["-34806", "-34807"]);
    assert_eq!(bench.finding(34807), "34807: V2X_STATUS.RADIO = 2 reports that states cannot be used");
    assert_eq!(bench.frame(60, "5A2 2 0|3@1=1").len(), 2, "its own frames are young enough");
    assert_eq!(bench.frame(70, "5A2 2 0|3@1=7"), ["-34806", "-34807"]);
    assert_eq!(bench.finding(34807), "34807: V2X_STATUS.RADIO = 7 is not a defined value");
    let mut bench = Bench::started("5A0 8 0|4@1=1 4|4@1=3");
    for ms in (100..1500).step_by(100) {
        bench.frame(ms, "5A0 8 0|4@1=1 4|4@1=3");
    }
    assert_eq!(bench.settle(1501), ["-34806", "-34807"], "the radio's status is stale");
    let mut bench = Bench::started(RED);
    assert_eq!(bench.frame(10, &RED.replace("28|1@1=1", "28|1@1=0")), ["-35101"], "by its own frame");
}

#[test]
fn a_cycling_message_carries_each_group_with_its_confidence() {
    let mut bench = Bench::started(RED);
    assert_eq!(bench.frame(50, GREEN), ["35102 green solidOn left at 0.5"]);
    assert_eq!(
        bench.frame(100, &RED.replace("32|7@1=100", "32|7@1=127")),
        [""; 0],
        "confidence not stated: full"
    );
    assert_eq!(bench.frame(150, &RED.replace("32|7@1=100", "32|7@1=101")), ["-35101"]);
    assert_eq!(bench.finding(35101), "35101: V2X_SPAT.CONFIDENCE = 101 (0x65) is not a defined value");
    assert_eq!(bench.frame(200, &RED.replace("1201", "1202")), ["35201 red solidOn circle"]);
    for stranger in [RED.replace("1201", "1203"), RED.replace("16|8@1=1", "16|8@1=3")] {
        assert_eq!(bench.frame(250, &stranger), [""; 0]);
    }
    assert_eq!(bench.reception.counts().unmapped, 2);
    assert_eq!(bench.status_value("unmapped_count", 250), "2");
    assert_eq!(bench.status_value("known_groups", 250), "2");
}

#[test]
fn every_state_of_the_standard_is_read() {
    for (raw, state) in [
        (0, ""),
        (1, "unknown solidOff circle"),
        (2, "red flashing circle"),
        (3, "red solidOn circle"),
        (4, "red solidOn circle"),
        (5, "green solidOn circle"),
        (6, "green solidOn left"),
        (7, "yellow solidOn circle"),
        (8, "yellow solidOn left"),
        (9, "yellow flashing circle"),
        (10, ""),
    ] {
        let bench = Bench::started(&GREEN.replace("24|4@1=6", &format!("24|4@1={raw}")));
        let valid_states: Vec<_> =
            bench.reception.valid_states().map(|(_, state)| state.bulbs.to_string()).collect();
        let expected: Vec<_> = (!state.is_empty()).then(|| state.to_owned()).into_iter().collect();
        assert_eq!(valid_states, expected, "{raw}");
    }
}

#[test]
fn a_group_that_is_not_received_again_is_removed_while_the_message_continues() {
    let mut bench = Bench::started(RED);
    let mut removed = Vec::new();
    for ms in (50..=2050).step_by(50) {
        for change in bench.frame(ms, GREEN) {
            removed.push((ms, change));
        }
    }
    let expected = [(50, "35102 green solidOn left at 0.5"), (2050, "-35101")];
    assert_eq!(removed, expected.map(|(ms, change)| (ms, change.to_owned())));
    assert_eq!(bench.finding(35101), "35101: not received again");
    let status = bench.reception.status("gw", &bench.buses, at_ms(2050).mono);
    assert!(!status.message.contains("35101"), "out of range is as it should be: {}", status.message);
}

#[test]
fn the_limit_of_a_group_is_a_deadline_too() {
    let mut bench = Bench::started(RED);
    for ms in (200..=2000).step_by(200) {
        bench.frame(ms, GREEN);
    }
    let deadline = bench.reception.next_deadline(at_ms(2000).mono).unwrap();
    assert_eq!(deadline, MonoTime::from_nanos(2_002_000_001));
    assert_eq!(bench.settle(2002), [""; 0]);
    assert_eq!(bench.settle(2003), ["-35101"]);
}

#[test]
fn a_message_that_broke_off_updates_only_what_it_carries_again() {
    let mut bench = Bench::started(RED);
    // Its limit is 250 ms, that of a group 2 s.
    assert_eq!(bench.settle(260), ["-35101"]);
    for ms in [350, 400] {
        assert_eq!(bench.frame(ms, GREEN), [""; 0], "the counter is not in sequence yet");
    }
    assert_eq!(bench.frame(450, GREEN), ["35102 green solidOn left at 0.5"]);
    assert_eq!(bench.finding(35101), "35101: not received yet");
    assert_eq!(bench.frame(500, RED), ["35101 red solidOn circle"]);
}

#[test]
fn a_unit_alone_reports_no_lights_and_its_frames_prove_the_bus_alive() {
    let settings = profile("v2x_unit").gateway.clone();
    let ids: Vec<_> = settings.relevant_ids(BusIndex(0)).iter().map(CanId::to_string).collect();
    assert_eq!(ids, ["5A0", "5A1", "5A2"]);
    let mut gateway = Gateway::new(settings, LinkState::Up, at_ms(0));
    let status = CanInput::Frame { bus: BusIndex(0), frame: frame("5A2 2 0|3@1=1"), stamp: at_ms(5).wall };
    gateway.handle(status, at_ms(5));
    let mut statuses = Vec::new();
    while let Some(output) = gateway.poll_output() {
        let Output::Diagnostics { diagnostics, .. } = output else { panic!("{output:?}") };
        statuses.extend(diagnostics.statuses);
    }
    let names: Vec<_> = statuses.iter().map(|status| status.name.as_str()).collect();
    assert!(!names.is_empty() && names.iter().all(|name| name.contains("can")), "{names:?}");
    assert_eq!(statuses.last().unwrap().level, Level::Ok);
}
