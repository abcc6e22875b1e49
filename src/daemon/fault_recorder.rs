//! The black box at work: keeps what happens, and writes a file around each change to ERROR.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io;
use std::path::PathBuf;

use tokio::task::spawn_blocking;

use crate::config::Settings;
use crate::core::can::input::CanInput;
use crate::core::can::link::LinkState;
use crate::core::diagnostics::Level;
use crate::core::gateway::black_box::{BlackBox, BlackBoxSettings, Recording};
use crate::core::gateway::event::Output;
use crate::core::time::{MonoTime, Now};
use crate::io::recorder::Recorder;
use crate::report::gateway::Changes;
use crate::report::view::time_text;

/// Most inputs in memory, about 10 MB.
const MAX_INPUTS: usize = 100_000;

/// A black box and where its recordings go.
pub(super) struct FaultRecorder {
    black_box: BlackBox,
    recorder: Recorder,
    changes: Changes,
    levels: BTreeMap<String, Level>,
}

impl FaultRecorder {
    /// A recorder into the configured folder, or into systemd's `STATE_DIRECTORY`; none without.
    pub(super) fn start(settings: &Settings, links: &[LinkState]) -> io::Result<Option<Self>> {
        let config = &settings.black_box;
        let Some(folder) =
            config.folder.clone().or_else(|| state_folder(std::env::var_os("STATE_DIRECTORY")))
        else {
            return Ok(None);
        };
        let unusable = |error: io::Error| {
            let text = format!("black box in {}: {error}; change [black_box] folder", folder.display());
            io::Error::new(error.kind(), text)
        };
        let recorder = Recorder::new(&folder, config.keep).map_err(unusable)?;
        let limits = BlackBoxSettings { before: config.before, after: config.after, most_inputs: MAX_INPUTS };
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
        Ok(Some(Self {
            black_box: BlackBox::new(limits, interfaces, links.to_vec()),
            recorder,
            changes: Changes::default(),
            levels: BTreeMap::new(),
        }))
    }

    /// Keeps an input at the time it is handled.
    pub(super) fn keep(&mut self, input: CanInput, at: Now) {
        self.black_box.keep(input, at);
    }

    /// Writes the recording whose time is over, if there is one.
    pub(super) fn save_if_over(&mut self, at: Now) {
        let line = |at: MonoTime, text: &str| format!("{} {text}", time_text(at));
        if let Some(recording) = self.black_box.take(at, line) {
            let recorder = self.recorder.clone();
            // Off the loop: a slow disk must not hold up frames.
            drop(spawn_blocking(move || save(&recorder, &recording)));
        }
    }

    /// Keeps what was decided.
    pub(super) fn decided(&mut self, output: &Output, at: Now) {
        let mut fault = false;
        if let Output::Diagnostics { diagnostics, .. } = output {
            for status in &diagnostics.statuses {
                let before = self.levels.insert(status.name.clone(), status.level);
                // What was never well has not changed.
                fault |= status.level == Level::Error && before.is_some_and(|before| before != Level::Error);
            }
        }
        for event in self.changes.of(output) {
            self.black_box.decided(event.to_string(), fault, at);
        }
    }
}

fn state_folder(variable: Option<OsString>) -> Option<PathBuf> {
    // A list separated by colons; ours has one entry.
    let first = variable?.to_str()?.split(':').next()?.to_owned();
    (!first.is_empty()).then(|| PathBuf::from(first).join("black-box"))
}

fn save(recorder: &Recorder, recording: &Recording) {
    let name =
        format!("{:010}.{:03}", recording.fault.wall.sec(), recording.fault.wall.nanosec() / 1_000_000);
    match recorder.save(&name, &recording.log, &recording.decisions) {
        Ok(path) => tracing::info!("black box written: {}", path.display()),
        Err(error) => tracing::error!("black box not written: {error}"),
    }
}
