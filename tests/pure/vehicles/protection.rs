//! Counters and checksums of the shipped profiles, computed byte by byte as a second opinion; frames
//! without the right ones change nothing.

use std::collections::BTreeSet;

use can_signal::can::frame::Frame;
use can_signal::validation::integrity::Protection;
use can_signal::validation::table::MessageIndex;

use crate::pure::vehicles::payload::{frame, put};
use crate::pure::vehicles::{profile, profile_names};
use crate::support::clock::at_ms;
use crate::support::vehicle_facts::{
    ChecksumKind, ProtectedMessage, ProtectionFacts, VEHICLES, VehicleFacts,
};
use crate::support::virtual_gateway::VirtualGateway;

/// The frame as its sender would send it for the `count`th time; unchanged when its message has neither
/// counter nor checksum.
pub(crate) fn protect(vehicle: &VehicleFacts, frame: &Frame, count: u8) -> Frame {
    let mut messages = vehicle.protection.iter().flat_map(|protection| &protection.messages);
    let Some(message) = messages.find(|message| message.id == frame.id().to_string()) else {
        return *frame;
    };
    let mut data = frame.data().to_vec();
    put(&mut data, &format!("{}={}", message.counter, count % counter_values(message)));
    let id = frame.id().number().to_be_bytes();
    let sum = |bytes: &[u8]| bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
    match message.checksum {
        None => {}
        // All nibbles make 8, with those of the identifier.
        Some(ChecksumKind::Honda) => set_last_nibble(&mut data, 8 - nibbles(&id)),
        Some(ChecksumKind::Psa) => set_last_nibble(&mut data, 4),
        Some(ChecksumKind::Mazda) => data[4] = !sum(&data[..4]),
        Some(ChecksumKind::Sum) => data[0] = sum(&data[1..]).wrapping_add(sum(&id)),
    }
    Frame::classic(frame.id(), &data).unwrap()
}

fn counter_values(message: &ProtectedMessage) -> u8 {
    1 << message.counter.split(['|', '@']).nth(1).unwrap().parse::<u32>().unwrap()
}

fn nibbles(data: &[u8]) -> i32 {
    data.iter().map(|byte| i32::from(byte >> 4) + i32::from(byte & 15)).sum()
}

/// Sets the last nibble so that all of them make this sum.
fn set_last_nibble(data: &mut [u8], sum: i32) {
    let last = data.len() - 1;
    data[last] &= 0xF0;
    data[last] |= u8::try_from((sum - nibbles(data)).rem_euclid(16)).unwrap();
}

/// A vehicle with protected messages, and a frame of the first.
struct Protected {
    name: &'static str,
    vehicle: &'static VehicleFacts,
    facts: &'static ProtectionFacts,
    frame: Frame,
}

impl Protected {
    /// Those with such a frame.
    fn all(frame_of: fn(&ProtectionFacts) -> Option<&String>) -> impl Iterator<Item = Self> {
        VEHICLES.iter().filter_map(move |(name, vehicle)| {
            let facts = vehicle.protection.as_ref()?;
            Some(Self { name, vehicle, facts, frame: frame(frame_of(facts)?) })
        })
    }

    fn with_left() -> impl Iterator<Item = Self> {
        Self::all(|facts| facts.left.as_ref())
    }

    fn with_dark_lamps() -> impl Iterator<Item = Self> {
        Self::all(|facts| facts.dark.as_ref())
    }

    fn at(&self, count: u8) -> Frame {
        protect(self.vehicle, &self.frame, count)
    }

    fn has_checksum(&self) -> bool {
        self.facts.messages[0].checksum.is_some()
    }

    fn gateway(&self) -> VirtualGateway {
        let mut settings = profile(self.name).gateway.clone();
        // The frames are fewer than an observation takes.
        settings.lights.requirements.clear();
        VirtualGateway::new(settings)
    }
}

fn with_changed_bit(frame: &Frame, bit: usize) -> Frame {
    let mut data = frame.data().to_vec();
    data[bit / 8] ^= 1 << (bit % 8);
    Frame::classic(frame.id(), &data).unwrap()
}

