//! The sqlite3 files of `rosbag2`: the table `topics`, and `messages` with the bytes of each message in CDR.

use std::collections::BTreeMap;
use std::io;

use super::recorded_topics::{Choose, LoggedMessage, MessageReader, RecordedTopic, TopicChoice};
use super::sqlite_file::{Database, Rows, Table, Value};
use crate::entry::BadLine;
use crate::file_budget::Kept;
use gateway_base::time::WallStamp;

/// Columns of the table `messages`.
pub(super) const COLUMNS: [&str; 3] = ["topic_id", "timestamp", "data"];

/// Reads the messages of the chosen topics.
pub(super) struct RosSqlite<T> {
    database: Database,
    messages: Rows<3>,
    topics: BTreeMap<i64, T>,
    choice: TopicChoice<T>,
    /// Topic and log time of the message in `content`.
    message: Option<(i64, WallStamp)>,
    content: Vec<u8>,
    /// Memory of `content`.
    kept: Kept,
}

impl<T> RosSqlite<T> {
    /// Reads the topics.
    pub(super) fn new(database: Database, messages: Table<3>, choose: Choose<T>) -> io::Result<Self> {
        let (mut topics, mut choice) = (BTreeMap::new(), TopicChoice::new(choose));
        if let Some(table) = database.table("topics", ["name", "type", "serialization_format"])? {
            let mut rows = Rows::new(table, &database);
            while let Some(row) = rows.next(&database)? {
                let Ok(texts) = row else { continue };
                let [name, type_name, encoding] = &texts.map(text);
                if let Some(topic) = choice.take(&RecordedTopic { name, type_name, encoding }) {
                    topics.insert(rows.row_number, topic);
                }
            }
        }
        let (messages, kept) = (Rows::new(messages, &database), database.budget.keep());
        Ok(Self { database, messages, topics, choice, message: None, content: Vec::new(), kept })
    }
}

impl<T: Send> MessageReader<T> for RosSqlite<T> {
    fn advance(&mut self) -> io::Result<Option<Result<(), BadLine>>> {
        while let Some(row) = self.messages.next(&self.database)? {
            let Ok([topic, logged, data]) = row else { return Ok(Some(Err(BadLine::NoFrame))) };
            let Some(topic) = topic.integer().filter(|topic| self.topics.contains_key(topic)) else {
                continue;
            };
            return Ok(Some(match (logged.integer(), data.bytes()) {
                (Some(logged), Some(data)) => {
                    self.message = Some((topic, WallStamp::from_nanos(logged)));
                    self.kept.resize_up(data.len() as u64)?;
                    self.content.clear();
                    self.content.extend(data);
                    Ok(())
                }
                (None, _) => Err(BadLine::NoTime),
                (_, None) => Err(BadLine::BadData),
            }));
        }
        Ok(None)
    }

    fn message(&self) -> Option<LoggedMessage<'_, T>> {
        let (topic, logged) = self.message?;
        Some(LoggedMessage { topic: self.topics.get(&topic)?, logged, bytes: &self.content })
    }

    fn choice(&self) -> &TopicChoice<T> {
        &self.choice
    }
}

fn text(value: Value<'_>) -> String {
    String::from_utf8_lossy(value.bytes().unwrap_or_default()).into_owned()
}
