//! Origin of a message for the command machine; determines the order of messages.

/// Identity of one writer of a topic; with DDS, its GUID. Two writers never share it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct WriterId(pub [u8; 16]);

/// Identity of one message of a topic: its writer, and its position among all messages of that writer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct SampleId {
    /// Writer of the message.
    pub writer: WriterId,
    /// Sequence number, which increases with each message of the writer.
    pub sequence: i64,
}

/// Origin of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CommandOrigin {
    /// A command topic of Autoware.
    Topic(SampleId),
    /// This gateway's own decider, whose commands arrive in order and without delay.
    Decider,
}
