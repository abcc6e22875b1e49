//! Decompresses gzip, bzip2, xz, Zstandard and LZ4 recordings with several members or frames, recognised by
//! their first bytes. Memory is bounded whatever sizes the file announces.

use std::error::Error;
use std::io::{self, BufRead, ErrorKind, Read};
use std::iter;

use bzip2::bufread::MultiBzDecoder;
use flate2::bufread::MultiGzDecoder;
use lz4_flex::frame::FrameDecoder as Lz4Decoder;
use lzma_rust2::XzReader;
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};

use crate::exact::skip;
use crate::file_budget::{FileBudget, Kept};

const GZIP: &[u8] = &[0x1F, 0x8B];
/// Followed by a digit in a file.
const BZIP2: &[u8] = b"BZh";
const XZ: &[u8] = &[0xFD, b'7', b'z', b'X', b'Z', 0];
const LZ4: &[u8] = &[0x04, 0x22, 0x4D, 0x18];
const ZSTD: &[u8] = &[0x28, 0xB5, 0x2F, 0xFD];
/// Last three bytes of the magic of a skippable Zstandard frame; the first byte is 0x50 to 0x5F.
const ZSTD_SKIPPABLE: &[u8] = &[0x2A, 0x4D, 0x18];

/// Memory limit of the xz decoder, KiB; `xz -9` needs 65 MiB.
const MAX_XZ_KIB: u32 = 96 << 10;
/// Maximum size of one read, bytes: when the file breaks off within a read, the decoders of xz and bzip2
/// discard that whole read.
const PIECE: usize = 1024;
/// Largest Zstandard window, bytes; the `zstd` tool has the same default limit.
const MAX_ZSTD_WINDOW: u64 = 128 << 20;
/// Memory of the Zstandard decoder besides a window, bytes: two blocks.
const ZSTD_BLOCKS: u64 = 256 << 10;

/// Longest header of a Zstandard frame, bytes.
const MAX_ZSTD_HEADER: usize = 18;

/// Cost of an unpacked byte, nominal ns.
mod cost {
    pub(super) const GZIP: u64 = 3;
    pub(super) const BZIP2: u64 = 15;
    pub(super) const XZ: u64 = 6;
    pub(super) const LZ4: u64 = 1;
    pub(super) const ZSTD: u64 = 2;
}
/// Cost of a member, block or frame that may be empty, nominal ns.
const PART_WORK: u64 = 500;

/// Returns the content of `source`, decompressed within the file's budget if it begins like a compressed
/// file. Fails if its first bytes cannot be read.
pub(super) fn decompressed(
    mut source: Box<dyn BufRead + Send>,
    budget: &FileBudget,
) -> io::Result<Box<dyn Read + Send>> {
    // A pipe may return its first bytes one at a time.
    let mut head = Vec::new();
    (&mut source).take(XZ.len() as u64).read_to_end(&mut head)?;
    let is = |magic| head.starts_with(magic);
    let (gzip, xz, lz4) = (is(GZIP), is(XZ), is(LZ4));
    let zstd = is(ZSTD)
        || head.first().is_some_and(|first| first >> 4 == 5) && head[1..].starts_with(ZSTD_SKIPPABLE);
    let bzip2 = is(BZIP2) && head.get(BZIP2.len()).is_some_and(u8::is_ascii_digit);
    let source = io::Cursor::new(head).chain(source);
    let decoder = |content, piece, byte_work| Decoder {
        content,
        is_failed: false,
        piece,
        byte_work,
        budget: budget.clone(),
    };
    Ok(if gzip {
        Box::new(decoder(Box::new(MultiGzDecoder::new(source)), usize::MAX, cost::GZIP))
    } else if xz {
        let kib = u32::try_from(budget.left() >> 10).unwrap_or(u32::MAX).min(MAX_XZ_KIB);
        Box::new(decoder(Box::new(XzReader::new_mem_limit(source, true, kib)), PIECE, cost::XZ))
    } else if bzip2 {
        Box::new(decoder(Box::new(MultiBzDecoder::new(source)), PIECE, cost::BZIP2))
    } else if lz4 {
        Box::new(decoder(Box::new(Lz4Decoder::new(source)), usize::MAX, cost::LZ4))
    } else if zstd {
        Box::new(decoder(Box::new(ZstdReader::new(source, budget.keep())), usize::MAX, cost::ZSTD))
    } else {
        Box::new(source)
    })
}

/// Decompresses within the budget. After an error, which may have left the decoder in an invalid state, it is
/// not called again.
struct Decoder {
    content: Box<dyn Read + Send>,
    is_failed: bool,
    /// Maximum number of bytes requested at once.
    piece: usize,
    /// Nominal ns.
    byte_work: u64,
    budget: FileBudget,
}

