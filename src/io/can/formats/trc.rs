//! PCAN TRC, as PCAN-View, PCAN-Explorer and python-can write it: versions 1.0 to 1.3, 2.0, 2.1.
//!
//! ```text
//! ;$FILEVERSION=2.1
//! ;$STARTTIME=45356.6041695602
//! ;$COLUMNS=N,O,T,B,I,d,R,L,D
//!       1      1.250 DT 1      01A0 Rx -  3    01 02 03
//! ```
//! Version 2 names its columns, versions 1 have fixed ones. The start is in days since
//! 1899-12-30, offsets in milliseconds. An identifier of more than four digits has 29 bits. Changes
//! of status and of error counters, warnings and events are not frames and are passed over.

use super::calendar::DAY;
use super::words::{bus_error, data_frame, decimal, fd_length, id, nothing_more, number, text};
use super::{Entry, Interface, Lines};
use crate::core::time::WallStamp;
use crate::io::can::candump::{BadLine, Content};

/// The headings so far.
#[derive(Debug, Default)]
pub struct Trc {
    /// Start of the recording, ns since 1970.
    start: i64,
    columns: Columns,
}

/// The columns, by the letters of `$COLUMNS`: `N`umber, `O`ffset, `T`ype, `B`us,
/// `I`dentifier, `d`irection, `R`eserved, `l`ength in bytes, `L` the DLC, `D`ata;
/// versions 1 mix direction and kind in one, `t`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns([u8; 10]);

impl Default for Columns {
    /// Those of version 1.0, which has no heading.
    fn default() -> Self {
        Self::from(b"NOILD")
    }
}

impl Columns {
    fn from(letters: &[u8]) -> Self {
        let mut columns = [0; 10];
        columns.iter_mut().zip(letters).for_each(|(column, letter)| *column = *letter);
        Self(columns)
    }

    fn of_version(version: &[u8]) -> Option<Self> {
        Some(Self::from(match version {
            b"1.0" => b"NOILD",
            b"1.1" => b"NOtILD",
            b"1.2" => b"NOBtILD",
            b"1.3" => b"NOBtIRLD",
            // Unless `$COLUMNS` follows.
            b"2.0" => b"NOTIdlD",
            b"2.1" => b"NOTBIdRlD",
            _ => return None,
        }))
    }
}

/// From 1899-12-30, where the start is counted from.
const DAYS_TO_1970: i64 = 25_569;

impl Lines for Trc {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<Entry<'a>>, BadLine> {
        if let Some(comment) = line.strip_prefix(b";") {
            return self.heading(comment).map(|()| None);
        }
        let line = parse_line(line, self.columns)?;
        Ok(line.content.map(|content| Entry {
            stamp: WallStamp::from_nanos(self.start.saturating_add(line.offset)),
            interface: Interface::Numbered(line.bus),
            content,
        }))
    }
}

impl Trc {
    fn heading(&mut self, comment: &[u8]) -> Result<(), BadLine> {
        if let Some(version) = comment.strip_prefix(b"$FILEVERSION=") {
            self.columns = Columns::of_version(version.trim_ascii()).ok_or(BadLine::NoFrame)?;
        } else if let Some(start) = comment.strip_prefix(b"$STARTTIME=") {
            let nanos = text(start).ok().and_then(|text| decimal(text.trim_ascii(), DAY));
            self.start = nanos.map(|nanos| nanos - DAYS_TO_1970 * DAY).ok_or(BadLine::NoTime)?;
        } else if let Some(columns) = comment.strip_prefix(b"$COLUMNS=") {
            let mut letters = [0; 10];
            let written = columns.trim_ascii().split(|byte| *byte == b',').map(<[u8]>::trim_ascii);
            for (index, column) in written.enumerate() {
                let ([letter], Some(place)) = (column, letters.get_mut(index)) else {
                    return Err(BadLine::NoFrame);
                };
                *place = *letter;
            }
            self.columns = Columns(letters);
        }
        Ok(())
    }
}

/// One line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Line {
    /// Time since the start, ns.
    pub offset: i64,
    /// Number of the bus, 0 if it is not written.
    pub bus: u32,
    /// `None` if it is not a frame.
    pub content: Option<Content>,
}

/// Reads one line.
///
/// # Errors
/// The reason why it cannot be read.
pub fn parse_line(line: &[u8], columns: Columns) -> Result<Line, BadLine> {
    let mut words = text(line)?.split_ascii_whitespace();
    let (mut offset, mut bus, mut kind, mut identifier, mut length) = (None, 0, "DT", None, None);
    for column in columns.0.into_iter().take_while(|column| !matches!(column, 0 | b'D')) {
        let word = words.next();
        match column {
            b'O' => offset = Some(word.and_then(|word| decimal(word, 1_000_000)).ok_or(BadLine::NoTime)?),
            b'B' => bus = word.and_then(|word| number(word, 10)).ok_or(BadLine::NoInterface)?,
            b'T' | b't' => kind = word.ok_or(BadLine::NoFrame)?,
            b'I' => identifier = word,
            b'L' | b'l' => length = word.and_then(|word| number(word, 10)).map(|length| (column, length)),
            _ if word.is_none() => return Err(BadLine::NoFrame),
            _ => {}
        }
    }
    let offset = offset.ok_or(BadLine::NoTime)?;
    let fd = matches!(kind, "FD" | "FB" | "FE" | "BI");
    let content = match kind {
        "DT" | "Rx" | "Tx" | "FD" | "FB" | "FE" | "BI" | "RR" => {
            Some(frame(identifier, fd, kind == "RR", length, &mut words)?)
        }
        "ER" | "Error" => Some(bus_error()),
        "ST" | "EC" | "EV" | "Warng" => None,
        _ => return Err(BadLine::NoFrame),
    };
    Ok(Line { offset, bus, content })
}

