//! ROS 2 messages in a recording of any file format, from topics that the reader of the recording chooses.

use std::io;
use std::sync::Arc;

use crate::entry::BadLine;
use gateway_base::time::WallStamp;

/// A topic of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedTopic<'a> {
    /// Absolute name.
    pub name: &'a str,
    /// Type of its messages: `can_msgs/msg/Frame`.
    pub type_name: &'a str,
    /// Encoding of its messages: `cdr`.
    pub encoding: &'a str,
}

/// Returns the reader's value for a topic; `None` for a topic that is not read.
pub type Choose<T> = Arc<dyn Fn(&RecordedTopic<'_>) -> Option<T> + Send + Sync>;

/// A message of a topic that was chosen.
#[derive(Debug, Clone, Copy)]
pub struct LoggedMessage<'a, T> {
    /// Value for the topic from [`Choose`].
    pub topic: &'a T,
    /// Time of reception at the recorder.
    pub logged: WallStamp,
    /// The message with its encapsulation header.
    pub bytes: &'a [u8],
}

/// Reads the messages of the chosen topics one by one, in bounded memory.
pub trait MessageReader<T>: Send {
    /// Advances to the next message, which [`Self::message`] then returns; an inner `Err` for an unreadable
    /// message, `None` at the end.
    ///
    /// # Errors
    /// Fails if the source fails; [`io::ErrorKind::UnexpectedEof`] if the file ends too early,
    /// [`io::ErrorKind::InvalidData`] if nothing after this point can be read.
    fn advance(&mut self) -> io::Result<Option<Result<(), BadLine>>>;

    /// Returns the message that was read last.
    fn message(&self) -> Option<LoggedMessage<'_, T>>;

    /// Returns the choice so far.
    fn choice(&self) -> &TopicChoice<T>;
}

/// Maximum number of topics listed in a refusal.
const LISTED: usize = 8;

/// The choice among the topics of a recording, and the topics that were not chosen.
pub struct TopicChoice<T> {
    choose: Choose<T>,
    /// True if a topic was chosen.
    pub(super) has_chosen: bool,
    others: Vec<String>,
}

impl<T> TopicChoice<T> {
    /// Creates a choice before any topic.
    pub(super) fn new(choose: Choose<T>) -> Self {
        Self { choose, has_chosen: false, others: Vec::new() }
    }

    /// Returns the value for a topic, and records whether it was chosen.
    pub(super) fn take(&mut self, topic: &RecordedTopic<'_>) -> Option<T> {
        let chosen = (self.choose)(topic);
        self.has_chosen |= chosen.is_some();
        if chosen.is_none()
            && self.others.len() <= LISTED
            && self.others.iter().all(|other| other != topic.name)
        {
            self.others.push(topic.name.to_owned());
        }
        chosen
    }

    /// Returns some of the topics that were not chosen, as the end of a sentence.
    pub fn others(&self) -> String {
        let listed = self.others.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
        match self.others.len() {
            0 => "it has none".to_owned(),
            1..=LISTED => format!("it has {listed}"),
            _ => format!("it has {listed}, …"),
        }
    }
}
