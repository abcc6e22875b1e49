//! The ways to break the rules of the link.

/// A message that breaks the rules of the link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// The length of a frame is invalid.
    #[error("a frame of {0} bytes")]
    Length(usize),
    /// The kind of message is unknown.
    #[error("a message of the unknown kind {0}")]
    Kind(u8),
    /// The message ends too early.
    #[error("a message that is cut off")]
    CutOff,
    /// Bytes follow the message.
    #[error("{0} bytes after a message")]
    Leftover(usize),
    /// A flag is neither 0 nor 1.
    #[error("a flag of {0}")]
    Flag(u8),
    /// A text is too long, or not UTF-8.
    #[error("a text that is too long or not UTF-8")]
    Text,
    /// The settings cannot be read.
    #[error("settings that cannot be read")]
    Settings,
    /// The state of the network side cannot be read.
    #[error("a state that cannot be read")]
    Status,
    /// The topic or subscription does not exist, or the number of topics is wrong.
    #[error("topic {0}, which does not exist")]
    Topic(usize),
    /// The sample is too large.
    #[error("a sample of {0} bytes")]
    Sample(usize),
    /// The message is out of sequence: none may precede the first, the first may come only once, and a pong
    /// needs a ping.
    #[error("a message out of turn")]
    OutOfTurn,
}