/// What the turn topic carries after the frames, 20 ms apart.
fn turn_after(gateway: &mut VirtualGateway, from_ms: u64, frames: &[Frame]) -> Option<&'static str> {
    gateway.outputs.clear();
    for (ms, frame) in (from_ms..).step_by(20).zip(frames) {
        gateway.now = at_ms(ms);
        gateway.receive(frame.id(), frame.data());
    }
    gateway.turn_states().last().copied().filter(|state| *state != "stops")
}

#[test]
fn the_protected_profiles_are_these() {
    let protections = |name: &str| -> Vec<_> {
        let messages = profile(name).gateway.lights.table.messages.iter();
        messages.filter_map(|message| Some(message.integrity.as_ref()?.protection.clone())).collect()
    };
    let is_protected = |name: &String| {
        let is_none =
            |protection: &_| matches!(protection, Protection::Fields { checksum: None, counter: None });
        !protections(name).iter().all(is_none)
    };
    let protected: BTreeSet<_> = profile_names().into_iter().filter(is_protected).collect();
    let known = Protected::with_left().chain(Protected::with_dark_lamps());
    assert_eq!(protected, known.map(|known| known.name.to_owned()).collect());
    for known in Protected::with_left() {
        let Protection::Fields { checksum, counter } = &protections(known.name)[0] else {
            panic!("{}", known.name)
        };
        assert_eq!((checksum.is_some(), counter.is_some()), (known.has_checksum(), true), "{}", known.name);
    }
}

#[test]
fn a_running_counter_is_valid_from_its_second_frame_on_and_across_its_wrap() {
    for known in Protected::with_left() {
        let (name, frames) = (known.name, (0..40).map(|count| known.at(count)).collect::<Vec<_>>());
        let mut gateway = known.gateway();
        assert_eq!(turn_after(&mut gateway, 10, &frames[..1]), None, "{name}");
        assert_eq!(turn_after(&mut gateway, 30, &frames[1..]), Some("ENABLE_LEFT"), "{name}");
        let lights = gateway.gateway.lights();
        let messages = 0..lights.binding().table.messages.len();
        let counts = messages.map(|index| lights.observations().integrity_counts(MessageIndex(index)));
        let trusted: u64 = counts.flatten().map(|counts| counts.trusted).sum();
        assert_eq!(trusted, 39, "{name}");
    }
}

#[test]
fn a_counter_that_repeats_or_decreases_is_rejected() {
    for known in Protected::with_left() {
        let lost = if counter_values(&known.facts.messages[0]) == 4 { 1 } else { 3 };
        for (counts, turn) in [
            (&[2, 2, 2][..], None),
            (&[3, 2], None),
            (&[0, 1 + lost], Some("ENABLE_LEFT")),
            (&[0, 2 + lost], None),
            // It comes back.
            (&[0, 2 + lost, 3 + lost, 4 + lost], Some("ENABLE_LEFT")),
        ] {
            let frames: Vec<_> = counts.iter().map(|count| known.at(*count)).collect();
            assert_eq!(turn_after(&mut known.gateway(), 10, &frames), turn, "{} {counts:?}", known.name);
        }
    }
}

#[test]
fn with_a_checksum_each_frame_with_a_changed_bit_is_rejected() {
    for known in Protected::with_left().filter(Protected::has_checksum) {
        for bit in 0..known.facts.covered_bits.unwrap_or(known.frame.data().len() * 8) {
            let frames = [known.at(0), with_changed_bit(&known.at(1), bit)];
            assert_eq!(turn_after(&mut known.gateway(), 10, &frames), None, "{} bit {bit}", known.name);
        }
    }
}

#[test]
fn lamps_are_observed_in_valid_frames_only() {
    for known in Protected::with_dark_lamps() {
        let turn = |frames: &[Frame]| turn_after(&mut known.gateway(), 10, frames);
        let right: Vec<_> = (0..80).map(|count| known.at(count)).collect();
        assert_eq!(turn(&right), Some("DISABLE"), "{}", known.name);
        assert_eq!(turn(&[right[0]; 80]), None, "{}", known.name);
        for bit in (0..64).filter(|_| known.has_checksum()) {
            let changed: Vec<_> = right.iter().map(|frame| with_changed_bit(frame, bit)).collect();
            assert_eq!(turn(&changed), None, "{} bit {bit}", known.name);
        }
    }
}
