//! Reads Cap'n Proto messages, as far as recordings need them (<https://capnproto.org/encoding.html>).
//!
//! A message has segments of 8-byte words. Pointers lead to structures, which have numbers and then pointers,
//! and to lists; a far pointer leads to a pointer in another segment.

use std::io::{self, ErrorKind, Read};

use crate::exact::append;
use crate::file_budget::{FileBudget, Kept};
use crate::format::{ObjectSource, damaged};

/// Length of a word, bytes.
const WORD: usize = 8;
/// Largest valid message, bytes; pictures and settings in logs have a few megabytes.
const MAX_BYTES: u64 = 16 << 20;
/// Maximum number of segments of a valid message.
const MAX_SEGMENTS: u32 = 512;

/// Returns true if `head`, the beginning of a file, starts with a message whose root is a structure with this
/// number of words and pointers.
pub(super) fn begins(head: &[u8], words: u16, pointers: u16) -> bool {
    let Some(last) = head.first_chunk().map(|last| u32::from_le_bytes(*last)) else { return false };
    let root = if last < MAX_SEGMENTS { head.get(table_length(last)..) } else { None };
    let [[a, b], [c, d]] = [words, pointers].map(u16::to_le_bytes);
    root.is_some_and(|root| root.starts_with(&[0, 0, 0, 0, a, b, c, d]))
}

/// Returns the length of the table before the segments, bytes; `last` is the number of segments minus one.
fn table_length(last: u32) -> usize {
    (8 + 4 * usize::try_from(last).unwrap_or(0)).next_multiple_of(WORD)
}

/// A message, whose buffer is reused for the next message.
#[derive(Debug)]
pub(super) struct Message {
    bytes: Vec<u8>,
    kept: Kept,
    /// Start and end of each segment in `bytes`.
    segments: Vec<(usize, usize)>,
}

/// A structure in a message.
#[derive(Debug, Clone, Copy)]
pub(super) struct Struct<'a> {
    message: &'a Message,
    segment: usize,
    /// Start of the numbers in the segment, bytes.
    start: usize,
    words: usize,
    pointers: usize,
}

/// The structures of a list.
#[derive(Debug, Clone, Copy)]
pub(super) struct Structs<'a> {
    first: Struct<'a>,
    count: usize,
}

struct Target {
    segment: usize,
    /// Start of the target in the segment, bytes.
    start: usize,
    pointer: u64,
}

impl Message {
    /// Creates an empty message; its buffer counts against the budget.
    pub(super) fn new(budget: &FileBudget) -> Self {
        Self { bytes: Vec::new(), kept: budget.keep(), segments: Vec::new() }
    }

    /// Reads the next message; returns false at the end of the source. Fails if the source ends within the
    /// message.
    pub(super) fn read(&mut self, source: &mut ObjectSource) -> io::Result<bool> {
        let mut count = Vec::new();
        match source.take(4).read_to_end(&mut count)? {
            0 => return Ok(false),
            4 => {}
            _ => return Err(ErrorKind::UnexpectedEof.into()),
        }
        let last = count.first_chunk().map_or(0, |last| u32::from_le_bytes(*last));
        if last >= MAX_SEGMENTS {
            return Err(damaged("Cap'n Proto: too many segments"));
        }
        let mut table = vec![0; table_length(last) - 4];
        source.read_exact(&mut table)?;
        self.segments.clear();
        let mut end = 0;
        for size in table.as_chunks::<4>().0.iter().take(usize::try_from(last).unwrap_or(0) + 1) {
            let start = end;
            end += u64::from(u32::from_le_bytes(*size)) * WORD as u64;
            if end > MAX_BYTES {
                return Err(damaged("Cap'n Proto: the message is too large"));
            }
            self.segments.push((usize::try_from(start).unwrap_or(0), usize::try_from(end).unwrap_or(0)));
        }
        self.bytes.clear();
        append(source, end, &mut self.bytes, &mut self.kept)?;
        Ok(true)
    }

