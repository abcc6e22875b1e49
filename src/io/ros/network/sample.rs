//! Encoded messages handed to RustDDS as they are.

use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{DataWriter, SerializerAdapter};
use rustdds::serialization::Error;

use crate::io::ros::messages::CdrBytes;

/// A writer of messages of any type.
pub(super) type SampleWriter = DataWriter<CdrBytes, AsIs>;

/// Hands RustDDS the bytes, which it shares.
pub(super) struct AsIs;

impl SerializerAdapter<CdrBytes> for AsIs {
    type Error = Error;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(sample: &CdrBytes) -> Result<Bytes, Error> {
        Ok(Bytes::from_owner(sample.clone()))
    }
}
