//! PCAN TRC, as written by PCAN-View, PCAN-Explorer and python-can: versions 1.0 to 1.3, 2.0, 2.1; and the
//! CSV that PEAK-Converter writes from it.
//!
//! ```text
//! ;$FILEVERSION=2.1
//! ;$STARTTIME=45356.6041695602
//! ;$COLUMNS=N,O,T,B,I,d,R,L,D
//!       1      1.250 DT 1      01A0 Rx -  3    01 02 03
//! ```
//! Version 2 names its columns, versions 1 have fixed columns. The start is in days since 1899-12-30, offsets
//! in milliseconds. An identifier of more than four digits has 29 bits. Changes of status and of error
//! counters, warnings and events are not frames and are skipped.
//!
//! ```text
//! 1,1.250,1,Rx,DT,01A0,-,3,01,02,03
//! ```
//! The CSV has other columns, and commas, semicolons or tabs between them: number, offset, bus, direction,
//! type, identifier, reserved, length, data. Its length may be a DLC or count bytes; the number of bytes
//! decides. The headings before it vary and are ignored, except for a start time.

use crate::clock::{DAY, SECOND};
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{SpacedFields, bus_error, decimal, fields, id, length_of_dlc, number, text};
use crate::format::{LineFormat, LineReader, begins};

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "PCAN TRC and PEAK-Converter CSV",
    claims: |line| {
        // Random bytes may also begin like this.
        let is_printed = |byte: &u8| *byte == b'\t' || !byte.is_ascii_control();
        let is_comment = || begins(line, &[";"]) && line.iter().all(is_printed);
        is_comment() || text(line).is_ok_and(|line| csv_row(line).is_some_and(|row| row.is_ok()))
    },
    unit_ns: None,
    // Version 1.0 has no heading.
    reader: |_| Box::new(Trc { start: 0, columns: TrcColumns::from(b"NOILD") }),
};

#[derive(Debug)]
struct Trc {
    start: i64,
    columns: TrcColumns,
}

/// Columns by the letters of `$COLUMNS`: `N`umber, `O`ffset, `T`ype, `B`us, `I`dentifier, `d`irection,
/// `R`eserved, `l`ength in bytes, `L` the DLC, `D`ata. Versions 1 combine direction and kind in `t`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TrcColumns([u8; 10]);

impl TrcColumns {
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
            // Used unless `$COLUMNS` follows.
            b"2.0" => b"NOTIdlD",
            b"2.1" => b"NOTBIdRlD",
            _ => return None,
        }))
    }
}

/// Days from 1899-12-30, the epoch of the start time.
const DAYS_TO_1970: i64 = 25_569;

impl LineReader for Trc {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        if let Some(comment) = line.strip_prefix(b";") {
            return self.heading(comment).map(|()| None);
        }
        let line = text(line)?;
        match csv_row(line) {
            Some(row) => {
                let CsvRow { offset, bus, content } = row?;
                let entry = |content| LogEntry::numbered(self.start.saturating_add(offset), bus, content);
                Ok(content.map(entry))
            }
            None => self.frame(fields(line, 16)),
        }
    }
}

impl Trc {
    fn heading(&mut self, comment: &[u8]) -> Result<(), BadLine> {
        if let Some(version) = comment.strip_prefix(b"$FILEVERSION=") {
            self.columns = TrcColumns::of_version(version.trim_ascii()).ok_or(BadLine::NoFrame)?;
        } else if let Some(start) = comment.strip_prefix(b"$STARTTIME=") {
            let nanos = text(start).ok().and_then(|text| decimal(text.trim_ascii(), DAY));
            self.start = nanos.map(|nanos| nanos - DAYS_TO_1970 * DAY).ok_or(BadLine::NoTime)?;
        } else if let Some(columns) = comment.strip_prefix(b"$COLUMNS=") {
            let mut letters = [0; 10];
            let columns = columns.trim_ascii().split(|byte| *byte == b',').map(<[u8]>::trim_ascii);
            for (index, column) in columns.enumerate() {
                let ([letter], Some(known)) = (column, letters.get_mut(index)) else {
                    return Err(BadLine::NoFrame);
                };
                *known = *letter;
            }
            self.columns = TrcColumns(letters);
        }
        Ok(())
    }

