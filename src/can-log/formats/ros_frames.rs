//! CAN frames as ROS 2 messages, as recorded by `ros2_socketcan` and the gateway itself:
//! `can_msgs/msg/Frame`, and `ros2_socketcan_msgs/msg/FdFrame` for CAN FD, in CDR.
//!
//! The namespace of a topic `/can0/from_can_bus` or `/can0/from_can_bus_fd` names the interface. Topics such
//! as `to_can_bus` hold sent rather than received frames, and are skipped.

use std::io;
use std::sync::Arc;

use super::recorded_topics::{Choose, MessageReader, RecordedTopic, TopicChoice};
use crate::entry::{BadLine, EntryContent, EntryInterface, LogEntry};
use crate::fields::{data_frame, id};
use crate::format::{ObjectReader, Outcome, refused};
use can_signal::can::ErrorFrame;
use gateway_base::time::WallStamp;
use ros_messages::builtin_interfaces::Time;
use ros_messages::can_msgs;
use ros_messages::cdr::{encapsulated, read_message};
use ros_messages::ros2_socketcan_msgs::FdFrame;

/// Topics of received frames, by their last part.
const RECEIVED: [&str; 2] = ["from_can_bus", "from_can_bus_fd"];
/// Prefix of the last part of a topic with sent frames.
const SENT: &str = "to_can_bus";
/// The interface of a topic without a namespace.
const UNNAMED: &str = "can0";

/// A topic with received frames.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FrameTopic {
    interface: String,
    is_fd: bool,
}

impl FrameTopic {
    /// Returns `None` for a topic of another type (`can_msgs/msg/Frame`), in another encoding, or with sent
    /// frames.
    pub(super) fn new(topic: &str, type_name: &str, encoding: &str) -> Option<Self> {
        let is_fd = type_name == FdFrame::TYPE_NAME;
        let (namespace, last) = topic.trim_matches('/').rsplit_once('/').unwrap_or((UNNAMED, topic));
        let last = last.trim_matches('/');
        if encoding != "cdr" || !is_fd && type_name != can_msgs::Frame::TYPE_NAME || last.starts_with(SENT) {
            return None;
        }
        let interface = if RECEIVED.contains(&last) { namespace } else { topic.trim_matches('/') };
        Some(Self { interface: interface.to_owned(), is_fd })
    }

    /// Reads a message with its encapsulation header. A message without a stamp has the time of its record.
    pub(super) fn entry(&self, message: &[u8], logged: WallStamp) -> Outcome<'_> {
        let (stamp, content) = received_frame(message, self.is_fd, logged)?;
        Ok(Some(LogEntry { stamp, interface: EntryInterface::Named(&self.interface), content }))
    }
}

/// Chooses the topics with received frames.
pub(super) fn choose_frames() -> Choose<FrameTopic> {
    Arc::new(|topic: &RecordedTopic<'_>| FrameTopic::new(topic.name, topic.type_name, topic.encoding))
}

/// Reads the messages of a recording as frames.
pub(super) struct Frames<R>(pub(super) R);

impl<R: MessageReader<FrameTopic>> ObjectReader for Frames<R> {
    fn next_object(&mut self) -> io::Result<Option<Outcome<'_>>> {
        match self.0.advance()? {
            Some(Ok(())) => {
                let message = self.0.message();
                Ok(message.map(|message| message.topic.entry(message.bytes, message.logged)))
            }
            Some(Err(reason)) => Ok(Some(Err(reason))),
            None if self.0.choice().has_chosen => Ok(None),
            None => Err(without_frames(self.0.choice())),
        }
    }
}

/// Returns the error for a recording without topics with frames; the error has its own kind.
fn without_frames(choice: &TopicChoice<FrameTopic>) -> io::Error {
    let refusal = refused(
        format!("the recording has no topic with received CAN frames; {}", choice.others()),
        "record a topic of can_msgs/msg/Frame or ros2_socketcan_msgs/msg/FdFrame",
    );
    match refusal.into_inner() {
        Some(inner) => io::Error::new(io::ErrorKind::Unsupported, inner),
        None => io::ErrorKind::Unsupported.into(),
    }
}

/// Reads a message with its encapsulation header, and returns its time of reception and content. A message
/// without a stamp has the time of its record.
///
/// # Errors
/// Fails if the bytes are not such a message.
pub fn received_frame(
    message: &[u8],
    is_fd: bool,
    logged: WallStamp,
) -> Result<(WallStamp, EntryContent), BadLine> {
    let (stamp, content) = if is_fd { fd_frame(message)? } else { frame(message)? };
    Ok((if stamp == Time::default() { logged } else { stamp.into() }, content))
}

fn frame(message: &[u8]) -> Result<(Time, EntryContent), BadLine> {
    let can_msgs::Frame { header, id: number, is_rtr, is_extended, is_error, dlc, data } = decoded(message)?;
    let content = if is_error {
        EntryContent::Error(ErrorFrame::new(number, &data))
    } else {
        let id = id(number, is_extended)?;
        let data = data.get(..dlc.into()).ok_or(BadLine::BadLength)?;
        if is_rtr { EntryContent::Remote } else { data_frame(id, false, data)? }
    };
    Ok((header.stamp, content))
}

