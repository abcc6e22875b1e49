//! Blocks of an ASAM MDF 4 file, which is held in memory since they refer to each other in any order.
//!
//! A block has two letters as its kind, its length, links to other blocks and data; a link of 0 leads
//! nowhere. The number of visits to blocks is bounded, so that reading ends whatever the links contain.

use std::cell::Cell;
use std::io::{self, ErrorKind};
use std::ops::Range;

use crate::exact::{append_rest, missing_part};
use crate::file_budget::{FileBudget, Kept};
use crate::format::{ObjectSource, damaged, refused};
use crate::little_endian::u64_at;

/// Cost of visiting a block, nominal ns.
const BLOCK_WORK: u64 = 100;
/// Length of the identification of a file, bytes; the block `HD` follows.
const IDENTIFICATION: usize = 64;
/// Length of the head of a block, bytes.
const HEAD: usize = 24;

pub(super) struct Blocks {
    bytes: Vec<u8>,
    /// True if the writer did not finish the file, so that the length of its data is not recorded.
    is_unfinished: bool,
    /// Number of bytes of blocks that may still be visited.
    unvisited: Cell<u64>,
    pub(super) budget: FileBudget,
    /// Memory of `bytes`.
    _kept: Kept,
    /// Reason why the file could not be read to its end.
    failure: Option<io::Error>,
}

/// A block other than a data block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block<'a> {
    pub(super) kind: [u8; 2],
    links: &'a [u8],
    /// Content after the links.
    pub(super) data: &'a [u8],
}

impl Block<'_> {
    /// Returns the target of a link; `None` for a null link.
    pub(super) fn link(&self, index: usize) -> Option<u64> {
        Some(u64_at(self.links, index * 8)).filter(|link| *link != 0)
    }

    pub(super) fn link_count(&self) -> usize {
        self.links.len() / 8
    }
}

impl Blocks {
    /// Reads as much of a file as possible. Fails if it is not of version 4.
    pub(super) fn read(mut source: ObjectSource) -> io::Result<Self> {
        let budget = source.budget.clone();
        budget.allow_whole();
        let (mut bytes, mut kept) = (Vec::new(), budget.keep());
        let failure = append_rest(&mut source, u64::MAX, &mut bytes, &mut kept).err();
        if bytes.len() < IDENTIFICATION {
            return Err(failure.unwrap_or_else(|| ErrorKind::UnexpectedEof.into()));
        }
        if bytes[8] != b'4' {
            return Err(refused(
                format!("MDF {} is not supported", String::from_utf8_lossy(&bytes[8..12])),
                "convert it to MDF 4, e.g. with asammdf",
            ));
        }
        // The data of an unsorted group are visited twice, for its values of variable length.
        let unvisited = Cell::new(4 * bytes.len() as u64);
        let is_unfinished = bytes.starts_with(b"UnFinMF ");
        Ok(Self { bytes, is_unfinished, unvisited, budget, _kept: kept, failure })
    }

    /// Returns the error for a missing part of the file.
    pub(super) fn cut(&self) -> io::Error {
        missing_part(self.failure.as_ref())
    }

    pub(super) fn header(&self) -> io::Result<Block<'_>> {
        self.block_of_kind(IDENTIFICATION as u64, *b"HD")
    }

    pub(super) fn block_of_kind(&self, at: u64, kind: [u8; 2]) -> io::Result<Block<'_>> {
        let block = self.block(at)?;
        if block.kind == kind { Ok(block) } else { Err(unexpected(block.kind)) }
    }

    /// Returns a block. Fails if the file ends within it, or there is none at this position.
    pub(super) fn block(&self, at: u64) -> io::Result<Block<'_>> {
        let (kind, content, is_cut) = self.data(at)?;
        if is_cut {
            return Err(self.cut());
        }
        let links = u64_at(&self.bytes, content.start - 8);
        let links = usize::try_from(links).ok().and_then(|links| links.checked_mul(8));
        let parts = links.and_then(|links| self.bytes[content].split_at_checked(links));
        let (links, data) = parts.ok_or_else(|| unexpected(kind))?;
        Ok(Block { kind, links, data })
    }

    pub(super) fn bytes(&self, range: Range<usize>) -> &[u8] {
        self.bytes.get(range).unwrap_or_default()
    }

    /// Returns a text, e.g. the name of a channel; empty if there is none.
    pub(super) fn text(&self, at: Option<u64>) -> io::Result<String> {
        let Some(at) = at else { return Ok(String::new()) };
        let text = self.block(at)?.data;
        let end = text.iter().position(|byte| *byte == 0).unwrap_or(text.len());
        Ok(String::from_utf8_lossy(&text[..end]).into_owned())
    }

    /// Returns the kind and content range of a block, and true if the file ends within the content.
    pub(super) fn data(&self, at: u64) -> io::Result<([u8; 2], Range<usize>, bool)> {
        self.budget.spend(BLOCK_WORK)?;
        let start = usize::try_from(at).map_err(|_| self.cut())?;
        let head = start.checked_add(HEAD).and_then(|end| self.bytes.get(start..end));
        let head = head.ok_or_else(|| self.cut())?;
        let kind = [head[2], head[3]];
        if !head.starts_with(b"##") {
            return Err(damaged(format!("MF4: no block at byte {at}")));
        }
        let (content, rest) = (start + HEAD, self.bytes.len() - start - HEAD);
        let length = u64_at(head, 8).saturating_sub(HEAD as u64);
        let is_open = self.is_unfinished && kind == *b"DT" && length == 0;
        let (length, is_cut) = match usize::try_from(length) {
            _ if is_open => (rest, self.failure.is_some()),
            Ok(length) if length <= rest => (length, false),
            _ => (rest, true),
        };
        let left = self.unvisited.get().checked_sub((HEAD + length) as u64);
        self.unvisited.set(left.ok_or_else(|| damaged("MF4: the blocks refer to each other in a circle"))?);
        Ok((kind, content..content + length, is_cut))
    }
}

pub(super) fn unexpected(kind: [u8; 2]) -> io::Error {
    damaged(format!("MF4: unexpected block {}", String::from_utf8_lossy(&kind)))
}
