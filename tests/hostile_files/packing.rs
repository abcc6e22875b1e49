//! Compressed files, as tools write them and as nobody should: members by the thousand, windows and sizes
//! that are only announced.

use std::io::Write;

/// How a file, or a chunk in one, is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Packing {
    Gzip,
    Bzip2,
    Xz,
    Zstd,
    Lz4,
}

pub(crate) const PACKINGS: [Packing; 5] =
    [Packing::Gzip, Packing::Bzip2, Packing::Xz, Packing::Zstd, Packing::Lz4];

impl Packing {
    /// The end of the name of a file, and the name that a chunk of MCAP has.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gz",
            Self::Bzip2 => "bz2",
            Self::Xz => "xz",
            Self::Zstd => "zstd",
            Self::Lz4 => "lz4",
        }
    }

    /// Packs as one member.
    pub(crate) fn pack(self, content: &[u8]) -> Vec<u8> {
        match self {
            Self::Gzip => {
                let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
                packer.write_all(content).unwrap();
                packer.finish().unwrap()
            }
            Self::Bzip2 => {
                let mut packer = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::best());
                packer.write_all(content).unwrap();
                packer.finish().unwrap()
            }
            Self::Xz => {
                let mut options = lzma_rust2::XzOptions::with_preset(1);
                // A small dictionary for a small content, which costs less to write.
                options.lzma_options.dict_size =
                    u32::try_from(content.len().next_power_of_two().clamp(1 << 12, 1 << 20)).unwrap();
                let mut packer = lzma_rust2::XzWriter::new(Vec::new(), options).unwrap();
                packer.write_all(content).unwrap();
                packer.finish().unwrap()
            }
            Self::Zstd => {
                ruzstd::encoding::compress_to_vec(content, ruzstd::encoding::CompressionLevel::Fastest)
            }
            Self::Lz4 => {
                let mut packer = lz4_flex::frame::FrameEncoder::new(Vec::new());
                packer.write_all(content).unwrap();
                packer.finish().unwrap()
            }
        }
    }

    /// Packs the same content again and again, `times` members of it; for 0 times a member of nothing.
    pub(crate) fn pack_often(self, content: &[u8], times: usize) -> Vec<u8> {
        self.pack(content).repeat(times)
    }
}

/// Packs with zlib, as containers of BLF and blocks of MF4 are.
pub(crate) fn zlib(content: &[u8]) -> Vec<u8> {
    let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(content).unwrap();
    packer.finish().unwrap()
}

/// A frame of Zstandard made by hand, which packs a run of one value to four bytes for each 128 KiB.
pub(crate) struct ZstdByHand(Vec<u8>);

impl ZstdByHand {
    /// `window_log` is the logarithm of the window that is announced, from 10 on.
    pub(crate) fn new(window_log: u8) -> Self {
        Self(vec![0x28, 0xB5, 0x2F, 0xFD, 0x00, (window_log - 10) << 3])
    }

    fn block(&mut self, kind: u32, size: usize, content: &[u8]) {
        let head = u32::try_from(size).unwrap() << 3 | kind << 1;
        self.0.extend(&head.to_le_bytes()[..3]);
        self.0.extend(content);
    }

    pub(crate) fn stored(mut self, content: &[u8]) -> Self {
        content.chunks(128 << 10).for_each(|part| self.block(0, part.len(), part));
        self
    }

    pub(crate) fn run(mut self, value: u8, mut length: usize) -> Self {
        while length > 0 {
            let size = length.min(128 << 10);
            self.block(1, size, &[value]);
            length -= size;
        }
        self
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        // An empty block, the last.
        self.0.extend([1, 0, 0]);
        self.0
    }
}

pub(crate) fn zstd_of_one_value(value: u8, length: usize, window_log: u8) -> Vec<u8> {
    ZstdByHand::new(window_log).run(value, length).finish()
}

/// A frame of LZ4 without content.
pub(crate) const EMPTY_LZ4: [u8; 11] = [0x04, 0x22, 0x4D, 0x18, 0x60, 0x40, 0x82, 0, 0, 0, 0];

/// Zeros before and behind which there may be something else, of about a thousandth of their length.
pub(crate) fn gzip_of_zeros_behind(content: &[u8], mebibytes: usize) -> Vec<u8> {
    [Packing::Gzip.pack(content), Packing::Gzip.pack_often(&vec![0; 1 << 20], mebibytes)].concat()
}

/// A skippable frame of Zstandard without content.
pub(crate) const EMPTY_SKIPPABLE: [u8; 8] = [0x50, 0x2A, 0x4D, 0x18, 0, 0, 0, 0];
