//! Passes the outputs to their destinations, and performs the process's duties to its supervisor.

use std::future::pending;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::time::{Interval, MissedTickBehavior, interval};

use super::error::DaemonError;
use super::fault_recorder::FaultRecorder;
use super::late_reports::LateReports;
use super::live::Live;
use super::publisher::Publisher;
use super::recording;
use super::signals::{ReloadSignal, StopSignals};
use super::watching::{Process, Watching};
use crate::config::Settings;
use crate::core::can::{CanInput, LinkState};
use crate::core::command::allow_list::CommandFrame;
use crate::core::command::input::CommandInput;
use crate::core::command::output::CommandOutput;
use crate::core::command::sender::SendFailure;
use crate::core::diagnostics::{Diagnostics, Status};
use crate::core::gateway::Gateway;
use crate::core::gateway::configuration::ConfigurationState;
use crate::core::gateway::event::{Input, Output};
use crate::core::gateway::process_status::LostLines;
use crate::core::gateway::snapshot::ProcessSnapshot;
use crate::core::time::{Now, WallStamp};
use crate::core::traffic_light::output::TrafficLightOutput;
use crate::core::turn_signal::output::TurnSignalOutput;
use crate::io::can::transmit::Transmitter;
use crate::io::clock::Clock;
use crate::io::mcap::recorder::McapRecorder;
use crate::io::precise_timer::PreciseTimer;
use crate::io::process_log;
use crate::io::ros::inbox::{Arrival, Inbox};
use crate::io::systemd::Supervisor;
use crate::report::decision::reasons;
use crate::report::gateway::JsonTimeline;
use crate::report::view::View;

/// Interval at which the statuses of the process are checked.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);

/// The destinations of the outputs, and the signals of the process.
pub(super) struct GatewayIo {
    publisher: Publisher,
    view: View,
    json: Option<JsonTimeline>,
    pub(super) supervisor: Supervisor,
    pub(super) watchdog: Watchdog,
    pub(super) stop: StopSignals,
    pub(super) reload: ReloadSignal,
    pub(super) watching: Watching,
    timer: PreciseTimer,
    faults: Option<FaultRecorder>,
    mcap: Option<McapRecorder>,
    late_reports: LateReports,
    /// `None` if the configuration cannot be reloaded.
    pub(super) configuration: Option<ConfigurationState>,
    /// Node name for statuses of the process; `None` leaves them out.
    node: Option<String>,
    /// Statuses of the process as they were last published.
    given_out: Vec<Status>,
    /// The latest time for the next call of [`emit_live`](Self::emit_live).
    pub(super) next_look: Instant,
    /// The first error of a destination that was not taken yet.
    failure: Option<DaemonError>,
}

impl GatewayIo {
    pub(super) fn open(
        settings: &Settings,
        view: View,
        json: Option<JsonTimeline>,
    ) -> Result<Self, DaemonError> {
        // Signals first: from here on a stop is an orderly one.
        let (stop, reload) = (StopSignals::of_service()?, ReloadSignal::listen()?);
        let supervisor = Supervisor::from_env()?;
        let watchdog = Watchdog::new(supervisor.watchdog_period());
        let publisher = Publisher::start(settings)?;
        let version = env!("SIGNAL_GATEWAY_VERSION");
        tracing::info!("{}: {}; signal-gateway {version}", settings.vehicle, publisher.graph());
        Ok(Self {
            publisher,
            view,
            json,
            supervisor,
            watchdog,
            stop,
            reload,
            watching: Watching::start(settings),
            timer: PreciseTimer::new()?,
            faults: None,
            mcap: recording::start(settings),
            late_reports: LateReports::default(),
            configuration: None,
            node: None,
            given_out: Vec::new(),
            next_look: Instant::now(),
            failure: None,
        })
    }

    /// Starts the black box if a folder is configured, the statuses of the process, and the state of the
    /// configuration.
    pub(super) fn observe_process(&mut self, settings: &Settings, links: &[LinkState]) {
        self.faults = FaultRecorder::start(settings, links);
        self.node = Some(settings.gateway.node.clone());
        self.configuration =
            self.reload.is_taken().then(|| ConfigurationState::new(settings.in_effect.clone()));
    }

    /// Ignores reload requests, since a recording is played with its first configuration.
    pub(super) fn keep_configuration(&mut self) {
        self.reload.refuse();
    }

