//! Reads and decodes the samples of ROS 2 topics in a recording: MCAP or sqlite3 files of `rosbag2`, as a
//! file or as the folder of a bag. The samples are inputs of the gateway and, in its own recordings, its
//! calls.

use std::collections::VecDeque;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use can_log::file_budget::{ENTRY_WORK, FileBudget};
use can_log::{
    Choose, EntryContent, MessageReader, RecordedTopic, begins_like_a_bag, files_of_bag, is_breakage,
    open_messages, received_frame,
};

use super::ros::messages::timed_call;
use super::ros::reading::read;
use super::ros::topics::SubscriptionKind;
use can_signal::can::{BusIndex, CanInput};
use gateway_base::time::WallStamp;
use gateway_core::command::origin::{SampleId, WriterId};
use gateway_core::gateway::call::{GatewayCall, TimedCall};
use gateway_core::gateway::event::Input;
use ros_messages::autoware_vehicle_msgs::TurnIndicatorsReport;
use ros_messages::cdr::{CdrBytes, Endian, Unreadable, encapsulated, read_message};
use ros_messages::ros2_socketcan_msgs::FdFrame;
use ros_messages::signal_gateway_msgs::GatewayCall as CallMessage;
use ros_messages::{TypeName, can_msgs};

/// Reads the samples of a recording in the order of the file.
pub struct SampleLog {
    reader: Box<dyn MessageReader<usize>>,
    choose: Choose<usize>,
    /// Budget of all files together.
    budget: FileBudget,
    topics: Vec<SampleTopic>,
    /// The remaining files of a bag.
    rest: VecDeque<PathBuf>,
    /// Identity of the next sample, given by the call before it.
    next_id: Option<SampleId>,
    losses: u64,
    first_loss: Option<String>,
    is_ended: bool,
}

/// The purpose of a topic's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleKind {
    /// Inputs of the gateway.
    Input(SubscriptionKind),
    /// `TurnIndicatorsReport`: the turn signals of the vehicle.
    TurnReport,
    /// Frames received on a bus.
    Frames {
        /// Bus that received the frames.
        bus: BusIndex,
        /// True for CAN FD frames.
        is_fd: bool,
    },
    /// Calls of the gateway.
    Calls,
}

impl SampleKind {
    fn type_name(self) -> TypeName {
        match self {
            Self::Input(kind) => kind.row().type_name,
            Self::TurnReport => TurnIndicatorsReport::TYPE_NAME,
            Self::Frames { is_fd: true, .. } => FdFrame::TYPE_NAME,
            Self::Frames { is_fd: false, .. } => can_msgs::Frame::TYPE_NAME,
            Self::Calls => CallMessage::TYPE_NAME,
        }
    }
}

/// A topic, with its counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SampleTopic {
    /// Absolute name.
    pub name: String,
    /// The purpose of its samples.
    pub kind: SampleKind,
    /// Number of decoded samples.
    pub received: u64,
    /// Number of samples that could not be decoded.
    pub undecodable: u64,
    /// Reason why the first of them could not be decoded.
    pub reason: Option<Unreadable>,
}

/// The content of a sample.
#[derive(Debug, Clone, PartialEq)]
pub enum SampleContent {
    /// An input of the gateway.
    Input(Input),
    /// The number in a `TurnIndicatorsReport`, as published.
    TurnReport(u8),
    /// A call of the gateway.
    Call(TimedCall),
}

/// A sample with its topic.
#[derive(Debug, Clone, PartialEq)]
pub struct LoggedSample {
    /// Position of its topic in [`SampleLog::topics`].
    pub topic: usize,
    /// Time at which the recorder received the sample.
    pub logged: WallStamp,
    /// The sample.
    pub content: SampleContent,
    /// The original bytes of an [`Input`](SampleKind::Input), without the encapsulation header; empty for
    /// other kinds.
    pub bytes: CdrBytes,
    /// Byte order of `bytes`.
    pub endian: Endian,
}

