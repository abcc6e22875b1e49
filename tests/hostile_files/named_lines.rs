//! Lines that are hostile on purpose: none, bad ones and short ones, packed as tightly as can be.

use super::choices::Choices;
use super::named::{DECODED, FRAMES, MOST, Named, QUICK, gzip_of, turn};
use super::packing::{EMPTY_LZ4, EMPTY_SKIPPABLE, Packing, zstd_of_one_value};
use super::recordings::{Frame, TEXT_FORMATS, drive, text};

const BLANK: &[u8] = &[b'\n'; 1 << 20];

pub(crate) const ALL: &[Named] = &[
    Named("empty_members.log.gz", QUICK, DECODED, |size| often(Packing::Gzip, b"", size)),
    Named("empty_members.log.bz2", QUICK, DECODED, |size| often(Packing::Bzip2, b"", size)),
    Named("empty_members.log.xz", QUICK, DECODED, |size| often(Packing::Xz, b"", size)),
    Named("empty_members.log.zst", QUICK, DECODED, |size| {
        [Packing::Zstd.pack(&candump()), EMPTY_SKIPPABLE.repeat(size / 8)].concat()
    }),
    Named("empty_members.log.lz4", QUICK, DECODED, |size| {
        [Packing::Lz4.pack(&candump()), EMPTY_LZ4.repeat(size / EMPTY_LZ4.len())].concat()
    }),
    Named("blank.log.gz", QUICK, DECODED, |size| often(Packing::Gzip, BLANK, size)),
    Named("blank.log.bz2", QUICK, DECODED, |size| often(Packing::Bzip2, BLANK, size)),
    Named("blank.log.xz", QUICK, DECODED, |size| often(Packing::Xz, BLANK, size)),
    Named("blank.log.zst", QUICK, DECODED, |size| {
        [Packing::Zstd.pack(&candump()), zstd_of_one_value(b'\n', size * 30_000, 17)].concat()
    }),
    Named("blank.log.lz4", QUICK, DECODED, |size| often(Packing::Lz4, BLANK, size)),
    Named("jumps.candump.log", MOST, 200, |_| {
        let frames: Vec<_> = (0..200_u64)
            .map(|index| Frame {
                micros: 1_000_000_000_000 + index / 2 * 1_000_003_000_000 + index,
                ..turn()
            })
            .collect();
        text(TEXT_FORMATS[0], &frames)
    }),
    Named("back_and_forth.candump.log", MOST, 200, |size| {
        let frames: Vec<_> = (0..size as u64 / 40)
            .map(|index| Frame { micros: if index % 2 == 0 { 1 } else { 9_000_000_000_000_000 }, ..turn() })
            .collect();
        text(TEXT_FORMATS[0], &frames)
    }),
    Named("short_lines.slcan.bz2", MOST, 0, |size| {
        let start = Packing::Bzip2.pack(&text(TEXT_FORMATS[12], &drive(FRAMES)));
        let piece = Packing::Bzip2.pack(&b"t1230\n".repeat(140_000));
        [start, piece.repeat(size / piece.len() + 1)].concat()
    }),
    Named("bad_lines.log.bz2", QUICK, DECODED, |size| of_lines(b"(1 x\n", size)),
    Named("short_frames.candump.log.bz2", MOST, DECODED, |size| of_lines(b"(1.0) can0 2A5#\n", size)),
    Named("identifiers.candump.log.gz", MOST, DECODED, |size| {
        let start = Packing::Gzip.pack(&candump());
        let lines = |part: u32| -> Vec<u8> {
            let line = |id: u32| format!("(1.0) can0 {:08X}#\n", part * 100_000 + id).into_bytes();
            (0..100_000).flat_map(line).collect()
        };
        let mut file = start;
        let mut part = 0;
        while file.len() < size {
            file.extend(Packing::Gzip.pack(&lines(part)));
            part += 1;
        }
        file
    }),
    Named("interfaces.candump.log.gz", QUICK, DECODED, |size| {
        let lines: Vec<u8> = (0..size as u64 / 6)
            .flat_map(|number| format!("(1.0) {number:0200}can 2A5#\n").into_bytes())
            .collect();
        Packing::Gzip.pack(&[candump(), lines].concat())
    }),
    // A line with a semicolon begins a trace of PCAN.
    Named("random_bytes.trc", QUICK, 0, |size| {
        let mut random = Choices::of(1, 1);
        b";\n".iter().copied().chain((0..size).map(|_| u8::try_from(random.below(256)).unwrap())).collect()
    }),
    Named("one_line.log.bz2", QUICK, DECODED, |size| of_lines(&[b'x'; 64], size)),
    Named("huge_numbers.asc", QUICK, DECODED, |size| {
        let line = format!("   {0}.{0} {0}  2A5             Rx   d {0} {0}\n", "9".repeat(200));
        [text(TEXT_FORMATS[1], &drive(FRAMES)), line.repeat(size / line.len()).into_bytes()].concat()
    }),
    Named("huge_numbers.trc", QUICK, DECODED, |size| {
        let line = format!("  1 {0}.{0} DT 1 02A5 Rx - {0} {0}\n", "9".repeat(200));
        [text(TEXT_FORMATS[2], &drive(FRAMES)), line.repeat(size / line.len()).into_bytes()].concat()
    }),
    Named("huge_numbers.csv", QUICK, 0, |size| {
        let line = format!("{0},{0},false,Rx,{0},8,{0},1,2,3,4,5,6,7\n", "9".repeat(100));
        [text(TEXT_FORMATS[3], &drive(FRAMES)), line.repeat(size / line.len()).into_bytes()].concat()
    }),
    Named("one_line.carbus.trc.gz", QUICK, 0, |size| {
        let start = Packing::Gzip.pack(&super::recordings::carbus(&drive(FRAMES)));
        [start, gzip_of(&[b'x'].repeat(1 << 20), size)].concat()
    }),
];

fn candump() -> Vec<u8> {
    text(TEXT_FORMATS[0], &drive(FRAMES))
}

/// Frames, and then the same member again and again.
fn often(packing: Packing, content: &[u8], size: usize) -> Vec<u8> {
    let piece = packing.pack(content);
    [packing.pack(&candump()), piece.repeat(size / piece.len() + 1)].concat()
}

/// Lines of candump, and then the same line, of which bzip2 makes next to nothing.
fn of_lines(line: &[u8], size: usize) -> Vec<u8> {
    let piece = Packing::Bzip2.pack(&line.repeat(800_000 / line.len()));
    [Packing::Bzip2.pack(&candump()), piece.repeat(size / piece.len() + 1)].concat()
}
