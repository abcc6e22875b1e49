//! Counters and checksums of the shipped profiles, computed byte by byte as a second opinion; frames
//! without the right ones change nothing.

use std::collections::BTreeSet;

use signal_gateway::core::can::frame::{CanId, Frame};
use signal_gateway::core::validation::integrity::Protection;

use crate::pure::vehicles::payload::frame;
use crate::pure::vehicles::{profile, profile_names};
use crate::support::clock::at_ms;
use crate::support::virtual_gateway::VirtualGateway;

/// The frame as its sender would send it for the `count`th time; unchanged when its message has
/// neither counter nor checksum.
pub(crate) fn protect(frame: &Frame, count: u8) -> Frame {
    let mut data = frame.data().to_vec();
    match frame.id() {
        // Honda: two bits of counter, a nibble that makes all nibbles 8.
        CanId::Standard(id @ (0x294 | 0x326)) => {
            data[7] = data[7] & 0xC0 | ((count % 4) << 4);
            let id = i32::from(id);
            data[7] |= nibble(8 - (id & 15) - (id >> 4 & 15) - (id >> 8) - nibbles(&data));
        }
        // PSA: of this message 4.
        CanId::Standard(0x452) => {
            data[3] = data[3] & 0x0F | ((count % 16) << 4);
            data[5] &= 0xF0;
            data[5] |= nibble(4 - nibbles(&data));
        }
        CanId::Standard(0x091) => {
            data[3] = data[3] & 0xF0 | (count % 16);
            data[4] = data[..4].iter().fold(0xFF, |rest: u8, byte| rest.wrapping_sub(*byte));
        }
        // Tesla, and Subaru of the global platform (nothing that VW PQ reads under 0x390): address and bytes in a sum.
        CanId::Standard(id @ (0x311 | 0x390)) => {
            data[1] = data[1] & 0xF0 | (count % 16);
            let [high, low] = id.to_be_bytes();
            data[0] = data[1..].iter().fold(high.wrapping_add(low), |sum, byte| sum.wrapping_add(*byte));
        }
        // VW, New Eagle and Rivian: a nibble of counter.
        CanId::Standard(0x3D4 | 0x658 | 0x235) => data[1] = data[1] & 0xF0 | (count % 16),
        CanId::Extended(0x1F14) => data[7] = data[7] & 0xF0 | (count % 16),
        // Hyundai i30.
        CanId::Standard(0x690) => data[6] = data[6] & 0xC3 | ((count % 16) << 2),
        // Mercedes and Tesla Model S.
        CanId::Standard(0x045 | 0x238) => data[6] = data[6] & 0x0F | ((count % 16) << 4),
        // Volvo S60.
        CanId::Extended(0x0261_300A) => data[0] = data[0] & 0x3F | ((count % 4) << 6),
        CanId::Standard(_) | CanId::Extended(_) => {}
    }
    let is_fd = data.len() > 8;
    let protected = if is_fd { Frame::fd(frame.id(), &data) } else { Frame::classic(frame.id(), &data) };
    protected.unwrap()
}

fn nibbles(data: &[u8]) -> i32 {
    data.iter().map(|byte| i32::from(byte >> 4) + i32::from(byte & 15)).sum()
}

fn nibble(sum: i32) -> u8 {
    u8::try_from(sum.rem_euclid(16)).unwrap()
}

/// Profile, a frame with left, its counter's values, and whether it has a checksum.
const PROTECTED: [(&str, &str, u8, bool); 13] = [
    ("acura_ilx_2016", "294 8 5|1@0=1", 4, true),
    ("honda_civic_hatchback_2017", "326 8 26|1@0=1", 4, true),
    ("honda_civic_touring_2016", "326 8 26|1@0=1", 4, true),
    ("mazda_2017", "091 8 13|1@0=1", 16, true),
    ("mercedes_e350_2010", "045 8 16|1@0=1", 16, false),
    ("new_eagle_dbw", "00001F14 8 4|3@1=1", 16, false),
    ("psa_aee2010", "452 6 5|2@0=2", 16, true),
    ("rivian_r1", "235 8 40|2@0=1", 16, false),
    ("tesla_model3_party", "311 7 25|2@0=1", 16, true),
    ("tesla_model_s", "045 8 16|2@1=1", 16, false),
    ("tesla_model_s_powertrain", "238 8 16|2@1=1", 16, false),
    ("volvo_s60_2002", "0261300A 8 34|2@1=2", 4, false),
    ("vw_meb", "3D4 8 12|1@1=1", 16, false),
];

/// Lamps, known only after an observation time: profile, a dark frame, and whether it has a checksum.
const PROTECTED_LAMPS: [(&str, &str, bool); 2] =
    [("hyundai_i30_2014", "690 8", false), ("subaru_global", "390 8", true)];

/// What the turn topic carries after the frames, 20 ms apart.
fn turn_after(gateway: &mut VirtualGateway, from_ms: u64, frames: &[Frame]) -> Option<&'static str> {
    gateway.outputs.clear();
    for (ms, frame) in (from_ms..).step_by(20).zip(frames) {
        gateway.now = at_ms(ms);
        gateway.receive(frame.id(), frame.data());
    }
    gateway.turn_states().last().copied().filter(|state| *state != "stops")
}

