//! Why the daemon stopped, or could not start.

use std::io;

use super::publisher::PublisherError;
use crate::io::can::sender_lock::SenderLockError;
use crate::report::story::WrongCaption;
use can_signal::can::{LinkState, link_text};

/// Why the daemon stopped, or could not start.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // see the texts
pub enum DaemonError {
    #[error("{file}: {error}")]
    Recording { file: String, error: io::Error },
    #[error("the configuration names no recording; add [recording] file = \"….log\"")]
    NoRecording,
    #[error(transparent)]
    Publisher(#[from] PublisherError),
    #[error("the ROS 2 session has ended unexpectedly")]
    RosEnded,
    #[error(transparent)]
    SenderLock(#[from] SenderLockError),
    #[error("{}", link_text(.interface, *.state))]
    NoLink { interface: String, state: LinkState },
    #[error("the task that receives {interface} has ended unexpectedly{reason}")]
    ReceiverEnded {
        interface: String,
        /// Message of the panic that ended the task, after `: `, or nothing.
        reason: String,
    },
    #[error(transparent)]
    WrongCaption(#[from] WrongCaption),
    /// An error of signals, the notification socket or standard output.
    #[error("{0}")]
    System(#[from] io::Error),
}
