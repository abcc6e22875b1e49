//! Messages of ROS 2 in a recording, whatever file holds them: of topics that the reader of the recording
//! chooses.

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

/// Returns what a topic is to its reader; `None` for a topic that is not read.
pub type Choose<T> = Arc<dyn Fn(&RecordedTopic<'_>) -> Option<T> + Send + Sync>;

/// A message of a topic that was chosen.
#[derive(Debug, Clone, Copy)]
pub struct LoggedMessage<'a, T> {
    /// What the topic is.
    pub topic: &'a T,
    /// When the recorder received it.
    pub logged: WallStamp,
    /// The message with its encapsulation header.
    pub bytes: &'a [u8],
}

/// Reads the messages of the chosen topics one by one, in bounded memory.
pub trait MessageReader<T>: Send {
    /// Reads on to the next message, which [`Self::message`] then returns; an `Err` within for one that
    /// cannot be read, `None` at the end.
    ///
    /// # Errors
    /// A source that fails; [`io::ErrorKind::UnexpectedEof`] if the file ends too early,
    /// [`io::ErrorKind::InvalidData`] if nothing behind can be read.
    fn advance(&mut self) -> io::Result<Option<Result<(), BadLine>>>;

    /// Returns the message that was read last.
    fn message(&self) -> Option<LoggedMessage<'_, T>>;

    /// Returns the choice so far.
    fn choice(&self) -> &TopicChoice<T>;
}

/// Topics that a refusal lists.
const LISTED: usize = 8;

/// The choice among the topics of a recording, and the topics that were not chosen.
pub struct TopicChoice<T> {
    choose: Choose<T>,
    has_chosen: bool,
    others: Vec<String>,
}

impl<T> TopicChoice<T> {
    /// Creates a choice among no topics yet.
    pub(super) fn new(choose: Choose<T>) -> Self {
        Self { choose, has_chosen: false, others: Vec::new() }
    }

    /// Chooses.
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

    /// Returns true if a topic was chosen.
    pub fn has_chosen(&self) -> bool {
        self.has_chosen
    }

    /// Returns the topics that were not chosen, as the end of a sentence; not more than a few.
    pub fn others(&self) -> String {
        let listed = self.others.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
        match self.others.len() {
            0 => "it has none".to_owned(),
            1..=LISTED => format!("it has {listed}"),
            _ => format!("it has {listed}, …"),
        }
    }
}
