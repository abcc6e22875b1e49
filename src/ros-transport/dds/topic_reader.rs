//! The reader of one topic, and its samples as bytes.

use std::task::Waker;

use rustdds::dds::result::CreateResult;
use rustdds::no_key::{Decode, DeserializerAdapter, SimpleDataReader};
use rustdds::serialization::Error;
use rustdds::{GUID, QosPolicies, RepresentationIdentifier, Subscriber, Topic};

use crate::link::{MAX_SAMPLE, SampleEncoding};

/// Samples taken from one topic before others have their turn.
const MAX_AT_ONCE: usize = 64;

/// A sample that was taken.
pub(super) enum TakenSample {
    /// It was read: its writer, its number among that writer's, and its bytes.
    Sample(GUID, i64, EncodedSample),
    /// It could not be read; the text says why.
    Unreadable(String),
}

/// A message in CDR, without the encapsulation header.
pub(super) struct EncodedSample {
    /// Byte order of the sample.
    pub(super) encoding: SampleEncoding,
    /// Its bytes, up to a limit.
    pub(super) bytes: Vec<u8>,
}

/// A topic of one participant.
pub(super) struct DdsTopicReader {
    reader: SimpleDataReader<EncodedSample, AsBytes>,
}

impl DdsTopicReader {
    /// A reader with this quality of service, else with the topic's.
    pub(super) fn new(
        subscriber: &Subscriber,
        topic: &Topic,
        qos: Option<QosPolicies>,
    ) -> CreateResult<Self> {
        Ok(Self { reader: subscriber.create_simple_datareader_no_key(topic, qos)? })
    }

    /// Returns the identity of the reader.
    pub(super) fn guid(&self) -> GUID {
        self.reader.guid()
    }

    /// Takes what has arrived until `hand_over` wants no more, and has `waker` called when more does. True
    /// when more has arrived already.
    pub(super) fn take(&self, waker: &Waker, mut hand_over: impl FnMut(TakenSample) -> bool) -> bool {
        // First, so that whatever arrives from here on wakes.
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

/// Tells RustDDS that [`Copied`] makes what is read.
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
    /// The most bytes of a sample.
    pub(super) limit: usize,
}

impl<'de> Decode<'de, EncodedSample> for Copied {
    type Error = Error;

    fn decode_bytes(
        self,
        bytes: &'de [u8],
        encoding: RepresentationIdentifier,
    ) -> Result<EncodedSample, Error> {
        let encoding = match encoding {
            RepresentationIdentifier::CDR_LE => SampleEncoding::Little,
            RepresentationIdentifier::CDR_BE => SampleEncoding::Big,
            other => return Err(Error::Message(format!("encoded as {other:?}"))),
        };
        let limit = self.limit;
        if bytes.len() > limit {
            return Err(Error::Message(format!("{} bytes, at most {limit}", bytes.len())));
        }
        Ok(EncodedSample { encoding, bytes: bytes.to_vec() })
    }
}
