//! Reads the rows of tables of an SQLite database, which is held in memory
//! (<https://www.sqlite.org/fileformat2.html>).
//!
//! A table is a tree of pages: inner pages refer to others, leaves hold the rows, and content that does not
//! fit is in a chain of overflow pages. Every page is visited at most once, so that reading ends whatever the
//! file contains.

use std::io::{self, ErrorKind};

use super::sqlite_columns::column_names;
use crate::exact::{append_rest, missing_part};
use crate::file_budget::{FileBudget, Kept};
use crate::format::{ObjectSource, refused};

pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";

/// Maximum length of a `CREATE TABLE` statement, bytes, as in SQLite.
const MAX_SQL: usize = 1_000_000;
/// Cost of a byte of such a statement, nominal ns.
const SQL_WORK: u64 = 30;
/// Cost of a row besides its bytes and columns, or of a page, nominal ns.
const ROW_WORK: u64 = 100;
/// Number of bytes of a row that cost a nominal ns.
const BYTES_PER_WORK: u64 = 4;
/// Cost of each column up to the last column read, nominal ns.
const COLUMN_WORK: u64 = 4;
/// Length of the header of a file, bytes.
const HEADER: usize = 100;
/// Minimum number of usable bytes per page of a valid database.
const MIN_USABLE: usize = 480;
/// The table of all tables: its columns `type`, `name`, `rootpage` and `sql`.
const SCHEMA: Table<4> = Table { root: 1, columns: [0, 1, 3, 4] };

/// A value of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value<'a> {
    Null,
    Integer(i64),
    Real(f64),
    Text(&'a [u8]),
    Blob(&'a [u8]),
}

impl<'a> Value<'a> {
    pub(super) fn integer(self) -> Option<i64> {
        if let Self::Integer(number) = self { Some(number) } else { None }
    }

    /// Returns the bytes of a text or blob.
    pub(super) fn bytes(self) -> Option<&'a [u8]> {
        if let Self::Text(bytes) | Self::Blob(bytes) = self { Some(bytes) } else { None }
    }
}

/// The location of a table's rows, and the positions of the columns to read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Table<const N: usize> {
    root: u32,
    columns: [usize; N],
}

impl<const N: usize> Table<N> {
    /// Returns the number of columns up to the last column read.
    fn columns_read(&self) -> usize {
        self.columns.into_iter().max().map_or(0, |last| last + 1)
    }
}

/// A row whose content is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct DamagedRow;

pub(super) struct Database {
    bytes: Vec<u8>,
    page_size: usize,
    /// Number of usable bytes per page; the rest is reserved for extensions.
    usable: usize,
    pub(super) budget: FileBudget,
    /// Memory of `bytes`.
    _kept: Kept,
    /// Reason why the file could not be read to its end.
    failure: Option<io::Error>,
}

impl Database {
    /// Reads as much of a database as possible. Fails if the source fails within the header, or for an
    /// unsupported database.
    pub(super) fn read(mut source: ObjectSource) -> io::Result<Self> {
        let budget = source.budget.clone();
        budget.allow_whole();
        let (mut bytes, mut kept) = (Vec::new(), budget.keep());
        let failure = match append_rest(&mut source, u64::MAX, &mut bytes, &mut kept) {
            Err(error) if bytes.len() < HEADER => return Err(error),
            _ if bytes.len() < HEADER => return Err(ErrorKind::UnexpectedEof.into()),
            // Bytes read before a failure are used; missing pages then return the same failure.
            outcome => outcome.err(),
        };
        if number(&bytes[56..60]) > 1 {
            return Err(refused(
                "the texts of the SQLite database are UTF-16",
                "convert it: sqlite3 FILE .dump",
            ));
        }
        let page_size = match number(&bytes[16..18]) {
            1 => 1 << 16,
            size => usize::try_from(size).unwrap_or(0),
        };
        let usable = page_size.saturating_sub(bytes[20].into());
        if !page_size.is_power_of_two() || usable < MIN_USABLE {
            return Err(refused("the SQLite database is damaged or encrypted: its page size is invalid", ""));
        }
        Ok(Self { bytes, page_size, usable, budget, _kept: kept, failure })
    }

