//! An entry of a recording, in a form common to all formats.

use std::fmt;

use derive_more::Display;

use can_signal::can::{ErrorFrame, Frame, LogNote};
use gateway_base::time::WallStamp;

/// One entry of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogEntry<'a> {
    /// Time of reception.
    pub stamp: WallStamp,
    /// The interface that received it.
    pub interface: EntryInterface<'a>,
    /// The frame or note.
    pub content: EntryContent,
}

impl LogEntry<'_> {
    /// Creates an entry with a bus number; `nanos` is in ns since 1970.
    pub(super) fn numbered(nanos: i64, number: u32, content: EntryContent) -> Self {
        Self { stamp: WallStamp::from_nanos(nanos), interface: EntryInterface::Numbered(number), content }
    }
}

/// The name of an interface in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EntryInterface<'a> {
    /// A name, as in the file.
    Named(&'a str),
    /// A number, as in the file; shown as `can` and the number.
    Numbered(u32),
}

impl EntryInterface<'_> {
    /// Returns true if this is the interface called `name`.
    pub fn is(&self, name: &str) -> bool {
        match self {
            Self::Named(own) => *own == name,
            Self::Numbered(own) => {
                name.strip_prefix("can").and_then(|digits| digits.parse().ok()) == Some(*own)
            }
        }
    }
}

impl fmt::Display for EntryInterface<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => f.write_str(name),
            Self::Numbered(number) => write!(f, "can{number}"),
        }
    }
}

/// The content of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EntryContent {
    /// A data frame, classic or FD.
    Data(Frame),
    /// A remote request; carries no data.
    Remote,
    /// An error frame, which reports a fault of the bus.
    Error(ErrorFrame),
    /// A note that the black box writes between frames.
    Note(LogNote),
}

/// Reason why a line of a recording cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Display)]
#[allow(missing_docs)] // the texts say it
pub enum BadLine {
    #[display("too long for a line of a recording")]
    TooLong,
    #[display("not text")]
    NotText,
    #[display("the time is missing")]
    NoTime,
    #[display("the interface is missing")]
    NoInterface,
    /// The frame is missing, or of a kind that the format does not define.
    #[display("the frame is missing")]
    NoFrame,
    #[display("invalid identifier")]
    BadId,
    /// Data that is not bytes, or fewer than announced.
    #[display("data is damaged or missing")]
    BadData,
    #[display("invalid data length")]
    BadLength,
    #[display("CAN XL frames are not supported")]
    CanXl,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_interfaces_are_called_can() {
        assert_eq!(EntryInterface::Numbered(1).to_string(), "can1");
        assert!(EntryInterface::Numbered(1).is("can1") && !EntryInterface::Numbered(1).is("can11"));
        assert!(EntryInterface::Named("vcan0").is("vcan0"));
    }
}
