//! Interface of a recording format: how its files are recognised and read.

use std::io::{self, BufRead, Read};

use crate::entry::{BadLine, LogEntry};
use crate::file_budget::FileBudget;

/// Longest line of any format, bytes; an ASC line of a CAN FD frame with a long name needs 500.
pub(super) const MAX_LINE: usize = 1024;

/// A format of lines.
#[derive(Clone, Copy)]
pub(super) struct LineFormat {
    pub(super) name: &'static str,
    /// Returns true for a line that identifies this format; the line has no line end.
    pub(super) claims: fn(&[u8]) -> bool,
    /// Default unit of the stamps, ns, if writers use different units; `None` if the format fixes the unit.
    pub(super) unit_ns: Option<i64>,
    /// Creates a reader of stamps in a unit, ns, which is used only by formats without a fixed unit.
    pub(super) reader: fn(i64) -> Box<dyn LineReader>,
}

impl LineFormat {
    /// Creates a reader of stamps in the usual unit.
    pub(super) fn usual_reader(&self) -> Box<dyn LineReader> {
        (self.reader)(self.unit_ns.unwrap_or(crate::clock::SECOND))
    }
}

/// A binary format.
#[derive(Clone, Copy)]
pub(super) struct ObjectFormat {
    pub(super) name: &'static str,
    pub(super) mark: Mark,
    /// Creates a reader of a file from its first byte on. Fails with the source, or for an unsupported file.
    pub(super) reader: fn(ObjectSource) -> io::Result<Box<dyn ObjectReader>>,
}

/// Feature by which the files of a binary format are recognised.
#[derive(Clone, Copy)]
pub(super) enum Mark {
    /// The file begins with one of these.
    Magics(&'static [&'static [u8]]),
    /// This function returns true for the beginning of the file.
    Content(fn(&[u8]) -> bool),
}

impl ObjectFormat {
    pub(super) fn begins(&self, head: &[u8]) -> bool {
        match self.mark {
            Mark::Magics(magics) => magics.iter().any(|magic| head.starts_with(magic)),
            Mark::Content(is) => is(head),
        }
    }
}

/// The decompressed bytes of a file, and its reading budget.
pub(super) struct ObjectSource {
    pub(super) bytes: Box<dyn BufRead + Send>,
    pub(super) budget: FileBudget,
}

impl Read for ObjectSource {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.bytes.read(buffer)
    }
}

impl BufRead for ObjectSource {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.bytes.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.bytes.consume(amount);
    }
}

/// The content of a line or an object: an entry, `None` if it is not one, or the reason why it cannot be
/// read.
pub(super) type Outcome<'a> = Result<Option<LogEntry<'a>>, BadLine>;

/// Reads a recording object by object, in bounded memory.
pub(super) trait ObjectReader: Send {
    /// Reads the next object; `None` at the end of the file. Fails if the source fails, or if nothing after
    /// this point can be read: with [`io::ErrorKind::UnexpectedEof`] if the file ends within an object, with
    /// [`io::ErrorKind::InvalidData`] if it is damaged.
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>>;
}

/// Reads a recording line by line, and keeps the state from its headings.
pub(super) trait LineReader: Send {
    /// Reads a trimmed line with content; `None` for a heading, a comment, or an event that is not a frame.
    fn read<'a>(&mut self, line: &'a [u8]) -> Outcome<'a>;
}

/// Reads lines that depend neither on headings nor on each other.
pub(super) struct EachLine {
    /// Unit of the stamps, ns.
    pub(super) unit_ns: i64,
    /// Reads a line with stamps in a unit, ns.
    pub(super) read: fn(&[u8], i64) -> Outcome<'_>,
}

impl LineReader for EachLine {
    fn read<'a>(&mut self, line: &'a [u8]) -> Outcome<'a> {
        (self.read)(line, self.unit_ns)
    }
}

/// Returns true if a line begins with one of these marks, ignoring case.
pub(super) fn begins(line: &[u8], marks: &[&str]) -> bool {
    marks
        .iter()
        .any(|mark| line.get(..mark.len()).is_some_and(|start| start.eq_ignore_ascii_case(mark.as_bytes())))
}

/// Reason why a file is not a recording, with a remedy.
#[derive(Debug, thiserror::Error)]
#[error("{reason}{}{remedy}", if .remedy.is_empty() { "" } else { "; " })]
pub struct NotRecording {
    /// The format that the file seems to have.
    pub reason: String,
    /// Remedy for the user; empty if there is none.
    pub remedy: String,
}

