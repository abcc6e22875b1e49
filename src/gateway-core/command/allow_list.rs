//! The allow-list of command messages: no other frames can be sent.
//!
//! Only a [`SendPermission`] makes a [`CommandFrame`], and only the [`AllowList`] makes a permission. The
//! configuration builds the list from the profile, so a frame with another identifier or on another bus
//! cannot be created.

use can_signal::can::{BusIndex, CanId, Frame, FrameFormat, MAX_DATA};

/// Messages that may be sent, by bus and identifier.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct AllowList(Vec<(BusIndex, CanId)>);

/// Permission to send one message of the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SendPermission {
    bus: BusIndex,
    id: CanId,
    length: usize,
    format: Option<FrameFormat>,
}

/// A frame that may be sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandFrame {
    bus: BusIndex,
    frame: Frame,
}

/// Reason why a message cannot be sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum NotSendable {
    #[error("another command message of this bus has the identifier {0}")]
    Twice(CanId),
    #[error("no frame has {0} bytes: 1 to 8, 12, 16, 20, 24, 32, 48 or 64")]
    Length(usize),
}

impl AllowList {
    /// Adds a message of `length` bytes. Without a `format` it is sent as CAN FD if it is longer than 8
    /// bytes.
    pub fn admit(
        &mut self,
        bus: BusIndex,
        id: CanId,
        length: usize,
        format: Option<FrameFormat>,
    ) -> Result<SendPermission, NotSendable> {
        if self.contains(bus, id) {
            return Err(NotSendable::Twice(id));
        }
        let permission = SendPermission { bus, id, length, format };
        if length == 0 || permission.frame(&[0; MAX_DATA]).is_none() {
            return Err(NotSendable::Length(length));
        }
        self.0.push((bus, id));
        Ok(permission)
    }

    /// Returns true if the message is in the list.
    pub fn contains(&self, bus: BusIndex, id: CanId) -> bool {
        self.0.contains(&(bus, id))
    }

    /// Returns the messages, in the order of the profile.
    pub fn entries(&self) -> &[(BusIndex, CanId)] {
        &self.0
    }
}

impl SendPermission {
    /// Returns the bus of the message.
    pub fn bus(&self) -> BusIndex {
        self.bus
    }

    /// Returns the identifier of the message.
    pub fn id(&self) -> CanId {
        self.id
    }

    /// Returns the length of the message in bytes.
    pub fn length(&self) -> usize {
        self.length
    }

    /// Builds a frame of the message; never `None` for a permission that the list has granted.
    pub(super) fn frame(&self, data: &[u8; MAX_DATA]) -> Option<CommandFrame> {
        let frame = Frame::with_format(self.id, self.format, data.get(..self.length)?)?;
        Some(CommandFrame { bus: self.bus, frame })
    }
}

impl CommandFrame {
    /// Returns the bus of the frame.
    pub fn bus(&self) -> BusIndex {
        self.bus
    }

    /// Returns the frame itself.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_admitted_once_and_with_a_length_that_exists() {
        let mut list = AllowList::default();
        let (bus, id) = (BusIndex(0), CanId::Standard(0x130));
        for length in [0, 9, 11, 65] {
            assert_eq!(list.admit(bus, id, length, None), Err(NotSendable::Length(length)));
        }
        assert!(!list.contains(bus, id));
        let permission = list.admit(bus, id, 2, None).unwrap();
        assert_eq!(list.admit(bus, id, 2, None), Err(NotSendable::Twice(id)));
        assert!(list.contains(bus, id) && !list.contains(BusIndex(1), id));
        assert!(!list.contains(bus, CanId::Extended(0x130)));
        let mut data = [0xFF; MAX_DATA];
        data[0] = 1;
        assert_eq!(permission.frame(&data).unwrap().frame().to_string(), "130#01FF");
        let long = list.admit(BusIndex(1), id, 12, None).unwrap();
        assert!(long.frame(&data).unwrap().frame().is_fd());
        let short = list.admit(BusIndex(2), id, 2, Some(FrameFormat::Fd)).unwrap();
        assert!(short.frame(&data).unwrap().frame().is_fd());
    }
}
