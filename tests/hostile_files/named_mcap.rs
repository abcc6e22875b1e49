//! MCAP that is hostile on purpose: names, chunks in chunks, windows, lengths and stamps.

use super::named::{DECODED, FRAMES, MOST, Named, QUICK, turn};
use super::packing::{Packing, ZstdByHand, zstd_of_one_value};
use super::recordings::{Frame, drive, mcap};

pub(crate) const ALL: &[Named] = &[
    Named("schemas.mcap", MOST, DECODED, |size| mcap_of_names(size, schema_of_long_name)),
    Named("schemas.mcap.zst", QUICK, DECODED, |size| {
        let start = [mcap::MAGIC.to_vec(), frames_of_mcap()].concat();
        names_by_hand(ZstdByHand::new(17).stored(&start), size, schema_of_long_name)
            .stored(&mcap::end())
            .finish()
    }),
    Named("topics.mcap", MOST, DECODED, |size| {
        mcap_of_names(size, |id, length| mcap::channel(id, 9, &vec![b'x'; length]))
    }),
    Named("topics_of_frames.mcap", QUICK, DECODED, |size| {
        mcap_of_names(size, |id, length| {
            let topic = [&[b'x'; 1].repeat(length)[..], b"/from_can_bus"].concat();
            mcap::channel(id, 1, &topic)
        })
    }),
    Named("nested_chunks.mcap", QUICK, DECODED, |size| {
        let mut records = frames_of_mcap();
        while records.len() < size / 4 {
            for packing in ["", "lz4", "zstd"] {
                let packed = match packing {
                    "lz4" => Packing::Lz4.pack(&records),
                    "zstd" => Packing::Zstd.pack(&records),
                    _ => records.clone(),
                };
                let chunk = mcap::chunk(packing, records.len() as u64, &packed);
                records.extend(chunk);
            }
        }
        mcap::file(&records)
    }),
    Named("chunk_of_zeros.mcap", MOST, DECODED, |size| {
        // Two windows of Zstandard: one of the file, one of a chunk in it, which is packed twice again.
        let zeros = zstd_of_one_value(0, size * 2000, 27);
        let twice = Packing::Zstd.pack(&zeros);
        let chunk = mcap::chunk("zstd", 1 << 40, &twice);
        mcap::file(&[frames_of_mcap(), mcap::chunk("zstd", 1 << 40, &zeros), chunk].concat())
    }),
    Named("two_windows.mcap.zst", QUICK, DECODED, |size| {
        // An attachment that fills the window of the file, and chunks that fill their own.
        const LENGTH: usize = 130 << 20;
        let start = [mcap::MAGIC.to_vec(), frames_of_mcap()].concat();
        let attachment = [&[9][..], &(LENGTH as u64).to_le_bytes()].concat();
        let chunk = mcap::chunk("zstd", 1 << 40, &zstd_of_one_value(0, size * 1000, 27));
        let rest = [chunk, mcap::end()].concat();
        ZstdByHand::new(27).stored(&start).stored(&attachment).run(0, LENGTH).stored(&rest).finish()
    }),
    Named("announced_chunk.mcap", QUICK, DECODED, |_| {
        let mut chunk = mcap::chunk("lz4", u64::MAX, &Packing::Lz4.pack(&frames_of_mcap()));
        // The lengths of the packed records and of the whole.
        chunk[1..9].copy_from_slice(&(1_u64 << 62).to_le_bytes());
        mcap::file(&[frames_of_mcap(), chunk].concat())
    }),
    Named("empty_chunks.mcap.gz", QUICK, DECODED, |size| {
        let chunks = mcap::chunk("", 0, &[]).repeat(20_000);
        let start = Packing::Gzip.pack(&[mcap::MAGIC.to_vec(), frames_of_mcap()].concat());
        let piece = Packing::Gzip.pack(&chunks);
        [start, piece.repeat(size / piece.len() + 1)].concat()
    }),
    Named("announced_arrays.mcap", QUICK, DECODED, |size| {
        let fd = [
            mcap::schema(2, b"ros2_socketcan_msgs/msg/FdFrame"),
            mcap::channel(2, 2, b"/can0/from_can_bus_fd"),
        ];
        let mut frame = vec![0, 1, 0, 0];
        frame.extend([1_u32, 0, 4].map(u32::to_le_bytes).concat());
        frame.extend(b"can\0");
        frame.extend([1, 0, 0x0800_0000, u32::MAX].map(u32::to_le_bytes).concat());
        let mut named = mcap::cdr(&drive(1)[0]);
        named[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
        let messages = [mcap::message(2, 1, &frame), mcap::message(1, 1, &named)].concat();
        mcap::file(&[frames_of_mcap(), fd.concat(), messages.repeat(size / messages.len())].concat())
    }),
    Named("scattered.mcap", MOST, 2, |_| {
        let frames: Vec<Frame> = (0..3000_u64)
            .map(|index| Frame {
                micros: 1_600_000_000_000_000 + index * 7_919 % 3001 * 30_000_000_000,
                ..turn()
            })
            .collect();
        mcap::file(&[mcap::described(), mcap::messages(&frames)].concat())
    }),
];

fn frames_of_mcap() -> Vec<u8> {
    [mcap::described(), mcap::messages(&drive(FRAMES))].concat()
}

fn schema_of_long_name(id: u16, length: usize) -> Vec<u8> {
    mcap::schema(id, &vec![b'x'; length])
}

/// Records with long names in a chunk of Zstandard.
fn mcap_of_names(size: usize, record: fn(u16, usize) -> Vec<u8>) -> Vec<u8> {
    let packed = names_by_hand(ZstdByHand::new(17), size, record).finish();
    mcap::file(&[frames_of_mcap(), mcap::chunk("zstd", 1 << 40, &packed)].concat())
}

/// Records whose names pack to next to nothing, of about so many bytes all in all, but not more than make six
/// gigabytes.
fn names_by_hand(zstd: ZstdByHand, size: usize, record: fn(u16, usize) -> Vec<u8>) -> ZstdByHand {
    const NAME: usize = 1_000_000;
    let count = u16::try_from((size / 80).min(6_000)).unwrap();
    (10..10 + count).fold(zstd, |zstd, id| {
        let record = record(id, NAME);
        // Behind two numbers and the length of the name.
        let before = record.windows(4).position(|part| part == b"xxxx").unwrap();
        zstd.stored(&record[..before]).run(b'x', NAME).stored(&record[before + NAME..])
    })
}