/// Returns the error for a file that is not a recording, or of a kind that is not supported.
pub(super) fn refused(reason: impl Into<String>, remedy: impl Into<String>) -> io::Error {
    let refusal = NotRecording { reason: reason.into(), remedy: remedy.into() };
    io::Error::new(io::ErrorKind::InvalidData, refusal)
}

/// Returns the error for a file that cannot be read further.
pub(super) fn damaged(reason: impl Into<String>) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, reason.into())
}

/// Shared by the tests of the formats.
#[cfg(test)]
pub(crate) mod testing {
    use super::*;
    use crate::entry::EntryContent;

    /// Reads lines; entries are written as microseconds, interface and content.
    pub(crate) fn read(format: LineFormat, lines: &[&str]) -> Vec<Result<String, BadLine>> {
        let mut reader = format.usual_reader();
        let entries = lines.iter().filter_map(|line| reader.read(line.as_bytes()).transpose());
        entries.map(|entry| entry.map(|entry| shown(&entry, 0))).collect()
    }

    pub(crate) fn source(bytes: &[u8]) -> ObjectSource {
        ObjectSource { bytes: Box::new(io::Cursor::new(bytes.to_vec())), budget: FileBudget::default() }
    }

    /// Reads a file to its end; entries are written like those of lines.
    pub(crate) fn objects(format: ObjectFormat, file: &[u8]) -> io::Result<Vec<Result<String, BadLine>>> {
        let (entries, outcome) = until_failure(format, file);
        outcome.map(|()| entries)
    }

    /// Reads a file to its end, or to the first error that ends reading.
    pub(crate) fn until_failure(
        format: ObjectFormat,
        file: &[u8],
    ) -> (Vec<Result<String, BadLine>>, io::Result<()>) {
        let mut entries = Vec::new();
        let outcome = (format.reader)(source(file)).and_then(|mut reader| {
            while let Some(object) = reader.next_object()? {
                entries.extend(object.map(|entry| entry.map(|entry| shown(&entry, 0))).transpose());
            }
            Ok(())
        });
        (entries, outcome)
    }

    /// Cuts a file at 20 places after its first `head` bytes. Each part must yield the first entries of the
    /// whole file, at most `most_lost` less than its share, and then fail unless the cut is between two
    /// objects.
    pub(crate) fn assert_parts_give_the_beginning(
        format: ObjectFormat,
        file: &[u8],
        head: usize,
        most_lost: usize,
    ) {
        let whole = objects(format, file).unwrap();
        for place in 0..20 {
            // Steps by a prime number, so that the cuts fall anywhere within objects.
            let cut = head + place * 7919 % (file.len() - head);
            let (part, outcome) = until_failure(format, &file[..cut]);
            let share = (cut - head) * whole.len() / (file.len() - head);
            assert!(whole.starts_with(&part), "{cut}: not the beginning");
            assert!(part.len() + most_lost >= share, "{cut}: {} of {share} entries", part.len());
            let kind = outcome.map_err(|error| error.kind());
            assert!(matches!(kind, Ok(()) | Err(io::ErrorKind::UnexpectedEof)), "{cut}: {kind:?}");
        }
    }

    /// Reads a file with bytes replaced, and cut at each of them: reading must end or fail, without a panic.
    pub(crate) fn assert_survives_damage(format: ObjectFormat, mut file: Vec<u8>, damage: &[(usize, u8)]) {
        for (at, byte) in damage {
            let at = at % file.len();
            file[at] = *byte;
            for file in [&file[..], &file[..at]] {
                let entries = objects(format, file).map_or(0, |entries| entries.len());
                assert!(entries <= file.len(), "no end");
            }
        }
    }

    /// Reads lines, none of which is malformed.
    pub(crate) fn good(format: LineFormat, lines: &[&str]) -> Vec<String> {
        read(format, lines).into_iter().map(Result::unwrap).collect()
    }

    /// Asserts the reason why each line after the headings is not read.
    pub(crate) fn assert_refused(format: LineFormat, headings: &[&str], cases: &[(&str, BadLine)]) {
        for (line, reason) in cases {
            let lines = [headings, &[line]].concat();
            assert_eq!(read(format, &lines).pop(), Some(Err(*reason)), "{line}");
        }
    }

    /// Returns microseconds since `start_micros`, interface and content.
    pub(crate) fn shown(entry: &LogEntry<'_>, start_micros: i64) -> String {
        let content = match entry.content {
            EntryContent::Data(frame) => frame.to_string(),
            EntryContent::Note(note) => {
                format!("Note(Controller({}))", note.to_string().trim_start_matches("controller "))
            }
            other @ (EntryContent::Remote | EntryContent::Error(_)) => format!("{other:?}"),
        };
        format!("{} {} {content}", entry.stamp.as_nanos() / 1000 - start_micros, entry.interface)
    }
}
