//! The state of the process itself, in statuses and in snapshots.

use std::time::{Duration, Instant};

use super::outputs::Outputs;
use crate::config::Settings;
use crate::io::can::traffic::TrafficMeter;
use crate::io::process_log;
use crate::io::snapshots::places::absolute_text;
use crate::process_status::configuration::ConfigurationState;
use crate::process_status::log::LogState;
use crate::process_status::snapshot::{Build, ProcessSnapshot, Snapshot};
use gateway_base::diagnostics::{Diagnostics, Status};
use gateway_base::time::{Now, millis};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::Output;
use ros_transport::link::LostLines;

/// Interval at which the statuses of the process are checked.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// The part of the process's state that is not held elsewhere, and its statuses.
pub(super) struct ProcessState {
    /// The part of a snapshot that changes only with the configuration.
    pub(super) known: ProcessSnapshot,
    started: Instant,
    traffic: Vec<TrafficMeter>,
    /// Node name for statuses of the process; `None` leaves them out.
    node: Option<String>,
    /// Statuses of the process as last published.
    published: Vec<Status>,
    /// Time at which [`Self::changes`] checks the statuses again.
    pub(super) next_check: Instant,
}

impl ProcessState {
    /// Creates the state at the start, without statuses, and with a configuration that cannot be reloaded.
    pub(super) fn new(settings: &Settings) -> Self {
        let known = ProcessSnapshot {
            pid: std::process::id(),
            build: build(),
            configuration_file: Some(absolute_text(&settings.file)),
            ..ProcessSnapshot::default()
        };
        let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.as_str());
        let mut state = Self {
            known,
            started: Instant::now(),
            traffic: interfaces.map(TrafficMeter::new).collect(),
            node: None,
            published: Vec::new(),
            next_check: Instant::now(),
        };
        state.reconfigure(settings);
        state
    }

    /// Starts the statuses of the process, and the state of a configuration that can be reloaded.
    pub(super) fn observe(&mut self, settings: &Settings, is_reloadable: bool) {
        self.node = Some(settings.gateway.node.clone());
        self.known.configuration = is_reloadable.then(|| ConfigurationState::new(settings.in_effect.clone()));
    }

    /// Applies the settings of another configuration.
    pub(super) fn reconfigure(&mut self, settings: &Settings) {
        self.known.vehicle.clone_from(&settings.vehicle);
        self.known.provenance = settings.provenance.summary();
    }

    /// Adds the statuses of the process if the output is a refresh of all statuses.
    pub(super) fn complete(&mut self, output: &mut Output, outputs: &Outputs) {
        if let Output::Diagnostics { diagnostics, .. } = output
            && diagnostics.refresh
        {
            self.published = self.statuses(outputs, process_log::state());
            diagnostics.statuses.extend(self.published.iter().cloned());
        }
    }

    /// Returns the statuses of the process whose level or message has changed since they were last published;
    /// `None` without a change, and until [`Self::next_check`].
    pub(super) fn changes(&mut self, outputs: &Outputs, now: Now) -> Option<Output> {
        let at = Instant::now();
        if at < self.next_check {
            return None;
        }
        self.next_check = at + CHECK_INTERVAL;
        // Called in every case, since it also writes due log lines.
        let statuses = self.statuses(outputs, process_log::state());
        let changed = changed(&statuses, &self.published);
        self.published = statuses;
        let node = self.node.clone().filter(|_| !changed.is_empty())?;
        let diagnostics = Diagnostics { node, statuses: changed, refresh: false };
        Some(Output::Diagnostics { diagnostics, stamp: now.wall })
    }

    fn statuses(&self, outputs: &Outputs, log: Option<LogState>) -> Vec<Status> {
        if self.node.is_none() {
            return Vec::new();
        }
        let recorders = &outputs.recorders;
        let network = outputs.publisher.network();
        let elsewhere = network.as_ref().map_or_else(LostLines::default, |network| network.lost_lines);
        let statuses = [
            recorders.black_box.as_ref().map(|black_box| black_box.recorder.state().status()),
            self.known.configuration.as_ref().map(ConfigurationState::status),
            recorders.mcap.as_ref().map(|mcap| mcap.state().status()),
            log.map(|log| log.with(elsewhere).status()),
            network.map(|network| network.status()),
        ];
        statuses.into_iter().flatten().collect()
    }

    /// Returns the current state of the gateway and of the process.
    pub(super) fn snapshot(&mut self, gateway: &Gateway, now: Now, outputs: &Outputs) -> Snapshot {
        let log = process_log::state();
        let statuses = self.statuses(outputs, log.clone());
        let process = ProcessSnapshot {
            uptime_ms: millis(self.started.elapsed()),
            black_box: outputs.recorders.black_box.as_ref().map(|black_box| black_box.recorder.state()),
            next_change: outputs.recorders.history.next_number,
            log,
            ros: outputs.publisher.snapshot(),
            ..self.known.clone()
        };
        let mut snapshot = gateway.snapshot(now).with_process(process, &statuses);
        for (bus, meter) in snapshot.buses.iter_mut().zip(&mut self.traffic) {
            bus.traffic = meter.measure();
        }
        snapshot
    }
}

/// Returns the statuses whose level or message differs from the last published one.
fn changed(statuses: &[Status], published: &[Status]) -> Vec<Status> {
    let is_known = |status: &Status| {
        let is_same = |known: &Status| {
            (&known.task, known.level, &known.message) == (&status.task, status.level, &status.message)
        };
        published.iter().any(is_same)
    };
    statuses.iter().filter(|status| !is_known(status)).cloned().collect()
}

/// Returns the build information of this binary.
pub fn build() -> Build {
    Build {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: option_env!("SIGNAL_GATEWAY_COMMIT").map(str::to_owned),
        distribution: ros_transport::IS_BUILT_IN.then(|| ros_transport::DISTRO.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process_status::catalogue::LOG;
    use gateway_base::diagnostics::Level;

    #[test]
    fn a_status_is_given_out_again_when_its_level_or_message_differs() {
        let status = |task: &str, level, message: &str, count: &str| {
            let values = vec![("count", count.to_owned())];
            Status { level, message: message.to_owned(), ..Status::new(&LOG, task, &[], values) }
        };
        let before = [status("log", Level::Ok, "a", "1"), status("ros", Level::Ok, "a", "1")];
        assert_eq!(changed(&before, &[]), before);
        assert_eq!(changed(&[status("log", Level::Ok, "a", "2")], &before), []);
        for now in [status("log", Level::Warn, "a", "1"), status("log", Level::Ok, "b", "1")] {
            assert_eq!(changed(&[now.clone(), before[1].clone()], &before), [now]);
        }
    }
}
