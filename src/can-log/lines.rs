//! Reads the lines of a recording into a buffer of fixed size.

use std::io::{self, ErrorKind, Read};

use memchr::memchr;

use crate::entry::BadLine;
use crate::format::MAX_LINE;

/// Minimum read from the source, bytes: the size of the underlying buffer, which is thereby bypassed.
const READ: usize = 64 << 10;

pub(super) struct Lines<R> {
    source: R,
    /// Bytes from `begin` to `end` are read and not yet returned.
    buffer: Box<[u8]>,
    begin: usize,
    end: usize,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Self { source, buffer: vec![0; MAX_LINE + READ].into(), begin: 0, end: 0 }
    }

    /// Returns the next line with its line end, which the last line may lack. A line longer than [`MAX_LINE`]
    /// bytes is skipped. Fails if the source fails.
    #[inline]
    pub(super) fn next_line(&mut self) -> io::Result<Option<Result<&[u8], BadLine>>> {
        let mut searched = 0;
        let length = loop {
            let unread = &self.buffer[self.begin..self.end];
            if let Some(at) = memchr(b'\n', &unread[searched..]) {
                break searched + at + 1;
            }
            searched = unread.len();
            if searched > MAX_LINE {
                self.skip_line()?;
                return Ok(Some(Err(BadLine::TooLong)));
            }
            if !self.read_on()? {
                break searched;
            }
        };
        let line = &self.buffer[self.begin..self.begin + length];
        self.begin += length;
        Ok(match length {
            0 => None,
            1..=MAX_LINE => Some(Ok(line)),
            _ => Some(Err(BadLine::TooLong)),
        })
    }

    /// Skips the rest of a line whose end has not been read.
    fn skip_line(&mut self) -> io::Result<()> {
        loop {
            self.begin = self.end;
            if !self.read_on()? {
                return Ok(());
            }
            if let Some(at) = memchr(b'\n', &self.buffer[..self.end]) {
                self.begin = at + 1;
                return Ok(());
            }
        }
    }

    /// Reads more bytes after at most [`MAX_LINE`] unread ones, which move to the start of the buffer;
    /// returns false at the end of the source.
    fn read_on(&mut self) -> io::Result<bool> {
        self.buffer.copy_within(self.begin..self.end, 0);
        (self.begin, self.end) = (0, self.end - self.begin);
        loop {
            match self.source.read(&mut self.buffer[self.end..]) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                read => {
                    let read = read?;
                    self.end += read;
                    return Ok(read > 0);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns its bytes in pieces of these sizes, repeatedly, with an interruption before each.
    struct Pieces<'a> {
        bytes: &'a [u8],
        sizes: std::iter::Cycle<std::vec::IntoIter<usize>>,
        interrupted: bool,
    }

    impl Read for Pieces<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            self.interrupted = !self.interrupted;
            if self.interrupted {
                return Err(ErrorKind::Interrupted.into());
            }
            let size = self.sizes.next().unwrap_or(1).min(self.bytes.len()).min(buffer.len());
            let (piece, rest) = self.bytes.split_at(size);
            buffer[..size].copy_from_slice(piece);
            self.bytes = rest;
            Ok(size)
        }
    }

    fn all(source: impl Read) -> Vec<Result<Vec<u8>, BadLine>> {
        let mut lines = Lines::new(source);
        std::iter::from_fn(|| lines.next_line().unwrap().map(|line| line.map(<[u8]>::to_vec))).collect()
    }

    #[test]
    fn the_longest_line_is_read_and_a_longer_one_passed_over() {
        let line = |length| [vec![b'x'; length], b"\n".to_vec()].concat();
        for (length, is_read) in [(MAX_LINE - 1, true), (MAX_LINE, false), (3 * READ, false)] {
            let lines = all([line(length), b"next".to_vec()].concat().as_slice());
            assert_eq!(lines.len(), 2, "{length}");
            assert_eq!(lines[0].is_ok(), is_read, "{length}");
            assert_eq!(lines[1], Ok(b"next".to_vec()));
        }
        for (length, is_read) in [(MAX_LINE, true), (MAX_LINE + 1, false), (3 * READ, false)] {
            let lines = all(vec![b'x'; length].as_slice());
            assert_eq!((lines.len(), lines[0].is_ok()), (1, is_read), "{length} without a line end");
        }
    }

    #[test]
    fn an_error_comes_after_the_whole_lines_before_it() {
        struct Broken;
        impl Read for Broken {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(ErrorKind::UnexpectedEof.into())
            }
        }
        for length in [1, 5 * MAX_LINE] {
            let text = [b"whole\n".to_vec(), vec![b'x'; length]].concat();
            let mut lines = Lines::new(text.chain(Broken));
            assert_eq!(lines.next_line().unwrap(), Some(Ok(&b"whole\n"[..])));
            assert_eq!(lines.next_line().unwrap_err().kind(), ErrorKind::UnexpectedEof);
        }
    }

    proptest! {
        /// As the standard library divides the text, whatever the pieces that it comes in.
        #[test]
        fn lines_are_those_of_the_whole_text(
            parts in proptest::collection::vec((0..2 * MAX_LINE, 0..3_usize), 0..100),
            sizes in proptest::collection::vec(1..3 * READ, 1..8),
            small in proptest::collection::vec(1..9_usize, 1..4),
        ) {
            let ends = parts.iter().flat_map(|(length, ends)| [vec![false; *length], vec![true; *ends]].concat());
            let letters = (b'a'..=b'z').cycle();
            let text: Vec<u8> = ends.zip(letters).map(|(ends, letter)| if ends { b'\n' } else { letter }).collect();
            let expected: Vec<_> = text
                .split_inclusive(|byte| *byte == b'\n')
                .map(|line| if line.len() > MAX_LINE { Err(BadLine::TooLong) } else { Ok(line.to_vec()) })
                .collect();
            for sizes in [sizes, small] {
                let sizes = sizes.into_iter().cycle();
                let pieces = Pieces { bytes: &text, sizes, interrupted: false };
                prop_assert_eq!(&all(pieces), &expected);
            }
        }
    }
}
