//! Opens the files of a bag to read messages of any chosen topics.

use std::io::{self, BufReader, Cursor, Read};
use std::path::Path;
use std::sync::Arc;

use super::recorded_topics::{Choose, MessageReader};
use super::{mcap, sqlite};
use crate::compression::decompressed;
use crate::counted_source::CountedSource;
use crate::file_budget::FileBudget;
use crate::format::{ObjectSource, refused};
use crate::regular_file;

const BUFFER: usize = 64 << 10;
/// Number of first bytes that identify the format.
const MAGIC_LENGTH: u64 = 16;

/// Opens a file of a bag, decompressed if necessary, to read the messages of the topics selected by `choose`,
/// within a budget that all readers of a recording share.
///
/// # Errors
/// Fails if the file cannot be read, or holds no ROS 2 messages.
pub fn open_messages<T: Send + 'static>(
    path: &Path,
    choose: &Choose<T>,
    budget: &FileBudget,
) -> io::Result<Box<dyn MessageReader<T>>> {
    sqlite::refuse_pending_rows(path)?;
    let file = BufReader::new(Box::new(regular_file::open(path)?) as Box<dyn Read + Send>);
    let mut source = decompressed(Box::new(CountedSource::new(file, budget.clone())), budget)?;
    let mut head = Vec::new();
    source.by_ref().take(MAGIC_LENGTH).read_to_end(&mut head)?;
    let bytes = Box::new(BufReader::with_capacity(BUFFER, Cursor::new(head.clone()).chain(source)));
    let source = ObjectSource { bytes, budget: budget.clone() };
    let choose = Arc::clone(choose);
    if mcap::FORMAT.begins(&head) {
        return Ok(Box::new(mcap::Mcap::new(source, choose)?));
    }
    if sqlite::FORMAT.begins(&head) {
        return Ok(Box::new(sqlite::messages(source, choose)?));
    }
    Err(refused(
        "the recording holds no messages of ROS 2",
        "give an MCAP file, or the sqlite3 file or folder of a bag",
    ))
}
