//! Records inputs and outputs of a run as MCAP, as they happen.

use std::time::Duration;

use super::publisher::{subscriptions, topics};
use crate::config::Settings;
use crate::io::mcap::bag::FileLimits;
use crate::io::mcap::encoder::{Encoder, RecordedBus};
use crate::io::mcap::recorder::{McapRecorder, RecorderLimits};

pub(super) const STOP_PATIENCE: Duration = Duration::from_secs(2);

/// Starts the requested recording; returns `None` without one, or without a thread.
pub(super) fn start(settings: &Settings) -> Option<McapRecorder> {
    let config = &settings.mcap;
    let folder = config.folder.as_ref()?;
    let file = FileLimits { bytes: config.file_bytes, duration: config.file_duration };
    McapRecorder::start(folder, RecorderLimits { file, total_bytes: config.total_bytes }, encoder(settings))
        .inspect_err(|error| tracing::warn!("no recording: {error}"))
        .ok()
}

/// Creates an encoder for the published topics, the frames of all buses and the subscribed topics.
pub fn encoder(settings: &Settings) -> Encoder {
    let buses = settings.gateway.buses.iter();
    let buses = buses.map(|bus| RecordedBus { name: bus.name.clone(), interface: bus.interface.clone() });
    Encoder::new(
        &topics(settings),
        settings.ros.durability,
        &settings.hardware_id,
        &buses.collect::<Vec<_>>(),
        &subscriptions(settings),
    )
}
