//! The messages of the link, and their encoding: one byte for the kind, followed by its little-endian
//! content.

use serde::{Deserialize, Serialize};

use super::bytes::FrameBytes;
use super::counts::{LostLines, ZenohLinks};
use super::settings::NetworkSettings;
use super::violation::Violation;
use crate::parameters::Parameters;
use ros_messages::cdr::{CdrBytes, Endian};

/// Maximum length of a text, bytes.
const MAX_TEXT: usize = 1024;
/// Maximum JSON size of a status, bytes: room for 11 bytes for each of a thousand topics, and for the few
/// named nodes.
const MAX_STATUS: usize = 32 * 1024;
/// Maximum size of a forwarded sample, bytes.
pub const MAX_SAMPLE: usize = 8 * 1024 * 1024;

/// An instruction for the writer of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Order {
    /// Publish these samples, oldest first.
    Publish(Vec<CdrBytes>),
    /// Publish nothing, not even to late readers.
    Withdraw,
}

/// A message of the gateway to its network side.
#[derive(Debug, Clone, PartialEq)]
pub enum ToNetwork {
    /// Join the network; only as the first message.
    Start(Box<NetworkSettings>),
    /// Carry out this order on the topic at this position of the settings.
    Order(u16, Order),
    /// These are the parameters of the node from now on.
    Parameters(Box<Parameters>),
    /// Answer with the same number once a sample has been sent and received back.
    Ping(u64),
    /// Leave the network and exit.
    Stop,
}

/// A message of the network side to the gateway. Texts and bytes borrow from the frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum FromNetwork<'a> {
    /// The network was joined; the first message on success.
    Ready,
    /// The network cannot be joined, for this reason; the only message in that case.
    Failed(&'a str),
    /// A sample was received.
    Sample(Sample<'a>),
    /// A sample of this subscription could not be read, for this reason.
    Unreadable(u16, &'a str),
    /// The state of the network side has changed.
    Status(NetworkStatus),
    /// The answer to a ping, with its number.
    Pong {
        /// The number of the ping.
        number: u64,
        /// True if a sample was received back. This may be impossible without a network, or where it never
        /// happened before.
        has_echo: bool,
        /// True if a sample has arrived since the last answer at a reader outside the network side's
        /// participant.
        is_heard: bool,
    },
}

/// A sample as it was received.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sample<'a> {
    /// Position of its subscription in the settings.
    pub subscription: u16,
    /// GUID of its writer.
    pub writer: [u8; 16],
    /// Sequence number at its writer.
    pub number: i64,
    /// Byte order of its bytes.
    pub endian: Endian,
    /// The message in CDR, without the encapsulation header.
    pub bytes: &'a [u8],
}

/// State and counts of the network side.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkStatus {
    /// Number of matched readers of each written topic.
    pub readers: Vec<u32>,
    /// Number of matched writers of each read topic.
    pub writers: Vec<u32>,
    /// Number of foreign writers on each written topic.
    pub other_writers: Vec<u32>,
    /// Number of participants whose lease expired, until a new participant has found them.
    pub missing_peers: u32,
    /// True while a second participant listens for them.
    pub has_probe: bool,
    /// Number of times that the participant was replaced.
    pub rebuilds: u32,
    /// Number of foreign participants present.
    pub participants: u32,
    /// Number of times that a writer was sending but not received.
    pub unheard_writers: u32,
    /// Number of samples that RustDDS refused.
    pub write_errors: u64,
    /// Number of unanswered parameter requests.
    pub unanswered_requests: u64,
    /// Log lines that the network side could not write.
    pub lost_lines: LostLines,
    /// True once it has left the ROS 2 graph, which belongs to another distribution.
    pub has_left_graph: bool,
    /// Zenoh connections; `None` with DDS, which has none.
    pub links: Option<ZenohLinks>,
}

impl NetworkStatus {
    /// Returns the number of other participants plus their endpoints that are matched with ours.
    pub fn peers(&self) -> u32 {
        let matched = self.readers.iter().chain(&self.writers).copied();
        matched.fold(self.participants, u32::saturating_add)
    }
}

const START: u8 = 1;
const PUBLISH: u8 = 2;
const WITHDRAW: u8 = 3;
const PING: u8 = 4;
const STOP: u8 = 5;
const PARAMETERS: u8 = 6;

