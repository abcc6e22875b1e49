//! A message as Zenoh bytes: CDR after a header that names its encoding.

use rustdds::bytes::Bytes;
use zenoh::bytes::ZBytes;

use crate::error::SampleError;
use ros_messages::cdr::{CdrBytes, Endian, encapsulated};

/// Length of the header before a message, bytes.
const LENGTH: usize = 4;

pub(super) struct ReceivedPayload {
    pub(super) endian: Endian,
    payload: Vec<u8>,
}

impl ReceivedPayload {
    /// Reads the header of a message of at most `limit` bytes.
    pub(super) fn read(payload: &ZBytes, limit: usize) -> Result<Self, SampleError> {
        let length = payload.len();
        if length.saturating_sub(LENGTH) > limit {
            return Err(SampleError::TooLong(length));
        }
        let payload = payload.to_bytes().into_owned();
        let header = *payload.first_chunk().ok_or(SampleError::TooShort(length))?;
        let (endian, _) = encapsulated(&payload).ok_or(SampleError::NotCdr(header))?;
        Ok(Self { endian, payload })
    }

    pub(super) fn bytes(&self) -> &[u8] {
        self.payload.get(LENGTH..).unwrap_or_default()
    }
}

/// Returns a message with its header, for sending.
pub(super) fn with_header(message: CdrBytes) -> ZBytes {
    let mut payload = ZBytes::writer();
    payload.append(ZBytes::from(Endian::Little.encapsulation()));
    payload.append(ZBytes::from(Bytes::from_owner(message)));
    payload.finish()
}