    /// Applies the settings of another configuration that concern the process itself.
    pub(super) fn reconfigure(&mut self, settings: &Settings) {
        if let Some(faults) = &mut self.faults {
            faults.reconfigure(&settings.black_box);
        }
        self.watching.vehicle.clone_from(&settings.vehicle);
        self.watching.provenance = settings.provenance.summary();
        self.publisher.show_configuration(settings);
    }

    /// Returns the queue of inputs received over ROS 2; `None` without ROS 2.
    pub(super) fn inbox(&self) -> Option<Arc<Inbox>> {
        self.publisher.inbox()
    }

    /// Handles the steps that are due and passes on their outputs; frames to the vehicle go to `transmitters`, one
    /// for each bus. Errors of destinations are kept for [`Self::take_failure`].
    pub(super) fn emit_live(&mut self, live: &mut Live, transmitters: &[Transmitter], clock: &Clock) {
        let (read, started) = (clock.now(), live.now());
        // The outputs from before the first step belong to the start.
        self.emit_and_send(live, transmitters, clock, read, started);
        while let Some(at) = live.step(read.mono, |input, at| {
            let Input::Can(input) = input else { return };
            if let CanInput::Frame { bus, frame, .. } = input {
                tracing::debug!("received on bus {}: {frame}", bus.0);
            }
            if let Some(faults) = &mut self.faults {
                faults.keep(*input, at);
            }
            if let Some(mcap) = &self.mcap {
                mcap.received(*input, at.wall);
            }
        }) {
            if let Some(faults) = &mut self.faults {
                faults.save_if_over(at);
            }
            self.emit_and_send(live, transmitters, clock, read, at);
        }
        // All that was due at `read` is decided: what is held now is current.
        for output in self.late_reports.take() {
            self.publish(&output, read);
        }
        live.settle_commands(read);
        self.emit_and_send(live, transmitters, clock, read, read);
        self.announce_process(read);
    }

    /// Publishes the statuses of the process whose level or message has changed.
    fn announce_process(&mut self, now: Now) {
        let at = Instant::now();
        if at < self.next_look {
            return;
        }
        self.next_look = at + LOOK_INTERVAL;
        let statuses = self.process_statuses();
        let changed = changed(&statuses, &self.given_out);
        self.given_out = statuses;
        let Some(node) = self.node.clone().filter(|_| !changed.is_empty()) else { return };
        let diagnostics = Diagnostics { node, statuses: changed, refresh: false };
        self.hand_on(&Output::Diagnostics { diagnostics, stamp: now.wall }, now, Duration::ZERO);
    }

    /// Passes on the outputs of a decision at `now` that was made at `read`. The result of sending a frame to the
    /// vehicle goes back as an input.
    fn emit_and_send(
        &mut self,
        live: &mut Live,
        transmitters: &[Transmitter],
        clock: &Clock,
        read: Now,
        now: Now,
    ) {
        while let Some(output) = live.poll_output() {
            if let Output::Command(CommandOutput::Transmit { frame, .. }) = &output {
                let result = transmit(frame, transmitters);
                if let CommandInput::Sent(_) = &result {
                    self.record_given_out(&output, read);
                }
                live.take([result], clock.now());
            }
            self.emit_output(output, now, read.mono.since(now.mono));
        }
        self.refresh(now);
    }

    /// Returns the first error of a destination since the last call.
    pub(super) fn take_failure(&mut self) -> Option<DaemonError> {
        self.failure.take()
    }

    pub(super) fn emit(
        &mut self,
        mut poll: impl FnMut() -> Option<Output>,
        now: Now,
    ) -> Result<(), DaemonError> {
        while let Some(output) = poll() {
            self.emit_output(output, now, Duration::ZERO);
        }
        self.refresh(now);
        self.take_failure().map_or(Ok(()), Err)
    }

    /// Passes on an output that was decided at `now` and is published `lag` later.
    fn emit_output(&mut self, mut output: Output, now: Now, lag: Duration) {
        if let Output::TrafficLights(TrafficLightOutput::CommandRefused(error)) = &output {
            tracing::warn!("a command was refused: {error}");
        }
        // Before the statuses of the process are added, which a replay does not have.
        if let Some(faults) = &mut self.faults {
            faults.decided(&output, now);
        }
        if let Output::Diagnostics { diagnostics, .. } = &mut output
            && diagnostics.refresh
        {
            self.given_out = self.process_statuses();
            diagnostics.statuses.extend(self.given_out.iter().cloned());
        }
        self.hand_on(&output, now, lag);
    }