impl Read for Decoder {
    /// A damaged source fails with [`ErrorKind::Other`], so that no reader mistakes it for damage of one
    /// object, which the next read would skip.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.is_failed {
            return Err(io::Error::other("the compressed data are damaged"));
        }
        let length = buffer.len().min(self.piece);
        let outcome = self.content.read(&mut buffer[..length]);
        let outcome = outcome.and_then(|read| {
            self.budget.spend(read as u64 * self.byte_work)?;
            Ok(read)
        });
        outcome.map_err(|error| {
            self.is_failed = error.kind() != ErrorKind::Interrupted;
            let is_damage = matches!(error.kind(), ErrorKind::InvalidData | ErrorKind::InvalidInput);
            if error.kind() == ErrorKind::UnexpectedEof {
                io::Error::new(error.kind(), "the file ends within compressed data")
            } else if is_damage {
                io::Error::other(error)
            } else {
                error
            }
        })
    }
}

/// Reads the frames of a Zstandard file and skips skippable ones.
struct ZstdReader<R> {
    source: R,
    decoder: FrameDecoder,
    in_frame: bool,
    /// Largest window of the frames so far, bytes: the decoder reuses its memory.
    window: u64,
    kept: Kept,
    /// Reason why the frame ends early.
    broken: Option<io::Error>,
}

/// An empty block that ends a frame, and room for a checksum. The decoder keeps the window for blocks that
/// refer to it, and returns its content only at the end of a frame.
const LAST_BLOCK: [u8; 7] = [1, 0, 0, 0, 0, 0, 0];

impl<R: BufRead> ZstdReader<R> {
    fn new(source: R, kept: Kept) -> Self {
        let mut decoder = FrameDecoder::new();
        decoder.set_max_window_size(MAX_ZSTD_WINDOW);
        Self { source, decoder, in_frame: false, window: 0, kept, broken: None }
    }

    /// Reads the header of the next frame; returns false at the end of the file.
    fn enter(&mut self) -> io::Result<bool> {
        while !self.source.fill_buf()?.is_empty() {
            self.kept.budget().spend(PART_WORK)?;
            let mut header = [0; MAX_ZSTD_HEADER];
            self.source.read_exact(&mut header[..5])?;
            if header[1..].starts_with(ZSTD_SKIPPABLE) {
                self.source.read_exact(&mut header[5..8])?;
                let length = u32::from_le_bytes([header[4], header[5], header[6], header[7]]);
                skip(&mut self.source, length.into())?;
                continue;
            }
            let length = if header.starts_with(ZSTD) { zstd_header_length(header[4]) } else { 5 };
            self.source.read_exact(&mut header[5..length])?;
            let header = &header[..length];
            // The decoder refuses a frame with a larger window, and reports the size.
            let window = zstd_window(header).min(MAX_ZSTD_WINDOW);
            self.kept.resize(self.window.max(window) + ZSTD_BLOCKS)?;
            self.window = self.window.max(window);
            self.decoder.reset(header).map_err(|error| damaged(&error))?;
            self.in_frame = true;
            return Ok(true);
        }
        Ok(false)
    }

    /// Checks the frame that has ended against its checksum.
    fn leave(&mut self) -> io::Result<()> {
        self.in_frame = false;
        if let Some(error) = self.broken.take() {
            return Err(error);
        }
        let stored = self.decoder.get_checksum_from_data();
        if stored.is_some() && stored != self.decoder.get_calculated_checksum() {
            return Err(io::Error::new(ErrorKind::InvalidData, "Zstandard: wrong checksum"));
        }
        Ok(())
    }
}

/// Returns the length of a frame's header, from the descriptor after its magic.
fn zstd_header_length(descriptor: u8) -> usize {
    let is_single = descriptor & 0x20 != 0;
    let dictionary = [0, 1, 2, 4][usize::from(descriptor & 3)];
    let content_size = [usize::from(is_single), 2, 4, 8][usize::from(descriptor >> 6)];
    5 + usize::from(!is_single) + dictionary + content_size
}

/// Returns the size of the window that a frame's header announces, bytes. A single-segment frame has the size
/// of its content.
fn zstd_window(header: &[u8]) -> u64 {
    let [_, _, _, _, descriptor, window, ..] = *header else { return 0 };
    if descriptor & 0x20 == 0 {
        let base = 1_u64 << (10 + u32::from(window >> 3));
        return base + base / 8 * u64::from(window & 7);
    }
    let size = &header[5 + [0, 1, 2, 4][usize::from(descriptor & 3)]..];
    let mut bytes = [0; 8];
    bytes[..size.len()].copy_from_slice(size);
    u64::from_le_bytes(bytes) + if size.len() == 2 { 256 } else { 0 }
}

impl<R: BufRead> Read for ZstdReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            if !self.in_frame && !self.enter()? {
                return Ok(0);
            }
            let read = self.decoder.read(buffer)?;
            if read > 0 || buffer.is_empty() {
                return Ok(read);
            }
            if self.decoder.is_finished() {
                self.leave()?;
            } else {
                self.kept.budget().spend(PART_WORK)?;
                let step = || BlockDecodingStrategy::UptoBlocks(1);
                if let Err(error) = self.decoder.decode_blocks(&mut self.source, step()) {
                    self.broken = Some(damaged(&error));
                    self.decoder.decode_blocks(&LAST_BLOCK[..], step()).map_err(|error| damaged(&error))?;
                }
            }
        }
    }
}