impl ToNetwork {
    /// Appends the encoded message.
    pub(super) fn encode(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Start(settings) => {
                bytes.push(START);
                // Settings have no map with non-text keys, so encoding succeeds; a failure would make the
                // message unreadable.
                bytes.extend(serde_json::to_vec(settings).unwrap_or_default());
            }
            Self::Order(topic, Order::Publish(samples)) => {
                bytes.push(PUBLISH);
                bytes.extend(topic.to_le_bytes());
                for sample in samples {
                    let sample = sample.as_ref();
                    // A frame is shorter than 4 GiB.
                    bytes.extend(u32::try_from(sample.len()).unwrap_or(u32::MAX).to_le_bytes());
                    bytes.extend(sample);
                }
            }
            Self::Order(topic, Order::Withdraw) => {
                bytes.push(WITHDRAW);
                bytes.extend(topic.to_le_bytes());
            }
            Self::Parameters(parameters) => {
                bytes.push(PARAMETERS);
                bytes.extend(serde_json::to_vec(parameters).unwrap_or_default());
            }
            Self::Ping(number) => {
                bytes.push(PING);
                bytes.extend(number.to_le_bytes());
            }
            Self::Stop => bytes.push(STOP),
        }
    }

    /// Decodes a message from its frame.
    pub fn decode(frame: &[u8]) -> Result<Self, Violation> {
        let mut bytes = FrameBytes(frame);
        let message = match bytes.u8()? {
            START => Self::Start(serde_json::from_slice(bytes.rest()).map_err(|_| Violation::Settings)?),
            PARAMETERS => {
                Self::Parameters(serde_json::from_slice(bytes.rest()).map_err(|_| Violation::Settings)?)
            }
            PUBLISH => {
                let (topic, mut samples) = (bytes.u16()?, Vec::new());
                while !bytes.0.is_empty() {
                    samples.push(CdrBytes::from(bytes.counted()?.to_vec()));
                }
                Self::Order(topic, Order::Publish(samples))
            }
            WITHDRAW => Self::Order(bytes.u16()?, Order::Withdraw),
            PING => Self::Ping(bytes.u64()?),
            STOP => Self::Stop,
            other => return Err(Violation::Kind(other)),
        };
        bytes.end()?;
        Ok(message)
    }
}

const READY: u8 = 1;
const FAILED: u8 = 2;
const SAMPLE: u8 = 3;
const UNREADABLE: u8 = 4;
const STATUS: u8 = 5;
const PONG: u8 = 6;

impl<'a> FromNetwork<'a> {
    /// Appends the encoded message; a reason is shortened to the limit, and the names in a status are short
    /// already.
    pub fn encode(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Ready => bytes.push(READY),
            Self::Failed(reason) => {
                bytes.push(FAILED);
                bytes.extend(shortened(reason).as_bytes());
            }
            Self::Sample(sample) => {
                bytes.push(SAMPLE);
                bytes.extend(sample.subscription.to_le_bytes());
                bytes.extend(sample.writer);
                bytes.extend(sample.number.to_le_bytes());
                bytes.push(u8::from(sample.endian == Endian::Little));
                bytes.extend(sample.bytes);
            }
            Self::Unreadable(subscription, reason) => {
                bytes.push(UNREADABLE);
                bytes.extend(subscription.to_le_bytes());
                bytes.extend(shortened(reason).as_bytes());
            }
            Self::Status(status) => {
                bytes.push(STATUS);
                bytes.extend(serde_json::to_vec(status).unwrap_or_default());
            }
            Self::Pong { number, has_echo, is_heard } => {
                bytes.push(PONG);
                bytes.extend(number.to_le_bytes());
                bytes.extend([u8::from(*has_echo), u8::from(*is_heard)]);
            }
        }
    }

    /// Decodes a message. Safe for any bytes.
    pub fn decode(frame: &'a [u8]) -> Result<Self, Violation> {
        let mut bytes = FrameBytes(frame);
        let message = match bytes.u8()? {
            READY => Self::Ready,
            FAILED => Self::Failed(bytes.text(MAX_TEXT)?),
            SAMPLE => Self::Sample(Sample {
                subscription: bytes.u16()?,
                writer: bytes.guid()?,
                number: bytes.i64()?,
                endian: if bytes.flag()? { Endian::Little } else { Endian::Big },
                bytes: match bytes.rest() {
                    sample if sample.len() <= MAX_SAMPLE => sample,
                    sample => return Err(Violation::Sample(sample.len())),
                },
            }),
            UNREADABLE => Self::Unreadable(bytes.u16()?, bytes.text(MAX_TEXT)?),
            STATUS => Self::Status(status(bytes.rest())?),
            PONG => Self::Pong { number: bytes.u64()?, has_echo: bytes.flag()?, is_heard: bytes.flag()? },
            other => return Err(Violation::Kind(other)),
        };
        bytes.end()?;
        Ok(message)
    }
}