    pub(super) fn root(&self) -> Option<Struct<'_>> {
        self.structure(0, 0)
    }

    fn segment(&self, index: usize) -> Option<&[u8]> {
        let (start, end) = *self.segments.get(index)?;
        self.bytes.get(start..end)
    }

    fn word(&self, segment: usize, at: usize) -> Option<u64> {
        self.segment(segment)?.get(at..)?.first_chunk().map(|word| u64::from_le_bytes(*word))
    }

    /// Follows the pointer at a position; the target is empty for a null pointer; `None` for an invalid
    /// pointer.
    fn follow(&self, segment: usize, at: usize) -> Option<Target> {
        let pointer = self.word(segment, at)?;
        if pointer == 0 || kind(pointer) != 2 {
            return Some(Target { segment, start: behind(at, pointer)?, pointer });
        }
        let far = |pointer: u64| {
            let segment = usize::try_from(pointer >> 32).ok()?;
            Some((segment, usize::try_from(low(pointer) >> 3).ok()? * WORD))
        };
        let (segment, at) = far(pointer)?;
        let landing = self.word(segment, at)?;
        if pointer & 4 == 0 {
            let is_near = kind(landing) != 2;
            return is_near
                .then(|| Some(Target { segment, start: behind(at, landing)?, pointer: landing }))?;
        }
        let (segment, start) = far(landing)?;
        Some(Target { segment, start, pointer: self.word(far(pointer)?.0, at + WORD)? })
    }

    fn structure(&self, segment: usize, at: usize) -> Option<Struct<'_>> {
        let Target { segment, start, pointer } = self.follow(segment, at)?;
        if pointer == 0 || kind(pointer) != 0 {
            return None;
        }
        let (words, pointers) = sizes(pointer);
        Some(Struct { message: self, segment, start, words, pointers })
    }
}

/// Returns the kind of a pointer: 0 for a structure, 1 for a list, 2 for a far pointer.
fn kind(pointer: u64) -> u64 {
    pointer & 3
}

fn low(pointer: u64) -> u32 {
    let [a, b, c, d, ..] = pointer.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// Returns the target of a pointer at `at` in its segment, bytes.
fn behind(at: usize, pointer: u64) -> Option<usize> {
    let words = isize::try_from(low(pointer).cast_signed() >> 2).ok()?;
    (at + WORD).checked_add_signed(words.checked_mul(8)?)
}

/// Returns the number of words and of pointers of a structure.
fn sizes(pointer: u64) -> (usize, usize) {
    let [.., a, b, c, d] = pointer.to_le_bytes();
    (u16::from_le_bytes([a, b]).into(), u16::from_le_bytes([c, d]).into())
}

impl<'a> Struct<'a> {
    /// Returns the numbers of the structure; empty if they are not in the segment.
    pub(super) fn numbers(&self) -> &'a [u8] {
        let segment = self.message.segment(self.segment);
        segment.and_then(|bytes| bytes.get(self.start..)?.get(..self.words * WORD)).unwrap_or_default()
    }

    fn pointer(&self, index: usize) -> Option<usize> {
        (index < self.pointers).then(|| self.start + (self.words + index) * WORD)
    }

    /// Returns the structure that a pointer leads to.
    pub(super) fn structure(&self, index: usize) -> Option<Struct<'a>> {
        self.message.structure(self.segment, self.pointer(index)?)
    }

    /// Returns the bytes that a pointer leads to, empty for a null pointer; `None` for anything else.
    pub(super) fn bytes(&self, index: usize) -> Option<&'a [u8]> {
        let target = self.message.follow(self.segment, self.pointer(index)?)?;
        if target.pointer == 0 {
            return Some(&[]);
        }
        let (kind, length) = list(target.pointer)?;
        let bytes = self.message.segment(target.segment)?.get(target.start..)?.get(..length)?;
        (kind == 2).then_some(bytes)
    }

    /// Returns the structures of the list that a pointer leads to, empty for a null pointer; `None` for
    /// anything else, and for a list longer than its segment.
    pub(super) fn structures(&self, index: usize) -> Option<Structs<'a>> {
        let message = self.message;
        let target = message.follow(self.segment, self.pointer(index)?)?;
        if target.pointer == 0 {
            return Some(Structs { first: *self, count: 0 });
        }
        let (kind, length) = list(target.pointer)?;
        let content = target.start + WORD;
        message.segment(target.segment)?.get(content..)?.get(..length * WORD)?;
        let tag = message.word(target.segment, target.start)?;
        let (words, pointers) = sizes(tag);
        let (count, size) = (usize::try_from(low(tag) >> 2).ok()?, words + pointers);
        let is_whole = kind == 7 && size > 0 && count.checked_mul(size)? <= length;
        let first = Struct { message, segment: target.segment, start: content, words, pointers };
        is_whole.then_some(Structs { first, count })
    }
}

impl<'a> Structs<'a> {
    /// Returns the structure at a position; `None` after the last one.
    pub(super) fn get(&self, index: usize) -> Option<Struct<'a>> {
        let size = (self.first.words + self.first.pointers) * WORD;
        (index < self.count).then(|| Struct { start: self.first.start + index * size, ..self.first })
    }
}

/// Returns the kind of the elements of a list, and its length in elements, or in words for structures.
fn list(pointer: u64) -> Option<(u8, usize)> {
    let length = usize::try_from(pointer >> 35).ok()?;
    (kind(pointer) == 1).then_some(((pointer >> 32 & 7) as u8, length))
}
