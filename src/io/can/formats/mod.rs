//! The formats of recordings, one in each file, and the recognition of a recording's format.
//!
//! | module | format | recognised by |
//! |---|---|---|
//! | [`super::candump`] | `candump -L` | `(`; also what nothing else claims |
//! | [`asc`] | Vector ASC | `date …`, `base …` or `//` |
//! | [`trc`] | PCAN TRC 1.0 to 1.3, 2.0, 2.1 | `;` |
//! | [`csv`] | SavvyCAN and GVRET CSV | `Time Stamp,ID,` |
//! | [`busmaster`] | BUSMASTER log | `***BUSMASTER` |
//! | [`plain`] | two layouts of serial sniffers | a line that fits one of them |
//! | [`blf`] | Vector BLF | the bytes `LOGG` |
//!
//! The name of a file does not matter. The first line that one of these claims decides; lines
//! before it are read (and counted as bad) in that format.
//!
//! # Time
//! A format with a date gives absolute stamps. Their writers note local time without saying which,
//! so it is taken for UTC: stamps of such a file are off by the writer's distance to UTC, which
//! matters to nobody but a reader of the wall clock. A format that knows only offsets or a free
//! counter gives stamps from the epoch on, a format without any time gives the epoch every time.
//!
//! # Interfaces
//! Formats that number their buses get the name `can` and the number as in the file: GVRET counts from 0, Vector and PCAN from 1. Without a number it is `can0`.

pub mod asc;
pub mod blf;
pub mod busmaster;
mod calendar;
pub mod csv;
pub mod plain;
pub mod trc;
mod words;

use std::io;

use super::candump::{self, BadLine, Content};
use crate::core::time::WallStamp;

/// The longest line of any format, bytes; an ASC line of a CAN FD frame with a long name needs 500.
pub const MAX_LINE: usize = 1024;

/// One entry of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry<'a> {
    /// Time of reception.
    pub stamp: WallStamp,
    /// Interface that received it.
    pub interface: Interface<'a>,
    /// Content.
    pub content: Content,
}

/// The name of an interface in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interface<'a> {
    /// A name.
    Named(&'a str),
    /// A number, as in the file; shown as `can` and the number.
    Numbered(u32),
}

impl Interface<'_> {
    /// Whether this is the one called `name`.
    pub fn is(&self, name: &str) -> bool {
        match self {
            Self::Named(own) => *own == name,
            Self::Numbered(own) => {
                name.strip_prefix("can").and_then(|digits| digits.parse().ok()) == Some(*own)
            }
        }
    }
}

impl std::fmt::Display for Interface<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Named(name) => f.write_str(name),
            Self::Numbered(number) => write!(f, "can{number}"),
        }
    }
}

/// Reads one line after another, and remembers headings.
pub trait Lines: Send {
    /// Reads one line, without its line end and outer blanks, not empty. `None` when it holds no
    /// frame and need not: a heading, a comment, an event of another kind.
    ///
    /// # Errors
    /// The reason why it cannot be read.
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<Entry<'a>>, BadLine>;
}

/// candump has no headings.
struct Candump;

impl Lines for Candump {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<Entry<'a>>, BadLine> {
        let line = match line {
            [b'#', ..] => match candump::parse_note(line) {
                Some(note) => note,
                None => return Ok(None),
            },
            _ => candump::parse_line(line)?,
        };
        let interface = Interface::Named(line.interface);
        Ok(Some(Entry { stamp: line.stamp, interface, content: line.content }))
    }
}

/// The format of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `candump -L`.
    Candump,
    /// Vector ASC.
    Asc,
    /// PCAN TRC.
    Trc,
    /// SavvyCAN or GVRET CSV.
    Csv,
    /// BUSMASTER log.
    Busmaster,
    /// Lines of a serial sniffer.
    Plain,
    /// Vector BLF.
    Blf,
    /// ASAM MDF 4, which is recognised only to say that it is not supported.
    Mf4,
}

/// The length of a recording's beginning by which its format is recognised, bytes.
pub const HEAD: usize = 4096;

const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

impl Format {
    /// The format of a recording that begins with `head`; `None` if the beginning fits none. Only whole lines
    /// count.
    pub fn of(head: &[u8]) -> Option<Self> {
        if head.starts_with(b"LOGG") {
            return Some(Self::Blf);
        }
        if head.starts_with(b"MDF     ") || head.starts_with(b"UnFinMF ") {
            return Some(Self::Mf4);
        }
        let text = without_byte_order_mark(head);
        text.split_inclusive(|byte| *byte == b'\n')
            .filter(|line| line.ends_with(b"\n"))
            .find_map(|line| Self::of_line(line.trim_ascii()))
    }

    /// The format that claims this line.
    pub fn of_line(line: &[u8]) -> Option<Self> {
        let begins =
            |word: &[u8]| line.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
        if begins(b"(") {
            Some(Self::Candump)
        } else if begins(b";") {
            Some(Self::Trc)
        } else if begins(b"***BUSMASTER") {
            Some(Self::Busmaster)
        } else if begins(b"Time Stamp,ID,") {
            Some(Self::Csv)
        } else if begins(b"date ") || begins(b"base ") || begins(b"//") {
            Some(Self::Asc)
        } else {
            plain::parse_line(line).is_ok().then_some(Self::Plain)
        }
    }