impl SampleLog {
    /// Returns true if a path is a recording that may contain samples: a folder, or a file with suitable
    /// first bytes. Fails if a file cannot be read.
    pub fn is_for(path: &Path) -> io::Result<bool> {
        Ok(path.is_dir() || path.is_file() && begins_like_a_bag(path)?)
    }

    /// Opens a file, or all files of a bag's folder, for the samples of these topics. All readers of one
    /// recording share a `budget`. Fails if a file cannot be read, or is of another kind.
    pub fn open(path: &Path, topics: Vec<(String, SampleKind)>, budget: FileBudget) -> io::Result<Self> {
        let mut rest =
            VecDeque::from(if path.is_dir() { files_of_bag(path)? } else { vec![path.to_owned()] });
        let first = rest.pop_front().ok_or(io::ErrorKind::IsADirectory)?;
        let named = |(name, kind): &(String, SampleKind)| (name.clone(), kind.type_name());
        let names: Vec<(String, TypeName)> = topics.iter().map(named).collect();
        let choose: Choose<usize> = Arc::new(move |topic: &RecordedTopic<'_>| {
            let is_topic =
                |(name, type_name): &(String, TypeName)| name == topic.name && *type_name == topic.type_name;
            names.iter().position(is_topic).filter(|_| topic.encoding == "cdr")
        });
        let topic = |(name, kind)| SampleTopic { name, kind, received: 0, undecodable: 0, reason: None };
        Ok(Self {
            reader: open_messages(&first, &choose, &budget)?,
            choose,
            budget,
            topics: topics.into_iter().map(topic).collect(),
            rest,
            next_id: None,
            losses: 0,
            first_loss: None,
            is_ended: false,
        })
    }

    /// Returns the next sample that can be decoded. Reading of a truncated or damaged file ends at the
    /// damage, which [`Self::losses`] reports, and continues with the next file of the bag. Fails if a file
    /// cannot be read.
    pub fn next_sample(&mut self) -> io::Result<Option<LoggedSample>> {
        while !self.is_ended {
            match self.budget.spend(ENTRY_WORK).and_then(|()| self.reader.advance()) {
                Ok(Some(Ok(()))) => {
                    if let Some(sample) = self.sample() {
                        return Ok(Some(sample));
                    }
                }
                Ok(Some(Err(reason))) => self.lose(reason.to_string()),
                Ok(None) => self.open_next()?,
                Err(error) if is_breakage(&error) => {
                    self.lose(error.to_string());
                    self.open_next()?;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }

    /// Returns the topics in their original order.
    pub fn topics(&self) -> &[SampleTopic] {
        &self.topics
    }

    /// Returns the number of places where the recording could not be read, and the reason at the first place.
    pub fn losses(&self) -> (u64, Option<&str>) {
        (self.losses, self.first_loss.as_deref())
    }

    /// Returns the other topics in the last file, as the end of a sentence.
    pub fn other_topics(&self) -> String {
        self.reader.choice().others()
    }

    fn lose(&mut self, reason: String) {
        self.losses += 1;
        self.first_loss.get_or_insert(reason);
    }

    fn open_next(&mut self) -> io::Result<()> {
        while let Some(next) = self.rest.pop_front() {
            match open_messages(&next, &self.choose, &self.budget) {
                Ok(reader) => {
                    self.reader = reader;
                    return Ok(());
                }
                Err(error) if is_breakage(&error) => self.lose(error.to_string()),
                Err(error) => return Err(error),
            }
        }
        self.is_ended = true;
        Ok(())
    }

    /// Decodes the last message; returns `None` and counts it if it cannot be decoded.
    fn sample(&mut self) -> Option<LoggedSample> {
        let message = self.reader.message()?;
        let (index, logged) = (*message.topic, message.logged);
        let topic = self.topics.get_mut(index)?;
        let decoded = encapsulated(message.bytes)
            .ok_or_else(|| Unreadable::Layout("it is not encapsulated as plain CDR".to_owned()))
            .and_then(|(endian, bytes)| {
                let content = match topic.kind {
                    SampleKind::Input(kind) => {
                        let id = self.next_id.take().unwrap_or_else(|| next_of_unknown(topic.received));
                        SampleContent::Input(read(kind, id, bytes, endian)?)
                    }
                    SampleKind::TurnReport => {
                        SampleContent::TurnReport(read_message::<TurnIndicatorsReport>(bytes, endian)?.report)
                    }
                    SampleKind::Frames { bus, is_fd } => {
                        SampleContent::Input(received(message.bytes, bus, is_fd, logged)?.into())
                    }
                    SampleKind::Calls => {
                        let call = timed_call(&read_message(bytes, endian)?);
                        let layout =
                            || Unreadable::Layout("expected a call as this version records it".to_owned());
                        SampleContent::Call(call.ok_or_else(layout)?)
                    }
                };
                let is_input = matches!(topic.kind, SampleKind::Input(_));
                let bytes = CdrBytes::from(if is_input { bytes.to_vec() } else { Vec::new() });
                Ok(LoggedSample { topic: index, logged, content, bytes, endian })
            });
        match decoded {
            Ok(sample) => {
                topic.received += 1;
                if let SampleContent::Call(TimedCall { call: GatewayCall::Sample(id), .. }) = sample.content {
                    self.next_id = Some(id);
                }
                Some(sample)
            }
            Err(reason) => {
                topic.undecodable += 1;
                topic.reason.get_or_insert(reason);
                None
            }
        }
    }
}

/// Returns the identity of a sample whose writer is not recorded: the samples of a topic are numbered in file
/// order.
fn next_of_unknown(received: u64) -> SampleId {
    SampleId { writer: WriterId::default(), sequence: i64::try_from(received + 1).unwrap_or(i64::MAX) }
}

/// Converts a frame to the input of a bus.
fn received(message: &[u8], bus: BusIndex, is_fd: bool, logged: WallStamp) -> Result<CanInput, Unreadable> {
    let received = received_frame(message, is_fd, logged);
    let (stamp, content) = received.map_err(|reason| Unreadable::Layout(reason.to_string()))?;
    match content {
        EntryContent::Data(frame) => Ok(CanInput::Frame { bus, frame, stamp }),
        EntryContent::Error(error) => Ok(CanInput::ErrorFrame { bus, error }),
        EntryContent::Note(_) | EntryContent::Remote => {
            Err(Unreadable::Layout("it is a remote frame".to_owned()))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::io::mcap::encoder::Encoder;
    use crate::io::mcap::file::McapFile;
    use crate::io::ros::topics::{Durability, Subscription, Topics};
    use ros_messages::cdr::{CdrBytes, Endian};
    use turn_signal::light_command::{EnumOrUnknown, TurnCommand};
    use turn_signal::planner_input::PlannerInput;

    const TURN: &str = "/planning/turn_indicators_cmd";
    const HAZARD: &str = "/planning/hazard_lights_cmd";

    fn own(turn: TurnCommand) -> SampleContent {
        SampleContent::Input(Input::Planner(PlannerInput::OwnTurnCommand(EnumOrUnknown::Known(turn))))
    }

    /// Writes a file as the gateway records it: a turn command in each byte order, a truncated one, and a
    /// hazard command.
    fn write(path: &Path) {
        let kinds = [(TURN, SubscriptionKind::OwnTurnCommand), (HAZARD, SubscriptionKind::OwnHazardCommand)];
        let subscriptions = kinds.map(|(name, kind)| Subscription::new(name, kind));
        let encoder = Encoder::new(&Topics::default(), Durability::Volatile, "car", &[], &subscriptions);
        let mut file = McapFile::create(path, false).unwrap();
        let samples: [(usize, Endian, &[u8]); 4] = [
            (0, Endian::Little, &[1, 0, 0, 0, 0, 0, 0, 0, 2]),
            (0, Endian::Big, &[0, 0, 0, 1, 0, 0, 0, 0, 3]),
            (0, Endian::Little, &[1, 0, 0, 0]),
            (1, Endian::Little, &[1, 0, 0, 0, 0, 0, 0, 0, 2]),
        ];
        for (second, (subscription, endian, bytes)) in (1..).zip(samples) {
            let at = WallStamp::from_nanos(second * 1_000_000_000);
            let message = encoder.sample(subscription, CdrBytes::from(bytes.to_vec()), endian, at).unwrap();
            file.add(&message, encoder.channels()).unwrap();
        }
        file.finish().unwrap();
    }

    fn read_all(path: &Path) -> (Vec<LoggedSample>, SampleLog) {
        let topics = vec![(TURN.to_owned(), SampleKind::Input(SubscriptionKind::OwnTurnCommand))];
        let mut log = SampleLog::open(path, topics, FileBudget::default()).unwrap();
        let mut samples = Vec::new();
        while let Some(sample) = log.next_sample().unwrap() {
            samples.push(sample);
        }
        (samples, log)
    }

    fn expected() -> [(usize, WallStamp, SampleContent, &'static [u8], Endian); 2] {
        let little: &[u8] = &[1, 0, 0, 0, 0, 0, 0, 0, 2];
        let big: &[u8] = &[0, 0, 0, 1, 0, 0, 0, 0, 3];
        let at = |second: i64| WallStamp::from_nanos(second * 1_000_000_000);
        [
            (0, at(1), own(TurnCommand::Left), little, Endian::Little),
            (0, at(2), own(TurnCommand::Right), big, Endian::Big),
        ]
    }

    fn are_expected(samples: &[LoggedSample]) -> bool {
        let parts = |sample: &LoggedSample| {
            (
                sample.topic,
                sample.logged,
                sample.content.clone(),
                sample.bytes.as_ref().to_vec(),
                sample.endian,
            )
        };
        let expected = expected()
            .map(|(topic, at, content, bytes, endian)| (topic, at, content, bytes.to_vec(), endian));
        samples.iter().map(parts).collect::<Vec<_>>() == expected
    }

    #[test]
    fn what_was_received_is_read_as_it_was_and_what_cannot_be_decoded_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive_0.mcap");
        write(&path);
        let (samples, log) = read_all(&path);
        assert!(are_expected(&samples), "{samples:?}");
        let topic = &log.topics()[0];
        assert_eq!((topic.received, topic.undecodable), (2, 1));
        assert!(matches!(topic.reason, Some(Unreadable::Layout(_))), "{:?}", topic.reason);
        assert_eq!(log.other_topics(), format!("it has {HAZARD}"));
        assert_eq!(log.losses(), (0, None));
    }

    #[test]
    fn a_cut_file_of_a_bag_gives_what_it_holds_and_the_next_one_follows() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["drive_0.mcap", "drive_1.mcap"] {
            write(&folder.path().join(name));
        }
        let first = folder.path().join("drive_0.mcap");
        let bytes = fs::read(&first).unwrap();
        fs::write(&first, &bytes[..bytes.len() / 2]).unwrap();
        fs::write(folder.path().join("drive_2.mcap"), &bytes[..10]).unwrap();
        let (samples, log) = read_all(folder.path());
        assert!(are_expected(&samples[samples.len() - 2..]), "{samples:?}");
        assert_eq!(log.losses().0, 2);
    }

    #[test]
    fn a_file_without_messages_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("drive.log");
        fs::write(&path, "(1.0) can0 123#00\n").unwrap();
        let error =
            SampleLog::open(&path, Vec::new(), FileBudget::default()).map(|_| ()).unwrap_err().to_string();
        assert!(error.starts_with("the recording holds no messages of ROS 2; give an MCAP file"), "{error}");
        assert!(
            SampleLog::open(folder.path(), Vec::new(), FileBudget::default()).is_err(),
            "a folder without a bag"
        );
    }
}
