//! The data of a group in an MF4 file: one stream from plain, listed or packed blocks.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::ops::Range;

use flate2::read::ZlibDecoder;

use super::mf4_blocks::{Blocks, unexpected};
use crate::exact::append_rest;
use crate::file_budget::Kept;
use crate::format::damaged;
use crate::little_endian::{u32_at, u64_at};

/// Largest unpacked content of a block, bytes. The format allows 4 MiB.
const MAX_UNPACKED: u64 = 64 << 20;
/// Cost of an unpacked byte, including its transposition from columns to rows, nominal ns.
const UNPACKED_WORK: u64 = 5;
/// Number of plain bytes that cost a nominal ns.
const BYTES_PER_WORK: u64 = 4;
/// Length of the numbers before the content of a packed block, bytes.
const PACKED_HEAD: usize = 24;
/// Size of a block's link in a list, bytes.
const LINK: u64 = 8;

/// Reads data piece by piece.
pub(super) struct DataReader {
    blocks: VecDeque<u64>,
    piece: Piece,
    /// Memory of `piece` and `blocks`.
    kept: Kept,
    /// Bytes that lie in more than one block.
    joined: Vec<u8>,
    joined_kept: Kept,
    /// Reason why nothing after the listed blocks can be read.
    failure: Option<io::Error>,
}

enum Piece {
    InFile(Range<usize>),
    Unpacked(Vec<u8>, usize),
}

impl Piece {
    fn left(&self) -> usize {
        match self {
            Self::InFile(range) => range.len(),
            Self::Unpacked(bytes, at) => bytes.len() - at,
        }
    }

    /// Returns up to `length` of the remaining bytes, and advances past them.
    fn take<'a>(&'a mut self, file: &'a Blocks, length: usize) -> &'a [u8] {
        let length = length.min(self.left());
        match self {
            Self::InFile(range) => {
                let start = range.start;
                range.start += length;
                file.bytes(start..start + length)
            }
            Self::Unpacked(bytes, at) => {
                *at += length;
                &bytes[*at - length..*at]
            }
        }
    }
}

impl DataReader {
    /// Lists the data blocks that a link leads to. Blocks that cannot be listed cause a failure when reading
    /// reaches them.
    pub(super) fn new(file: &Blocks, link: Option<u64>) -> Self {
        let (mut blocks, mut kept) = (VecDeque::new(), file.budget.keep());
        let failure = link.and_then(|link| list(file, link, &mut blocks, &mut kept).err());
        let (joined, joined_kept) = (Vec::new(), file.budget.keep());
        Self { blocks, piece: Piece::InFile(0..0), kept, joined, joined_kept, failure }
    }

    /// Returns the next `length` bytes; `None` at the end. Fails if the data ends within them.
    pub(super) fn take<'a>(&'a mut self, file: &'a Blocks, length: usize) -> io::Result<Option<&'a [u8]>> {
        if self.piece.left() >= length {
            return Ok(Some(self.piece.take(file, length)));
        }
        self.joined.clear();
        loop {
            let part = self.piece.take(file, length - self.joined.len());
            self.joined_kept.resize((self.joined.len() + part.len()).max(self.joined.capacity()) as u64)?;
            self.joined.extend(part);
            if self.joined.len() == length {
                return Ok(Some(&self.joined));
            }
            if !self.enter(file)? {
                let is_whole = self.joined.is_empty();
                return if is_whole { Ok(None) } else { Err(ErrorKind::UnexpectedEof.into()) };
            }
        }
    }

    /// Appends all remaining bytes to `content`, within the budget; a failure counts as the end.
    pub(super) fn append_all(mut self, file: &Blocks, content: &mut Vec<u8>, kept: &mut Kept) {
        while self.piece.left() > 0 || matches!(self.enter(file), Ok(true)) {
            let part = self.piece.take(file, usize::MAX);
            if kept.grow(part.len() as u64).is_err() {
                return;
            }
            content.extend(part);
        }
    }

