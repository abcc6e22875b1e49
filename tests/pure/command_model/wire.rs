//! What is on the wire: counters, checksums, own frames and others', frames that could not be sent.

use can_signal::can::frame::CanId;
use can_signal::can::frame::Frame;
use can_signal::can::link::BusIndex;
use can_signal::validation::integrity::{IntegrityChecker, MessageIntegrity, Reject};
use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::command::Turn;
use gateway_core::command::arbitration::VehicleRequest;
use gateway_core::command::input::CommandInput;
use gateway_core::command::sender::{FrameOrigin, SendFailure, Sender};

use crate::pure::command_model::bench::{Bench, config};
use crate::pure::command_model::closed_loop::shipped;
use crate::pure::vehicles::payload::put;
use crate::support::clock::MS;
use crate::support::command_vehicle::PROFILE;
use crate::support::vehicle_facts::{CommandChecksum, VEHICLES};

/// CRC-8 SAE J1850, bit by bit.
fn j1850(data: &[u8]) -> u8 {
    let step = |crc: u8| if crc & 0x80 == 0 { crc << 1 } else { crc << 1 ^ 0x1D };
    !data.iter().fold(0xFF, |crc, byte| (0..8).fold(crc ^ byte, |crc, _| step(crc)))
}

/// CRC of Hyundai and Kia of a message of 32 bytes on CAN FD, bit by bit: over the bytes behind it and the
/// identifier.
fn hyundai_fd(data: &[u8], id: u16) -> u16 {
    let step = |crc: u16| if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x1021 };
    let covered = data[2..].iter().copied().chain(id.to_le_bytes());
    covered.fold(0, |crc, byte| (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| step(crc))) ^ 0x9F5B
}

#[test]
fn over_ten_thousand_frames_the_counter_is_unbroken_and_the_receiver_trusts_every_frame() {
    let command = config("tx = \"on\"\nturn_timeout_ms = 3600000\nhazard_timeout_ms = 3600000", PROFILE);
    let protection = command.binding.messages[0].protection.clone().unwrap();
    let mut bench = Bench::new(command);
    let mut at_ms = 0;
    while bench.sent.len() < 10_000 {
        bench.mode(1);
        bench.turn(u8::try_from(1 + at_ms / 700 % 3).unwrap());
        bench.hazard(u8::try_from(1 + at_ms / 2900 % 2).unwrap());
        bench.settle();
        at_ms += 500;
        bench.pass_until(at_ms * MS);
    }
    let rules = MessageIntegrity { length: Some(8), protection, window: None, forget_after: None };
    let mut checker = IntegrityChecker::new(rules);
    for (index, (at, frame)) in bench.sent.iter().enumerate() {
        let data = frame.data();
        assert_eq!(usize::from(data[6] & 15), index % 16, "frame {index}");
        assert_eq!(data[7], j1850(&data[..7]), "frame {index}");
        let verdict = checker.check(frame, MonoTime::from_nanos(*at));
        assert_eq!(verdict, if index == 0 { Err(Reject::Initial) } else { Ok(()) }, "frame {index}");
    }
}

#[test]
fn a_frame_that_was_not_sent_leaves_no_gap_and_is_sent_again() {
    let mut bench = Bench::new(config("tx = \"on\"", PROFILE));
    let (mut wire, mut failed) = (Vec::new(), 0);
    for ms in 0..3_000 {
        bench.now_ns = ms * MS;
        if ms % 100 == 0 {
            bench.mode(1);
            bench.turn(2);
        }
        for frame in bench.settle() {
            if (1_000..1_180).contains(&ms) {
                let failure = [SendFailure::QueueFull, SendFailure::Refused(100)][failed % 2];
                failed += 1;
                bench.take(CommandInput::SendFailed { frame, failure });
            } else {
                wire.push((ms, frame.frame().data()[6] & 15));
            }
        }
        if ms == 1_050 {
            assert_eq!(bench.status_texts()[2], (Level::Warn, "frames are delayed".to_owned()));
        }
        if ms == 1_170 {
            assert_eq!(bench.status_texts()[2], (Level::Error, "frames cannot be sent".to_owned()));
        }
    }
    // Not as many as the counter has values.
    assert_eq!(failed, 14, "every 10 ms, not faster");
    assert!(wire.windows(2).all(|pair| pair[1].1 == (pair[0].1 + 1) % 16), "{wire:?}");
    assert!(wire.iter().any(|(ms, _)| (1_180..1_200).contains(ms)), "at once when there is room");
    assert_eq!(bench.status_texts()[2].0, Level::Ok);
    let (_, counts) = bench.flow.send_counts().next().unwrap();
    assert_eq!((counts.queue_full, counts.refused, counts.sent), (7, 7, u64::try_from(wire.len()).unwrap()));
}

