//! ASAM MDF 4 that is hostile on purpose: blocks that are referred to more often than once, circles, and
//! records without bytes.

use super::named::{DECODED, FRAMES, MOST, Named, QUICK};
use super::packing::{gzip_of_zeros_behind, zlib};
use super::recordings::{drive, mf4};

pub(crate) const ALL: &[Named] = &[
    Named("zeros_behind.mf4.gz", QUICK, DECODED, |size| gzip_of_zeros_behind(&mf4_of_frames(), size / 1024)),
    Named("listed_thrice.mf4", MOST, DECODED, listed_thrice),
    Named("circle.mf4", QUICK, 0, |_| {
        let mut file = mf4::Writer::new();
        let group = file.frames_group();
        let records = file.block(*b"DT", &[], &mf4::records(&drive(FRAMES)));
        let list = file.block(*b"DL", &[0, records, records], &[0; 8]);
        file.set_link(list, 0, list);
        file.set_link(group, 2, list);
        file.0
    }),
    Named("circle_of_groups.mf4", QUICK, 0, |_| {
        let mut file = mf4::Writer::new();
        let group = file.frames_group();
        file.set_link(group, 0, group);
        let records = file.block(*b"DT", &[], &mf4::records(&drive(FRAMES)));
        file.set_link(group, 2, records);
        file.0
    }),
    Named("many_groups.mf4", QUICK, 0, |size| {
        // Each with the same channels and the same data.
        let mut file = mf4::Writer::new();
        let channels = file.frame_channels();
        let group = file.group(0, channels, 0, 0, 21);
        let records = file.block(*b"DT", &[], &mf4::records(&drive(FRAMES)));
        let mut before = None;
        for _ in 0..size / 64 {
            let at = file.data_group(before, group, 0);
            file.set_link(at, 2, records);
            before = Some(at);
        }
        file.0
    }),
    Named("many_channel_groups.mf4", QUICK, 0, |size| {
        let mut file = mf4::Writer::new();
        let channels = file.frame_channels();
        let mut group = 0;
        for number in 0..size as u64 / 112 {
            group = file.group(group, channels, number, 0, 21);
        }
        let at = file.data_group(None, group, 4);
        let records: Vec<u8> =
            mf4::records(&drive(FRAMES)).chunks(21).flat_map(|record| [&[0; 4], record].concat()).collect();
        let records = file.block(*b"DT", &[], &records);
        file.set_link(at, 2, records);
        file.0
    }),
    Named("shared_values.mf4", QUICK, 0, shared_values),
    Named("shared_table.mf4", QUICK, 0, |size| {
        // A table of conversion that each channel of each group refers to.
        let mut file = mf4::Writer::new();
        let pairs: Vec<f64> = (0..60_000_u32).map(f64::from).collect();
        let table = file.conversion(&pairs);
        let data = file.channel(0, "CAN_DataFrame.DataBytes", [0, 10, 0, 13, 64], [0, 0]);
        let id = file.channel(data, "CAN_DataFrame.ID", [0, 0, 0, 8, 32], [table, 0]);
        let frame = file.channel(id, "CAN_DataFrame", [0, 10, 0, 8, 104], [0, 0]);
        let time = file.channel(frame, "t", [2, 4, 0, 0, 64], [0, 0]);
        let mut group = 0;
        for number in 0..size as u64 / 512 {
            group = file.group(group, time, number, 0, 21);
        }
        let at = file.data_group(None, group, 1);
        let records: Vec<u8> =
            mf4::records(&drive(2000)).chunks(21).flat_map(|record| [&[0], record].concat()).collect();
        let records = file.block(*b"DT", &[], &records);
        file.set_link(at, 2, records);
        file.0
    }),
    Named("records_of_nothing.mf4", QUICK, 0, |size| {
        // A byte a record, of a group without frames, packed to a thousandth.
        let mut file = mf4::Writer::new();
        let channels = file.frame_channels();
        let frames = file.group(0, channels, 1, 0, 21);
        let nothing = file.group(frames, 0, 0, 0, 0);
        let at = file.data_group(None, nothing, 1);
        let packed = zlib(&vec![0; 4 << 20]);
        let blocks: Vec<_> = (0..=size / packed.len()).map(|_| file.packed(4 << 20, &packed)).collect();
        let list = file.block(*b"DL", &[&[0], &blocks[..]].concat(), &[0; 8]);
        file.set_link(at, 2, list);
        file.0
    }),
    Named("frames_of_nothing.mf4", QUICK, 0, |size| {
        let mut file = mf4::Writer::new();
        let group = file.frames_group();
        let packed = zlib(&vec![0; 4 << 20]);
        let blocks: Vec<_> = (0..=size / packed.len()).map(|_| file.packed(4 << 20, &packed)).collect();
        let list = file.block(*b"DL", &[&[0], &blocks[..]].concat(), &[0; 8]);
        file.set_link(group, 2, list);
        file.0
    }),
    Named("deep_chain.mf4", QUICK, 0, |size| {
        let mut file = mf4::Writer::new();
        let group = file.frames_group();
        let mut next = file.block(*b"DT", &[], &mf4::records(&drive(FRAMES)));
        for _ in 0..size / 40 {
            next = file.block(*b"HL", &[next], &[0; 8]);
        }
        file.set_link(group, 2, next);
        file.0
    }),
];

fn mf4_of_frames() -> Vec<u8> {
    let mut file = mf4::Writer::new();
    let group = file.frames_group();
    let records = file.block(*b"DT", &[], &mf4::records(&drive(FRAMES)));
    file.set_link(group, 2, records);
    file.0
}

/// Packed blocks of 64 MiB of zeros, which a list names three times each, behind whole frames.
fn listed_thrice(size: usize) -> Vec<u8> {
    let mut file = mf4::Writer::new();
    let group = file.frames_group();
    let first = file.block(*b"DT", &[], &mf4::records(&drive(FRAMES)));
    let packed = zlib(&vec![0; 64 << 20]);
    let blocks: Vec<_> = (0..(size / packed.len()).max(1)).map(|_| file.packed(64 << 20, &packed)).collect();
    let list = file.block(*b"DL", &[&[0, first], &blocks.repeat(3)[..]].concat(), &[0; 8]);
    file.set_link(group, 2, list);
    file.0
}

/// Groups of frames whose values of variable length are all the same packed blocks.
fn shared_values(size: usize) -> Vec<u8> {
    let mut file = mf4::Writer::new();
    let packed = zlib(&vec![0; 32 << 20]);
    let values = file.packed(32 << 20, &packed);
    let mut group = 0;
    for number in 0..(size as u64 / 2000).min(200) {
        let data = file.channel(0, "CAN_DataFrame.DataBytes", [1, 10, 0, 13, 64], [0, values]);
        let id = file.channel(data, "CAN_DataFrame.ID", [0, 0, 0, 8, 32], [0, 0]);
        let frame = file.channel(id, "CAN_DataFrame", [0, 10, 0, 8, 104], [0, 0]);
        let time = file.channel(frame, "t", [2, 4, 0, 0, 64], [0, 0]);
        group = file.group(group, time, number, 0, 21);
    }
    let at = file.data_group(None, group, 1);
    let records: Vec<u8> =
        mf4::records(&drive(FRAMES)).chunks(21).flat_map(|record| [&[0], record].concat()).collect();
    let records = file.block(*b"DT", &[], &records);
    file.set_link(at, 2, records);
    file.0
}
