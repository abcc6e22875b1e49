//! The CSV format of CSS Electronics' `mdf2csv`, for `CANedge` recordings.
//!
//! ```text
//! TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;ESI;RTR;DataBytes
//! 1689951599.926300;9;06A;0;3;3;0;0;0;0;0;474400
//! ```
//! The heading names the columns (some files have no `ESI` and `RTR`). Time is in seconds since 1970,
//! identifier and data are hexadecimal. `IDE` is 1 for 29 bits, `EDL` for CAN FD, `RTR` for a remote request.
//! CSS Electronics' python-can-cansub writes and reads the same layout; its channel may also be a name, or
//! empty, which means `can0`.

use crate::clock::SECOND;
use crate::entry::{BadLine, EntryContent, EntryInterface, LogEntry};
use crate::fields::{decimal, id, number, packed_frame, text};
use crate::format::{LineFormat, LineReader, begins};
use gateway_base::time::WallStamp;

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "CANedge CSV",
    claims: |line| begins(line, &[MARK]),
    unit_ns: Some(SECOND),
    reader: |unit_ns| Box::new(CanEdge { unit_ns, ..CanEdge::default() }),
};

const MARK: &str = "TimestampEpoch;BusChannel;ID;IDE;";

/// Columns that every file has, in the order in which [`CanEdge`] holds their positions.
const COLUMNS: [&str; 7] = ["TimestampEpoch", "BusChannel", "ID", "IDE", "DataLength", "EDL", "DataBytes"];

/// Positions of the columns from the heading.
#[derive(Debug, Default)]
struct CanEdge {
    columns: [usize; COLUMNS.len()],
    remote: Option<usize>,
    /// Number of columns, 0 before the heading.
    count: usize,
    /// Unit of the stamps, ns.
    unit_ns: i64,
}

impl CanEdge {
    fn of_heading(heading: &str, unit_ns: i64) -> Option<Self> {
        let position = |name: &str| heading.split(';').position(|column| column.eq_ignore_ascii_case(name));
        let mut columns = [0; COLUMNS.len()];
        for (column, name) in columns.iter_mut().zip(COLUMNS) {
            *column = position(name)?;
        }
        Some(Self { columns, remote: position("RTR"), count: heading.split(';').count(), unit_ns })
    }
}

impl LineReader for CanEdge {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        let line = text(line)?;
        if begins(line.as_bytes(), &[MARK]) {
            *self = Self::of_heading(line, self.unit_ns).ok_or(BadLine::NoFrame)?;
            return Ok(None);
        }
        if self.count == 0 || line.split(';').count() != self.count {
            return Err(BadLine::NoFrame);
        }
        let field = |column| line.split(';').nth(column).unwrap_or_default().trim();
        let flag = |column| match field(column) {
            "0" => Ok(false),
            "1" => Ok(true),
            _ => Err(BadLine::NoFrame),
        };
        let [time, bus, identifier, extended, length, fd, data] = self.columns;
        let nanos = decimal(field(time), self.unit_ns).ok_or(BadLine::NoTime)?;
        let interface = match field(bus) {
            "" => EntryInterface::Numbered(0),
            bus => number(bus, 10).map_or(EntryInterface::Named(bus), EntryInterface::Numbered),
        };
        let id = id(number(field(identifier), 16).ok_or(BadLine::BadId)?, flag(extended)?)?;
        let is_remote = self.remote.map(flag).transpose()?.unwrap_or_default();
        let (fd, data) = (flag(fd)?, field(data));
        let content = if is_remote { EntryContent::Remote } else { packed_frame(id, fd, data)? };
        let length = number(field(length), 10).and_then(|length| usize::try_from(length).ok());
        if !is_remote && length != Some(data.len() / 2) {
            return Err(BadLine::BadLength);
        }
        Ok(Some(LogEntry { stamp: WallStamp::from_nanos(nanos), interface, content }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    const SHORT: &str = "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;DataBytes";
    const LONG: &str = "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;ESI;RTR;DataBytes";

    #[test]
    fn both_headings_are_read() {
        let lines = good(
            FORMAT,
            &[
                LONG,
                "1689951599.926300;9;06A;0;3;3;0;0;0;0;0;474400",
                "1.5;1;18FEF100;1;9;12;0;1;1;0;0;000102030405060708090A0B",
                "2.0;1;1A0;0;8;0;0;0;0;0;1;",
                "2.5;1;1A0;0;1;1;0;1;0;0;0;01",
                SHORT,
                "3.0;2;1A0;0;2;2;0;0;0;0102",
                "4.0;vcan0;1A0;0;0;0;0;0;0;",
                "5.0;;1A0;0;0;0;0;0;0;",
            ],
        );
        let expected = [
            "1689951599926300 can9 06A#474400",
            "1500000 can1 18FEF100##0000102030405060708090A0B",
            "2000000 can1 Remote",
            "2500000 can1 1A0##001",
            "3000000 can2 1A0#0102",
            "4000000 vcan0 1A0#",
            "5000000 can0 1A0#",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("TimestampEpoch;BusChannel;ID;IDE;DLC", BadLine::NoFrame),
            ("1.0;1;1A0;0", BadLine::NoFrame),
            ("x;1;1A0;0;0;0;0;0;0;", BadLine::NoTime),
            ("1.0;1;800;0;0;0;0;0;0;", BadLine::BadId),
            ("1.0;1;1A0;2;0;0;0;0;0;", BadLine::NoFrame),
            ("1.0;1;1A0;0;0;0;0;x;0;", BadLine::NoFrame),
            ("1.0;1;1A0;0;2;2;0;0;0;01", BadLine::BadLength),
            ("1.0;1;1A0;0;1;1;0;0;0;0", BadLine::BadData),
            ("1.0;1;1A0;0;9;9;0;0;0;000102030405060708", BadLine::BadLength),
        ];
        assert_refused(FORMAT, &[SHORT], &cases);
        assert_refused(FORMAT, &[], &[("3.0;2;1A0;0;2;2;0;0;0;0102", BadLine::NoFrame)]);
    }
}
