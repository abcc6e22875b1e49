//! A message in its bytes: encoded once, then shared by all topics and participants that send it.

use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{DataWriter, SerializerAdapter};
use rustdds::serialization::{Error, to_writer_with_rep_id};
use serde::Serialize;

/// Little-endian CDR without the encapsulation header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Sample(Bytes);

/// A writer of messages of any type.
pub(super) type SampleWriter = DataWriter<Sample, AsIs>;

const ENCODING: RepresentationIdentifier = RepresentationIdentifier::CDR_LE;

impl Sample {
    /// Encodes a message. The error is the text of the encoder.
    pub(super) fn encode(message: &impl Serialize) -> Result<Self, String> {
        let mut bytes = Vec::new();
        to_writer_with_rep_id(&mut bytes, message, ENCODING).map_err(|error| error.to_string())?;
        Ok(Self(bytes.into()))
    }

    /// Whether both are the same bytes in memory.
    #[cfg(test)]
    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.0.as_ptr() == other.0.as_ptr()
    }

    /// Length in bytes.
    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

/// Hands RustDDS the bytes.
pub(super) struct AsIs;

impl SerializerAdapter<Sample> for AsIs {
    type Error = Error;

    fn output_encoding() -> RepresentationIdentifier {
        ENCODING
    }

    fn to_bytes(sample: &Sample) -> Result<Bytes, Error> {
        Ok(sample.0.clone())
    }
}
