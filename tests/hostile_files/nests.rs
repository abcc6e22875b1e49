//! Recordings in containers in compressed files: any format, in any container, in any compression, with any
//! damage.

use super::choices::Choices;
use super::damage;
use super::packing::{EMPTY_LZ4, EMPTY_SKIPPABLE, PACKINGS, Packing, ZstdByHand, zlib};
use super::recordings::{Frame, TEXT_FORMATS, blf, capture, carbus, drive, mcap, mf4, openpilot, text};
use super::sqlite;

/// What is read as a recording.
#[derive(Debug)]
pub(crate) struct Nest {
    /// Its formats, from the inside out.
    pub(crate) name: String,
    pub(crate) content: Vec<u8>,
    /// True if it has to be held whole.
    pub(crate) is_held_whole: bool,
}

/// Most bytes that blocks have before they are packed, so that a nest costs little unless a reader makes much
/// of it.
const MOST: usize = 256 << 10;

const CONTAINERS: usize = 8;

/// Makes a nest.
pub(crate) fn nest(choices: &mut Choices<'_>) -> Nest {
    let frames = frames(choices);
    let (mut name, mut is_held_whole) = (String::new(), false);
    let mut content = match choices.below(TEXT_FORMATS.len() / 2 + 2 * CONTAINERS) {
        0..CONTAINERS | CONTAINERS..16 => {
            let which = choices.below(CONTAINERS);
            let names = ["blf", "mcap", "mf4", "sqlite", "db3", "rlog", "pcap", "pcapng"];
            name += names[which];
            is_held_whole = (2..=4).contains(&which);
            container(choices, which, &frames)
        }
        _ => {
            let format = *choices.pick(&TEXT_FORMATS);
            name += format.0;
            let mut lines: Vec<Vec<u8>> =
                text(format, &frames).split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect();
            if choices.percent(10) {
                "carbus.trc".clone_into(&mut name);
                lines = carbus(&frames).split_inclusive(|byte| *byte == b'\r').map(<[u8]>::to_vec).collect();
            }
            damaged(choices, &mut lines);
            lines.concat()
        }
    };
    if choices.percent(15) {
        damage::bytes(choices, &mut content);
    }
    for _ in 0..*choices.pick(&[1, 0, 1, 1, 1, 0, 1, 1, 2, 3]) {
        let packing = *choices.pick(&PACKINGS);
        name = format!("{name}.{}", packing.name());
        content = packed(choices, packing, &content);
    }
    Nest { name, content, is_held_whole }
}

/// Frames whose stamps rise, stand still, are scattered, or jump.
fn frames(choices: &mut Choices<'_>) -> Vec<Frame> {
    let mut frames = drive(1 + choices.below(60));
    let how = choices.below(6);
    for (index, frame) in (0_u64..).zip(&mut frames) {
        match how {
            0 => frame.micros = 0,
            1 => frame.micros = index.wrapping_mul(7_919) % 61 * 40_000_000_000_000,
            2 => frame.micros += index / 5 * 1_000_003_000_000,
            3 if index % 2 == 0 => frame.micros = u64::MAX / 2048,
            _ => {}
        }
        if choices.percent(5) {
            frame.id = u16::try_from(choices.below(0x800)).unwrap_or(0);
        }
        if choices.percent(5) {
            frame.data.truncate(choices.below(9));
        }
    }
    frames
}

/// Does a few kinds of damage, or none.
fn damaged(choices: &mut Choices<'_>, list: &mut Vec<Vec<u8>>) {
    for _ in 0..*choices.pick(&[0, 0, 0, 1, 1, 2, 4]) {
        damage::blocks(choices, list, MOST);
    }
}

