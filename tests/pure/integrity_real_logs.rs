//! Checksums and counters on what real vehicles sent.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use can_log::EntryContent;
use can_log::Log;
use can_signal::can::frame::{CanId, Frame};
use can_signal::dbc::codec::{ByteOrder, Layout, SignalCodec};
use can_signal::validation::integrity::checksum::{Checksum, ChecksumRule, CrcRule, Sum};
use can_signal::validation::integrity::counter::{Counter, CounterRule};
use can_signal::validation::integrity::{
    IntegrityChecker, IntegrityCounts, MessageIntegrity, Protection, Reject,
};
use gateway_base::time::MonoTime;

use crate::support::prerequisite::{require, shared_data};

/// The data frames of a recording, by message and in order.
fn messages(path: &Path) -> BTreeMap<CanId, Vec<Frame>> {
    let mut log = Log::open(path).unwrap();
    let mut messages: BTreeMap<_, Vec<_>> = BTreeMap::new();
    while let Some(record) = log.next_record().unwrap() {
        if let EntryContent::Data(frame) = record.content {
            messages.entry(frame.id()).or_default().push(frame);
        }
    }
    messages
}

fn field(start: usize, length: u16, order: ByteOrder) -> SignalCodec {
    let start = u16::try_from(start).unwrap();
    SignalCodec::new(Layout { start, length, order, signed: false }, 64).unwrap()
}

/// The last byte of messages of that length.
fn last_byte(length: usize) -> SignalCodec {
    field((length - 1) * 8, 8, ByteOrder::Intel)
}

/// The low half of the last byte.
fn honda(length: usize) -> Checksum {
    Checksum::new(ChecksumRule::Honda, field((length - 1) * 8, 4, ByteOrder::Intel)).unwrap()
}

fn j1850(length: usize) -> Checksum {
    Checksum::new(ChecksumRule::Crc(CrcRule::j1850()), last_byte(length)).unwrap()
}

fn holds(checksum: &Checksum, frame: &Frame) -> bool {
    checksum.compare(frame).is_some_and(|(stored, expected)| stored == expected)
}

/// Frames that hold their checksum, and all of them; the length of the first is that of all.
fn rate(frames: &[Frame], checksum: impl Fn(usize) -> Checksum) -> (usize, usize) {
    let length = frames[0].data().len();
    if length == 0 {
        return (0, frames.len());
    }
    let checksum = checksum(length);
    (frames.iter().filter(|frame| holds(&checksum, frame)).count(), frames.len())
}

/// The results of a checker for a message's frames: the first, then the rest counted.
fn guarded(frames: &[Frame], checksum: Checksum, counter: Counter) -> (Result<(), Reject>, IntegrityCounts) {
    let mut checker = IntegrityChecker::new(MessageIntegrity {
        length: Some(frames[0].data().len()),
        protection: Protection::Fields { checksum: Some(checksum), counter: Some(counter) },
        window: None,
        forget_after: None,
    });
    let verdicts: Vec<_> = frames.iter().map(|frame| checker.check(frame, MonoTime::ZERO)).collect();
    (verdicts[0], checker.counts())
}

/// Honda's two bits above the checksum; every break is counted as one.
fn honda_counter(length: usize) -> Counter {
    let mut rule = CounterRule::new(0, 3).unwrap();
    (rule.sync_after, rule.tolerated_repeats) = (0, u8::MAX);
    Counter::new(rule, field((length - 1) * 8 + 4, 2, ByteOrder::Intel)).unwrap()
}

#[test]
fn every_honda_frame_of_icsim_is_whole_and_in_sequence() {
    let path = require!(shared_data()).join("can-logs/icsim-sample-can.log");
    let messages = messages(&path);
    let rates = messages.values().map(|frames| rate(frames, honda));
    let (good, all) = rates.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    assert_eq!((messages.len(), good, all), (34, 6158, 6158));
    for (id, frames) in messages.iter().filter(|(id, _)| id.number() != 0x1D0) {
        let length = frames[0].data().len();
        let (_, counts) = guarded(frames, honda(length), honda_counter(length));
        let expected =
            IntegrityCounts { initial: 1, trusted: frames.len() as u64 - 1, ..IntegrityCounts::default() };
        assert_eq!(counts, expected, "{id}");
    }
}

#[test]
fn the_civic_lost_frames_but_damaged_none() {
    let path = require!(shared_data()).join("can-logs/eld-civic-type-r-2019-turnonanddrive.log");
    let messages = messages(&path);
    let not_whole = messages.iter().filter_map(|(id, frames)| {
        let (good, all) = rate(frames, honda);
        (good < all).then_some((id.number(), all - good, all))
    });
    assert_eq!((messages.len(), not_whole.collect::<Vec<_>>()), (57, vec![(0x255, 348, 404)]));
    let (_, counts) = guarded(&messages[&CanId::Standard(0x326)], honda(8), honda_counter(8));
    let breaks = counts.wrong_sequence + counts.repeated;
    assert_eq!((counts.initial, breaks, counts.trusted), (1, 26, 193 - 26 - 1));
}

#[test]
fn every_toyota_frame_of_the_checksummed_messages_is_whole() {
    let path = require!(shared_data()).join("can-logs/comma2k19-rav4-b0c9d232-seg40.candump.log.gz");
    let ids = [0x024, 0x025, 0x0B4, 0x1C4, 0x1D0, 0x1D2, 0x1D3, 0x223, 0x260, 0x2C1, 0x320, 0x3F9, 0x420];
    let messages = messages(&path);
    let toyota = |length| Checksum::new(ChecksumRule::Sum(Sum::TOYOTA), last_byte(length)).unwrap();
    let mut frames = 0;
    for id in ids {
        let (good, all) = rate(&messages[&CanId::Standard(id)], toyota);
        assert_eq!(good, all, "{id:03X}");
        frames += all;
    }
    assert_eq!(frames, 30_772);
    assert!(rate(&messages[&CanId::Standard(0x614)], toyota).0 < 8, "the turn signals have none");
}

