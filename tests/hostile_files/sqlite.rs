//! SQLite: pages of cells, and the tables of python-can and `rosbag2`.

use super::recordings::{Frame, mcap};

pub(crate) const CAN_TABLE: &str = "CREATE TABLE messages (ts REAL, arbitration_id INTEGER, extended INTEGER, \
                                    remote INTEGER, error INTEGER, dlc INTEGER, data BLOB)";
pub(crate) const ROS_MESSAGES: &str =
    "CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)";
pub(crate) const ROS_TOPICS: &str =
    "CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)";

#[derive(Debug, Clone)]
pub(crate) enum Value<'a> {
    Null,
    Integer(i64),
    Real(f64),
    Text(&'a [u8]),
    Blob(&'a [u8]),
}

pub(crate) fn varint(number: usize) -> Vec<u8> {
    let mut bytes = vec![u8::try_from(number & 0x7F).unwrap()];
    let mut left = number >> 7;
    while left > 0 {
        bytes.insert(0, u8::try_from(left & 0x7F).unwrap() | 0x80);
        left >>= 7;
    }
    bytes
}

pub(crate) fn record(values: &[Value<'_>]) -> Vec<u8> {
    let (mut types, mut content) = (Vec::new(), Vec::new());
    for value in values {
        let (kind, bytes) = match value {
            Value::Null => (0, Vec::new()),
            Value::Integer(number) => (6, number.to_be_bytes().to_vec()),
            Value::Real(number) => (7, number.to_be_bytes().to_vec()),
            Value::Blob(bytes) => (12 + 2 * bytes.len(), bytes.to_vec()),
            Value::Text(bytes) => (13 + 2 * bytes.len(), bytes.to_vec()),
        };
        types.extend(varint(kind));
        content.extend(bytes);
    }
    // Its own length is a part of the head.
    let length = if types.len() < 0x7F { 1 } else { 2 };
    [varint(types.len() + length), types, content].concat()
}

pub(crate) fn cell(row: usize, record: &[u8]) -> Vec<u8> {
    [varint(record.len()), varint(row), record.to_vec()].concat()
}

/// A page of cells, a leaf unless it has a last child; `at` is 100 in the first page.
pub(crate) fn page(size: usize, at: usize, right: Option<u32>, cells: &[Vec<u8>]) -> Vec<u8> {
    let mut page = vec![0; size];
    page[at] = if right.is_some() { 0x05 } else { 0x0D };
    page[at + 3..at + 5].copy_from_slice(&u16::try_from(cells.len()).unwrap().to_be_bytes());
    let (mut end, mut pointer) = (size, at + 8);
    if let Some(right) = right {
        page[at + 8..at + 12].copy_from_slice(&right.to_be_bytes());
        pointer += 4;
    }
    for cell in cells {
        end -= cell.len();
        page[end..end + cell.len()].copy_from_slice(cell);
        page[pointer..pointer + 2].copy_from_slice(&u16::try_from(end).unwrap().to_be_bytes());
        pointer += 2;
    }
    page
}

/// A file whose tables have these names, statements and roots.
pub(crate) fn file(size: usize, tables: &[(&str, &str, i64)], pages: &[Vec<u8>]) -> Vec<u8> {
    let cells: Vec<_> = (1..)
        .zip(tables)
        .map(|(row, (name, sql, root))| {
            let name = Value::Text(name.as_bytes());
            let values = [
                Value::Text(b"table"),
                name.clone(),
                name,
                Value::Integer(*root),
                Value::Text(sql.as_bytes()),
            ];
            cell(row, &record(&values))
        })
        .collect();
    let mut first = page(size, 100, None, &cells);
    first[..16].copy_from_slice(b"SQLite format 3\0");
    let written = u16::try_from(size).unwrap_or(1);
    first[16..18].copy_from_slice(&written.to_be_bytes());
    first[18..20].copy_from_slice(&[1, 1]);
    first[59] = 1;
    [first, pages.concat()].concat()
}

pub(crate) fn python(frames: &[Frame]) -> Vec<u8> {
    let row = |frame: &Frame| {
        #[allow(clippy::cast_precision_loss)] // below 2^53
        let time = Value::Real(frame.micros as f64 / 1e6);
        let [id, length] =
            [i64::from(frame.id), i64::try_from(frame.data.len()).unwrap()].map(Value::Integer);
        let flag = || Value::Integer(0);
        record(&[time, id, flag(), flag(), flag(), length, Value::Blob(&frame.data)])
    };
    let records: Vec<_> = frames.iter().map(row).collect();
    leaves(&[("messages", CAN_TABLE, 2)], &records)
}

pub(crate) fn ros(frames: &[Frame]) -> Vec<u8> {
    let topic = record(&[
        Value::Null,
        Value::Text(b"/can0/from_can_bus"),
        Value::Text(b"can_msgs/msg/Frame"),
        Value::Text(b"cdr"),
    ]);
    let row = |frame: &Frame| {
        let (cdr, nanos) = (mcap::cdr(frame), i64::try_from(frame.micros * 1000).unwrap());
        record(&[Value::Null, Value::Integer(1), Value::Integer(nanos), Value::Blob(&cdr)])
    };
    let records: Vec<_> = frames.iter().map(row).collect();
    let topics = page(PAGE, 0, None, &[cell(1, &topic)]);
    let mut file = leaves(&[("topics", ROS_TOPICS, 0), ("messages", ROS_MESSAGES, 2)], &records);
    // The topics are on the last page.
    let root = i64::try_from(file.len() / PAGE + 1).unwrap();
    let first = self::file(PAGE, &[("topics", ROS_TOPICS, root), ("messages", ROS_MESSAGES, 2)], &[]);
    file[..PAGE].copy_from_slice(&first);
    [file, topics].concat()
}

const PAGE: usize = 4096;

/// A table whose root, page 2, has a leaf for each thirty rows.
fn leaves(tables: &[(&str, &str, i64)], records: &[Vec<u8>]) -> Vec<u8> {
    let pages: Vec<_> = (0..)
        .zip(records.chunks(30))
        .map(|(index, rows)| {
            let cells: Vec<_> = (1..).zip(rows).map(|(row, record)| cell(30 * index + row, record)).collect();
            page(PAGE, 0, None, &cells)
        })
        .collect();
    let child = |index: usize| u32::try_from(3 + index).unwrap();
    let inner: Vec<_> = (0..pages.len().saturating_sub(1))
        .map(|index| [&child(index).to_be_bytes()[..], &varint(30 * (index + 1))].concat())
        .collect();
    let root = page(PAGE, 0, Some(child(inner.len())), &inner);
    let pages = if pages.is_empty() { vec![page(PAGE, 0, None, &[])] } else { pages };
    file(PAGE, tables, &[vec![root], pages].concat())
}
