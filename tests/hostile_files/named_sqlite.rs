//! SQLite that is hostile on purpose: rows that share bytes, chains that share pages, and what zeros stand
//! behind.

use super::named::{DECODED, FRAMES, MOST, Named, QUICK};
use super::packing::{Packing, gzip_of_zeros_behind};
use super::recordings::drive;
use super::sqlite;

pub(crate) const ALL: &[Named] = &[
    Named("columns.sqlite.gz", MOST, 0, |_| {
        Packing::Gzip.pack(&overlapping_cells(sqlite::CAN_TABLE, "messages"))
    }),
    Named("columns.db3.gz", QUICK, 0, |_| {
        Packing::Gzip.pack(&overlapping_cells(sqlite::ROS_MESSAGES, "messages"))
    }),
    Named("topics.db3.gz", QUICK, 0, |_| {
        Packing::Gzip.pack(&overlapping_cells(sqlite::ROS_TOPICS, "topics"))
    }),
    Named("shared_overflow.sqlite.gz", QUICK, 0, |_| Packing::Gzip.pack(&shared_overflow())),
    Named("long_statement.sqlite.gz", QUICK, 0, |size| Packing::Gzip.pack(&long_statement(size * 8))),
    Named("zeros_behind.sqlite.gz", QUICK, DECODED, |size| {
        gzip_of_zeros_behind(&sqlite::python(&drive(FRAMES)), size / 1024)
    }),
    Named("zeros_behind.db3.gz", QUICK, DECODED, |size| {
        gzip_of_zeros_behind(&sqlite::ros(&drive(FRAMES)), size / 1024)
    }),
];

/// Ten leaves of 64 KiB, whose 16,000 pointers lead to one row that lists 30,000 columns.
fn overlapping_cells(statement: &str, name: &str) -> Vec<u8> {
    const PAGE: usize = 1 << 16;
    const CELLS: usize = 16_000;
    let mut leaf = sqlite::page(PAGE, 0, None, &[]);
    let head = [sqlite::varint(30_003), vec![0; 30_000]].concat();
    let cell = sqlite::cell(1, &head);
    let at = PAGE - cell.len();
    leaf[at..].copy_from_slice(&cell);
    leaf[3..5].copy_from_slice(&u16::try_from(CELLS).unwrap().to_be_bytes());
    for index in 0..CELLS {
        leaf[8 + 2 * index..10 + 2 * index].copy_from_slice(&u16::try_from(at).unwrap().to_be_bytes());
    }
    let children: Vec<_> = (3..12_u32).map(|child| [&child.to_be_bytes()[..], &[1]].concat()).collect();
    let root = sqlite::page(PAGE, 0, Some(12), &children);
    let tables: &[_] = if name == "messages" {
        &[("messages", statement, 2)]
    } else {
        &[("messages", sqlite::ROS_MESSAGES, 3), ("topics", sqlite::ROS_TOPICS, 2)]
    };
    sqlite::file(PAGE, tables, &[vec![root], vec![leaf; 10]].concat())
}

/// Rows whose rest is in the same chain of pages.
fn shared_overflow() -> Vec<u8> {
    const PAGE: usize = 4096;
    const PAGES: usize = 2000;
    let length = PAGES * (PAGE - 4);
    let record = [sqlite::varint(9), vec![0; 8]].concat();
    let mut cell = [sqlite::varint(length), vec![1], record].concat();
    cell.resize(PAGE - 600, 0);
    cell.extend(3_u32.to_be_bytes());
    let mut leaf = sqlite::page(PAGE, 0, None, &[cell]);
    let pointer = [leaf[8], leaf[9]];
    leaf[3..5].copy_from_slice(&200_u16.to_be_bytes());
    for index in 0..200 {
        leaf[8 + 2 * index..10 + 2 * index].copy_from_slice(&pointer);
    }
    let chain = (0..PAGES).map(|index| {
        let mut page = vec![0; PAGE];
        let next = if index + 1 < PAGES { u32::try_from(4 + index).unwrap() } else { 3 };
        page[..4].copy_from_slice(&next.to_be_bytes());
        page
    });
    let pages: Vec<_> = std::iter::once(leaf).chain(chain).collect();
    sqlite::file(PAGE, &[("messages", sqlite::CAN_TABLE, 2)], &pages)
}

/// A table that is described by a statement of many columns, which overflows its page.
fn long_statement(length: usize) -> Vec<u8> {
    const PAGE: usize = 4096;
    let columns = "a,".repeat(length / 2);
    let statement = format!("CREATE TABLE messages ({columns}ts)");
    let text = statement.as_bytes();
    let values = [
        sqlite::Value::Text(b"table"),
        sqlite::Value::Text(b"messages"),
        sqlite::Value::Text(b"messages"),
        sqlite::Value::Integer(2),
        sqlite::Value::Text(text),
    ];
    let record = sqlite::record(&values);
    let (max, min) = (PAGE - 35, (PAGE - 12) * 32 / 255 - 23);
    let fitting = min + (record.len() - min) % (PAGE - 4);
    let local = if record.len() <= max {
        record.len()
    } else if fitting <= max {
        fitting
    } else {
        min
    };
    let mut cell = [sqlite::varint(record.len()), vec![1], record[..local].to_vec()].concat();
    cell.extend(3_u32.to_be_bytes());
    let mut first = sqlite::file(PAGE, &[], &[]);
    let end = PAGE - cell.len();
    first[end..].copy_from_slice(&cell);
    first[103..105].copy_from_slice(&1_u16.to_be_bytes());
    first[108..110].copy_from_slice(&u16::try_from(end).unwrap().to_be_bytes());
    let mut file = [first, sqlite::page(PAGE, 0, None, &[])].concat();
    let chunks: Vec<_> = record[local..].chunks(PAGE - 4).collect();
    for (index, chunk) in chunks.iter().enumerate() {
        let next = if index + 1 < chunks.len() { u32::try_from(4 + index).unwrap() } else { 0 };
        let mut page = [&next.to_be_bytes()[..], chunk].concat();
        page.resize(PAGE, 0);
        file.extend(page);
    }
    file
}