    /// Publishes and shows an output.
    fn hand_on(&mut self, output: &Output, now: Now, lag: Duration) {
        match output {
            Output::VehicleLights(report) => {
                tracing::debug!("{report:?}, {lag:?} after its decision was due");
            }
            // Formatting the reasons is costly, so it is skipped unless debug logging is enabled.
            Output::TurnSignal(TurnSignalOutput::Decision(decision))
                if tracing::enabled!(tracing::Level::DEBUG) =>
            {
                reasons(decision).for_each(|reason| tracing::debug!("decision {}: {reason}", decision.turn));
            }
            Output::VehicleStatus(_)
            | Output::TurnSignal(_)
            | Output::TrafficLights(_)
            | Output::Command(_)
            | Output::Diagnostics { .. } => {}
        }
        if !self.late_reports.holds(output, lag) {
            self.publish(output, Now { wall: now.wall.after(lag), ..now });
        }
        let shown = match &self.json {
            Some(json) => json.line(output, now.mono).map_or(Ok(()), |line| write_line(&line)),
            None => self.view.show(output, now.mono),
        };
        self.note(shown.map_err(DaemonError::from));
    }

    /// Publishes an output and records it. Frames to the vehicle are recorded when they are sent.
    fn publish(&mut self, output: &Output, now: Now) {
        self.publisher.send(output);
        if !matches!(output, Output::Command(CommandOutput::Transmit { .. })) {
            self.record_given_out(output, now);
        }
    }

    fn record_given_out(&mut self, output: &Output, now: Now) {
        if let Some(faults) = &mut self.faults {
            faults.given_out(output, now);
        }
        if let Some(mcap) = &self.mcap {
            mcap.given_out(output.clone(), now.wall);
        }
    }

    /// Records an input of a played recording, with the time at which it is handled.
    pub(super) fn record_received(&self, input: CanInput, at: WallStamp) {
        self.mcap.iter().for_each(|mcap| mcap.received(input, at));
    }

    /// Records a sample of ROS 2 that is handed to the gateway now.
    pub(super) fn record_sample(&self, arrival: &Arrival, at: WallStamp) {
        if let Some(mcap) = &self.mcap {
            mcap.sample(arrival.subscription, arrival.bytes.clone(), arrival.endian, at);
        }
    }

    fn note(&mut self, outcome: Result<(), DaemonError>) {
        if let (Err(error), None) = (outcome, &self.failure) {
            self.failure = Some(error);
        }
    }

    fn process_statuses(&self) -> Vec<Status> {
        // Called in any case, since it writes lines that are due.
        let log = process_log::state();
        if self.node.is_none() {
            return Vec::new();
        }
        let recordings = self.faults.as_ref().map(|faults| faults.state().status());
        let mcap = self.mcap.as_ref().map(|mcap| mcap.state().status());
        let network = self.publisher.network();
        let elsewhere = network.as_ref().map_or_else(LostLines::default, |network| network.lost_lines);
        let log = log.map(|log| log.with(elsewhere).status());
        let configuration = self.configuration.as_ref().map(ConfigurationState::status);
        recordings
            .into_iter()
            .chain(configuration)
            .chain(mcap)
            .chain(log)
            .chain(network.map(|network| network.status()))
            .collect()
    }

    pub(super) fn ready(&mut self, gateway: &Gateway, now: Now) {
        let process = self.process();
        self.watching.ready(gateway, now, &mut self.supervisor, process);
    }

    /// Takes a snapshot of the gateway if a view or a client needs one.
    pub(super) fn show(&mut self, gateway: &Gateway, now: Now) {
        let is_view_due = self.view.is_due();
        if is_view_due || self.watching.is_due(&self.supervisor) {
            let process = self.process();
            let snapshot = self.watching.show(gateway, now, &mut self.supervisor, process);
            if is_view_due {
                self.view.snapshot(snapshot);
            }
        }
    }

    fn process(&self) -> Process {
        let snapshot = ProcessSnapshot {
            configuration: self.configuration.clone(),
            black_box: self.faults.as_ref().map(FaultRecorder::state),
            log: process_log::state(),
            ros: self.publisher.snapshot(),
            ..ProcessSnapshot::default()
        };
        Process { snapshot, statuses: self.process_statuses() }
    }

