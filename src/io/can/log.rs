//! candump logs on disk, plain or gzip, read line by line in constant memory.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::candump::{BadLine, Content, MAX_LINE, parse_line};
use crate::core::time::WallStamp;

/// Position of an interface's name in [`Log::interfaces`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InterfaceIndex(pub usize);

/// One entry of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    /// When it was received.
    pub stamp: WallStamp,
    /// On which interface.
    pub interface: InterfaceIndex,
    /// What.
    pub content: Content,
}

/// A log that is being read.
pub struct Log {
    source: Box<dyn BufRead + Send>,
    line: Vec<u8>,
    line_number: u64,
    interfaces: Vec<String>,
    bad_lines: u64,
    first_bad: Option<(u64, BadLine)>,
}

const GZIP_MAGIC: [u8; 2] = [0x1F, 0x8B];
const BUFFER: usize = 64 << 10;
/// More names than this are a sign of garbage; the rest counts as bad lines.
const MOST_INTERFACES: usize = 64;

impl Log {
    /// Opens a log file; `-` is standard input.
    ///
    /// # Errors
    /// As the system says.
    pub fn open(path: &Path) -> io::Result<Self> {
        if path == Path::new("-") {
            return Self::new(Box::new(io::stdin()));
        }
        Self::new(Box::new(File::open(path)?))
    }

    /// Reads from anything, unpacking gzip if it begins like gzip.
    ///
    /// # Errors
    /// When the first bytes cannot be read.
    pub fn new(source: Box<dyn Read + Send>) -> io::Result<Self> {
        let mut plain = BufReader::with_capacity(BUFFER, source);
        let packed = plain.fill_buf()?.starts_with(&GZIP_MAGIC);
        let source: Box<dyn BufRead + Send> = if packed {
            Box::new(BufReader::with_capacity(BUFFER, MultiGzDecoder::new(plain)))
        } else {
            Box::new(plain)
        };
        Ok(Self {
            source,
            line: Vec::with_capacity(MAX_LINE),
            line_number: 0,
            interfaces: Vec::new(),
            bad_lines: 0,
            first_bad: None,
        })
    }

    /// The next entry; lines that cannot be read are counted and left out.
    ///
    /// # Errors
    /// When the file cannot be read on, e.g. a truncated gzip.
    pub fn next_record(&mut self) -> io::Result<Option<Record>> {
        while self.next_line()? {
            let text = self.line.trim_ascii();
            if text.is_empty() {
                continue;
            }
            match parse_line(text) {
                Ok(line) => {
                    let known = self.interfaces.iter().position(|name| name == line.interface);
                    let index = match known {
                        Some(index) => index,
                        None if self.interfaces.len() < MOST_INTERFACES => {
                            self.interfaces.push(line.interface.to_owned());
                            self.interfaces.len() - 1
                        }
                        None => {
                            self.count_bad(BadLine::NoInterface);
                            continue;
                        }
                    };
                    let interface = InterfaceIndex(index);
                    return Ok(Some(Record { stamp: line.stamp, interface, content: line.content }));
                }
                Err(reason) => self.count_bad(reason),
            }
        }
        Ok(None)
    }

    /// Interface names met so far, in order of appearance.
    pub fn interfaces(&self) -> &[String] {
        &self.interfaces
    }

    /// Lines that could not be read so far.
    pub fn bad_lines(&self) -> u64 {
        self.bad_lines
    }

    /// Number and fault of the first line that could not be read.
    pub fn first_bad(&self) -> Option<(u64, BadLine)> {
        self.first_bad
    }

    fn count_bad(&mut self, reason: BadLine) {
        self.bad_lines += 1;
        self.first_bad.get_or_insert((self.line_number, reason));
    }

    /// Reads one line of at most [`MAX_LINE`] + 1 bytes; what a longer one has beyond is skipped.
    fn next_line(&mut self) -> io::Result<bool> {
        self.line.clear();
        let limit = MAX_LINE as u64 + 1;
        if (&mut self.source).take(limit).read_until(b'\n', &mut self.line)? == 0 {
            return Ok(false);
        }
        self.line_number += 1;
        if self.line.len() > MAX_LINE && self.line.last() != Some(&b'\n') {
            self.source.skip_until(b'\n')?;
        }
        Ok(true)
    }
}

impl std::fmt::Debug for Log {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { line_number, bad_lines, .. } = self;
        write!(f, "Log(line {line_number}, {bad_lines} bad)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const TEXT: &str = "(1.000000) can0 123#01\n\nnonsense\r\n(1.100000) can1 123#02\r\n(1.2) can0 124#";

    fn read_all(bytes: Vec<u8>) -> (Log, Vec<Record>) {
        let mut log = Log::new(Box::new(io::Cursor::new(bytes))).unwrap();
        let mut records = Vec::new();
        while let Some(record) = log.next_record().unwrap() {
            records.push(record);
        }
        (log, records)
    }

    #[test]
    fn bad_lines_are_counted_and_the_rest_is_read() {
        let (log, records) = read_all(TEXT.into());
        let order: Vec<_> = records.iter().map(|record| record.interface.0).collect();
        assert_eq!(order, [0, 1, 0]);
        assert_eq!(log.interfaces(), ["can0", "can1"]);
        assert_eq!((log.bad_lines(), log.first_bad()), (1, Some((3, BadLine::NoTime))));
    }

    #[test]
    fn gzip_is_recognised_and_a_truncated_one_is_an_error_at_its_end() {
        let lines = (0..5_000_u32).map(|i| format!("({i}.0) can0 123#{:08X}", i.wrapping_mul(2_654_435_761)));
        let text = lines.collect::<Vec<_>>().join("\n");
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        gzip.write_all(text.as_bytes()).unwrap();
        let packed = gzip.finish().unwrap();
        assert_eq!(read_all(packed.clone()).1.len(), 5_000);
        let mut cut = Log::new(Box::new(io::Cursor::new(packed[..packed.len() / 2].to_vec()))).unwrap();
        let mut read = 0;
        let error = loop {
            match cut.next_record() {
                Ok(Some(_)) => read += 1,
                Ok(None) => panic!("the end of a truncated file is an error"),
                Err(error) => break error,
            }
        };
        assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
        assert!(read > 0);
    }

    #[test]
    fn an_endless_line_does_not_fill_memory() {
        let mut bytes = vec![b'x'; 1 << 20];
        bytes.extend(b"\n(1.0) can0 123#01\n");
        let (log, records) = read_all(bytes);
        assert_eq!((records.len(), log.bad_lines()), (1, 1));
        assert!(log.line.capacity() < 4 * MAX_LINE);
    }
}
