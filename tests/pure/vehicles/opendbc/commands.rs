//! The frames that command Hyundai and Kia on CAN FD, byte for byte against opendbc: those of its own
//! function for the two sides, and its packer's for the hazard lights, which that function never requests.

use gateway_base::time::MonoTime;
use gateway_core::command::Turn;
use gateway_core::command::arbitration::VehicleRequest;
use gateway_core::command::sender::Sender;
use serde_json::{Value, json};

use super::ask;
use crate::pure::vehicles::profile;
use crate::support::prerequisite::{opendbc_python, require};

const DBC: &str = "hyundai_canfd_generated";
/// More frames of each message than its counter has values.
const FRAMES: usize = 600;
const HAZARD: u64 = 1;

const NONE: VehicleRequest = VehicleRequest { turn: None, hazard: None };
const OFF: VehicleRequest = VehicleRequest { turn: Some(Turn::Off), hazard: Some(false) };
const LEFT: VehicleRequest = VehicleRequest { turn: Some(Turn::Left), hazard: Some(false) };
const RIGHT: VehicleRequest = VehicleRequest { turn: Some(Turn::Right), hazard: None };
const BOTH: VehicleRequest = VehicleRequest { turn: Some(Turn::Left), hazard: Some(true) };

/// Our frames of a message as identifier and digits, with one request after the other.
fn ours(name: &str, requests: &[VehicleRequest]) -> Vec<(u64, String)> {
    let mut messages = profile("hyundai_canfd").command_binding.messages.iter();
    let message = messages.find(|message| message.name == name).unwrap();
    let mut sender = Sender::new(message);
    let frames = requests.iter().cycle().take(FRAMES).zip(0..).map(|(request, index)| {
        let at = MonoTime::from_millis(index * 10);
        let frame = sender.settle(message, message.contents(*request, false), at).unwrap();
        assert!(frame.frame().is_fd());
        let digits = frame.frame().data().iter().map(|byte| format!("{byte:02x}")).collect();
        (frame.frame().id().number().into(), digits)
    });
    frames.collect()
}

/// opendbc's frames of a message, from all that it has made.
fn theirs(answer: &Value, id: u64) -> Vec<(u64, String)> {
    let frames = answer["frames"].as_array().unwrap().iter();
    let pairs = frames.map(|frame| {
        let [.., id, digits] = frame.as_array().unwrap().as_slice() else { panic!("{frame}") };
        (id.as_u64().unwrap(), digits.as_str().unwrap().to_owned())
    });
    pairs.filter(|(known, _)| *known == id).collect()
}

#[test]
fn the_commands_of_hyundai_and_kia_are_those_of_opendbc() {
    let python = require!(opendbc_python());
    let requests = [NONE, LEFT, OFF, RIGHT, LEFT, LEFT, RIGHT];
    let sides = requests.iter().cycle().take(FRAMES);
    let sides: Vec<_> =
        sides.map(|request| [request.turn == Some(Turn::Left), request.turn == Some(Turn::Right)]).collect();
    let hazard: Vec<_> =
        (0..FRAMES).map(|index| json!([index * 10, "SPAS2", { "BLINKER_CONTROL": HAZARD }])).collect();
    let answers = ask(
        &python,
        &[
            json!({ "dbc": DBC, "requested": sides }),
            json!({ "dbc": DBC, "platform": null, "length_ms": 0, "frames": hazard }),
        ],
    );
    let [turn, hazard] = answers.as_slice() else { panic!("{answers:?}") };
    assert_eq!(ours("SPAS2", &requests), theirs(turn, 0x16A));
    assert_eq!(ours("SPAS1", &requests), theirs(turn, 0x165));
    assert_eq!(ours("SPAS2", &[BOTH]), theirs(hazard, 0x16A));
}
