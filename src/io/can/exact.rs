//! Reads or passes over exactly as many bytes as a file announces.

use std::io::{self, ErrorKind, Read};

/// Passes over bytes. Fails if the source ends before.
pub(super) fn skip(source: &mut impl Read, length: u64) -> io::Result<()> {
    whole(io::copy(&mut source.take(length), &mut io::sink())?, length)
}

/// Appends bytes to `content`, which grows with what there is. Fails if the source ends before.
pub(super) fn append(source: &mut impl Read, length: u64, content: &mut Vec<u8>) -> io::Result<()> {
    whole(source.take(length).read_to_end(content)? as u64, length)
}

fn whole(read: u64, length: u64) -> io::Result<()> {
    if read == length { Ok(()) } else { Err(ErrorKind::UnexpectedEof.into()) }
}