fn container(choices: &mut Choices<'_>, which: usize, frames: &[Frame]) -> Vec<u8> {
    match which {
        0 => {
            let mut objects: Vec<_> = frames.iter().map(blf::frame).collect();
            for _ in 0..choices.below(4) {
                damaged(choices, &mut objects);
                objects =
                    objects.chunks(1 + choices.below(40)).map(|part| blf_container(choices, part)).collect();
            }
            damaged(choices, &mut objects);
            [blf::head(), objects.concat()].concat()
        }
        1 => {
            let mut records =
                vec![mcap::schema(1, b"can_msgs/msg/Frame"), mcap::channel(1, 1, b"/can0/from_can_bus")];
            records.extend(frames.iter().map(|frame| mcap::messages(std::slice::from_ref(frame))));
            if choices.percent(20) {
                let length = choices.length(18);
                records.insert(0, mcap::schema(2, &vec![b'x'; length]));
                records.insert(1, mcap::channel(2, 1, &vec![b'x'; length]));
            }
            for _ in 0..choices.below(4) {
                damaged(choices, &mut records);
                records =
                    records.chunks(1 + choices.below(40)).map(|part| mcap_chunk(choices, part)).collect();
            }
            damaged(choices, &mut records);
            mcap::file(&records.concat())
        }
        2 => mdf(choices, frames),
        3 | 4 => {
            let file = if which == 3 { sqlite::python(frames) } else { sqlite::ros(frames) };
            let mut pages: Vec<_> = file.chunks(512).map(<[u8]>::to_vec).collect();
            for _ in 0..*choices.pick(&[0, 1, 2, 5]) {
                // Within pages, whose places matter.
                let at = choices.place(pages.len());
                damage::bytes(choices, &mut pages[at]);
                pages[at].resize(512, 0);
            }
            if choices.percent(20) {
                damaged(choices, &mut pages);
            }
            pages.concat()
        }
        5 => {
            let mut events = vec![openpilot::start()];
            events.extend(frames.chunks(1 + choices.below(8)).map(openpilot::event));
            if choices.percent(20) {
                let count = choices.length(16) as u64;
                let mut words = vec![
                    openpilot::structure(0, 2, 1),
                    0,
                    4,
                    openpilot::list(0, 7, count),
                    openpilot::structure(count, 0, 1),
                ];
                words.resize(5 + usize::try_from(count).unwrap_or(0), 0);
                events.push(openpilot::message(&words));
            }
            damaged(choices, &mut events);
            events.concat()
        }
        6 => {
            let mut packets: Vec<_> = frames.iter().map(capture::pcap_packet).collect();
            damaged(choices, &mut packets);
            [capture::pcap_head(), packets.concat()].concat()
        }
        _ => {
            let mut blocks = vec![capture::section(), capture::interface(b"can0")];
            blocks.extend(frames.iter().map(|frame| capture::pcapng_packet(0, frame)));
            damaged(choices, &mut blocks);
            blocks.concat()
        }
    }
}

fn blf_container(choices: &mut Choices<'_>, objects: &[Vec<u8>]) -> Vec<u8> {
    let mut objects = objects.concat();
    match choices.below(8) {
        0 => objects,
        1 => blf::container(0, objects.len(), &objects),
        2 => {
            let mut packed = zlib(&objects);
            damage::bytes(choices, &mut packed);
            blf::container(2, objects.len(), &packed)
        }
        3 => {
            objects.resize(objects.len() + choices.length(22), 0);
            blf::packed(&objects)
        }
        _ => blf::packed(&objects),
    }
}

fn mcap_chunk(choices: &mut Choices<'_>, records: &[Vec<u8>]) -> Vec<u8> {
    let records = records.concat();
    let unpacked = *choices.pick(&[records.len() as u64, 0, 1, u64::MAX]);
    let packing = *choices.pick(&PACKINGS);
    match choices.below(6) {
        0 => mcap::chunk("", unpacked, &records),
        1 => mcap::chunk(packing.name(), unpacked, &packed(choices, packing, &packing.pack(&records))),
        2 => mcap::chunk("zstd", unpacked, &packed(choices, packing, &records)),
        3 => mcap::chunk("lz4", unpacked, &packed(choices, Packing::Lz4, &records)),
        _ => mcap::chunk("zstd", unpacked, &packed(choices, Packing::Zstd, &records)),
    }
}

