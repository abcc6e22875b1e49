//! An entry of a recording, as every format yields it.

use std::fmt;

use crate::core::can::error_frame::ErrorFrame;
use crate::core::can::frame::Frame;
use crate::core::can::note::Note;
use crate::core::time::WallStamp;

/// One entry of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry<'a> {
    /// Time of reception.
    pub stamp: WallStamp,
    /// Interface that received it.
    pub interface: Interface<'a>,
    /// The frame or note.
    pub content: Content,
}

impl Entry<'_> {
    /// An entry of a format that numbers its buses; the time is in ns since 1970.
    pub(super) fn numbered(nanos: i64, number: u32, content: Content) -> Self {
        Self { stamp: WallStamp::from_nanos(nanos), interface: Interface::Numbered(number), content }
    }
}

/// The name of an interface in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interface<'a> {
    /// A name, as in the file.
    Named(&'a str),
    /// A number, as in the file; shown as `can` and the number.
    Numbered(u32),
}

impl Interface<'_> {
    /// True if this is the interface called `name`.
    pub fn is(&self, name: &str) -> bool {
        match self {
            Self::Named(own) => *own == name,
            Self::Numbered(own) => {
                name.strip_prefix("can").and_then(|digits| digits.parse().ok()) == Some(*own)
            }
        }
    }
}

impl fmt::Display for Interface<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => f.write_str(name),
            Self::Numbered(number) => write!(f, "can{number}"),
        }
    }
}

/// The content of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// A data frame, classic or FD.
    Data(Frame),
    /// A remote request; carries no data.
    Remote,
    /// An error frame.
    Error(ErrorFrame),
    /// A note of the black box beside frames.
    Note(Note),
}

/// The reason why a line of a recording cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BadLine {
    /// Longer than any line of the format.
    TooLong,
    /// Not UTF-8 text.
    NotText,
    /// No time where the format has it.
    NoTime,
    /// No interface name or number where the format has it.
    NoInterface,
    /// No frame where the format has it, or one of a kind that the format does not define.
    NoFrame,
    /// An identifier that is not written as the format does, or out of range.
    BadId,
    /// Data that is not bytes, or fewer than announced.
    BadData,
    /// A length that no frame has.
    BadLength,
    /// A CAN XL frame.
    CanXl,
}

impl fmt::Display for BadLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooLong => "too long for a line of a recording",
            Self::NotText => "not text",
            Self::NoTime => "the time is missing",
            Self::NoInterface => "the interface is missing",
            Self::NoFrame => "the frame is missing",
            Self::BadId => "invalid identifier",
            Self::BadData => "data is damaged or missing",
            Self::BadLength => "invalid data length",
            Self::CanXl => "CAN XL frames are not supported",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_interfaces_are_called_can() {
        assert_eq!(Interface::Numbered(1).to_string(), "can1");
        assert!(Interface::Numbered(1).is("can1") && !Interface::Numbered(1).is("can11"));
        assert!(Interface::Named("vcan0").is("vcan0"));
    }
}
