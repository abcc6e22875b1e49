//! Opens the files of a bag for their messages, whatever topics are chosen.

use std::fs::File;
use std::io::{self, BufReader, Cursor, Read as _};
use std::path::Path;
use std::sync::Arc;

use super::super::compression::decompressed;
use super::ros_messages::{Choose, MessageReader};
use super::{mcap, refuse_pending_rows, refused, sqlite};

const BUFFER: usize = 64 << 10;
/// First bytes that tell the format.
const MAGIC_LENGTH: u64 = 16;

/// Opens a file of a bag, decompressed if necessary, for the messages of the topics that `choose` names.
///
/// # Errors
/// A file that cannot be read, or that holds no messages of ROS 2.
pub fn open_messages<T: Send + 'static>(
    path: &Path,
    choose: &Choose<T>,
) -> io::Result<Box<dyn MessageReader<T>>> {
    refuse_pending_rows(path)?;
    let mut source = decompressed(Box::new(BufReader::new(File::open(path)?)))?;
    let mut head = Vec::new();
    source.by_ref().take(MAGIC_LENGTH).read_to_end(&mut head)?;
    let source = Box::new(BufReader::with_capacity(BUFFER, Cursor::new(head.clone()).chain(source)));
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
