//! Encodes inputs and outputs of the gateway as messages of channels.

use crate::io::ros::messages::call_message;
use crate::io::ros::outgoing::messages::OutgoingMessages;
use crate::io::ros::outgoing::{LightsEncoders, Outgoing, orders, table};
use crate::io::ros::topics::{Durability, Subscription, Topics};
use crate::io::sample_log::SampleKind;
use can_signal::can::{BusIndex, CanId, CanInput, ErrorFrame, Frame};
use gateway_base::time::WallStamp;
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::call::TimedCall;
use gateway_core::gateway::event::Output;
use ros_messages::TypeName;
use ros_messages::can_msgs;
use ros_messages::cdr::{CdrBytes, Endian};
use ros_messages::ros2_socketcan_msgs::FdFrame;
use ros_messages::signal_gateway_msgs::GatewayCall;
use ros_messages::std_msgs::Header;
use ros_transport::link::Order;

/// History depth of a bus's topics in a player, samples.
const CAN_DEPTH: i32 = 100;
/// The channels of a bus: last part of the topic, and type.
const CAN_CHANNELS: [(&str, TypeName); 6] = [
    ("from_can_bus", can_msgs::Frame::TYPE_NAME),
    ("from_can_bus_fd", FdFrame::TYPE_NAME),
    ("to_can_bus", can_msgs::Frame::TYPE_NAME),
    ("to_can_bus_fd", FdFrame::TYPE_NAME),
    ("to_can_bus_dry_run", can_msgs::Frame::TYPE_NAME),
    ("to_can_bus_dry_run_fd", FdFrame::TYPE_NAME),
];

const CALLS_TOPIC: &str = "/signal_gateway/calls";

/// A topic in a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedChannel {
    /// Absolute name of the topic.
    pub topic: String,
    /// Type of its messages.
    pub type_name: TypeName,
    /// Durability of the topic on DDS.
    pub durability: Durability,
    /// History depth of the topic's writer, samples.
    pub depth: i32,
}

/// A message of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedMessage {
    /// Position of its channel in [`Encoder::channels`].
    pub channel: usize,
    /// Time at which the gateway received or published the message.
    pub log_time: WallStamp,
    /// Time at which the message was sent: the kernel's stamp for a received frame, otherwise equal to
    /// `log_time`.
    pub publish_time: WallStamp,
    /// The message in CDR, without the encapsulation header.
    pub bytes: CdrBytes,
    /// Byte order of `bytes`.
    pub endian: Endian,
}

impl RecordedMessage {
    /// Creates a message that was sent when the gateway received or published it.
    fn new(channel: usize, at: WallStamp, bytes: CdrBytes) -> Self {
        Self { channel, log_time: at, publish_time: at, bytes, endian: Endian::Little }
    }
}

/// A CAN bus, for the names of its topics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedBus {
    /// Name in the profile.
    pub name: String,
    /// SocketCAN interface of the bus; used as the `frame_id` of its frames.
    pub interface: String,
}

/// Creates the messages of a recording.
#[derive(Debug)]
pub struct Encoder {
    table: Vec<Outgoing>,
    channels: Vec<RecordedChannel>,
    encoders: LightsEncoders,
    interfaces: Vec<String>,
    /// Position of the first channel that belongs to a subscribed topic.
    first_read: usize,
    hardware_id: String,
}

impl Encoder {
    /// Creates an encoder for the published topics, the frames of these buses, and the subscribed topics.
    pub fn new(
        topics: &Topics,
        durability: Durability,
        hardware_id: &str,
        buses: &[RecordedBus],
        read: &[Subscription],
    ) -> Self {
        let table = table(topics, durability);
        let published = table.iter().map(|outgoing| {
            let (topic, type_name) = (outgoing.name.clone(), outgoing.type_name);
            RecordedChannel { topic, type_name, durability: outgoing.durability, depth: outgoing.depth }
        });
        let volatile = |topic, type_name| RecordedChannel {
            topic,
            type_name,
            durability: Durability::Volatile,
            depth: CAN_DEPTH,
        };
        let frames = buses.iter().flat_map(|bus| {
            let name = topic_token(&bus.name);
            CAN_CHANNELS.map(|(end, type_name)| volatile(format!("/{name}/{end}"), type_name))
        });
        let mut channels: Vec<RecordedChannel> = published.chain(frames).collect();
        let first_read = channels.len();
        channels.extend(read.iter().map(|subscription| RecordedChannel {
            topic: subscription.name.clone(),
            type_name: subscription.kind.row().type_name,
            durability: subscription.durability,
            depth: subscription.depth,
        }));
        channels.push(volatile(CALLS_TOPIC.to_owned(), GatewayCall::TYPE_NAME));
        Self {
            table,
            channels,
            encoders: LightsEncoders::default(),
            interfaces: buses.iter().map(|bus| bus.interface.clone()).collect(),
            first_read,
            hardware_id: hardware_id.to_owned(),
        }
    }

