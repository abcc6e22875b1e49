//! A message as bytes of Zenoh: CDR behind a header that names its encoding.

use rustdds::bytes::Bytes;
use zenoh::bytes::ZBytes;

use crate::link::SampleEncoding;
use ros_messages::cdr::CdrBytes;

/// Bytes of the header before a message.
const LENGTH: usize = 4;
/// The header before a message of ours: CDR, little-endian, no options.
const HEADER: [u8; LENGTH] = [0, 1, 0, 0];

/// A message that was received.
pub(super) struct ReceivedPayload {
    /// Byte order of the message.
    pub(super) encoding: SampleEncoding,
    payload: Vec<u8>,
}

impl ReceivedPayload {
    /// Reads what is before a message of at most so many bytes. The error is a text for people.
    pub(super) fn read(payload: &ZBytes, limit: usize) -> Result<Self, String> {
        let length = payload.len();
        if length.saturating_sub(LENGTH) > limit {
            return Err(format!("{length} bytes are too many"));
        }
        let payload = payload.to_bytes().into_owned();
        let encoding = match payload.get(..LENGTH) {
            Some([0, 0, ..]) => SampleEncoding::Big,
            Some([0, 1, ..]) => SampleEncoding::Little,
            Some(other) => return Err(format!("its encoding {other:02x?} is not CDR")),
            None => return Err(format!("{length} bytes are no message")),
        };
        Ok(Self { encoding, payload })
    }

    /// The message, without the header.
    pub(super) fn bytes(&self) -> &[u8] {
        self.payload.get(LENGTH..).unwrap_or_default()
    }
}

/// A message with its header, to be sent.
pub(super) fn with_header(message: CdrBytes) -> ZBytes {
    let mut payload = ZBytes::writer();
    payload.append(ZBytes::from(HEADER));
    payload.append(ZBytes::from(Bytes::from_owner(message)));
    payload.finish()
}
