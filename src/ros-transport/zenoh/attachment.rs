//! The attachment of each sample: its number, the time it was sent, and the identity of its publisher.

use std::time::{SystemTime, UNIX_EPOCH};

use zenoh::bytes::ZBytes;

use crate::error::SampleError;

/// Length of a publisher's identity, bytes.
const GID_LENGTH: u8 = 16;
/// Length of an attachment, bytes.
pub(super) const LENGTH: usize = 8 + 8 + 1 + GID_LENGTH as usize;

pub(super) type Gid = [u8; GID_LENGTH as usize];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Attachment {
    /// Number of the sample at its publisher, from 1.
    pub(super) number: i64,
    /// Time of sending, ns since 1970.
    pub(super) sent_ns: i64,
    pub(super) gid: Gid,
}

impl Attachment {
    /// Creates the attachment of a sample that is sent now.
    pub(super) fn now(number: i64, gid: Gid) -> Self {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self { number, sent_ns: i64::try_from(since_1970.as_nanos()).unwrap_or(i64::MAX), gid }
    }

    /// Returns the bytes of the attachment, little-endian.
    pub(super) fn to_bytes(self) -> [u8; LENGTH] {
        let mut bytes = [0; LENGTH];
        let fields = [&self.number.to_le_bytes()[..], &self.sent_ns.to_le_bytes(), &[GID_LENGTH], &self.gid];
        for (byte, field) in bytes.iter_mut().zip(fields.concat()) {
            *byte = field;
        }
        bytes
    }

    /// Reads the attachment of a sample, which this kind of sender attaches.
    pub(super) fn of(attached: Option<&ZBytes>, sender: &'static str) -> Result<Self, SampleError> {
        let read = attached.and_then(|attached| Self::read(&attached.to_bytes()));
        read.ok_or(SampleError::NotAttached(sender))
    }

    /// Reads the bytes of an attachment; later versions may append fields, which are ignored.
    fn read(bytes: &[u8]) -> Option<Self> {
        let (number, rest) = bytes.split_first_chunk()?;
        let (sent, rest) = rest.split_first_chunk()?;
        let (length, rest) = rest.split_first()?;
        let (gid, _) = rest.split_first_chunk()?;
        (*length == GID_LENGTH).then_some(Self {
            number: i64::from_le_bytes(*number),
            sent_ns: i64::from_le_bytes(*sent),
            gid: *gid,
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn any_bytes_are_an_attachment_or_none(mut bytes in prop::collection::vec(any::<u8>(), 0..50), marks in any::<bool>()) {
            if let Some(length) = bytes.get_mut(16).filter(|_| marks) {
                *length = GID_LENGTH;
            }
            let is_one = bytes.len() >= LENGTH && bytes[16] == GID_LENGTH;
            prop_assert_eq!(Attachment::read(&bytes).map(|read| read.to_bytes().to_vec()), is_one.then(|| bytes[..LENGTH].to_vec()));
        }
    }

    #[test]
    fn an_attachment_has_its_bytes_and_nothing_else_is_one() {
        let attachment = Attachment { number: 3, sent_ns: -2, gid: [7; 16] };
        let bytes = attachment.to_bytes();
        let expected = [&[3, 0, 0, 0, 0, 0, 0, 0][..], &[0xFE], &[0xFF; 7], &[16], &[7; 16]].concat();
        assert_eq!(bytes[..], expected);
        assert_eq!(Attachment::read(&bytes), Some(attachment));
        assert_eq!(Attachment::read(&[&bytes[..], &[1]].concat()), Some(attachment), "a longer one");
        for end in 0..LENGTH {
            assert_eq!(Attachment::read(&bytes[..end]), None);
        }
        let mut other = bytes;
        other[16] = 15;
        assert_eq!(Attachment::read(&other), None, "another length of the identity");
    }
}
