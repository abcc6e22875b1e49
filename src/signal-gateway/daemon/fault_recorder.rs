//! Buffers inputs, decisions and outputs, and writes a black-box file around each change to ERROR.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use super::recording;
use crate::config::Settings;
use crate::config::gateway::BlackBoxConfig;
use crate::io::recorder::BlackBoxRecorder;
use crate::io::systemd::service_folder;
use crate::report::gateway::Changes;
use crate::report::view::time_text;
use can_signal::can::{CanInput, LinkState};
use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, Now};
use gateway_core::gateway::WALL_CLOCK_TASK;
use gateway_core::gateway::black_box::{BlackBox, BlackBoxSettings, Recording};
use gateway_core::gateway::event::Output;

/// Maximum number of inputs in memory, about 10 MB.
const MAX_INPUTS: usize = 100_000;

/// Maximum number of outputs in memory, about 10 MB.
const MAX_OUTPUTS: usize = 20_000;

const STOP_PATIENCE: Duration = Duration::from_secs(2);

/// A black box and the recorder that writes its files.
pub(super) struct FaultRecorder {
    pub(super) black_box: BlackBox,
    pub(super) recorder: BlackBoxRecorder,
    changes: Changes,
    levels: BTreeMap<String, Level>,
}

impl FaultRecorder {
    /// Starts a recorder in the configured folder, or in systemd's `STATE_DIRECTORY`; returns `None` without
    /// a folder or thread. A folder that cannot be written is reported in the log and in the diagnostics.
    pub(super) fn start(settings: &Settings, links: &[LinkState]) -> Option<Self> {
        let config = &settings.black_box;
        let folder = folder(settings)?;
        let recorder =
            BlackBoxRecorder::start(&folder, config.keep, time_and_text, recording::encoder(settings))
                .inspect_err(|error| tracing::warn!("no black box: {error}"))
                .ok()?;
        let limits = limits(config);
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
        Some(Self {
            black_box: BlackBox::new(limits, interfaces, links.to_vec()),
            recorder,
            changes: Changes::default(),
            levels: BTreeMap::new(),
        })
    }

    /// Applies the limits of another configuration with the same folder.
    pub(super) fn reconfigure(&mut self, config: &BlackBoxConfig) {
        self.black_box.reconfigure(limits(config));
        self.recorder.set_keep(config.keep);
    }

    /// Buffers an input that is handled next, and writes a recording if its window has ended. Returns the
    /// start of its frames and its name.
    pub(super) fn handled(&mut self, input: Option<CanInput>, at: Now) -> Option<(MonoTime, String)> {
        if let Some(input) = input {
            self.black_box.keep(input, at);
        }
        self.black_box.take(at).map(|recording| self.save(recording))
    }

    /// Writes the recording of an open window, if there is one; returns the start of its frames and its name.
    pub(super) fn save_open(&mut self) -> Option<(MonoTime, String)> {
        self.black_box.flush().map(|recording| self.save(recording))
    }

    fn save(&self, recording: Recording) -> (MonoTime, String) {
        let named = (recording.start().mono, self.recorder.name(&recording));
        self.recorder.save(recording);
        named
    }

    pub(super) fn stop(&mut self) {
        self.recorder.stop(STOP_PATIENCE);
    }

    /// Buffers the changes of an output, and opens a window if a status changes to ERROR. Omits changes that
    /// a replay cannot reproduce.
    pub(super) fn decided(&mut self, output: &Output, at: Now) {
        let mut fault = false;
        if let Output::Diagnostics { diagnostics, .. } = output {
            for status in &diagnostics.statuses {
                let before = self.levels.insert(status.task.clone(), status.level);
                // A new status has not changed.
                fault |= status.level == Level::Error && before.is_some_and(|before| before != Level::Error);
            }
        }
        let events = self.changes.of(output).into_iter();
        for event in events.filter(|event| event.change.subject != WALL_CLOCK_TASK) {
            self.black_box.decided(event.to_string(), fault, at);
        }
    }
}

fn limits(config: &BlackBoxConfig) -> BlackBoxSettings {
    let (before, after) = (config.before, config.after);
    BlackBoxSettings { before, after, most_inputs: MAX_INPUTS, most_outputs: MAX_OUTPUTS }
}

/// Returns the folder of the black-box files: as configured, or in systemd's `STATE_DIRECTORY`; `None`
/// without one.
pub(super) fn folder(settings: &Settings) -> Option<PathBuf> {
    let from_systemd = || Some(service_folder("STATE_DIRECTORY")?.join("black-box"));
    settings.black_box.folder.clone().or_else(from_systemd)
}

fn time_and_text(at: MonoTime, text: &str) -> String {
    format!("{} {text}", time_text(at))
}