#[test]
fn twenty_seven_durango_messages_have_a_j1850() {
    let path = require!(shared_data()).join("can-logs/eld-durango-keyon.log");
    let messages = messages(&path);
    // Three frames of a message prove nothing.
    let whole = messages.iter().filter(|(_, frames)| frames.len() >= 10).filter(|(_, frames)| {
        let (good, all) = rate(frames, j1850);
        good == all
    });
    let whole: Vec<_> = whole.collect();
    let frames: usize = whole.iter().map(|(_, frames)| frames.len()).sum();
    assert_eq!((whole.len(), frames), (27, 7952));
    let unbroken = whole.iter().filter(|(_, frames)| {
        let length = frames[0].data().len();
        let counter = field((length - 1) * 8 - 4, 4, ByteOrder::Intel);
        let counter = Counter::new(CounterRule::new(0, 15).unwrap(), counter).unwrap();
        let (_, counts) = guarded(frames, j1850(length), counter);
        counts.trusted + 1 == frames.len() as u64
    });
    assert_eq!(unbroken.count(), 24, "the counters of 0x230, 0x23B and 0x26A do not always run");
}

/// Name, identifier and payload of each known-good frame, by DBC.
fn known_good(shared: &Path, dbc: &str) -> Vec<(String, CanId, Vec<u8>)> {
    let text = fs::read_to_string(shared.join("can-logs/e2e-known-good-frames.csv")).unwrap();
    let rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let rows = rows.filter(|row| row[0] == dbc).map(|row| {
        let id = u32::from_str_radix(row[2].trim_start_matches("0x"), 16).unwrap();
        let digits = row[3].as_bytes().chunks(2);
        let byte = |digits: &[u8]| u8::from_str_radix(str::from_utf8(digits).unwrap(), 16).unwrap();
        (row[1].to_owned(), CanId::standard(id).unwrap(), digits.map(byte).collect())
    });
    rows.collect()
}

/// Whether the frame holds, and no frame that differs in one bit does; `free` bits excepted.
fn holds_as_it_is(checksum: &Checksum, id: CanId, data: &[u8], free: std::ops::Range<usize>) -> bool {
    let holds = |data: &[u8]| holds(checksum, &Frame::classic(id, data).unwrap());
    let changed = |bit: usize| {
        let mut data = data.to_vec();
        data[bit / 8] ^= 1 << (bit % 8);
        data
    };
    holds(data) && (0..data.len() * 8).filter(|bit| !free.contains(bit)).all(|bit| !holds(&changed(bit)))
}

/// A checksum for each value that a message's constants may have.
fn volkswagen_candidates() -> Vec<Checksum> {
    let rule = |constant| ChecksumRule::Crc(CrcRule::volkswagen([constant; 16]));
    (0..=u8::MAX).map(|constant| Checksum::new(rule(constant), last_byte(1)).unwrap()).collect()
}

#[test]
fn the_known_good_frames_of_volkswagen_are_good() {
    let frames = known_good(&require!(shared_data()), "vw_mqb");
    let candidates = volkswagen_candidates();
    let mut constants: BTreeMap<&str, [Option<u8>; 16]> = BTreeMap::new();
    for (message, _, data) in &frames {
        let frame = Frame::classic(CanId::Standard(0), data).unwrap();
        let constant = candidates.iter().position(|candidate| holds(candidate, &frame)).unwrap();
        let (counter, constant) = (data[1] & 0xF, u8::try_from(constant).unwrap());
        let before = constants.entry(message).or_default()[usize::from(counter)].replace(constant);
        assert_eq!(before, None, "{message} has each counter once");
    }
    let table = |message: &str| constants[message].map(Option::unwrap);
    // Sixteen frames that agree on one constant were not made to: the rule is right.
    let agreeing = constants.values().filter(|table| table.iter().all(|constant| *constant == table[0]));
    assert_eq!((constants.len(), agreeing.count()), (23, 12));
    for (message, id, data) in &frames {
        let checksum =
            Checksum::new(ChecksumRule::Crc(CrcRule::volkswagen(table(message))), last_byte(1)).unwrap();
        assert!(holds_as_it_is(&checksum, *id, data, 8..12), "{message} {data:02X?}");
    }
    assert_eq!(frames.len(), 368);
}

#[test]
fn the_known_good_frames_of_giorgio_are_good_but_for_a_damaged_one() {
    let frames = known_good(&require!(shared_data()), "fca_giorgio");
    let mut damaged = vec![];
    for (message, id, data) in &frames {
        let last_xor = match message.as_str() {
            "EPS_1" => 0x10,
            "EPS_2" => 0xF6,
            "EPS_3" => 0xF1,
            _ => 0x0A,
        };
        let checksum =
            Checksum::new(ChecksumRule::Crc(CrcRule::giorgio(last_xor)), last_byte(data.len())).unwrap();
        if !holds_as_it_is(&checksum, *id, data, 0..0) {
            damaged.push((message.as_str(), data.as_slice()));
        }
    }
    // One bit away from a good one; its two sisters and eleven other frames fit the rule.
    assert_eq!((frames.len(), damaged), (12, vec![("EPS_3", [0x7B, 0xF0, 0x02, 0x6E].as_slice())]));
}
