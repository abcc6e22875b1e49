//! The SQLite database of python-can: the table `messages`, with a row for each frame.
//!
//! It does not name buses, so all frames belong to `can0`. Neither CAN FD nor the kind of an error is stated,
//! so frames of more than 8 bytes are read as FD.

use std::io;

use super::sqlite_file::{Database, Rows, Table, Value};
use crate::clock::{SECOND, nanos_of_seconds};
use crate::entry::{BadLine, EntryContent, LogEntry};
use crate::fields::{bus_error, data_frame, id};
use crate::format::{ObjectReader, Outcome};

/// Columns of the table `messages`.
pub(super) const COLUMNS: [&str; 7] = ["ts", "arbitration_id", "extended", "remote", "error", "dlc", "data"];

pub(super) struct PythonSqlite {
    database: Database,
    rows: Rows<7>,
}

impl PythonSqlite {
    pub(super) fn new(database: Database, table: Table<7>) -> Self {
        let rows = Rows::new(table, &database);
        Self { database, rows }
    }
}

impl ObjectReader for PythonSqlite {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        let row = self.rows.next(&self.database)?;
        Ok(row.map(|row| row.map_err(|_| BadLine::NoFrame).and_then(entry).map(Some)))
    }
}

fn entry(
    [time, number, extended, remote, error, dlc, data]: [Value<'_>; 7],
) -> Result<LogEntry<'static>, BadLine> {
    let flag = |value: Value<'_>| value.integer().map(|flag| flag != 0).ok_or(BadLine::NoFrame);
    let (extended, remote, error) = (flag(extended)?, flag(remote)?, flag(error)?);
    let content = if error {
        bus_error()
    } else {
        let number = number.integer().and_then(|number| u32::try_from(number).ok());
        let id = id(number.ok_or(BadLine::BadId)?, extended)?;
        if remote {
            EntryContent::Remote
        } else {
            let data = if data == Value::Null { &[] } else { data.bytes().ok_or(BadLine::BadData)? };
            if dlc.integer() != i64::try_from(data.len()).ok() {
                return Err(BadLine::BadLength);
            }
            data_frame(id, data.len() > 8, data)?
        }
    };
    Ok(LogEntry::numbered(nanos(time).ok_or(BadLine::NoTime)?, 0, content))
}

/// Returns a time in seconds in ns, unless it is out of range. SQLite writes whole seconds as integers.
fn nanos(time: Value<'_>) -> Option<i64> {
    match time {
        Value::Integer(seconds) => seconds.checked_mul(SECOND),
        Value::Real(seconds) => nanos_of_seconds(seconds),
        Value::Null | Value::Text(_) | Value::Blob(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::sqlite::FORMAT;
    use super::super::sqlite_file::testing::{file, page, record, whole};
    use super::*;
    use crate::format::testing::{assert_survives_damage, objects};
    use proptest::prelude::*;

    const SQL: &[u8] = b"CREATE TABLE messages (ts REAL, arbitration_id INTEGER, extended INTEGER, remote INTEGER, error INTEGER, dlc INTEGER, data BLOB)";

    fn database(rows: &[[Value<'_>; 7]]) -> Vec<u8> {
        let cells: Vec<_> = rows.iter().zip(1..).map(|(row, number)| whole(number, &record(row))).collect();
        file(b"messages", SQL, &[page(0, None, &cells)])
    }

    fn row<'a>(time: Value<'a>, id: i64, flags: [i64; 3], length: i64, data: &'a [u8]) -> [Value<'a>; 7] {
        let [extended, remote, error] = flags.map(Value::Integer);
        [time, Value::Integer(id), extended, remote, error, Value::Integer(length), Value::Blob(data)]
    }

    #[test]
    fn every_kind_of_row_is_read_and_damaged_ones_are_not() {
        let (time, whole) = (Value::Real(1.000_25), Value::Integer(-2));
        let rows = [
            row(time, 0x123, [0, 0, 0], 2, &[1, 2]),
            row(whole, 0x18FE_F100, [1, 0, 0], 12, &[7; 12]),
            row(time, 0x123, [0, 1, 0], 4, &[]),
            row(time, 0, [0, 0, 1], 0, &[]),
            row(time, 0x800, [0, 0, 0], 0, &[]),
            row(time, -1, [1, 0, 0], 0, &[]),
            row(time, 0x123, [0, 0, 0], 3, &[1]),
            row(time, 0x123, [0, 0, 0], 9, &[1; 9]),
            row(Value::Real(1e12), 0x123, [0, 0, 0], 0, &[]),
            row(Value::Null, 0x123, [0, 0, 0], 0, &[]),
        ];
        let error = "1000250 can0 Error(ErrorFrame { class: 136, data: [0, 0, 0, 0, 0, 0, 0, 0] })";
        let expected = [
            Ok("1000250 can0 123#0102"),
            Ok("-2000000 can0 18FEF100##0070707070707070707070707"),
            Ok("1000250 can0 Remote"),
            Ok(error),
            Err(BadLine::BadId),
            Err(BadLine::BadId),
            Err(BadLine::BadLength),
            Err(BadLine::BadLength),
            Err(BadLine::NoTime),
            Err(BadLine::NoTime),
        ];
        assert_eq!(
            objects(FORMAT, &database(&rows)).unwrap(),
            expected.map(|entry| entry.map(str::to_owned))
        );
    }

    #[test]
    fn a_database_without_frames_is_refused() {
        let other = file(b"messages", b"CREATE TABLE messages (id, text)", &[page(0, None, &[])]);
        let error = objects(FORMAT, &other).unwrap_err().to_string();
        assert!(error.contains("no table messages of CAN frames; python-can writes one"), "{error}");
    }

    proptest! {
        #[test]
        fn damaged_files_are_read_to_their_end(damage in proptest::collection::vec((any::<usize>(), any::<u8>()), 0..20)) {
            let rows = [1, 2, 3, 4].map(|id| row(Value::Integer(5), id, [0; 3], 2, &[1, 2]));
            assert_survives_damage(FORMAT, database(&rows), &damage);
        }
    }
}