fn fresh(profile_name: &str) -> VirtualGateway {
    VirtualGateway::new(profile(profile_name).gateway.clone())
}

#[test]
fn the_protected_profiles_are_these() {
    let protected = |name: &String| {
        let settings = profile(name);
        let mut messages = settings.gateway.lights.table.messages.iter();
        messages.any(|message| {
            let integrity = message.integrity.as_ref();
            integrity.is_some_and(|integrity| {
                !matches!(integrity.protection, Protection::Fields { checksum: None, counter: None })
            })
        })
    };
    let protected: BTreeSet<_> = profile_names().into_iter().filter(protected).collect();
    let lamps = PROTECTED_LAMPS.iter().map(|(name, ..)| *name);
    let known = PROTECTED.iter().map(|(name, ..)| *name).chain(lamps);
    assert_eq!(protected, known.map(str::to_owned).collect());
    for (name, _, _, has_checksum) in PROTECTED {
        let settings = profile(name);
        let integrity =
            settings.gateway.lights.table.messages.iter().find_map(|message| message.integrity.clone());
        let Protection::Fields { checksum, counter } = integrity.unwrap().protection else {
            panic!("{name}")
        };
        assert_eq!((checksum.is_some(), counter.is_some()), (has_checksum, true), "{name}");
    }
}

#[test]
fn a_running_counter_is_valid_from_its_second_frame_on_and_across_its_wrap() {
    for (name, text, _, _) in PROTECTED {
        let frames: Vec<_> = (0..40).map(|count| protect(&frame(text), count)).collect();
        let mut gateway = fresh(name);
        assert_eq!(turn_after(&mut gateway, 10, &frames[..1]), None, "{name}");
        assert_eq!(turn_after(&mut gateway, 30, &frames[1..]), Some("ENABLE_LEFT"), "{name}");
        let counts: u64 = gateway
            .gateway
            .lights()
            .binding()
            .table
            .messages
            .iter()
            .enumerate()
            .map(|(index, _)| {
                let index = signal_gateway::core::validation::table::MessageIndex(index);
                gateway
                    .gateway
                    .lights()
                    .observations()
                    .integrity_counts(index)
                    .map_or(0, |counts| counts.trusted)
            })
            .sum();
        assert_eq!(counts, 39, "{name}");
    }
}

#[test]
fn a_counter_that_repeats_or_decreases_is_rejected() {
    for (name, text, values, _) in PROTECTED {
        let at = |count| protect(&frame(text), count);
        assert_eq!(turn_after(&mut fresh(name), 10, &[at(2), at(2), at(2)]), None, "{name}");
        assert_eq!(turn_after(&mut fresh(name), 10, &[at(3), at(2)]), None, "{name}");
        let lost = if values == 4 { 1 } else { 3 };
        assert_eq!(turn_after(&mut fresh(name), 10, &[at(0), at(1 + lost)]), Some("ENABLE_LEFT"), "{name}");
        assert_eq!(turn_after(&mut fresh(name), 10, &[at(0), at(2 + lost)]), None, "{name}");
        let then = [at(0), at(2 + lost), at(3 + lost), at(4 + lost)];
        assert_eq!(turn_after(&mut fresh(name), 10, &then), Some("ENABLE_LEFT"), "{name}: comes back");
    }
}

#[test]
fn with_a_checksum_each_frame_with_a_changed_bit_is_rejected() {
    for (name, text, _, has_checksum) in PROTECTED {
        let (first, second) = (protect(&frame(text), 0), protect(&frame(text), 1));
        // Mazda's covers the first four bytes, and itself.
        let covered = if name.starts_with("mazda") { 40 } else { second.data().len() * 8 };
        for bit in (0..covered).filter(|_| has_checksum) {
            let mut data = second.data().to_vec();
            data[bit / 8] ^= 1 << (bit % 8);
            let changed = Frame::classic(second.id(), &data).unwrap();
            assert_eq!(turn_after(&mut fresh(name), 10, &[first, changed]), None, "{name} bit {bit}");
        }
    }
}

#[test]
fn lamps_are_observed_in_valid_frames_only() {
    for (name, text, has_checksum) in PROTECTED_LAMPS {
        let right: Vec<_> = (0..80).map(|count| protect(&frame(text), count)).collect();
        assert_eq!(turn_after(&mut fresh(name), 10, &right), Some("DISABLE"), "{name}");
        let standing = vec![right[0]; 80];
        assert_eq!(turn_after(&mut fresh(name), 10, &standing), None, "{name}");
        for bit in (0..64).filter(|_| has_checksum) {
            let changed = right.iter().map(|frame| {
                let mut data = frame.data().to_vec();
                data[bit / 8] ^= 1 << (bit % 8);
                Frame::classic(frame.id(), &data).unwrap()
            });
            assert_eq!(
                turn_after(&mut fresh(name), 10, &changed.collect::<Vec<_>>()),
                None,
                "{name} bit {bit}"
            );
        }
    }
}
