//! The reader of one topic, and its samples as inputs.

use std::task::Waker;

use rustdds::dds::result::CreateResult;
use rustdds::no_key::{Decode, DeserializerAdapter, SimpleDataReader};
use rustdds::serialization::Error;
use rustdds::{GUID, RepresentationIdentifier, Subscriber, Topic};

use crate::core::gateway::event::Input;
use crate::io::ros::reading::{Endian, read};
use crate::io::ros::topics::SubscriptionKind;

/// Samples taken from one topic before others have their turn.
const MAX_AT_ONCE: usize = 64;

/// A sample that was taken.
pub(super) enum Taken {
    /// It was decoded: its writer, its number among that writer's, and the input.
    Sample(GUID, i64, Input),
    /// Its bytes are not of the type; the text gives the reason.
    Undecodable(String),
}

/// A topic of one participant.
pub(super) struct TopicReader {
    reader: SimpleDataReader<Input, Typed>,
    kind: SubscriptionKind,
}

impl TopicReader {
    /// A reader with the topic's quality of service.
    pub(super) fn new(subscriber: &Subscriber, topic: &Topic, kind: SubscriptionKind) -> CreateResult<Self> {
        Ok(Self { reader: subscriber.create_simple_datareader_no_key(topic, None)?, kind })
    }

    /// The reader's identity.
    pub(super) fn guid(&self) -> GUID {
        self.reader.guid()
    }

    /// Takes what has arrived and has `waker` called when more does. True when more has arrived already.
    pub(super) fn take(&self, waker: &Waker, mut hand_over: impl FnMut(Taken)) -> bool {
        // First, so that whatever arrives from here on wakes.
        self.reader.set_waker(Some(waker.clone()));
        self.reader.drain_read_notifications();
        for _ in 0..MAX_AT_ONCE {
            match self.reader.try_take_one_with(Decoder(self.kind)) {
                Ok(Some(sample)) => {
                    let number = sample.sequence_number.into();
                    hand_over(Taken::Sample(sample.writer_guid(), number, sample.into_value()));
                }
                Ok(None) => return false,
                Err(error) => hand_over(Taken::Undecodable(error.to_string())),
            }
        }
        true
    }
}

/// Marks for RustDDS that a [`Decoder`] makes the decoded values.
struct Typed;

impl DeserializerAdapter<Input> for Typed {
    type Error = Error;
    type Decoded = Input;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Input) -> Input {
        decoded
    }
}

/// Decodes a sample's bytes to the input that its topic is for.
#[derive(Clone)]
struct Decoder(SubscriptionKind);

impl<'de> Decode<'de, Input> for Decoder {
    type Error = Error;

    fn decode_bytes(self, bytes: &'de [u8], encoding: RepresentationIdentifier) -> Result<Input, Error> {
        let endian = match encoding {
            RepresentationIdentifier::CDR_LE => Endian::Little,
            RepresentationIdentifier::CDR_BE => Endian::Big,
            other => return Err(Error::Message(format!("encoded as {other:?}"))),
        };
        read(self.0, bytes, endian).map_err(|error| Error::Message(error.to_string()))
    }
}
