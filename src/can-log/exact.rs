//! Reads or skips exactly as many bytes as a file announces.

use std::io::{self, ErrorKind, Read};

use crate::file_budget::Kept;

/// Minimum growth of a buffer, bytes.
const GROWTH: u64 = 64 << 10;

/// Skips `length` bytes. Fails if the source ends earlier.
pub(super) fn skip(source: &mut impl Read, length: u64) -> io::Result<()> {
    whole(io::copy(&mut source.take(length), &mut io::sink())?, length)
}

/// Appends bytes to `content`, which grows only as bytes arrive, within the budget. Fails if the source ends
/// earlier.
pub(super) fn append(
    source: &mut impl Read,
    length: u64,
    content: &mut Vec<u8>,
    kept: &mut Kept,
) -> io::Result<()> {
    whole(append_rest(source, length, content, kept)?, length)
}

/// Appends the rest of the source, at most `most` bytes, to `content`, which grows within the budget. Returns
/// the number of bytes appended.
pub(super) fn append_rest(
    source: &mut impl Read,
    most: u64,
    content: &mut Vec<u8>,
    kept: &mut Kept,
) -> io::Result<u64> {
    let mut read = 0;
    while read < most {
        let piece = (content.len() as u64).max(GROWTH).min(most - read);
        if content.capacity() - content.len() < usize::try_from(piece).unwrap_or(usize::MAX) {
            kept.resize(content.len() as u64 + piece)?;
        }
        let of_piece = source.take(piece).read_to_end(content)? as u64;
        read += of_piece;
        if of_piece < piece {
            break;
        }
    }
    Ok(read)
}

fn whole(read: u64, length: u64) -> io::Result<()> {
    if read == length { Ok(()) } else { Err(ErrorKind::UnexpectedEof.into()) }
}

/// Returns the error for a missing part of a file whose readable part is kept: the `failure` that ended
/// reading, or the end of the file.
pub(super) fn missing_part(failure: Option<&io::Error>) -> io::Error {
    failure.map_or_else(
        || ErrorKind::UnexpectedEof.into(),
        |failure| io::Error::new(failure.kind(), failure.to_string()),
    )
}
