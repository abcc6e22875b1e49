//! A message as Zenoh bytes: CDR after a header that names its encoding.

use rustdds::bytes::Bytes;
use zenoh::bytes::ZBytes;

use crate::link::SampleEncoding;
use ros_messages::cdr::CdrBytes;

/// Length of the header before a message, bytes.
const LENGTH: usize = 4;
/// The header of our messages: CDR, little-endian, no options.
const HEADER: [u8; LENGTH] = [0, 1, 0, 0];

/// A received message.
pub(super) struct ReceivedPayload {
    /// Byte order of the message.
    pub(super) encoding: SampleEncoding,
    payload: Vec<u8>,
}

impl ReceivedPayload {
    /// Reads the header of a message of at most `limit` bytes. The error is a text for the user.
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

    /// Returns the message without the header.
    pub(super) fn bytes(&self) -> &[u8] {
        self.payload.get(LENGTH..).unwrap_or_default()
    }
}

/// Returns a message with its header, for sending.
pub(super) fn with_header(message: CdrBytes) -> ZBytes {
    let mut payload = ZBytes::writer();
    payload.append(ZBytes::from(HEADER));
    payload.append(ZBytes::from(Bytes::from_owner(message)));
    payload.finish()
}
