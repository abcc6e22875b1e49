//! The sqlite3 files of `rosbag2`: the table `topics`, and `messages` with the bytes of each message in CDR.

use std::collections::BTreeMap;
use std::io;

use super::entry::BadLine;
use super::ros_frames::{FrameTopic, without_frames};
use super::sqlite_file::{Database, Rows, Table, Value};
use super::{ObjectReader, Outcome};
use crate::core::time::WallStamp;

const COLUMNS: [&str; 3] = ["topic_id", "timestamp", "data"];

pub(super) struct RosSqlite {
    database: Database,
    messages: Rows<3>,
    /// The topics with frames, by their numbers.
    topics: BTreeMap<i64, FrameTopic>,
}

impl RosSqlite {
    /// Returns the table of messages; `None` for a database that `rosbag2` has not written.
    pub(super) fn table(database: &Database) -> io::Result<Option<Table<3>>> {
        database.table("messages", COLUMNS)
    }

    /// Reads the topics. Fails if none has frames.
    pub(super) fn new(database: Database, messages: Table<3>) -> io::Result<Self> {
        let (mut topics, mut others) = (BTreeMap::new(), Vec::new());
        if let Some(table) = database.table("topics", ["name", "type", "serialization_format"])? {
            let mut rows = Rows::new(table);
            while let Some(row) = rows.next(&database)? {
                let Ok(texts) = row else { continue };
                let [name, kind, encoding] = texts.map(text);
                match FrameTopic::new(&name, &kind, &encoding) {
                    Some(topic) => drop(topics.insert(rows.row_number(), topic)),
                    None => others.push(name),
                }
            }
        }
        if topics.is_empty() {
            return Err(without_frames(&others));
        }
        Ok(Self { database, messages: Rows::new(messages), topics })
    }
}

impl ObjectReader for RosSqlite {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        let Some(row) = self.messages.next(&self.database)? else { return Ok(None) };
        let Ok([topic, logged, data]) = row else { return Ok(Some(Err(BadLine::NoFrame))) };
        let Some(topic) = topic.integer().and_then(|topic| self.topics.get(&topic)) else {
            return Ok(Some(Ok(None)));
        };
        Ok(Some(match (logged.integer(), data.bytes()) {
            (Some(logged), Some(data)) => topic.entry(data, WallStamp::from_nanos(logged)),
            (None, _) => Err(BadLine::NoTime),
            (_, None) => Err(BadLine::BadData),
        }))
    }
}

fn text(value: Value<'_>) -> String {
    String::from_utf8_lossy(value.bytes().unwrap_or_default()).into_owned()
}
