//! BLF, logs of openpilot and captures that are hostile on purpose: bombs, nests, and objects by the million.

use super::named::{DECODED, FRAMES, MOST, Named, QUICK, gzip_of, turn};
use super::packing::{Packing, zlib};
use super::recordings::{TURN, blf, capture, drive, openpilot};

pub(crate) const ALL: &[Named] = &[
    Named("wide.rlog.zst", MOST, DECODED, |size| wide(size, 2_000_000)),
    Named("empty_messages.rlog.gz", QUICK, DECODED, |size| {
        let start = Packing::Gzip.pack(&[openpilot::start(), events()].concat());
        [start, gzip_of(&openpilot::message(&[0]).repeat(60_000), size)].concat()
    }),
    Named("shared_data.rlog.zst", QUICK, DECODED, |size| {
        // Each frame of a list has the same data.
        let count = 600_000_u64;
        let mut words = vec![
            openpilot::structure(0, 2, 1),
            0,
            4,
            openpilot::list(0, 7, 2 * count),
            openpilot::structure(count, 1, 1),
        ];
        for index in 0..count {
            words.extend([u64::from(TURN), openpilot::list(2 * (count - index) - 2, 2, 8)]);
        }
        words.push(0);
        let message = Packing::Zstd.pack(&openpilot::message(&words));
        let times = size / message.len() + 1;
        [Packing::Zstd.pack(&[openpilot::start(), events()].concat()), message.repeat(times)].concat()
    }),
    Named("bombs.blf", MOST, DECODED, |size| {
        let packed = blf::container(2, 16 << 20, &zlib(&vec![0; 16 << 20]));
        [blf::head(), frames_of_blf(), packed.repeat(size / packed.len() + 1)].concat()
    }),
    Named("nested.blf", QUICK, DECODED, |size| {
        let mut objects = frames_of_blf();
        while objects.len() < size / 2 {
            objects =
                [objects.clone(), blf::packed(&objects), blf::container(0, objects.len(), &objects)].concat();
        }
        [blf::head(), objects].concat()
    }),
    Named("bomb_in_containers.blf.gz", QUICK, DECODED, |size| {
        // Containers within containers, each of which packs the next one.
        let mut bomb = blf::packed(&vec![0; 8 << 20]);
        bomb = blf::packed(&bomb.repeat(400));
        let start = Packing::Gzip.pack(&[blf::head(), frames_of_blf()].concat());
        [start, gzip_of(&bomb.repeat(64), size)].concat()
    }),
    Named("tiny_objects.blf", QUICK, DECODED, |size| {
        let object: Vec<u8> = [&b"LOBJ\x10\0\x01\0\x10\0\0\0"[..], &99_u32.to_le_bytes()].concat();
        let packed = blf::packed(&object.repeat(500_000));
        [blf::head(), frames_of_blf(), packed.repeat(size / packed.len() + 1)].concat()
    }),
    Named("frames.blf.gz", QUICK, DECODED, |size| {
        let frame = blf::frame(&turn());
        let start = Packing::Gzip.pack(&[blf::head(), frames_of_blf()].concat());
        [start, gzip_of(&frame.repeat(50_000), size)].concat()
    }),
    Named("magic_within_magic.blf.gz", QUICK, DECODED, |size| {
        let start = Packing::Gzip.pack(&[blf::head(), frames_of_blf()].concat());
        [start, gzip_of(&b"LOBJ".repeat(500_000), size)].concat()
    }),
    Named("interfaces.pcapng", QUICK, DECODED, |size| {
        let interface = capture::interface(&[b'x'; 64]);
        let interfaces = interface.repeat((size / interface.len()).min(65_000));
        [capture::section(), capture::interface(b"can0"), packets(0), interfaces].concat()
    }),
    Named("interfaces.pcapng.gz", QUICK, DECODED, |size| {
        let start = [capture::section(), capture::interface(b"can0"), packets(0)].concat();
        let interfaces = capture::interface(&[b'x'; 64]).repeat(65_000);
        [Packing::Gzip.pack(&start), gzip_of(&[capture::section(), interfaces].concat(), size)].concat()
    }),
    Named("options.pcapng.gz", QUICK, DECODED, |size| {
        let options = capture::option(9, &[6]).repeat(30_000);
        let interface = capture::block(1, &[&[227, 0, 0, 0, 0, 0, 0, 0][..], &options].concat());
        let start = [capture::section(), capture::interface(b"can0"), packets(0)].concat();
        [Packing::Gzip.pack(&start), gzip_of(&interface.repeat(8), size)].concat()
    }),
    Named("blocks.pcapng.gz", QUICK, DECODED, |size| {
        let start = [capture::section(), capture::interface(b"can0"), packets(0)].concat();
        let empty = capture::block(0x0BAD, &[]).repeat(80_000);
        [Packing::Gzip.pack(&start), gzip_of(&empty, size)].concat()
    }),
    Named("packets.pcap.gz", QUICK, DECODED, |size| {
        let frames: Vec<u8> = drive(FRAMES).iter().flat_map(capture::pcap_packet).collect();
        let start = Packing::Gzip.pack(&[capture::pcap_head(), frames].concat());
        [start, gzip_of(&[0; 16].repeat(60_000), size)].concat()
    }),
];

fn frames_of_blf() -> Vec<u8> {
    blf::packed(&drive(FRAMES).iter().flat_map(blf::frame).collect::<Vec<_>>())
}

fn packets(interface: u32) -> Vec<u8> {
    drive(FRAMES).iter().flat_map(|frame| capture::pcapng_packet(interface, frame)).collect()
}

fn events() -> Vec<u8> {
    drive(FRAMES).iter().flat_map(|frame| openpilot::event(std::slice::from_ref(frame))).collect()
}

/// Messages with a list of frames that are all null.
fn wide(size: usize, frames: u64) -> Vec<u8> {
    let mut words = vec![
        openpilot::structure(0, 2, 1),
        0,
        4,
        openpilot::list(0, 7, frames),
        openpilot::structure(frames, 0, 1),
    ];
    words.resize(words.len() + usize::try_from(frames).unwrap(), 0);
    let message = Packing::Zstd.pack(&openpilot::message(&words));
    let times = size / message.len() + 1;
    [Packing::Zstd.pack(&[openpilot::start(), events()].concat()), message.repeat(times)].concat()
}