    fn refresh(&mut self, now: Now) {
        if self.json.is_none() {
            let shown = self.view.end_moment(now.mono);
            self.note(shown.map_err(DaemonError::from));
        }
        if !self.publisher.is_healthy() {
            self.note(Err(DaemonError::RosEnded));
        }
    }

    /// Feeds the watchdog until `wake`, a stop signal, or an input. Fails if the timer does.
    pub(super) async fn wait_until(
        &mut self,
        wake: Instant,
        received: impl Future<Output = Arrival>,
    ) -> io::Result<Woken> {
        // Signals and timers are polled in between only, even when `wake` is past.
        tokio::task::yield_now().await;
        let mut received = pin!(received);
        loop {
            tokio::select! {
                biased;
                () = self.stop.requested() => return Ok(Woken::Stopped),
                () = self.watchdog.ping_due() => self.supervisor.feed_watchdog(),
                () = self.watching.due() => return Ok(Woken::Watched),
                arrival = &mut received => return Ok(Woken::Received(arrival)),
                due = self.timer.sleep_until(wake) => return due.map(|()| Woken::Due),
            }
        }
    }

    pub(super) fn close(mut self) {
        self.supervisor.stopping();
        let mut faults = self.faults;
        // The disk works while the network disconnects.
        faults.iter_mut().for_each(FaultRecorder::save_open);
        self.publisher.stop();
        faults.iter_mut().for_each(FaultRecorder::stop);
        self.mcap.iter().for_each(|mcap| mcap.stop(recording::STOP_PATIENCE));
        tracing::info!("stopped");
    }
}

/// Returns the statuses whose level or message differs from the last published one.
fn changed(statuses: &[Status], given_out: &[Status]) -> Vec<Status> {
    let is_known = |status: &Status| {
        let is_same = |known: &Status| {
            (&known.task, known.level, &known.message) == (&status.task, status.level, &status.message)
        };
        given_out.iter().any(is_same)
    };
    statuses.iter().filter(|status| !is_known(status)).cloned().collect()
}

/// Why a wait has ended.
pub(super) enum Woken {
    Stopped,
    Received(Arrival),
    /// A client needs a snapshot.
    Watched,
    Due,
}

/// Sends a frame to the vehicle, and returns the result for the command machine.
fn transmit(frame: &CommandFrame, transmitters: &[Transmitter]) -> CommandInput {
    let transmitter = transmitters.get(usize::from(frame.bus().0));
    let no_transmitter = Err(SendFailure::Refused(libc::ENODEV));
    match transmitter.map_or(no_transmitter, |transmitter| transmitter.send(frame.frame())) {
        Ok(()) => CommandInput::Sent(frame.clone()),
        Err(failure) => CommandInput::SendFailed { frame: frame.clone(), failure },
    }
}

#[allow(clippy::print_stdout)] // JSON lines are an output
fn write_line(line: &str) -> io::Result<()> {
    use io::Write;
    writeln!(io::stdout().lock(), "{line}")
}

/// The times at which the service manager expects a sign of life, in real time.
pub(super) struct Watchdog(Option<Interval>);

impl Watchdog {
    /// Creates the timer. Must be called within a runtime.
    fn new(period: Option<Duration>) -> Self {
        Self(period.filter(|period| !period.is_zero()).map(|period| {
            let mut ping_interval = interval(period);
            ping_interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
            ping_interval
        }))
    }

    pub(super) async fn ping_due(&mut self) {
        match &mut self.0 {
            Some(ping_interval) => drop(ping_interval.tick().await),
            None => pending().await,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::diagnostics::Level;

    #[test]
    fn a_status_is_given_out_again_when_its_level_or_message_differs() {
        let status = |task: &str, level, message: &str, count: &str| {
            Status::new(task, level, message.to_owned(), vec![("count", count.to_owned())])
        };
        let before = [status("log", Level::Ok, "a", "1"), status("ros", Level::Ok, "a", "1")];
        assert_eq!(changed(&before, &[]), before);
        assert_eq!(changed(&[status("log", Level::Ok, "a", "2")], &before), []);
        for now in [status("log", Level::Warn, "a", "1"), status("log", Level::Ok, "b", "1")] {
            assert_eq!(changed(&[now.clone(), before[1].clone()], &before), [now]);
        }
    }
}
