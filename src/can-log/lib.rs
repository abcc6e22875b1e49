//! Reads recordings of CAN frames in the formats of other tools, plain or compressed, in bounded memory.
//!
//! [`Log`] recognises the format by the content of a file and reads it entry by entry: candump, Vector ASC
//! and BLF, PCAN TRC, MF4, MCAP and rosbag2, pcap, SavvyCAN and other CSV, and more ([`names`] lists them
//! all). Unreadable lines or objects are counted, with the place and reason of the first; if a file was cut
//! or is damaged, everything before that point is read. The time and memory spent on a hostile file are
//! limited by its size ([`file_budget`]).
//!
//! ```
//! use can_log::{EntryContent, Log};
//!
//! let text = "(1436509052.249713) can0 044#2A366C2B\n(1436509052.449847) can1 0F6#7ADF\nnot a frame\n";
//! let mut log = Log::new(Box::new(text.as_bytes()))?;
//! let mut frames = Vec::new();
//! while let Some(record) = log.next_record()? {
//!     if let EntryContent::Data(frame) = record.content {
//!         frames.push(format!("{} {frame}", log.interfaces()[record.interface.0]));
//!     }
//! }
//! assert_eq!(frames, ["can0 044#2A366C2B", "can1 0F6#7ADF"]);
//! assert_eq!(log.bad_lines(), 1);
//! # Ok::<(), std::io::Error>(())
//! ```
//!
//! ROS recordings may contain other messages besides frames: [`open_messages`] reads the messages of chosen
//! topics.
//!
//! It uses `gateway_base` for stamps, `can_signal` for frames, and `ros_messages` for frames within ROS
//! messages. A new format needs a file in `formats` and a line in its table.

mod bag_folder;
mod clock;
mod compression;
mod counted_source;
mod entry;
mod exact;
mod fields;
pub mod file_budget;
mod format;
mod formats;
mod lines;
mod little_endian;
mod log;
pub mod regular_file;
pub mod standard_input;

pub use bag_folder::{begins_like_a_bag, files as files_of_bag};
pub use entry::{BadLine, EntryContent, EntryInterface, LogEntry};
pub use format::NotRecording;
pub use formats::{
    Choose, LoggedMessage, Looks, MessageReader, RecordedTopic, TopicChoice, begins_like_binary, candump,
    known_magic, names, open_messages, received_frame,
};
pub use log::{Breakage, Crowd, InterfaceIndex, Log, LogRecord, is_breakage, is_without_frames, no_frame};
