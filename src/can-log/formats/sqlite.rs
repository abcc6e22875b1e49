//! SQLite databases: the tables show whether python-can or `rosbag2` has written them.

use std::ffi::OsString;
use std::io;
use std::path::Path;

use super::python_sqlite::{self, PythonSqlite};
use super::recorded_topics::Choose;
use super::ros_frames::{Frames, choose_frames};
use super::ros_sqlite::{self, RosSqlite};
use super::sqlite_file::{Database, MAGIC};
use crate::format::{Mark, ObjectFormat, ObjectReader, ObjectSource, refused};

pub(super) const FORMAT: ObjectFormat =
    ObjectFormat { name: "SQLite of python-can or rosbag2", mark: Mark::Magics(&[MAGIC]), reader: open };

/// Table of frames or of ROS 2 messages, by its columns.
const MESSAGES: &str = "messages";

fn open(source: ObjectSource) -> io::Result<Box<dyn ObjectReader>> {
    let database = Database::read(source)?;
    if let Some(table) = database.table(MESSAGES, python_sqlite::COLUMNS)? {
        return Ok(Box::new(PythonSqlite::new(database, table)));
    }
    if let Some(table) = database.table(MESSAGES, ros_sqlite::COLUMNS)? {
        return Ok(Box::new(Frames(RosSqlite::new(database, table, choose_frames())?)));
    }
    Err(refused(
        "the SQLite database has no table messages of CAN frames",
        "python-can writes one with the columns ts, arbitration_id, extended, remote, error, dlc and data, rosbag2 one with \
         topic_id, timestamp and data",
    ))
}

/// Opens a `rosbag2` database to read the messages of chosen topics.
pub(super) fn messages<T>(source: ObjectSource, choose: Choose<T>) -> io::Result<RosSqlite<T>> {
    let database = Database::read(source)?;
    match database.table(MESSAGES, ros_sqlite::COLUMNS)? {
        Some(table) => RosSqlite::new(database, table, choose),
        None => Err(refused("the SQLite database is not one of rosbag2", "give the file or folder of a bag")),
    }
}

/// Refuses a database whose newest rows are in a separate write-ahead log.
pub(crate) fn refuse_pending_rows(path: &Path) -> io::Result<()> {
    let mut log = OsString::from(path);
    log.push("-wal");
    if std::fs::metadata(&log).is_ok_and(|log| log.is_file() && log.len() > 0) {
        return Err(refused(
            "the newest rows of the SQLite database are in a write-ahead log beside it",
            "merge them: sqlite3 FILE 'PRAGMA journal_mode=DELETE'",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_database_with_rows_in_a_log_beside_it_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.db");
        assert!(refuse_pending_rows(&path).is_ok());
        std::fs::write(folder.path().join("drive.db-wal"), "").unwrap();
        assert!(refuse_pending_rows(&path).is_ok(), "an empty log has no rows");
        std::fs::write(folder.path().join("drive.db-wal"), "rows").unwrap();
        assert!(refuse_pending_rows(&path).unwrap_err().to_string().contains("write-ahead log beside it"));
    }
}