    /// Enters the next block; returns false at the end.
    fn enter(&mut self, file: &Blocks) -> io::Result<bool> {
        let Some(at) = self.blocks.pop_front() else { return self.failure.take().map_or(Ok(false), Err) };
        let (kind, range, is_cut) = file.data(at)?;
        let failure = if kind == *b"DZ" {
            // Frees the memory of the previous block.
            self.piece = Piece::InFile(0..0);
            let listed = self.blocks.len() as u64 * LINK;
            self.kept.resize(listed)?;
            let (content, failure) = unpack(file.bytes(range), &mut self.kept)?;
            self.kept.resize(listed + content.len() as u64)?;
            self.piece = Piece::Unpacked(content, 0);
            failure
        } else {
            file.budget.spend(range.len() as u64 / BYTES_PER_WORK)?;
            self.piece = Piece::InFile(range);
            None
        };
        if is_cut || failure.is_some() {
            self.blocks.clear();
            self.failure = Some(failure.unwrap_or_else(|| file.cut()));
        }
        Ok(true)
    }
}

fn list(file: &Blocks, link: u64, blocks: &mut VecDeque<u64>, kept: &mut Kept) -> io::Result<()> {
    let mut next = Some(link);
    while let Some(at) = next.take() {
        let (kind, ..) = file.data(at)?;
        match &kind {
            b"DT" | b"SD" | b"DZ" => blocks.push_back(at),
            b"HL" => next = file.block(at)?.link(0),
            b"DL" => {
                let list = file.block(at)?;
                kept.grow(list.link_count() as u64 * LINK)?;
                blocks.extend((1..list.link_count()).filter_map(|index| list.link(index)));
                next = list.link(0);
            }
            _ => return Err(unexpected(kind)),
        }
    }
    Ok(())
}

/// Unpacks a block. Returns the bytes that could be unpacked, and the reason if they are not all.
fn unpack(block: &[u8], kept: &mut Kept) -> io::Result<(Vec<u8>, Option<io::Error>)> {
    let (head, packed) = block.split_at_checked(PACKED_HEAD).ok_or(ErrorKind::UnexpectedEof)?;
    let (method, columns, length) = (head[2], u32_at(head, 4), u64_at(head, 8));
    if method > 1 || length > MAX_UNPACKED {
        return Err(damaged("MF4: a packed block is of an unknown kind or too large"));
    }
    let (mut content, mut unpacked) = (Vec::new(), kept.budget().keep());
    let outcome = append_rest(&mut ZlibDecoder::new(packed), length, &mut content, &mut unpacked);
    kept.budget().spend(content.len() as u64 * UNPACKED_WORK)?;
    let failure = match outcome {
        Err(error) => Some(error),
        Ok(_) if (content.len() as u64) < length => Some(ErrorKind::UnexpectedEof.into()),
        Ok(_) => None,
    };
    Ok(match (method, failure) {
        (0, failure) => (content, failure),
        // Part of a transposed block is useless.
        (_, Some(failure)) => return Err(failure),
        (_, None) => {
            unpacked.resize(2 * content.len() as u64)?;
            (rows_of_columns(&content, usize::try_from(columns).unwrap_or(0)), None)
        }
    })
}

/// Undoes the transposition of rows with `width` bytes. Remaining bytes of an incomplete row stay at the end
/// unchanged.
fn rows_of_columns(columns: &[u8], width: usize) -> Vec<u8> {
    let Some(height) = columns.len().checked_div(width).filter(|height| *height > 0) else {
        return columns.to_vec();
    };
    let (table, rest) = columns.split_at(width * height);
    let rows = (0..height).flat_map(|row| table.iter().skip(row).step_by(height));
    rows.chain(rest).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_rows_again_and_a_part_of_a_row_stays() {
        assert_eq!(rows_of_columns(b"ADBECFx", 3), b"ABCDEFx");
        assert_eq!(rows_of_columns(b"AB", 3), b"AB");
        assert_eq!(rows_of_columns(b"AB", 0), b"AB");
    }
}