    /// Returns the channels. Messages refer to them by position.
    pub fn channels(&self) -> &[RecordedChannel] {
        &self.channels
    }

    /// Returns the topics of all inputs and calls, from which a run is replayed. The topics of the
    /// subscriptions come first, in their order.
    pub fn inputs(&self, subscriptions: &[Subscription]) -> Vec<(String, SampleKind)> {
        let samples = subscriptions.iter().map(|topic| (topic.name.clone(), SampleKind::Input(topic.kind)));
        let buses = (0..=u8::MAX).map(BusIndex).zip(&self.interfaces);
        let frames = buses.flat_map(|(bus, _)| {
            [false, true].map(|is_fd| {
                let channel = &self.channels[self.can_channel(bus, usize::from(is_fd))];
                (channel.topic.clone(), SampleKind::Frames { bus, is_fd })
            })
        });
        let calls = (CALLS_TOPIC.to_owned(), SampleKind::Calls);
        samples.chain(frames).chain([calls]).collect()
    }

    /// Returns the message of an input; `None` if it is not a frame.
    pub fn received(&self, input: &CanInput, at: WallStamp) -> Option<RecordedMessage> {
        match input {
            CanInput::Frame { bus, frame, stamp } => {
                let message = self.frame(*bus, 0, frame, *stamp)?;
                Some(RecordedMessage { log_time: at, ..message })
            }
            CanInput::ErrorFrame { bus, error } => self.error_frame(*bus, *error, at),
            CanInput::Link { .. }
            | CanInput::Controller { .. }
            | CanInput::Drops { .. }
            | CanInput::BadRecords { .. } => None,
        }
    }

    /// Returns the message of a received sample; `subscription` is the position of its subscription.
    pub fn sample(
        &self,
        subscription: usize,
        bytes: CdrBytes,
        endian: Endian,
        at: WallStamp,
    ) -> Option<RecordedMessage> {
        let channel = self.first_read + subscription;
        let message = RecordedMessage { endian, ..RecordedMessage::new(channel, at, bytes) };
        (channel < self.calls_channel()).then_some(message)
    }

    /// Returns the message of a call.
    pub fn call(&self, call: &TimedCall) -> Option<RecordedMessage> {
        let bytes = CdrBytes::encode(&call_message(call)).ok()?;
        Some(RecordedMessage::new(self.calls_channel(), call.at.wall, bytes))
    }

    /// Returns the messages of an output that was published at `at`.
    pub fn given_out(&mut self, output: &Output, at: WallStamp) -> Vec<RecordedMessage> {
        match output {
            Output::Command(CommandOutput::Transmit { frame, .. }) => {
                self.frame(frame.bus(), 2, frame.frame(), at).into_iter().collect()
            }
            Output::Command(CommandOutput::WouldTransmit { bus, frame, .. }) => {
                self.frame(*bus, 4, frame, at).into_iter().collect()
            }
            Output::VehicleLights(_)
            | Output::VehicleStatus(_)
            | Output::TrafficLights(_)
            | Output::TurnSignal(_)
            | Output::Diagnostics { .. } => self.published(output, at),
        }
    }

    fn published(&mut self, output: &Output, at: WallStamp) -> Vec<RecordedMessage> {
        let mut messages = OutgoingMessages::default();
        messages.put(output, &self.hardware_id);
        let orders = orders(&self.table, &mut self.encoders, &messages);
        let samples = orders.into_iter().filter_map(|(channel, order)| match order {
            Ok(Order::Publish(samples)) => Some((channel, samples)),
            // A withdrawal is not a message; a message that cannot be encoded was not published either.
            Ok(Order::Withdraw) | Err(_) => None,
        });
        let messages = samples.flat_map(|(channel, samples)| {
            samples.into_iter().map(move |bytes| RecordedMessage::new(channel, at, bytes))
        });
        messages.collect()
    }

