//! Encoded messages for RustDDS, padded to a multiple of four bytes.
//!
//! RTPS requires such a length for every submessage but the last of a datagram, and Cyclone DDS up to 0.10.2
//! (the version of Debian 12) rejects a last fragment without it as malformed, so that no sample larger than
//! a datagram arrives there. RustDDS splits samples into fragments of 256 bytes and pads none. The padding
//! follows the last field, where CDR decoders have stopped reading; its length, for which DDS-XTypes has two
//! bits in the encapsulation options, is left at zero, since RustDDS does not set them and no decoder of
//! these plain types needs it.

use rustdds::RepresentationIdentifier;
use rustdds::bytes::Bytes;
use rustdds::no_key::{DataWriter, SerializerAdapter};
use rustdds::serialization::Error;

use ros_messages::cdr::CdrBytes;

/// A writer of messages of any type.
pub(super) type SampleWriter = DataWriter<CdrBytes, Padded>;

/// Samples are padded to a multiple of this many bytes. The preceding encapsulation header has the same
/// length.
const ALIGNMENT: usize = 4;

/// Passes the bytes to RustDDS, without a copy unless they need padding.
pub(super) struct Padded;

impl SerializerAdapter<CdrBytes> for Padded {
    type Error = Error;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(sample: &CdrBytes) -> Result<Bytes, Error> {
        let bytes = sample.as_ref();
        let length = bytes.len().next_multiple_of(ALIGNMENT);
        if length == bytes.len() {
            return Ok(Bytes::from_owner(sample.clone()));
        }
        let mut padded = Vec::with_capacity(length);
        padded.extend_from_slice(bytes);
        padded.resize(length, 0);
        Ok(padded.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_padded_with_zeros_to_a_multiple_of_four() {
        for (length, padded) in [(0, 0), (1, 4), (3, 4), (4, 4), (5, 8), (1447, 1448), (1448, 1448)] {
            let bytes = Padded::to_bytes(&CdrBytes::from(vec![7; length])).unwrap();
            assert_eq!(bytes[..length], vec![7; length]);
            assert_eq!(bytes[length..], vec![0; padded - length]);
        }
    }
}
