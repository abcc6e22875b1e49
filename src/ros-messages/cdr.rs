//! A message in its wire encoding: CDR, the encoding of DDS.

use std::sync::Arc;

use byteorder::{BigEndian, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;
use thiserror::Error;

/// A message in little-endian CDR, without the encapsulation header. Clones share the bytes: each message is
/// encoded once for all topics and participants that send it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CdrBytes(pub Arc<Vec<u8>>);

impl CdrBytes {
    /// Encodes a message; fails only for a sequence of more than 2³² − 1 elements.
    pub fn encode(message: &impl Serialize) -> cdr_encoding::Result<Self> {
        Ok(Self(Arc::new(cdr_encoding::to_vec::<_, LittleEndian>(message)?)))
    }
}

impl From<Vec<u8>> for CdrBytes {
    /// Wraps bytes that are already encoded.
    fn from(bytes: Vec<u8>) -> Self {
        Self(Arc::new(bytes))
    }
}

impl AsRef<[u8]> for CdrBytes {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

/// Byte order of CDR, as stated in the sample's header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Endian {
    /// Most significant byte first, `CDR_BE`.
    Big,
    /// Least significant byte first, `CDR_LE`.
    Little,
}

impl Endian {
    /// Returns the encapsulation header of a message in plain CDR.
    pub const fn encapsulation(self) -> [u8; 4] {
        match self {
            Self::Big => [0, 0, 0, 0],
            Self::Little => [0, 1, 0, 0],
        }
    }
}

/// Reason why bytes are not a message of the topic.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum Unreadable {
    /// The bytes have another layout, are truncated, or have a value that is not defined; contains the
    /// reason.
    #[error("{0}")]
    Layout(String),
    /// The bytes have another layout that happens to begin like this one.
    #[error("{used} of {length} bytes are a message")]
    Leftover {
        /// Number of bytes that were decoded.
        used: usize,
        /// Number of bytes of the sample.
        length: usize,
    },
    /// A text or sequence is longer than is accepted.
    #[error("{length} bytes or elements, at most {limit}")]
    TooMuch {
        /// Length in the message.
        length: usize,
        /// Maximum accepted length.
        limit: usize,
    },
}

/// Decodes a message from its bytes, without their encapsulation header.
///
/// # Errors
/// Fails if the bytes have another layout.
pub fn read_message<M: DeserializeOwned>(bytes: &[u8], endian: Endian) -> Result<M, Unreadable> {
    CdrInput { bytes, endian }.whole()
}

/// Returns the byte order stated by the encapsulation header of a message, and the bytes after it; `None` for
/// an encoding other than plain CDR.
pub const fn encapsulated(message: &[u8]) -> Option<(Endian, &[u8])> {
    match message {
        [0, 0, _, _, bytes @ ..] => Some((Endian::Big, bytes)),
        [0, 1, _, _, bytes @ ..] => Some((Endian::Little, bytes)),
        _ => None,
    }
}

/// Bytes that may be a message, without their encapsulation header.
#[derive(Debug, Clone, Copy)]
pub struct CdrInput<'a> {
    /// The bytes.
    pub bytes: &'a [u8],
    /// Byte order of the bytes.
    pub endian: Endian,
}

impl CdrInput<'_> {
    /// Decodes a message that uses all of the bytes, except for padding to a multiple of four: another layout
    /// may decode by chance, but hardly to its end.
    ///
    /// # Errors
    /// Fails if the bytes have another layout.
    pub fn whole<M: DeserializeOwned>(self) -> Result<M, Unreadable> {
        let read = match self.endian {
            Endian::Big => cdr_encoding::from_bytes::<M, BigEndian>(self.bytes),
            Endian::Little => cdr_encoding::from_bytes::<M, LittleEndian>(self.bytes),
        };
        let (message, used) = read.map_err(|error| Unreadable::Layout(error.to_string()))?;
        match self.bytes.len().checked_sub(used) {
            Some(0..=3) => Ok(message),
            Some(_) | None => Err(Unreadable::Leftover { used, length: self.bytes.len() }),
        }
    }
}