    /// Returns the table with this name and all of these columns; `None` if there is none.
    pub(super) fn table<const N: usize>(
        &self,
        name: &str,
        columns: [&str; N],
    ) -> io::Result<Option<Table<N>>> {
        let mut tables = Rows::new(SCHEMA, self);
        while let Some(row) = tables.next(self)? {
            let Ok([kind, table, root, sql]) = row else { continue };
            if kind != Value::Text(b"table")
                || !table.bytes().is_some_and(|table| table.eq_ignore_ascii_case(name.as_bytes()))
            {
                continue;
            }
            let sql = sql.bytes().filter(|sql| sql.len() <= MAX_SQL).unwrap_or_default();
            self.budget.spend(sql.len() as u64 * SQL_WORK)?;
            let sql = String::from_utf8_lossy(sql);
            let names = column_names(&sql);
            let positions =
                columns.map(|column| names.iter().position(|name| name.eq_ignore_ascii_case(column)));
            let Some(root) = root.integer().and_then(|root| u32::try_from(root).ok()) else { continue };
            if positions.iter().all(Option::is_some) {
                return Ok(Some(Table { root, columns: positions.map(Option::unwrap_or_default) }));
            }
        }
        Ok(None)
    }

    /// Returns the usable bytes of a page, counted from 1. Fails if it is not in the file.
    fn page(&self, page: u32) -> io::Result<&[u8]> {
        let index =
            usize::try_from(page).ok().and_then(|page| page.checked_sub(1)).ok_or(ErrorKind::InvalidData)?;
        let start = index.checked_mul(self.page_size).ok_or(ErrorKind::InvalidData)?;
        let page = self.bytes.get(start..).and_then(|bytes| bytes.get(..self.usable));
        page.ok_or_else(|| missing_part(self.failure.as_ref()))
    }

    /// Counts a page in `visited`. Fails if there are more than the file has: the pages form a cycle.
    fn visit(&self, visited: &mut usize) -> io::Result<()> {
        self.budget.spend(ROW_WORK)?;
        *visited += 1;
        let is_possible = *visited <= self.bytes.len() / self.page_size + 1;
        is_possible.then_some(()).ok_or_else(|| ErrorKind::InvalidData.into())
    }

    /// Appends `length` bytes of a row to `payload`, from a leaf and its chain of overflow pages.
    fn collect(
        &self,
        cell: &[u8],
        length: u64,
        payload: &mut Vec<u8>,
        kept: &mut Kept,
        visited: &mut usize,
    ) -> io::Result<()> {
        self.budget.spend(ROW_WORK + length / BYTES_PER_WORK)?;
        let length = usize::try_from(length).ok().filter(|length| *length <= self.bytes.len());
        let length = length.ok_or(ErrorKind::InvalidData)?;
        kept.resize(payload.capacity().max(length) as u64)?;
        payload.reserve_exact(length);
        let (max, min) = (self.usable - 35, (self.usable - 12) * 32 / 255 - 23);
        let fitting = min + length.saturating_sub(min) % (self.usable - 4);
        let local = if length <= max {
            length
        } else if fitting <= max {
            fitting
        } else {
            min
        };
        payload.extend(cell.get(..local).ok_or(ErrorKind::InvalidData)?);
        let mut next = cell.get(local..).unwrap_or_default();
        while payload.len() < length {
            self.visit(visited)?;
            let page = next.get(..4).ok_or(ErrorKind::InvalidData)?;
            next = self.page(u32::try_from(number(page)).unwrap_or(0))?;
            let content = &next[4..];
            payload.extend_from_slice(&content[..content.len().min(length - payload.len())]);
        }
        Ok(())
    }
}

/// Reads the rows of a table in the order of their row numbers.
pub(super) struct Rows<const N: usize> {
    table: Table<N>,
    /// The pages from the root down, each with the position of the next cell.
    path: Vec<(u32, usize)>,
    /// Number of pages visited so far.
    visited: usize,
    payload: Vec<u8>,
    /// Memory of `payload`.
    kept: Kept,
    /// Number of the last row, which is the value of a column INTEGER PRIMARY KEY.
    pub(super) row_number: i64,
}