fn fd_frame(message: &[u8]) -> Result<(Time, EntryContent), BadLine> {
    let FdFrame { header, id: number, is_extended, is_error, len, data } = decoded(message)?;
    let content = if is_error {
        EntryContent::Error(ErrorFrame::new(number, &data))
    } else {
        let data = data.get(..len.into()).ok_or(BadLine::BadLength)?;
        data_frame(id(number, is_extended)?, true, data)?
    };
    Ok((header.stamp, content))
}

fn decoded<M: serde::de::DeserializeOwned>(message: &[u8]) -> Result<M, BadLine> {
    let (endian, bytes) = encapsulated(message).ok_or(BadLine::NoFrame)?;
    read_message(bytes, endian).map_err(|_| BadLine::BadData)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ros_messages::cdr::CdrBytes;
    use ros_messages::std_msgs::Header;

    const FRAME: &str = "can_msgs/msg/Frame";
    const FD_FRAME: &str = "ros2_socketcan_msgs/msg/FdFrame";

    #[test]
    fn the_namespace_of_a_topic_names_the_interface() {
        let interface = |topic| FrameTopic::new(topic, FRAME, "cdr").map(|topic| topic.interface);
        for (topic, expected) in [
            ("/from_can_bus", Some("can0")),
            ("/body/from_can_bus_fd", Some("body")),
            ("/sensing/left/from_can_bus", Some("sensing/left")),
            ("/vehicle/frames", Some("vehicle/frames")),
            ("/frames", Some("frames")),
            ("/to_can_bus", None),
            ("/body/to_can_bus_dry_run", None),
        ] {
            assert_eq!(interface(topic).as_deref(), expected, "{topic}");
        }
        assert_eq!(FrameTopic::new("/can0/from_can_bus", "std_msgs/msg/String", "cdr"), None);
        assert_eq!(FrameTopic::new("/can0/from_can_bus", FRAME, "json"), None);
        assert!(FrameTopic::new("/can0/from_can_bus_fd", FD_FRAME, "cdr").unwrap().is_fd);
    }

    fn message(message: &impl serde::Serialize) -> Vec<u8> {
        [&[0, 1, 0, 0], CdrBytes::encode(message).unwrap().as_ref()].concat()
    }

    fn shown(topic: &FrameTopic, message: &[u8]) -> Result<String, BadLine> {
        let entry = topic.entry(message, WallStamp::from_nanos(9_000))?.unwrap();
        Ok(crate::format::testing::shown(&entry, 0))
    }

    #[test]
    fn frames_remote_requests_and_errors_are_read_with_their_stamp() {
        let topic = FrameTopic::new("/a/from_can_bus", FRAME, "cdr").unwrap();
        let header = Header { stamp: Time { sec: 1, nanosec: 2_000 }, frame_id: "can0".to_owned() };
        let frame = can_msgs::Frame {
            header,
            id: 0x123,
            is_rtr: false,
            is_extended: false,
            is_error: false,
            dlc: 2,
            data: [1, 2, 0, 0, 0, 0, 0, 0],
        };
        assert_eq!(shown(&topic, &message(&frame)).unwrap(), "1000002 a 123#0102");
        let extended = can_msgs::Frame { is_extended: true, ..frame.clone() };
        assert_eq!(shown(&topic, &message(&extended)).unwrap(), "1000002 a 00000123#0102");
        let remote = can_msgs::Frame { is_rtr: true, ..frame.clone() };
        assert_eq!(shown(&topic, &message(&remote)).unwrap(), "1000002 a Remote");
        let error = can_msgs::Frame { is_error: true, ..frame.clone() };
        assert!(shown(&topic, &message(&error)).unwrap().starts_with("1000002 a Error("));
        let without_stamp = can_msgs::Frame { header: Header::default(), ..frame.clone() };
        assert_eq!(shown(&topic, &message(&without_stamp)).unwrap(), "9 a 123#0102");
        let long = can_msgs::Frame { dlc: 9, ..frame.clone() };
        assert_eq!(shown(&topic, &message(&long)), Err(BadLine::BadLength));
        let no_id = can_msgs::Frame { id: 0x800, ..frame.clone() };
        assert_eq!(shown(&topic, &message(&no_id)), Err(BadLine::BadId));
        let whole = message(&frame);
        assert_eq!(shown(&topic, &whole[..whole.len() - 1]), Err(BadLine::BadData));
        assert_eq!(shown(&topic, &[]), Err(BadLine::NoFrame));
    }

    #[test]
    fn can_fd_is_read_with_its_length() {
        let topic = FrameTopic::new("/a/from_can_bus_fd", FD_FRAME, "cdr").unwrap();
        let header = Header { stamp: Time { sec: 1, nanosec: 0 }, ..Header::default() };
        let frame = FdFrame { header, id: 1, is_extended: true, is_error: false, len: 12, data: vec![7; 12] };
        assert_eq!(shown(&topic, &message(&frame)).unwrap(), "1000000 a 00000001##0070707070707070707070707");
        let short = FdFrame { len: 13, ..frame.clone() };
        assert_eq!(shown(&topic, &message(&short)), Err(BadLine::BadLength));
    }
}
