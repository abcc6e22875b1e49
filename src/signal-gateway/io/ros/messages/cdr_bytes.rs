//! A message as it goes over the wire.

use std::sync::Arc;

use byteorder::LittleEndian;
use serde::Serialize;

/// A message in little-endian CDR, without the encapsulation header. Clones share the bytes: each message is
/// encoded once for all topics and participants that send it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CdrBytes(pub(super) Arc<Vec<u8>>);

impl CdrBytes {
    /// Encodes a message; fails only for a sequence of more than 2³² − 1 elements.
    pub fn encode(message: &impl Serialize) -> cdr_encoding::Result<Self> {
        Ok(Self(Arc::new(cdr_encoding::to_vec::<_, LittleEndian>(message)?)))
    }
}

impl From<Vec<u8>> for CdrBytes {
    /// Takes bytes that are encoded already.
    fn from(bytes: Vec<u8>) -> Self {
        Self(Arc::new(bytes))
    }
}

impl AsRef<[u8]> for CdrBytes {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}
