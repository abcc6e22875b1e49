//! The reader of one topic, and its samples as bytes.

use std::task::Waker;

use rustdds::dds::result::CreateResult;
use rustdds::no_key::{Decode, DeserializerAdapter, SimpleDataReader};
use rustdds::serialization::Error;
use rustdds::{GUID, QosPolicies, RepresentationIdentifier, Subscriber, Topic};

use crate::link::MAX_SAMPLE;
use ros_messages::cdr::Endian;

/// Maximum number of samples read from one topic before other work.
const MAX_AT_ONCE: usize = 64;

pub(super) enum TakenSample {
    /// A readable sample: its writer, its number at that writer, and its bytes.
    Sample(GUID, i64, EncodedSample),
    Unreadable(String),
}

/// A message in CDR, without the encapsulation header.
pub(super) struct EncodedSample {
    pub(super) endian: Endian,
    /// Bytes of the message, up to a limit.
    pub(super) bytes: Vec<u8>,
}

pub(super) struct DdsTopicReader {
    reader: SimpleDataReader<EncodedSample, AsBytes>,
}

impl DdsTopicReader {
    /// Creates a reader with this quality of service, or else with the topic's.
    pub(super) fn new(
        subscriber: &Subscriber,
        topic: &Topic,
        qos: Option<QosPolicies>,
    ) -> CreateResult<Self> {
        Ok(Self { reader: subscriber.create_simple_datareader_no_key(topic, qos)? })
    }

    pub(super) fn guid(&self) -> GUID {
        self.reader.guid()
    }

    /// Passes the samples that have arrived to `hand_over` until that returns false; `waker` is called when
    /// more arrive. Returns true if more have arrived already.
    pub(super) fn take(&self, waker: &Waker, mut hand_over: impl FnMut(TakenSample) -> bool) -> bool {
        // Set first, so that any sample arriving from now on wakes the task.
        self.reader.set_waker(Some(waker.clone()));
        self.reader.drain_read_notifications();
        for _ in 0..MAX_AT_ONCE {
            let wants_more = match self.reader.try_take_one_with(Copied { limit: MAX_SAMPLE }) {
                Ok(Some(sample)) => {
                    let number = sample.sequence_number.into();
                    hand_over(TakenSample::Sample(sample.writer_guid(), number, sample.into_value()))
                }
                Ok(None) => return false,
                Err(error) => hand_over(TakenSample::Unreadable(error.to_string())),
            };
            if !wants_more {
                break;
            }
        }
        true
    }
}

/// Makes RustDDS read samples as [`Copied`].
pub(super) struct AsBytes;

impl DeserializerAdapter<EncodedSample> for AsBytes {
    type Error = Error;
    type Decoded = EncodedSample;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: EncodedSample) -> EncodedSample {
        decoded
    }
}

/// Copies a sample's bytes; the gateway decodes them.
#[derive(Clone)]
pub(super) struct Copied {
    /// Maximum length, bytes.
    pub(super) limit: usize,
}

impl<'de> Decode<'de, EncodedSample> for Copied {
    type Error = Error;

    fn decode_bytes(
        self,
        bytes: &'de [u8],
        encoding: RepresentationIdentifier,
    ) -> Result<EncodedSample, Error> {
        let endian = match encoding {
            RepresentationIdentifier::CDR_LE => Endian::Little,
            RepresentationIdentifier::CDR_BE => Endian::Big,
            other => return Err(Error::Message(format!("encoded as {other:?}"))),
        };
        let limit = self.limit;
        if bytes.len() > limit {
            return Err(Error::Message(format!("{} bytes, at most {limit}", bytes.len())));
        }
        Ok(EncodedSample { endian, bytes: bytes.to_vec() })
    }
}