fn status(json: &[u8]) -> Result<NetworkStatus, Violation> {
    if json.len() > MAX_STATUS {
        return Err(Violation::Status);
    }
    let status: NetworkStatus = serde_json::from_slice(json).map_err(|_| Violation::Status)?;
    let mut nodes = status.links.iter().flat_map(|links| &links.unreachable);
    if nodes.all(|node| node.len() <= MAX_TEXT) { Ok(status) } else { Err(Violation::Text) }
}

fn shortened(text: &str) -> &str {
    let end = (0..=text.len().min(MAX_TEXT)).rev().find(|end| text.is_char_boundary(*end));
    text.get(..end.unwrap_or_default()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use proptest::prelude::*;

    use super::super::settings::{ReadTopic, WrittenTopic};
    use super::*;
    use crate::parameters::{DoorLayouts, ParameterValue, ServiceContents};
    use crate::qos::{Delivery, Durability, Reliability};
    use crate::settings::{Recovery, Transport, TypeHashes, ZenohSettings};
    use ros_messages::autoware_adapi_v1_msgs::DoorLayout;

    fn there_and_back(message: &ToNetwork) {
        let mut bytes = Vec::new();
        message.encode(&mut bytes);
        assert_eq!(ToNetwork::decode(&bytes).as_ref(), Ok(message));
        for end in 0..bytes.len() {
            assert_ne!(ToNetwork::decode(&bytes[..end]).as_ref(), Ok(message));
        }
    }

    #[test]
    fn what_the_gateway_sends_arrives() {
        let mut parameters = Parameters::default();
        parameters.set("a", ParameterValue::Double(0.1));
        parameters.set("b", ParameterValue::Double(f64::NAN));
        let settings = NetworkSettings {
            node: "gw".to_owned(),
            namespace: "/".to_owned(),
            graph: true,
            domain_id: 7,
            only_networks: vec!["10.0.0.1".parse().unwrap()],
            written: vec![WrittenTopic {
                name: "/a".to_owned(),
                type_name: "p/msg/T".to_owned(),
                durability: Durability::TransientLocal,
                depth: 1,
                delivery: Delivery::Report,
            }],
            read: vec![ReadTopic {
                name: "/b".to_owned(),
                type_name: "p/msg/T".to_owned(),
                reliability: Reliability::BestEffort,
                durability: Durability::Volatile,
                depth: 2,
            }],
            recovery: Recovery { check_interval: Duration::from_millis(1500), ..Recovery::default() },
            echo_is_proven: true,
            history_bytes: 1 << 20,
            services: Some(ServiceContents {
                parameters: parameters.clone(),
                doors: Some(DoorLayouts { service: "/doors".to_owned(), doors: vec![DoorLayout::default()] }),
            }),
            transport: Transport::Zenoh(ZenohSettings {
                config: Some("{ mode: 'peer' }".to_owned()),
                type_hashes: TypeHashes::NotSupported,
            }),
        };
        there_and_back(&ToNetwork::Start(Box::new(settings)));
        let samples = [vec![1, 2, 3], vec![], vec![4]].map(CdrBytes::from).to_vec();
        there_and_back(&ToNetwork::Order(3, Order::Publish(samples)));
        there_and_back(&ToNetwork::Order(u16::MAX, Order::Withdraw));
        there_and_back(&ToNetwork::Parameters(Box::new(parameters)));
        there_and_back(&ToNetwork::Ping(u64::MAX));
        there_and_back(&ToNetwork::Stop);
    }

    fn status() -> impl Strategy<Value = NetworkStatus> {
        let counts = || prop::collection::vec(any::<u32>(), 0..9);
        let lines = any::<(u64, u64)>();
        let errors = any::<(u64, u64)>();
        let links = prop::option::of((any::<(u32, u32, u64)>(), prop::collection::vec(".{0,20}", 0..3)));
        let numbers = any::<[u32; 4]>();
        let topics = (counts(), counts(), counts());
        let status = (topics, any::<(bool, bool)>(), numbers, errors, lines, links);
        status.prop_map(|(topics, flags, numbers, errors, (suppressed, dropped), links)| {
            let (readers, writers, other_writers) = topics;
            let [missing_peers, rebuilds, participants, unheard_writers] = numbers;
            let (has_probe, has_left_graph) = flags;
            let (write_errors, unanswered_requests) = errors;
            let links = links.map(|((routers, peers, lost), unreachable)| ZenohLinks {
                routers,
                peers,
                lost,
                unreachable,
            });
            let lost_lines = LostLines { suppressed, dropped };
            NetworkStatus {
                readers,
                writers,
                other_writers,
                missing_peers,
                has_probe,
                rebuilds,
                participants,
                unheard_writers,
                write_errors,
                unanswered_requests,
                lost_lines,
                has_left_graph,
                links,
            }
        })
    }

    proptest! {
        #[test]
        fn what_the_network_side_sends_arrives_and_what_is_cut_off_does_not(
            status in status(),
            (subscription, writer, number) in any::<(u16, [u8; 16], i64)>(),
            is_little in any::<bool>(),
            sample in prop::collection::vec(any::<u8>(), 0..40),
            reason in "\\PC{0,30}",
            (has_echo, is_heard) in any::<(bool, bool)>(),
        ) {
            let endian = if is_little { Endian::Little } else { Endian::Big };
            let messages = [
                FromNetwork::Ready,
                FromNetwork::Failed(&reason),
                FromNetwork::Sample(Sample { subscription, writer, number, endian, bytes: &sample }),
                FromNetwork::Unreadable(subscription, &reason),
                FromNetwork::Status(status),
                FromNetwork::Pong { number: number.unsigned_abs(), has_echo, is_heard },
            ];
            for message in &messages {
                let mut bytes = Vec::new();
                message.encode(&mut bytes);
                prop_assert_eq!(FromNetwork::decode(&bytes), Ok(message.clone()));
                for end in 0..bytes.len() {
                    prop_assert_ne!(FromNetwork::decode(&bytes[..end]), Ok(message.clone()));
                }
            }
        }

        #[test]
        fn any_bytes_are_read_or_refused(frame in prop::collection::vec(any::<u8>(), 0..64), kind in 0..8_u8) {
            let mut bytes = frame.clone();
            if let Some(first) = bytes.first_mut() {
                *first = kind;
            }
            for frame in [frame, bytes] {
                if let Ok(message) = FromNetwork::decode(&frame) {
                    let mut again = Vec::new();
                    message.encode(&mut again);
                    prop_assert_eq!(&again, &frame, "one message has one encoding");
                }
                let _ = ToNetwork::decode(&frame);
            }
        }
    }

    #[test]
    fn bounds_hold() {
        let long = "ä".repeat(MAX_TEXT);
        let mut bytes = Vec::new();
        FromNetwork::Failed(&long).encode(&mut bytes);
        assert_eq!(bytes.len(), 1 + MAX_TEXT, "shortened where a character ends");
        assert!(FromNetwork::decode(&bytes).is_ok());
        bytes.push(b'x');
        assert_eq!(FromNetwork::decode(&bytes), Err(Violation::Text));
        let header = [&[SAMPLE][..], &[0; 26], &[1]].concat();
        let sample = |length: usize| [header.clone(), vec![0; length]].concat();
        assert!(FromNetwork::decode(&sample(MAX_SAMPLE)).is_ok());
        assert_eq!(FromNetwork::decode(&sample(MAX_SAMPLE + 1)), Err(Violation::Sample(MAX_SAMPLE + 1)));
        for json in ["{}", "\u{ff}"] {
            let bytes = [&[STATUS], json.as_bytes()].concat();
            assert_eq!(FromNetwork::decode(&bytes), Err(Violation::Status), "{json}");
        }
        let mut bytes = Vec::new();
        FromNetwork::Status(NetworkStatus::default()).encode(&mut bytes);
        assert_eq!(FromNetwork::decode(&bytes), Ok(FromNetwork::Status(NetworkStatus::default())));
        let unknown = [&bytes[..bytes.len() - 1], b",\"other\":1}"].concat();
        assert_eq!(FromNetwork::decode(&unknown), Err(Violation::Status));
        bytes.resize(MAX_STATUS + 2, b' ');
        assert_eq!(FromNetwork::decode(&bytes), Err(Violation::Status), "longer than any status");
        assert_eq!(FromNetwork::decode(&[READY, 0]), Err(Violation::Leftover(1)));
        assert_eq!(FromNetwork::decode(&[]), Err(Violation::CutOff));
    }
}