fn damaged(error: &(dyn Error + 'static)) -> io::Error {
    let mut causes = iter::successors(Some(error), |cause: &&(dyn Error + 'static)| (*cause).source());
    let kind = causes.find_map(|cause| cause.downcast_ref::<io::Error>()).map(io::Error::kind);
    match kind {
        Some(ErrorKind::UnexpectedEof) => ErrorKind::UnexpectedEof.into(),
        _ => io::Error::new(ErrorKind::InvalidData, format!("Zstandard: {error}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::process::{Command, Stdio};

    /// Returns the output of a tool for this input; `None` if the tool is not installed.
    fn packed(tool: &str, arguments: &[&str], input: &[u8]) -> Option<Vec<u8>> {
        let mut command = Command::new(tool);
        let child = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut child = child.ok()?;
        let mut stdin = child.stdin.take().unwrap();
        let input = input.to_vec();
        let writer = std::thread::spawn(move || stdin.write_all(&input));
        let output = child.wait_with_output().unwrap();
        writer.join().unwrap().unwrap();
        Some(output.stdout)
    }

    fn unpacked(packed: &[u8]) -> io::Result<Vec<u8>> {
        let mut content = Vec::new();
        decompressed(Box::new(io::Cursor::new(packed.to_vec())), &FileBudget::default())?
            .read_to_end(&mut content)?;
        Ok(content)
    }

    /// Returns numbers that no compressor can shrink much.
    fn content() -> Vec<u8> {
        (0..300_000_u32).flat_map(|i| i.wrapping_mul(2_654_435_761).to_le_bytes()).collect()
    }

    #[test]
    fn every_compression_is_recognised_in_several_parts() {
        let content = content();
        assert_eq!(unpacked(&content).unwrap(), content, "nothing to unpack");
        for (tool, arguments) in [
            ("gzip", &["-c"][..]),
            ("bzip2", &["-c"]),
            ("xz", &["-c"]),
            ("xz", &["-9c"]),
            ("zstd", &["-qc"]),
            ("zstd", &["-19qc", "--long=27"]),
        ] {
            let Some(first) = packed(tool, arguments, &content[..100_000]) else {
                println!("skipped: no {tool} here");
                continue;
            };
            let both = [first, packed(tool, arguments, &content[100_000..]).unwrap()].concat();
            assert!(unpacked(&both).unwrap() == content, "{tool} {arguments:?}");
        }
    }

    #[test]
    fn damage_is_an_error_and_the_bytes_before_it_are_read() {
        let content = content();
        for (tool, arguments) in
            [("gzip", &["-c"][..]), ("bzip2", &["-1c"]), ("xz", &["-c"]), ("zstd", &["-qc"])]
        {
            let Some(whole) = packed(tool, arguments, &content) else {
                println!("skipped: no {tool} here");
                continue;
            };
            // Zstandard returns no partial blocks.
            let most_lost = if tool == "zstd" { 128 << 10 } else { PIECE };
            for place in 1..=20 {
                let cut = whole.len() / 21 * place + place;
                let mut reader =
                    decompressed(Box::new(io::Cursor::new(whole[..cut].to_vec())), &FileBudget::default())
                        .unwrap();
                let mut read = Vec::new();
                assert!(reader.read_to_end(&mut read).is_err(), "{tool}: cut");
                assert!(content.starts_with(&read), "{tool}");
                let by_tool = packed(tool, &["-dc"], &whole[..cut]).unwrap().len();
                assert!(read.len() + most_lost >= by_tool, "{tool} at {cut}: {} of {by_tool}", read.len());
                assert!(reader.read(&mut [0; 8]).is_err(), "{tool}: an error stays one");
            }
            for at in [whole.len() / 2, whole.len() - 2] {
                let mut damaged = whole.clone();
                damaged[at] ^= 0x55;
                assert!(unpacked(&damaged).is_err(), "{tool}: byte {at}");
            }
        }
    }

    #[test]
    fn memory_that_a_file_demands_is_bounded() {
        // A window of 2 GiB, and a dictionary of 1.5 GiB.
        let zstd = [ZSTD, &[0, 0xA8, 1, 0, 0]].concat();
        assert!(unpacked(&zstd).unwrap_err().to_string().contains("window"), "{:?}", unpacked(&zstd));
        let mut xz = b"\xFD7zXZ\0\0\x01\x69\x22\xDE\x36".to_vec();
        let block = [2, 0, 0x21, 1, 0x25, 0, 0, 0];
        xz.extend(block);
        xz.extend(crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&block).to_le_bytes());
        xz.extend([0; 64]);
        assert!(unpacked(&xz).unwrap_err().to_string().contains("memory"), "{:?}", unpacked(&xz));
    }

    #[test]
    fn skippable_frames_are_passed_over() {
        let Some(frame) = packed("zstd", &["-qc"], b"text") else { return println!("skipped: no zstd here") };
        let skippable = [&[0x51][..], ZSTD_SKIPPABLE, &3_u32.to_le_bytes(), b"abc"].concat();
        assert_eq!(unpacked(&[skippable.clone(), frame, skippable].concat()).unwrap(), b"text");
    }
}