/// Packs in a few members, with others between, and with damage.
fn packed(choices: &mut Choices<'_>, packing: Packing, content: &[u8]) -> Vec<u8> {
    let parts = 1 + choices.below(3);
    let mut members: Vec<Vec<u8>> =
        content.chunks((content.len() / parts).max(1)).map(|part| packing.pack(part)).collect();
    if choices.percent(15) {
        let member = match packing {
            Packing::Zstd => EMPTY_SKIPPABLE.to_vec(),
            Packing::Lz4 => EMPTY_LZ4.to_vec(),
            Packing::Gzip | Packing::Bzip2 | Packing::Xz => packing.pack(b""),
        };
        let at = choices.place(members.len());
        let times = choices.length(14).min(MOST / member.len());
        members.insert(at, member.repeat(times));
    }
    if choices.percent(25) {
        let fill = *choices.pick(b"\0\n x");
        // Now and then a window of Zstandard is full.
        let log = if packing == Packing::Zstd && choices.percent(10) { 28 } else { 24 };
        let length = choices.length(log);
        let window = u8::try_from(10 + choices.below(20)).unwrap_or(10);
        members.push(match packing {
            Packing::Zstd => ZstdByHand::new(window).stored(content).run(fill, length).finish(),
            // They cost as much to write as to read.
            Packing::Gzip | Packing::Bzip2 | Packing::Xz | Packing::Lz4 => {
                packing.pack(&vec![fill; length >> 3])
            }
        });
    }
    if choices.percent(30) {
        damaged(choices, &mut members);
    }
    let mut packed = members.concat();
    match choices.below(12) {
        0 => packed.extend([0; 100]),
        1 => packed.extend(b"something else"),
        2 | 3 => damage::bytes(choices, &mut packed),
        _ => {}
    }
    packed
}

/// A file of blocks that refer to each other, more often than once.
fn mdf(choices: &mut Choices<'_>, frames: &[Frame]) -> Vec<u8> {
    let mut file = mf4::Writer::new();
    let number_length = *choices.pick(&[0, 0, 1, 8]);
    let records: Vec<u8> = mf4::records(frames)
        .chunks(21)
        .flat_map(|record| [&[0; 8][..number_length], record].concat())
        .collect();
    let channels = file.frame_channels();
    let mut group = 0;
    for number in 0..=choices.below(3) as u64 {
        let flags = u8::from(choices.percent(10));
        let length = *choices.pick(&[21, 21, 21, 21, 21, 0, 255]);
        group = file.group(group, channels, number, flags, length);
    }
    let mut before = None;
    for _ in 0..=choices.below(3) {
        let at = file.data_group(before, group, u8::try_from(number_length).unwrap_or(0));
        before = Some(at);
        let mut blocks = Vec::new();
        for _ in 0..=choices.below(4) {
            blocks.push(match choices.below(4) {
                0 => file.block(*b"DT", &[], &records),
                1 => {
                    let zeros = vec![0; choices.length(22)];
                    file.packed(zeros.len() as u64, &zlib(&zeros))
                }
                2 => {
                    let mut packed = zlib(&records);
                    damage::bytes(choices, &mut packed);
                    file.packed(records.len() as u64, &packed)
                }
                _ => file.packed(records.len() as u64, &zlib(&records)),
            });
        }
        let times = choices.length(6);
        let mut data = file.block(*b"DL", &[&[0], &blocks.repeat(times)[..]].concat(), &[0; 8]);
        if choices.percent(30) {
            // Itself, the group, or another list.
            let next = *choices.pick(&[data, at, group, blocks[0]]);
            file.set_link(data, 0, next);
        }
        if choices.percent(30) {
            data = file.block(*b"HL", &[data], &[0; 8]);
        }
        file.set_link(at, 2, data);
    }
    let mut content = file.0;
    for _ in 0..*choices.pick(&[0, 0, 1, 3]) {
        damage::bytes(choices, &mut content);
    }
    content
}
