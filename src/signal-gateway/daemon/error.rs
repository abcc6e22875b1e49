//! Why the daemon stopped, or could not start.

use std::io;

use super::publisher::PublisherError;
use crate::io::can::sender_lock::SenderLockError;
use crate::report::story::WrongCaption;
use can_signal::can::{LinkState, link_text};

/// Why the daemon stopped, or could not start.
#[derive(Debug, thiserror::Error)]
pub enum DaemonError {
    /// The recording cannot be read.
    #[error("{file}: {error}")]
    Recording {
        /// Path of the recording.
        file: String,
        /// The error of the operating system.
        error: io::Error,
    },
    /// The configuration has `source = "recording"` but names none.
    #[error("the configuration names no recording; add [recording] file = \"….log\"")]
    NoRecording,
    /// The ROS 2 graph cannot be joined.
    #[error(transparent)]
    Publisher(#[from] PublisherError),
    /// The ROS 2 session has ended by itself.
    #[error("the ROS 2 session has ended unexpectedly")]
    RosEnded,
    /// Commands cannot be sent by this process.
    #[error(transparent)]
    SenderLock(#[from] SenderLockError),
    /// An interface cannot be used.
    #[error("{}", link_text(.interface, *.state))]
    NoLink {
        /// Name of the interface.
        interface: String,
        /// State of its link.
        state: LinkState,
    },
    /// A task that receives frames has ended by itself.
    #[error("the task that receives {interface} has ended unexpectedly{reason}")]
    ReceiverEnded {
        /// Name of the interface.
        interface: String,
        /// Message of the panic that ended the task, after `: `, or nothing.
        reason: String,
    },
    /// A caption of the demo does not hold.
    #[error(transparent)]
    WrongCaption(#[from] WrongCaption),
    /// An error of signals, the notification socket or standard output.
    #[error("{0}")]
    System(#[from] io::Error),
}