fn frame<'a>(
    identifier: Option<&str>,
    fd: bool,
    remote: bool,
    length: Option<(u8, u32)>,
    words: &mut (impl Iterator<Item = &'a str> + Clone),
) -> Result<Content, BadLine> {
    let identifier = identifier.ok_or(BadLine::NoFrame)?;
    let number = number(identifier, 16).ok_or(BadLine::BadId)?;
    let id = id(number, identifier.len() > 4)?;
    if remote || words.clone().next() == Some("RTR") {
        return Ok(Content::Remote);
    }
    let length = match length {
        Some((b'L', dlc)) if fd => fd_length(dlc),
        // A DLC above 8 is sent as it is, but the frame still has 8 bytes.
        Some((b'L', dlc)) => fd_length(dlc).map(|length| length.min(8)),
        Some((_, length)) => usize::try_from(length).ok(),
        None => None,
    };
    let content = data_frame(id, fd, length.ok_or(BadLine::BadLength)?, words, 16)?;
    nothing_more(words)?;
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::super::shown;
    use super::*;

    fn read(lines: &[&str]) -> Vec<Result<String, BadLine>> {
        shown(&mut Trc::default(), lines)
    }

    fn good(lines: &[&str]) -> Vec<String> {
        read(lines).into_iter().map(Result::unwrap).collect()
    }

    #[test]
    fn version_2_has_the_columns_it_names() {
        let lines = good(&[
            ";$FILEVERSION=2.1",
            ";$STARTTIME=45356.5",
            ";$COLUMNS=N,O,T,B,I,d,R,L,D",
            "; anything",
            "1 1.250 DT 1 01A0 Rx - 3 01 02 fF",
            "2 2.000 FB 2 18FEF100 Tx - 9 01 02 03 04 05 06 07 08 09 0A 0B 0C",
            "3 3.000 RR 1 01A0 Rx - 8",
            "4 4.000 ER 1 - Rx - 5 04 00 02 00 00",
            "5 5.000 ST 1 - Rx - 4 00 00 00 08",
            "6 6.000 DT 1 01A0 Rx - 0",
        ]);
        let start = 1_709_640_000_000_000_u64;
        let expected = [
            (1_250, "can1 1A0#0102FF"),
            (2_000, "can2 18FEF100##00102030405060708090A0B0C"),
            (3_000, "can1 Remote"),
            (4_000, "can1 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })"),
            (6_000, "can1 1A0#"),
        ];
        let expected: Vec<_> =
            expected.iter().map(|(time, text)| format!("{} {text}", start + time)).collect();
        assert_eq!(lines, expected);
        let lengths = good(&[
            ";$FILEVERSION=2.0",
            ";$COLUMNS=N,O,T,I,d,l,D",
            "1 1.5 FD 01A0 Rx 12 0 1 2 3 4 5 6 7 8 9 A B",
        ]);
        assert_eq!(lengths, ["1500 can0 1A0##0000102030405060708090A0B"]);
    }

    #[test]
    fn versions_1_have_fixed_columns() {
        assert_eq!(good(&["1) 2 01A0 2 01 02"]), ["2000 can0 1A0#0102"]);
        let lines = good(&[
            ";$FILEVERSION=1.1",
            "1) 1.2 Rx 01A0 2 01 02",
            "2) 1.3 Tx 18FEF100 8 RTR",
            "3) 1.4 Warng FFFFFFFF 4 00 00 00 08 BUSHEAVY",
            "4) 1.5 Error 0001 4 00 00 00 00",
        ]);
        assert_eq!(
            lines,
            [
                "1200 can0 1A0#0102",
                "1300 can0 Remote",
                "1500 can0 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })"
            ]
        );
        assert_eq!(good(&[";$FILEVERSION=1.2", "1) 1.2 2 Rx 01A0 1 01"]), ["1200 can2 1A0#01"]);
        assert_eq!(good(&[";$FILEVERSION=1.3", "1) 1.2 2 Rx 01A0 - 1 01"]), ["1200 can2 1A0#01"]);
    }

    #[test]
    fn every_way_to_break_a_line_has_its_reason() {
        for (line, reason) in [
            (";$FILEVERSION=9.9", BadLine::NoFrame),
            (";$STARTTIME=never", BadLine::NoTime),
            (";$COLUMNS=N,O,Type", BadLine::NoFrame),
            ("1) soon Rx 01A0 1 00", BadLine::NoTime),
            ("1)", BadLine::NoTime),
            ("1) 1.0 Rz 01A0 1 00", BadLine::NoFrame),
            ("1) 1.0 Rx", BadLine::NoFrame),
            ("1) 1.0 Rx 01G0 1 00", BadLine::BadId),
            ("1) 1.0 Rx 0800 1 00", BadLine::BadId),
            ("1) 1.0 Rx 20000000 1 00", BadLine::BadId),
            ("1) 1.0 Rx 01A0 16 00", BadLine::BadLength),
            ("1) 1.0 Rx 01A0 x 00", BadLine::BadLength),
            ("1) 1.0 Rx 01A0 1 00 01", BadLine::BadLength),
            ("1) 1.0 Rx 01A0 2 00", BadLine::BadData),
            ("1) 1.0 Rx 01A0 1 100", BadLine::BadData),
        ] {
            assert_eq!(read(&[";$FILEVERSION=1.1", line]), [Err(reason)], "{line}");
        }
        assert_eq!(read(&[";$FILEVERSION=2.1", "1 1.0 DT x 01A0 Rx - 0"]), [Err(BadLine::NoInterface)]);
    }
}