impl<const N: usize> Rows<N> {
    pub(super) fn new(table: Table<N>, database: &Database) -> Self {
        let (path, payload, kept) = (vec![(table.root, 0)], Vec::new(), database.budget.keep());
        Self { table, path, visited: 0, payload, kept, row_number: 0 }
    }

    /// Returns the values of the next row, `None` at the end. Fails if pages are missing or damaged.
    pub(super) fn next(
        &mut self,
        database: &Database,
    ) -> io::Result<Option<Result<[Value<'_>; N], DamagedRow>>> {
        while let Some((page_number, position)) = self.path.last_mut() {
            let page = database.page(*page_number)?;
            // On the first page, the header of the file precedes the content.
            let head = &page[if *page_number == 1 { HEADER } else { 0 }..];
            let (pointers, is_leaf) = match head[0] {
                0x0D => (8, true),
                0x05 => (12, false),
                _ => return Err(ErrorKind::InvalidData.into()),
            };
            if *position == 0 {
                database.visit(&mut self.visited)?;
            }
            let index = *position;
            *position += 1;
            let cells = usize::try_from(number(&head[3..5])).unwrap_or(0);
            if index >= cells {
                let last = (index == cells && !is_leaf).then(|| number(&head[8..12]));
                match last.map(u32::try_from) {
                    Some(Ok(child)) => self.path.push((child, 0)),
                    _ => _ = self.path.pop(),
                }
                continue;
            }
            let pointer = head.get(pointers + 2 * index..).and_then(|rest| rest.get(..2));
            let cell = pointer.and_then(|pointer| page.get(usize::try_from(number(pointer)).ok()?..));
            let cell = cell.ok_or(ErrorKind::InvalidData)?;
            if is_leaf {
                let (length, rest) = varint(cell).ok_or(ErrorKind::InvalidData)?;
                let (row_number, rest) = varint(rest).ok_or(ErrorKind::InvalidData)?;
                self.row_number = row_number.cast_signed();
                self.payload.clear();
                let Self { payload, kept, visited, .. } = self;
                database.collect(rest, length, payload, kept, visited)?;
                database.budget.spend(self.table.columns_read() as u64 * COLUMN_WORK)?;
                return Ok(Some(values(&self.payload, self.table).ok_or(DamagedRow)));
            }
            let child = cell.get(..4).and_then(|child| u32::try_from(number(child)).ok());
            self.path.push((child.ok_or(ErrorKind::InvalidData)?, 0));
        }
        Ok(None)
    }
}

/// Returns these columns of a record; a column that is not stored has no value.
fn values<const N: usize>(record: &[u8], table: Table<N>) -> Option<[Value<'_>; N]> {
    let (length, mut types) = varint(record)?;
    let (head, mut content) = record.split_at_checked(usize::try_from(length).ok()?)?;
    types = head.get(record.len() - types.len()..)?;
    let mut found = [Value::Null; N];
    for column in 0..table.columns_read() {
        let Some((kind, rest)) = varint(types) else { break };
        types = rest;
        let length = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            10 | 11 => return None,
            _ => (kind - 12) / 2,
        };
        let (bytes, rest) = content.split_at_checked(usize::try_from(length).ok()?)?;
        content = rest;
        let value = match kind {
            0 => Value::Null,
            8 | 9 => Value::Integer(i64::from(kind == 9)),
            7 => Value::Real(f64::from_bits(number(bytes))),
            1..=6 => {
                let unused = 64 - 8 * bytes.len();
                Value::Integer((number(bytes) << unused).cast_signed() >> unused)
            }
            _ if kind % 2 == 0 => Value::Blob(bytes),
            _ => Value::Text(bytes),
        };
        for (found, wanted) in found.iter_mut().zip(table.columns) {
            if wanted == column {
                *found = value;
            }
        }
    }
    Some(found)
}

