//! Each reader of recordings keeps to its bound of memory, whatever the file says: in each format, in each
//! compression, hostile ones as well.

use std::io::Cursor;

use can_log::Log;

use crate::counting_allocator::most_held;
use crate::hostile_files::choices::Choices;
use crate::hostile_files::packing::{PACKINGS, Packing};
use crate::hostile_files::recordings::{
    TEXT_FORMATS, blf, capture, carbus, drive, mcap, mf4, openpilot, text,
};
use crate::hostile_files::{named, nests, sqlite};

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;

/// Most that is held while a file is read that is neither packed nor held whole, bytes: buffers, and a line
/// or an object.
const STREAMED: u64 = MIB;
/// Of formats that are held whole: so many times the file in addition.
const WHOLE_TIMES: u64 = 3;
/// Most that is held of any file that is not larger than 10 MB, bytes: the limit of readers, and buffers
/// beside it.
const ANY: u64 = 208 * MIB;
/// Steps that any such file makes at most: what its reader counts as read, or as bad.
const STEPS: u64 = 25_000_000;

/// Most that a decoder holds in addition, bytes. That of xz has the dictionary of the file, here the least
/// that there is.
fn of_decoder(packing: Packing) -> u64 {
    match packing {
        Packing::Gzip => 256 * KIB,
        Packing::Bzip2 => 6 * MIB,
        Packing::Xz => MIB,
        Packing::Zstd => 4 * MIB,
        Packing::Lz4 => 12 * MIB,
    }
}

/// What was read of a file, and the most bytes that were held of it, beside the file itself.
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

/// A recording in every format: its name, its content, and what is held beside what every reader holds,
/// bytes.
fn recordings() -> Vec<(&'static str, Vec<u8>, u64)> {
    let whole = |content: &[u8]| WHOLE_TIMES * content.len() as u64;
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
    let (python, ros) = (sqlite::python(&frames), sqlite::ros(&frames));
    let events: Vec<u8> = frames.chunks(9).flat_map(openpilot::event).collect();
    let mut all = vec![
        ("blf", [blf::head(), blf::packed(&objects(blf::frame))].concat(), 0),
        ("mcap", mcap::file(&messages), 0),
        ("mcap in chunks", mcap::file(&chunk), chunk.len() as u64 + of_decoder(Packing::Zstd)),
        ("mf4", mdf.0.clone(), whole(&mdf.0) + records.len() as u64),
        ("sqlite", python.clone(), whole(&python)),
        ("db3", ros.clone(), whole(&ros)),
        ("rlog", [openpilot::start(), events].concat(), 0),
        ("pcap", [capture::pcap_head(), objects(capture::pcap_packet)].concat(), 0),
        ("pcapng", [capture::section(), capture::interface(b"can0"), packets].concat(), 0),
        ("carbus", carbus(&frames), 0),
    ];
    all.extend(TEXT_FORMATS.map(|format| (format.0, text(format, &frames), 0)));
    all
}

#[test]
fn the_counter_knows_what_is_held_and_what_is_free_again() {
    let block = |bytes| drop(std::hint::black_box(vec![1_u8; bytes]));
    let two = || {
        block(1000);
        block(500);
    };
    assert_eq!(most_held(two), 1000);
    assert_eq!(most_held(|| ()), 0);
}

#[test]
fn a_recording_of_any_format_in_any_compression_needs_little_memory() {
    let mut wrong = Vec::new();
    for (name, content, beside) in recordings() {
        let mut files = vec![(name.to_owned(), content.clone(), 0)];
        files.extend(PACKINGS.map(|packing| {
            (format!("{name}.{}", packing.name()), packing.pack(&content), of_decoder(packing))
        }));
        for (name, content, of_decoder) in files {
            let bound = STREAMED + beside + of_decoder;
            let (steps, held) = read(content);
            if steps != 2000 || held > bound {
                wrong.push(format!("{name}: {steps} frames, {held} bytes, bound {bound}"));
            }
        }
    }
    assert_eq!(wrong, [""; 0]);
}

#[test]
fn a_nest_of_any_formats_keeps_to_the_bound() {
    for number in 0..100 {
        let nest = nests::nest(&mut Choices::of(1, number));
        let (steps, held) = read(nest.content);
        assert!(held <= ANY && steps <= STEPS, "nest {number}, {}: {held} bytes, {steps} steps", nest.name);
    }
}

mod exhaustive {
    use super::*;

    #[test]
    #[ignore = "exhaustive: tests/run --release"]
    fn a_recording_that_is_hostile_on_purpose_keeps_to_the_bound() {
        for (name, make) in named::all(10_000) {
            let (_, content) = make().files.swap_remove(0);
            let (steps, held) = read(content);
            assert!(held <= ANY && steps <= STEPS, "{name}: {held} bytes, {steps} steps");
        }
    }
}