    /// Reads a line that is not a heading; returns `None` if it is not a frame.
    fn frame(&self, mut fields: SpacedFields<'_>) -> Result<Option<LogEntry<'static>>, BadLine> {
        let (mut offset, mut bus, mut kind, mut identifier, mut length) = (None, 0, "DT", None, None);
        for column in self.columns.0.into_iter().take_while(|column| !matches!(column, 0 | b'D')) {
            match column {
                b'O' => offset = Some(fields.time(SECOND / 1000)?),
                b'B' => bus = fields.channel()?,
                b'T' | b't' => kind = fields.text(BadLine::NoFrame)?,
                b'I' => identifier = fields.next(),
                b'L' | b'l' => length = fields.length().ok().map(|length| (column, length)),
                _ => {
                    fields.text(BadLine::NoFrame)?;
                }
            }
        }
        let offset = offset.ok_or(BadLine::NoTime)?;
        let fd = matches!(kind, "FD" | "FB" | "FE" | "BI");
        let content = match kind {
            // A warning of version 1.0.
            _ if identifier == Some("FFFFFFFF") => return Ok(None),
            "DT" | "Rx" | "Tx" | "FD" | "FB" | "FE" | "BI" | "RR" => {
                content(identifier, fd, kind == "RR", length, fields)?
            }
            "ER" | "Error" => bus_error(),
            "ST" | "EC" | "EV" | "Warng" => return Ok(None),
            _ => return Err(BadLine::NoFrame),
        };
        Ok(Some(LogEntry::numbered(self.start.saturating_add(offset), bus, content)))
    }
}

fn content(
    identifier: Option<&str>,
    fd: bool,
    remote: bool,
    length: Option<(u8, usize)>,
    mut data: SpacedFields<'_>,
) -> Result<EntryContent, BadLine> {
    let identifier = identifier.ok_or(BadLine::NoFrame)?;
    if data.clone().next() == Some("ERROR") {
        return Ok(bus_error());
    }
    let id = id(number(identifier, 16).ok_or(BadLine::BadId)?, identifier.len() > 4)?;
    if remote || data.clone().next() == Some("RTR") {
        return Ok(EntryContent::Remote);
    }
    let length = match length {
        Some((b'L', dlc)) => u32::try_from(dlc).ok().and_then(|dlc| length_of_dlc(dlc, fd)),
        other => other.map(|(_, length)| length),
    };
    let content = data.data_frame(id, fd, length.ok_or(BadLine::BadLength)?)?;
    data.end()?;
    Ok(content)
}

/// A row of PEAK-Converter's CSV.
struct CsvRow {
    /// Time since the start, ns.
    offset: i64,
    bus: u32,
    /// `None` if the row is not a frame.
    content: Option<EntryContent>,
}

/// Reads a row of PEAK-Converter's CSV; returns `None` if the line does not begin like one.
fn csv_row(line: &str) -> Option<Result<CsvRow, BadLine>> {
    let (index, rest) = line.split_once([',', ';', '\t'])?;
    number(index.trim(), 10)?;
    let separator = line[index.len()..].chars().next()?;
    let mut columns = rest.split(separator).map(str::trim);
    decimal(columns.clone().next()?, 1)?;
    Some(row(&mut columns))
}

fn row<'a>(columns: &mut impl Iterator<Item = &'a str>) -> Result<CsvRow, BadLine> {
    let mut next = || columns.next().unwrap_or_default();
    let offset = decimal(next(), SECOND / 1000).ok_or(BadLine::NoTime)?;
    let bus = number(next(), 10).ok_or(BadLine::NoInterface)?;
    let (_direction, kind, identifier, _reserved) = (next(), next(), next(), next());
    let length = number(next(), 10);
    let fd = matches!(kind, "FD" | "FB" | "FE" | "BI");
    let content = match kind {
        "DT" | "FD" | "FB" | "FE" | "BI" | "RR" => {
            let id = id(number(identifier, 16).ok_or(BadLine::BadId)?, identifier.len() > 4)?;
            let bytes = columns.filter(|byte| !byte.is_empty()).collect::<Vec<_>>().join(" ");
            let mut bytes = fields(&bytes, 16);
            if kind == "RR" {
                Some(EntryContent::Remote)
            } else {
                let length = length.ok_or(BadLine::BadLength)?;
                let count = bytes.clone().count();
                let announced = [usize::try_from(length).ok(), length_of_dlc(length, fd)];
                if !announced.contains(&Some(count)) {
                    return Err(BadLine::BadLength);
                }
                Some(bytes.data_frame(id, fd, count)?)
            }
        }
        "ER" => Some(bus_error()),
        "ST" | "EC" | "EV" => None,
        _ => return Err(BadLine::NoFrame),
    };
    Ok(CsvRow { offset, bus, content })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    #[test]
    fn version_2_has_the_columns_it_names() {
        let lines = good(
            FORMAT,
            &[
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
            ],
        );
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
        let lengths = good(
            FORMAT,
            &[";$FILEVERSION=2.0", ";$COLUMNS=N,O,T,I,d,l,D", "1 1.5 FD 01A0 Rx 12 0 1 2 3 4 5 6 7 8 9 A B"],
        );
        assert_eq!(lengths, ["1500 can0 1A0##0000102030405060708090A0B"]);
    }

    #[test]
    fn versions_1_have_fixed_columns() {
        let lines = good(
            FORMAT,
            &[
                "1) 2 01A0 2 01 02",
                "2) 3 0008 4 ERROR 00 19 08 08",
                "3) 4 FFFFFFFF 4 00 00 00 04 BUSLIGHT",
                "4) 5 01A0 3 RTR",
            ],
        );
        let error = "3000 can0 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })";
        assert_eq!(lines, ["2000 can0 1A0#0102", error, "5000 can0 Remote"]);
        let lines = good(
            FORMAT,
            &[
                ";$FILEVERSION=1.1",
                "1) 1.2 Rx 01A0 2 01 02",
                "2) 1.3 Tx 18FEF100 8 RTR",
                "3) 1.4 Warng FFFFFFFF 4 00 00 00 08 BUSHEAVY",
                "4) 1.5 Error 0001 4 00 00 00 00",
            ],
        );
        assert_eq!(
            lines,
            [
                "1200 can0 1A0#0102",
                "1300 can0 Remote",
                "1500 can0 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })"
            ]
        );
        assert_eq!(good(FORMAT, &[";$FILEVERSION=1.2", "1) 1.2 2 Rx 01A0 1 01"]), ["1200 can2 1A0#01"]);
        assert_eq!(good(FORMAT, &[";$FILEVERSION=1.3", "1) 1.2 2 Rx 01A0 - 1 01"]), ["1200 can2 1A0#01"]);
    }

    #[test]
    fn csv_of_peak_converter_is_read_with_any_separator() {
        for separator in [",", ";", "\t"] {
            let rows = [
                "1,1.250,1,Rx,DT,01A0,-,3,01,02,fF,,,,,",
                "2,2.0,2,Tx,FB,18FEF100,-,9,1,2,3,4,5,6,7,8,9,A,B,C",
                "3,3.0,2,Tx,FD,18FEF100,-,12,1,2,3,4,5,6,7,8,9,A,B,C",
                "4,4.0,1,Rx,RR,01A0,-,8",
                "5,5.0,1,Rx,ST,-,-,4,00,00,00,08",
                "6,6.0,1,Rx,ER,-,-,5,04,00,02,00,00",
                "7,7.0,1,Rx,DT,01A0,-,0",
            ];
            let rows = rows.map(|row| row.replace(',', separator));
            assert!((FORMAT.claims)(rows[0].as_bytes()), "{}", rows[0]);
            let lines: Vec<_> =
                [";$STARTTIME=25569.5"].into_iter().chain(rows.iter().map(String::as_str)).collect();
            let expected = [
                "43200001250 can1 1A0#0102FF",
                "43200002000 can2 18FEF100##00102030405060708090A0B0C",
                "43200003000 can2 18FEF100##00102030405060708090A0B0C",
                "43200004000 can1 Remote",
                "43200006000 can1 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })",
                "43200007000 can1 1A0#",
            ];
            assert_eq!(good(FORMAT, &lines), expected);
        }
        let cases = [
            ("1,1.0,x,Rx,DT,01A0,-,0", BadLine::NoInterface),
            ("1,1.0,1,Rx,XY,01A0,-,0", BadLine::NoFrame),
            ("1,1.0", BadLine::NoInterface),
            ("1,1.0,1,Rx,DT,0800,-,0", BadLine::BadId),
            ("1,1.0,1,Rx,DT,01A0,-,2,00", BadLine::BadLength),
            ("1,1.0,1,Rx,DT,01A0,-,x,00", BadLine::BadLength),
            ("1,1.0,1,Rx,DT,01A0,-,1,zz", BadLine::BadData),
        ];
        assert_refused(FORMAT, &[], &cases);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
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
        ];
        assert_refused(FORMAT, &[";$FILEVERSION=1.1"], &cases);
        let no_bus = ("1 1.0 DT x 01A0 Rx - 0", BadLine::NoInterface);
        assert_refused(FORMAT, &[";$FILEVERSION=2.1"], &[no_bus]);
    }
}