    /// A reader for this format, `None` for those that are not made of lines.
    pub fn lines(self) -> Option<Box<dyn Lines>> {
        Some(match self {
            Self::Candump => Box::new(Candump),
            Self::Asc => Box::new(asc::Asc::default()),
            Self::Trc => Box::new(trc::Trc::default()),
            Self::Csv => Box::new(csv::Csv::default()),
            Self::Busmaster => Box::new(busmaster::Busmaster::default()),
            Self::Plain => Box::new(plain::Plain),
            Self::Blf | Self::Mf4 => return None,
        })
    }
}

/// `text` behind the mark that some editors put before UTF-8.
pub fn without_byte_order_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text)
}

/// The error for a file in a format that cannot be read.
pub fn not_supported() -> io::Error {
    io::Error::new(
        io::ErrorKind::Unsupported,
        "ASAM MDF (MF4) is not supported: convert it with python-can, \
         `pip install python-can asammdf` and `python -m can.logconvert recording.mf4 recording.log`",
    )
}

/// The entries that a reader makes of lines, for the tests of each format.
#[cfg(test)]
fn shown(reader: &mut impl Lines, lines: &[&str]) -> Vec<Result<String, BadLine>> {
    let entries = lines.iter().filter_map(|line| reader.read(line.as_bytes()).transpose());
    entries.map(|entry| entry.map(|entry| entry.shown(0))).collect()
}

#[cfg(test)]
impl Entry<'_> {
    /// Microseconds since `start_micros`, interface and content.
    fn shown(&self, start_micros: i64) -> String {
        let content = match self.content {
            Content::Data(frame) => frame.to_string(),
            other @ (Content::Remote | Content::Error(_) | Content::Note(_)) => format!("{other:?}"),
        };
        format!("{} {} {content}", self.stamp.as_nanos() / 1000 - start_micros, self.interface)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn each_format_is_recognised_by_its_first_line_with_a_mark() {
        for (head, format) in [
            ("(1.0) can0 123#\n", Some(Format::Candump)),
            ("\u{FEFF};$FILEVERSION=2.1\r\n", Some(Format::Trc)),
            ("cut off\n\n***BUSMASTER Ver 3.2.2***\n", Some(Format::Busmaster)),
            ("Time Stamp,ID,Extended,Bus,LEN\n", Some(Format::Csv)),
            ("date Mon Jan 1 00:00:00 2024\n", Some(Format::Asc)),
            ("820298   0x085: 7C 33\n", Some(Format::Plain)),
            ("01 00 00 03 50 05 00\n", Some(Format::Plain)),
            ("LOGG", Some(Format::Blf)),
            ("MDF     4.10", Some(Format::Mf4)),
            ("UnFinMF 4.11", Some(Format::Mf4)),
            ("(1.0) can0 123#", None),
            ("", None),
        ] {
            assert_eq!(Format::of(head.as_bytes()), format, "{head}");
        }
    }

    #[test]
    fn numbered_interfaces_are_called_can() {
        assert_eq!(Interface::Numbered(1).to_string(), "can1");
        assert!(Interface::Numbered(1).is("can1") && !Interface::Numbered(1).is("can11"));
        assert!(Interface::Named("vcan0").is("vcan0"));
    }

    proptest! {
        #[test]
        fn any_lines_are_read_or_refused_in_every_format(
            lines in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..200), 0..10),
        ) {
            for format in [
                Format::Candump, Format::Asc, Format::Trc, Format::Csv, Format::Busmaster, Format::Plain,
            ] {
                let mut reader = format.lines().unwrap();
                for line in &lines {
                    let _outcome = reader.read(line);
                }
            }
        }

        /// Closer to what the readers look for than any bytes.
        #[test]
        fn lines_of_likely_words_are_read_or_refused_in_every_format(
            lines in proptest::collection::vec(proptest::collection::vec(likely_word(), 0..14), 0..20),
            separator in prop::sample::select(vec![" ", ",", ":"]),
        ) {
            for format in [
                Format::Candump, Format::Asc, Format::Trc, Format::Csv, Format::Busmaster, Format::Plain,
            ] {
                let mut reader = format.lines().unwrap();
                for line in &lines {
                    let _outcome = reader.read(line.join(separator).as_bytes());
                }
            }
        }
    }

    fn likely_word() -> impl Strategy<Value = String> {
        let fixed = prop::sample::select(vec![
            "date",
            "base",
            "hex",
            "dec",
            "timestamps",
            "relative",
            "Begin",
            "Triggerblock",
            "CANFD",
            "Rx",
            "Tx",
            "d",
            "r",
            "ErrorFrame",
            "1)",
            ";$STARTTIME=45860.70",
            ";$COLUMNS=N,O,T,I,d,l,D",
            "DT",
            "FD",
            "***DEC***",
            "***RELATIVE MODE***",
            "***START DATE AND TIME 1:1:2024 0:0:0:0***",
            "Time Stamp",
            "ID",
            "Extended",
            "Bus",
            "LEN",
            "D1",
            "true",
            "s",
            "x",
            "08",
            "00",
        ]);
        prop_oneof![
            fixed.prop_map(str::to_owned),
            any::<u64>().prop_map(|number| number.to_string()),
            (any::<u32>(), any::<u32>()).prop_map(|(a, b)| format!("{a}.{b}")),
            any::<u32>().prop_map(|number| format!("{number:X}")),
        ]
    }
}
