//! CSV of data sets for intrusion detection, with a label for each frame.
//!
//! ```text
//! timestamp,arbitration_id,data_field,attack
//! 1672531200.000000,1E5,3000000430000004,0
//!
//! Timestamp,Arbitration_ID,DLC,Data,Class,SubClass
//! 1597759710.125893,153,8,20 A1 10 FF 00 FF 50 1F,Normal,Normal
//! ```
//! The heading names the columns, in any order. The time is in seconds. Identifier and data are hexadecimal,
//! with or without `0x`, data also with spaces; an identifier of eight digits, or above `7FF`, has 29 bits,
//! and more than eight bytes are CAN FD. A column `dlc` or `dlc_value` must agree with the data. A column
//! `interface` names the bus; without it, all frames belong to `can0`. All other columns are ignored,
//! including labels: injected frames were on the bus. Rows without values (`na`) are bad.

use crate::clock::SECOND;
use crate::entry::{BadLine, EntryInterface, LogEntry};
use crate::fields::{columns, decimal, fields, id, number, packed_frame, text};
use crate::format::{LineFormat, LineReader};
use gateway_base::time::WallStamp;

pub(super) const FORMAT: LineFormat = LineFormat {
    name: "data set CSV",
    claims: |line| text(line).ok().and_then(DataSetColumns::of_heading).is_some(),
    unit_ns: Some(SECOND),
    reader: |unit_ns| Box::new(DataSet { columns: None, unit_ns }),
};

struct DataSet {
    /// Positions of the columns; `None` before the heading.
    columns: Option<DataSetColumns>,
    /// Unit of the stamps, ns.
    unit_ns: i64,
}

/// Position of each column.
#[derive(Debug, Clone, Copy)]
struct DataSetColumns {
    time: usize,
    id: usize,
    data: usize,
    length: Option<usize>,
    interface: Option<usize>,
}

impl DataSetColumns {
    /// Returns the positions in a heading; `None` for any other line. A column `data` next to a column
    /// `extended` is the python-can format, in Base64.
    fn of_heading(heading: &str) -> Option<Self> {
        let position = |names: &[&str]| {
            columns(heading, 0).position(|column| names.iter().any(|name| column.eq_ignore_ascii_case(name)))
        };
        let data = position(&["data_field"])
            .or_else(|| position(&["data"]).filter(|_| position(&["extended"]).is_none()));
        Some(Self {
            time: position(&["timestamp"])?,
            id: position(&["arbitration_id"])?,
            data: data?,
            length: position(&["dlc", "dlc_value"]),
            interface: position(&["interface"]),
        })
    }
}

impl LineReader for DataSet {
    fn read<'a>(&mut self, line: &'a [u8]) -> Result<Option<LogEntry<'a>>, BadLine> {
        let line = text(line)?;
        if let Some(columns) = DataSetColumns::of_heading(line) {
            self.columns = Some(columns);
            return Ok(None);
        }
        let at = self.columns.ok_or(BadLine::NoFrame)?;
        let field = |column| columns(line, column).next().unwrap_or_default();
        let nanos = decimal(field(at.time), self.unit_ns).ok_or(BadLine::NoTime)?;
        let interface = match at.interface.map(field) {
            None => EntryInterface::Numbered(0),
            Some(name) if !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_graphic()) => {
                EntryInterface::Named(name)
            }
            Some(_) => return Err(BadLine::NoInterface),
        };
        let digits = without_mark(field(at.id));
        let number = number(digits, 16).ok_or(BadLine::BadId)?;
        let id = id(number, number > 0x7FF || digits.len() == 8)?;
        let data = without_mark(field(at.data));
        let mut bytes = fields(data, 16);
        let is_spaced = data.contains(' ');
        let count = if is_spaced { bytes.clone().count() } else { data.len() / 2 };
        if at.length.is_some_and(|length| columns(line, length).length() != Ok(count)) {
            return Err(BadLine::BadLength);
        }
        let is_fd = count > 8;
        let content =
            if is_spaced { bytes.data_frame(id, is_fd, count) } else { packed_frame(id, is_fd, data) };
        Ok(Some(LogEntry { stamp: WallStamp::from_nanos(nanos), interface, content: content? }))
    }
}

fn without_mark(field: &str) -> &str {
    field.strip_prefix("0x").unwrap_or(field)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::testing::{assert_refused, good};

    #[test]
    fn headings_of_public_data_sets_are_read() {
        let lines = good(
            FORMAT,
            &[
                "timestamp,arbitration_id,data_field,attack",
                "1672531200.000001,1E5,3000000430000004,0",
                "1672531200.5,0x07F,00c3,1",
                "1672531201.0,18FEF100,,0",
                "1672531201.0,00000123,01,0",
                "1672531202.0,123,000102030405060708090A0B,0",
                "timestamp,arbitration_id,data_field,dlc_value,attack",
                "1698233010.284626,436,00000000,4,0",
                "Timestamp,Arbitration_ID,DLC,Data,Class,SubClass",
                "1597759710.1258929,153,8,20 A1 10 FF 00 FF 50 1F,Normal,Normal",
                "Interface,Timestamp,Arbitration_ID,DLC,Data,Label",
                "C-CAN,0.00104,2c0,2,ffff,1",
                "Label , Data , Arbitration_ID , Timestamp",
                "0,11,111,2.5",
            ],
        );
        let expected = [
            "1672531200000001 can0 1E5#3000000430000004",
            "1672531200500000 can0 07F#00C3",
            "1672531201000000 can0 18FEF100#",
            "1672531201000000 can0 00000123#01",
            "1672531202000000 can0 123##0000102030405060708090A0B",
            "1698233010284626 can0 436#00000000",
            "1597759710125892 can0 153#20A110FF00FF501F",
            "1040 C-CAN 2C0#FFFF",
            "2500000 can0 111#11",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn only_a_heading_with_all_three_columns_is_one() {
        for line in [
            "timestamp,arbitration_id,attack",
            "arbitration_id,data_field,attack",
            "timestamp,id,data_field",
            "timestamp,arbitration_id,data,extended",
            "1672531200.000001,1E5,3000000430000004,0",
        ] {
            assert!(!(FORMAT.claims)(line.as_bytes()), "{line}");
        }
    }

    #[test]
    fn every_malformed_line_has_its_reason() {
        let cases = [
            ("x,123,00,1,a", BadLine::NoTime),
            ("1.0,,,,a", BadLine::BadId),
            ("1.0,na,na,1,a", BadLine::BadId),
            ("1.0,20000000,00,1,a", BadLine::BadId),
            ("1.0,123,na,1,a", BadLine::BadData),
            ("1.0,123,0,0,a", BadLine::BadData),
            ("1.0,123,00 zz,2,a", BadLine::BadData),
            ("1.0,123,00,2,a", BadLine::BadLength),
            ("1.0,123,00,x,a", BadLine::BadLength),
            ("1.0,123,000102030405060708,9,a", BadLine::BadLength),
            ("1.0,123,00,1,", BadLine::NoInterface),
        ];
        assert_refused(FORMAT, &["timestamp,arbitration_id,data_field,dlc,interface"], &cases);
        assert_refused(FORMAT, &[], &[("1.0,123,00", BadLine::NoFrame)]);
    }
}