    /// Returns the message of a frame that was received or sent at `at`. `kind` is the position in
    /// [`CAN_CHANNELS`] of the channel for classic frames; the channel for CAN FD follows it.
    fn frame(&self, bus: BusIndex, kind: usize, frame: &Frame, at: WallStamp) -> Option<RecordedMessage> {
        let header = self.header(bus, at)?;
        let (id, is_extended) = (frame.id().number(), matches!(frame.id(), CanId::Extended(_)));
        let len = u8::try_from(frame.data().len()).ok()?;
        let bytes = if frame.is_fd() {
            let data = frame.data().to_vec();
            CdrBytes::encode(&FdFrame { header, id, is_extended, is_error: false, len, data })
        } else {
            let data = *frame.padded().first_chunk()?;
            let (is_rtr, is_error) = (false, false);
            CdrBytes::encode(&can_msgs::Frame { header, id, is_rtr, is_extended, is_error, dlc: len, data })
        };
        let channel = self.can_channel(bus, kind + usize::from(frame.is_fd()));
        Some(RecordedMessage::new(channel, at, bytes.ok()?))
    }

    fn error_frame(&self, bus: BusIndex, error: ErrorFrame, at: WallStamp) -> Option<RecordedMessage> {
        let bytes = CdrBytes::encode(&can_msgs::Frame {
            header: self.header(bus, at)?,
            id: error.class,
            is_rtr: false,
            is_extended: false,
            is_error: true,
            dlc: 8,
            data: error.data,
        });
        Some(RecordedMessage::new(self.can_channel(bus, 0), at, bytes.ok()?))
    }

    fn header(&self, bus: BusIndex, stamp: WallStamp) -> Option<Header> {
        let frame_id = self.interfaces.get(usize::from(bus.0))?.clone();
        Some(Header { stamp: stamp.into(), frame_id })
    }

    /// Returns the position of the channel of calls, the last channel.
    fn calls_channel(&self) -> usize {
        self.channels.len() - 1
    }

    fn can_channel(&self, bus: BusIndex, kind: usize) -> usize {
        self.table.len() + usize::from(bus.0) * CAN_CHANNELS.len() + kind
    }
}

/// Converts a name to a topic token: letters, digits and `_`, starting with a letter.
pub fn topic_token(name: &str) -> String {
    let allowed = |char: char| if char.is_ascii_alphanumeric() { char } else { '_' };
    let token: String = name.chars().map(allowed).collect();
    if token.starts_with(|first: char| first.is_ascii_alphabetic()) { token } else { format!("can_{token}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoder() -> Encoder {
        let bus = |name: &str| RecordedBus { name: name.to_owned(), interface: format!("if-{name}") };
        Encoder::new(&Topics::default(), Durability::Volatile, "car", &[bus("body"), bus("0 ä")], &[])
    }

    #[test]
    fn names_of_buses_become_valid_topics() {
        let topics: Vec<_> = encoder().channels().iter().map(|channel| channel.topic.clone()).collect();
        assert!(topics.contains(&"/body/from_can_bus".to_owned()), "{topics:?}");
        assert!(topics.contains(&"/can_0__/to_can_bus_fd".to_owned()), "{topics:?}");
    }

    #[test]
    fn frames_go_to_the_channel_of_their_bus_and_format() {
        let encoder = encoder();
        let at = WallStamp::from_nanos(5_000_000_009);
        let stamp = WallStamp::from_nanos(5_000_000_001);
        let frame = Frame::classic(CanId::Extended(0x123), &[1, 2]).unwrap();
        let message = encoder.received(&CanInput::Frame { bus: BusIndex(1), frame, stamp }, at).unwrap();
        let channel = &encoder.channels()[message.channel];
        assert_eq!(
            (channel.topic.as_str(), channel.type_name),
            ("/can_0__/from_can_bus", "can_msgs/msg/Frame")
        );
        assert_eq!((message.log_time, message.publish_time), (at, stamp));
        let mut expected = vec![5, 0, 0, 0, 1, 0, 0, 0];
        expected.extend([8, 0, 0, 0]);
        expected.extend("if-0 ä\0".bytes());
        let expected_header = expected.len();
        assert_eq!(message.bytes.as_ref()[..8], expected[..8]);
        assert!(message.bytes.as_ref().len() > expected_header);
        assert!(message.bytes.as_ref().ends_with(&[0x23, 1, 0, 0, 0, 1, 0, 2, 1, 2, 0, 0, 0, 0, 0, 0]));

        let fd = Frame::fd(CanId::Standard(0x7FF), &[9; 12]).unwrap();
        let message = encoder.received(&CanInput::Frame { bus: BusIndex(0), frame: fd, stamp }, at).unwrap();
        let channel = &encoder.channels()[message.channel];
        assert_eq!(
            (channel.topic.as_str(), channel.type_name),
            ("/body/from_can_bus_fd", "ros2_socketcan_msgs/msg/FdFrame")
        );
        assert!(message.bytes.as_ref().ends_with(&[9; 12]));
    }
}
