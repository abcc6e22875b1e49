//! Quality of service of topics.

use std::time::Duration;

use serde::{Deserialize, Serialize};

/// The durability of a topic: whether a late reader gets the current sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Durability {
    /// It gets the sample. A writer serves transient-local and volatile readers alike; a reader takes
    /// transient-local writers only.
    #[default]
    TransientLocal,
    /// It waits for the next message. A writer does not serve transient-local readers; a reader takes any
    /// writer.
    Volatile,
}

/// The reliability that a reader requests: whether lost samples are sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Reliability {
    /// Reliable writers send them again; others are not read at all.
    #[default]
    Reliable,
    /// Lost samples stay lost, and every writer is read. Samples of more than one datagram are easily lost.
    BestEffort,
}

/// The delivery of a topic's messages to readers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Delivery {
    /// The newest counts, changes are rare, and it can be withdrawn.
    Report,
    /// The newest counts, and there are many a second.
    Stream,
    /// The newest counts for the readers of that moment, and is never sent again: it was true at its stamp
    /// alone.
    Live,
    /// Each counts for the readers of that moment, and is not sent again.
    Once,
    /// Each counts, also for readers that come within [`LOG_LIFESPAN`].
    Log,
}

impl Delivery {
    /// Returns true if each message counts, and not only the newest of its topic.
    pub fn counts_each(self) -> bool {
        matches!(self, Self::Once | Self::Log)
    }

    /// Returns true if the newest message is published again when what published it is replaced.
    pub fn is_kept(self) -> bool {
        matches!(self, Self::Report | Self::Stream)
    }
}

/// Age from which a line of the log is not sent to a late reader any more, as `rclcpp` has it.
pub const LOG_LIFESPAN: Duration = Duration::from_secs(10);
/// Samples of the log that its writer keeps.
pub const LOG_DEPTH: i32 = 100;