#[test]
fn own_frames_are_known_again_and_others_with_our_identifier_are_an_error() {
    let mut bench = Bench::new(config("tx = \"on\"", PROFILE));
    bench.mode(1);
    let own = *bench.settle()[0].frame();
    let now = bench.now();
    let hear =
        |bench: &mut Bench, bus: u8, frame: &Frame| bench.flow.classify_frame(BusIndex(bus), frame, now);
    assert_eq!(hear(&mut bench, 0, &own), FrameOrigin::Own);
    assert_eq!(hear(&mut bench, 0, &own), FrameOrigin::Foreign, "it was sent once");
    let vehicle = Frame::classic(CanId::Standard(560), &[0; 4]).unwrap();
    assert_eq!(hear(&mut bench, 0, &vehicle), FrameOrigin::Vehicle);
    assert_eq!(hear(&mut bench, 1, &own), FrameOrigin::Vehicle, "another bus");
    let same_number = Frame::classic(CanId::Extended(304), own.data()).unwrap();
    assert_eq!(hear(&mut bench, 0, &same_number), FrameOrigin::Vehicle);
    bench.settle();
    assert_eq!(bench.status_texts()[2], (Level::Error, "conflicting sender of CMD".to_owned()));
    bench.pass_until(1_100 * MS);
    assert_ne!(bench.status_texts()[2].1, "conflicting sender of CMD");
}

#[test]
fn the_shipped_profiles_send_what_public_facts_demand() {
    let mut wrong = Vec::new();
    for (profile, vehicle) in &*VEHICLES {
        let Some(facts) = &vehicle.command else { continue };
        let command = shipped(profile, "").command.unwrap();
        let mut messages = command.binding.messages.iter();
        let message = messages.find(|message| message.permission.id().to_string() == facts.message).unwrap();
        for [turn, hazard, frame, _] in &facts.requests {
            let request = VehicleRequest { turn: turn_of(turn), hazard: hazard_of(hazard) };
            let mut sender = Sender::new(message);
            let frames = (0..3).map(|index| {
                let at = MonoTime::from_millis(index * 1000);
                sender.settle(message, message.contents(request, false), at).unwrap()
            });
            // The last one of three, so the counter is 2.
            let sent = *frames.last().unwrap().frame();
            let digits = frame.replace('x', "0");
            let bytes = digits.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap());
            let mut expected: Vec<_> = bytes.collect();
            if let Some(counter) = &facts.counter {
                put(&mut expected, &format!("{counter}=2"));
                let data = &expected[..7];
                let id = sent.id().number();
                let sum = |bytes: &[u8]| bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
                match facts.checksum.unwrap() {
                    CommandChecksum::J1850 => expected[7] = j1850(data),
                    CommandChecksum::Sum => expected[7] = sum(&id.to_be_bytes()).wrapping_add(sum(data)),
                    CommandChecksum::HyundaiFd => {
                        let crc = hyundai_fd(&expected, id.try_into().unwrap());
                        expected[..2].copy_from_slice(&crc.to_le_bytes());
                    }
                }
            }
            if sent.data() != expected.as_slice() || sent.id().to_string() != facts.message {
                wrong.push(format!("{profile} {request:?}: {sent}, not {} {expected:02X?}", facts.message));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

fn turn_of(text: &str) -> Option<Turn> {
    match text {
        "-" => None,
        "off" => Some(Turn::Off),
        "left" => Some(Turn::Left),
        "right" => Some(Turn::Right),
        _ => panic!("{text}"),
    }
}

fn hazard_of(text: &str) -> Option<bool> {
    match text {
        "-" => None,
        "off" => Some(false),
        "on" => Some(true),
        _ => panic!("{text}"),
    }
}

#[test]
fn a_message_with_an_e2e_profile_is_trusted_by_the_receiver() {
    let profile = r#"name = "Sealed"
bus.body.dbc = "bench.dbc"
turn.fitted = false
hazard.from = "not_fitted"
[[command.message]]
name = "SEALED"
period_ms = 20
e2e = { profile = "1A", data_id = 0x123 }
[command.message.turn]
off = { SEALED_REQ = 0 }
left = { SEALED_REQ = 1 }
right = { SEALED_REQ = 2 }
hazard = { SEALED_REQ = 3 }
none = { SEALED_REQ = 7 }
"#;
    let command = config("tx = \"on\"\ncontrol_mode_timeout_ms = 60000", profile);
    let protection = command.binding.messages[0].protection.clone().unwrap();
    let mut bench = Bench::new(command);
    bench.mode(1);
    bench.turn(2);
    bench.settle();
    bench.pass_until(2_000 * MS);
    let mut checker = IntegrityChecker::new(MessageIntegrity {
        length: Some(8),
        protection,
        window: None,
        forget_after: None,
    });
    assert!(bench.sent.len() > 100);
    for (index, (at, frame)) in bench.sent.iter().enumerate() {
        assert_eq!(usize::from(frame.data()[1] & 15), index % 15, "profile 1 counts from 0 to 14");
        let trusted = checker.check(frame, MonoTime::from_nanos(*at)).is_ok();
        assert_eq!(trusted, index > 0, "frame {index}");
    }
    assert_eq!(bench.sent[0].1.data()[2] & 7, 1);
}