/// Returns up to eight bytes as a big-endian number.
fn number(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// Reads a number of one to nine bytes, and returns the rest.
fn varint(bytes: &[u8]) -> Option<(u64, &[u8])> {
    let mut number = 0;
    for (index, byte) in bytes.iter().take(9).enumerate() {
        if index == 8 {
            return Some((number << 8 | u64::from(*byte), &bytes[9..]));
        }
        number = number << 7 | u64::from(byte & 0x7F);
        if byte & 0x80 == 0 {
            return Some((number, &bytes[index + 1..]));
        }
    }
    None
}

/// Writes databases for tests, with pages of 512 bytes.
#[cfg(test)]
pub(super) mod testing {
    use super::*;

    pub(crate) const PAGE: usize = 512;

    fn varint_bytes(number: usize) -> Vec<u8> {
        let byte = |shift: usize| u8::try_from(number >> shift & 0x7F).unwrap();
        if number < 0x80 { vec![byte(0)] } else { vec![byte(7) | 0x80, byte(0)] }
    }

    pub(crate) fn record(values: &[Value<'_>]) -> Vec<u8> {
        let (mut types, mut content) = (Vec::new(), Vec::new());
        for value in values {
            let (kind, bytes) = match value {
                Value::Null => (0, Vec::new()),
                Value::Integer(0) => (8, Vec::new()),
                Value::Integer(1) => (9, Vec::new()),
                Value::Integer(number) => match i8::try_from(*number) {
                    Ok(small) => (1, small.to_be_bytes().to_vec()),
                    Err(_) => (5, number.to_be_bytes()[2..].to_vec()),
                },
                Value::Real(number) => (7, number.to_be_bytes().to_vec()),
                Value::Blob(bytes) => (12 + 2 * bytes.len(), bytes.to_vec()),
                Value::Text(bytes) => (13 + 2 * bytes.len(), bytes.to_vec()),
            };
            types.extend(varint_bytes(kind));
            content.extend(bytes);
        }
        [varint_bytes(types.len() + 1), types, content].concat()
    }

    /// Returns the cell of a row with `local` bytes in the leaf, whose rest begins on page `overflow`.
    pub(crate) fn cell(row: u8, record: &[u8], local: usize, overflow: Option<u8>) -> Vec<u8> {
        let pointer = overflow.map(|page| vec![0, 0, 0, page]).unwrap_or_default();
        [varint_bytes(record.len()), vec![row], record[..local].to_vec(), pointer].concat()
    }

    pub(crate) fn whole(row: u8, record: &[u8]) -> Vec<u8> {
        cell(row, record, record.len(), None)
    }

    /// Returns a page of cells; an inner page has its last child as `right`.
    pub(crate) fn page(at: usize, right: Option<u8>, cells: &[Vec<u8>]) -> Vec<u8> {
        let mut page = vec![0; PAGE];
        page[at] = if right.is_some() { 0x05 } else { 0x0D };
        page[at + 4] = u8::try_from(cells.len()).unwrap();
        page[at + 11] = right.unwrap_or(0);
        let (mut end, mut pointer) = (PAGE, at + if right.is_some() { 12 } else { 8 });
        for cell in cells {
            end -= cell.len();
            page[end..end + cell.len()].copy_from_slice(cell);
            page[pointer..pointer + 2].copy_from_slice(&u16::try_from(end).unwrap().to_be_bytes());
            pointer += 2;
        }
        page
    }

    /// Returns a file with one table, whose root is the first of `pages`.
    pub(crate) fn file(name: &[u8], sql: &[u8], pages: &[Vec<u8>]) -> Vec<u8> {
        let schema = [
            Value::Text(b"table"),
            Value::Text(name),
            Value::Text(name),
            Value::Integer(2),
            Value::Text(sql),
        ];
        let mut first = page(HEADER, None, &[whole(1, &record(&schema))]);
        first[..16].copy_from_slice(MAGIC);
        first[16..20].copy_from_slice(&[2, 0, 1, 1]);
        first[59] = 1;
        [first, pages.concat()].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::testing::{cell, file, page, record, whole};
    use super::*;
    use crate::format::testing::source;

    /// Returns three leaves below an inner page; rows 2 and 3 continue on other pages.
    fn blobs() -> (Vec<u8>, [Vec<u8>; 4]) {
        let bytes = |length: usize| (0..length).map(|at| u8::try_from(at % 251).unwrap()).collect::<Vec<_>>();
        let blobs = [bytes(3), bytes(700), bytes(1000), bytes(470)];
        let records = blobs.each_ref().map(|blob| record(&[Value::Null, Value::Blob(blob)]));
        // With pages of 512 bytes, a leaf holds 39 to 477 bytes of a row: the part that fills no overflow
        // page.
        let inner = page(0, Some(5), &[vec![0, 0, 0, 3, 1], vec![0, 0, 0, 4, 3]]);
        let leaves = [
            page(0, None, &[whole(1, &records[0])]),
            page(0, None, &[cell(2, &records[1], 196, Some(6)), cell(3, &records[2], 39, Some(7))]),
            page(0, None, &[whole(4, &records[3])]),
        ];
        let chain = |next: u8, bytes: &[u8]| {
            let mut page = [&[0, 0, 0, next], bytes].concat();
            page.resize(testing::PAGE, 0);
            page
        };
        let overflow =
            [chain(0, &records[1][196..]), chain(8, &records[2][39..547]), chain(0, &records[2][547..])];
        let pages = [&[inner][..], &leaves, &overflow].concat();
        (file(b"Blobs", b"CREATE TABLE \"Blobs\" (id INTEGER PRIMARY KEY, [the data] BLOB)", &pages), blobs)
    }

    fn read(file: &[u8]) -> io::Result<Vec<Vec<u8>>> {
        let database = Database::read(source(file))?;
        let table = database.table("blobs", ["The Data"])?.ok_or(ErrorKind::NotFound)?;
        let (mut rows, mut found) = (Rows::new(table, &database), Vec::new());
        while let Some(row) = rows.next(&database)? {
            found.push(row.map_err(|_| ErrorKind::InvalidData)?[0].bytes().unwrap_or_default().to_vec());
        }
        Ok(found)
    }

    #[test]
    fn rows_of_inner_and_overflow_pages_are_read_in_their_order() {
        let (file, blobs) = blobs();
        assert_eq!(read(&file).unwrap(), blobs);
    }

    #[test]
    fn a_cut_database_ends_where_its_pages_are_missing() {
        let (file, _) = blobs();
        for length in 0..file.len() {
            assert_eq!(read(&file[..length]).unwrap_err().kind(), ErrorKind::UnexpectedEof, "{length}");
        }
    }

    #[test]
    fn pages_that_refer_in_a_circle_are_damage() {
        let (mut file, _) = blobs();
        file[512 + 11] = 2;
        assert_eq!(read(&file).unwrap_err().kind(), ErrorKind::InvalidData);
        file[7 * 512 + 3] = 7;
        let database = Database::read(source(&file)).unwrap();
        let cell = [&[0; 39][..], &[0, 0, 0, 7]].concat();
        let mut visited = 0;
        let mut kept = database.budget.keep();
        let mut collect = || database.collect(&cell, 4045, &mut Vec::new(), &mut kept, &mut visited);
        assert!(collect().is_ok() && collect().is_err(), "a chain of eight pages, twice, in a file of eight");
    }

    #[test]
    fn what_is_not_supported_is_refused_with_its_reason() {
        for (at, byte, expected) in [(59, 2, "UTF-16"), (16, 3, "page size"), (20, 200, "page size")] {
            let (mut file, _) = blobs();
            file[at] = byte;
            let error = read(&file).unwrap_err().to_string();
            assert!(error.contains(expected), "{at}: {error}");
        }
    }

    #[test]
    fn numbers_have_their_sign_and_length() {
        assert_eq!(varint(&[0x81, 0x00, 7]), Some((128, &[7][..])));
        assert_eq!(varint(&[0xFF; 9]), Some((u64::MAX, &[][..])));
        assert_eq!(varint(&[0xFF; 8]), None);
        let integers = [3, 1, 6, 0xFF, 0x80, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(
            values(&integers, Table { root: 0, columns: [0, 1, 2] }),
            Some([Value::Integer(-1), Value::Integer(i64::MIN), Value::Null])
        );
        let only = Table { root: 0, columns: [0] };
        assert_eq!(values(&[2, 10], only), None);
        assert_eq!(values(&[2, 4, 0], only), None);
    }
}
