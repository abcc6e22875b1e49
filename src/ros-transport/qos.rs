//! Quality of service of topics.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The durability of a topic: whether a late reader receives the current sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Durability {
    /// A late reader receives the sample. A writer serves transient-local and volatile readers; a reader
    /// accepts only transient-local writers.
    #[default]
    TransientLocal,
    /// A late reader waits for the next message. A writer does not serve transient-local readers; a reader
    /// accepts any writer.
    Volatile,
}

/// The reliability that a reader requests: whether lost samples are resent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Reliability {
    /// Reliable writers resend lost samples; best-effort writers are not read.
    #[default]
    Reliable,
    /// Lost samples are not resent, and every writer is read. Samples of more than one datagram are easily
    /// lost.
    BestEffort,
}

/// The delivery of a topic's messages to readers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Delivery {
    /// The newest message counts, changes are rare, and it can be withdrawn.
    Report,
    /// The newest message counts, and there are many per second.
    Stream,
    /// The newest message counts for the present readers, and is never resent: it was true only at its stamp.
    Live,
    /// Each message counts for the present readers, and is not resent.
    Once,
    /// Each message counts, also for readers that join within [`LOG_LIFESPAN`].
    Log,
}

impl Delivery {
    /// Returns true if each message counts, not only the newest of its topic.
    pub fn counts_each(self) -> bool {
        matches!(self, Self::Once | Self::Log)
    }

    /// Returns true if the newest message is published again when its publisher is replaced.
    pub fn is_kept(self) -> bool {
        matches!(self, Self::Report | Self::Stream)
    }
}

/// Age from which a log line is no longer sent to a late reader, as in `rclcpp`.
pub const LOG_LIFESPAN: Duration = Duration::from_secs(10);
/// Number of log samples that the writer keeps.
pub const LOG_DEPTH: i32 = 100;
