//! Each reader of recordings keeps to its bound of memory, whatever the file says: in each format, in each compression, hostile ones
//! as well.

use std::io::Cursor;

use signal_gateway::io::can::log::Log;

use crate::counting_allocator::most_held;
use crate::hostile_files::choices::Choices;
use crate::hostile_files::packing::{PACKINGS, Packing};
use crate::hostile_files::recordings::{
    TEXT_FORMATS, blf, capture, carbus, drive, mcap, mf4, openpilot, sqlite, text,
};
use crate::hostile_files::{named, nests};

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;

/// Most that is held while a file is read that is neither packed nor held whole, bytes: buffers, and a line or an object.
const STREAMED: u64 = 512 * KIB;
/// Of formats that are held whole: so many times the file in addition.
const WHOLE_TIMES: u64 = 3;
/// Most that is held of any file that is not larger than 10 MB, bytes: the limit of readers, and buffers beside it.
const ANY: u64 = 208 * MIB;
/// Steps that any such file makes at most: what its reader counts as read, or as bad.
const STEPS: u64 = 25_000_000;

/// Most that a decoder holds in addition, bytes. That of xz has the dictionary of the file, here the least that there is.
fn of_decoder(packing: Packing) -> u64 {
    match packing {
        Packing::Gzip => 128 * KIB,
        Packing::Bzip2 => 5 * MIB,
        Packing::Xz => 512 * KIB,
        Packing::Zstd => 4 * MIB,
        Packing::Lz4 => 10 * MIB,
    }
}

/// What was read of a file, and the most bytes that were held of it.
fn read(content: Vec<u8>) -> (u64, u64) {
    let mut steps = 0;
    let held = most_held(|| {
        let Ok(mut log) = Log::new(Box::new(Cursor::new(content))) else { return };
        while let Ok(Some(_)) = log.next_record() {
            steps += 1;
        }
        steps += log.bad_lines();
    });
    (steps, held)
}

/// A recording in every format: its name, its content, and whether it is held whole.
fn recordings() -> Vec<(&'static str, Vec<u8>, bool)> {
    let frames = drive(2000);
    let objects = |one: fn(&_) -> Vec<u8>| frames.iter().flat_map(one).collect::<Vec<u8>>();
    let mut mdf = mf4::Writer::new();
    let group = mdf.frames_group();
    let records = mf4::records(&frames);
    let packed = mdf.packed(records.len() as u64, &crate::hostile_files::packing::zlib(&records));
    mdf.set_link(group, 2, packed);
    let messages = [mcap::described(), mcap::messages(&frames)].concat();
    let chunk = mcap::chunk("zstd", messages.len() as u64, &Packing::Zstd.pack(&messages));
    let packets: Vec<u8> = frames.iter().flat_map(|frame| capture::pcapng_packet(0, frame)).collect();
    let mut all = vec![
        ("blf", [blf::head(), blf::packed(&objects(blf::frame))].concat(), false),
        ("mcap", mcap::file(&messages), false),
        ("mcap in chunks", mcap::file(&chunk), false),
        ("mf4", mdf.0, true),
        ("sqlite", sqlite::python(&frames), true),
        ("db3", sqlite::ros(&frames), true),
        ("rlog", [openpilot::start(), frames.chunks(9).flat_map(openpilot::event).collect()].concat(), false),
        ("pcap", [capture::pcap_head(), objects(capture::pcap_packet)].concat(), false),
        ("pcapng", [capture::section(), capture::interface(b"can0"), packets].concat(), false),
        ("carbus", carbus(&frames), false),
    ];
    all.extend(TEXT_FORMATS.map(|format| (format.0, text(format, &frames), false)));
    all
}

#[test]
fn the_counter_knows_what_is_held_and_what_is_free_again() {
    let block = |bytes| drop(std::hint::black_box(vec![1_u8; bytes]));
    assert_eq!(most_held(|| (block(1000), block(500)).into()), 1000);
    assert_eq!(most_held(|| ()), 0);
}

#[test]
fn a_recording_of_any_format_in_any_compression_needs_little_memory() {
    for (name, content, is_held_whole) in recordings() {
        let whole = if is_held_whole { WHOLE_TIMES * content.len() as u64 } else { 0 };
        let (steps, held) = read(content.clone());
        assert_eq!(steps, 2000, "{name}");
        // The file itself is in memory here.
        let bound = content.len() as u64 + STREAMED + whole;
        assert!(held <= bound, "{name}: {held} bytes, more than {bound}");
        for packing in PACKINGS {
            let packed = packing.pack(&content);
            let bound = packed.len() as u64 + STREAMED + whole + of_decoder(packing);
            let (steps, held) = read(packed);
            assert_eq!(steps, 2000, "{name}.{}", packing.name());
            assert!(held <= bound, "{name}.{}: {held} bytes, more than {bound}", packing.name());
        }
    }
}

#[test]
fn a_nest_of_any_formats_keeps_to_the_bound() {
    for number in 0..100 {
        let nest = nests::nest(&mut Choices::of(1, number));
        let (steps, held) = read(nest.content);
        assert!(held <= ANY && steps <= STEPS, "nest {number}, {}: {held} bytes, {steps} steps", nest.name);
    }
}

mod slow {
    use super::*;

    #[test]
    fn a_recording_that_is_hostile_on_purpose_keeps_to_the_bound() {
        for (name, make) in named::all(10_000) {
            let (_, content) = make().files.swap_remove(0);
            let (steps, held) = read(content);
            assert!(held <= ANY && steps <= STEPS, "{name}: {held} bytes, {steps} steps");
        }
    }
}
