//! Passes the outputs to their destinations, and performs the process's duties to its supervisor.

use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::error::DaemonError;
use super::fault_recorder::{self, FaultRecorder};
use super::history::HistoryKeeper;
use super::pages::ReportPage;
use super::publisher::Publisher;
use super::recording;
use super::signals::{ReloadSignal, StopSignals};
use super::status_changes::changed;
use super::watchdog::Watchdog;
use super::watching::{Process, Watching};
use crate::config::Settings;
use crate::io::can::transmit::Transmitter;
use crate::io::clock::Clock;
use crate::io::mcap::recorder::McapRecorder;
use crate::io::precise_timer::PreciseTimer;
use crate::io::process_log;
use crate::io::ros::inbox::{Arrival, Inbox};
use crate::io::systemd::Supervisor;
use crate::process_status::configuration::ConfigurationState;
use crate::process_status::snapshot::ProcessSnapshot;
use crate::report::decision::reasons;
use crate::report::gateway::JsonTimeline;
use crate::report::view::View;
use can_signal::can::{CanInput, LinkState, LogNote};
use gateway_base::diagnostics::{Diagnostics, Status};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::allow_list::CommandFrame;
use gateway_core::command::input::CommandInput;
use gateway_core::command::output::CommandOutput;
use gateway_core::command::sender::SendFailure;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::call::GatewayCall;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::live::{Edges, GivenOut, Live};
use ros_transport::link::LostLines;
use traffic_lights::output::TrafficLightOutput;
use turn_signal::output::TurnSignalOutput;

/// Interval at which the statuses of the process are checked.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);

/// The destinations of the outputs, and the signals of the process.
pub(super) struct GatewayIo {
    publisher: Publisher,
    pub(super) view: View,
    json: Option<JsonTimeline>,
    pub(super) supervisor: Supervisor,
    pub(super) watchdog: Watchdog,
    pub(super) stop: StopSignals,
    pub(super) reload: ReloadSignal,
    pub(super) watching: Watching,
    timer: PreciseTimer,
    history: HistoryKeeper,
    faults: Option<FaultRecorder>,
    mcap: Option<McapRecorder>,
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
        report: Option<ReportPage>,
    ) -> Result<Self, DaemonError> {
        // Signals first: from here on a stop is an orderly one.
        let (stop, reload) = (StopSignals::of_service()?, ReloadSignal::listen()?);
        let supervisor = Supervisor::from_env()?;
        let watchdog = Watchdog::new(supervisor.watchdog_period());
        let publisher = Publisher::start(settings)?;
        let history = HistoryKeeper::new();
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
            watching: Watching::start(settings, history.shared(), report),
            history,
            timer: PreciseTimer::new()?,
            faults: None,
            mcap: recording::start(settings),
            configuration: None,
            node: None,
            given_out: Vec::new(),
            next_look: Instant::now(),
            failure: None,
        })
    }

    /// Starts the black box if a folder is configured.
    pub(super) fn open_black_box(&mut self, settings: &Settings, links: &[LinkState]) {
        self.faults = FaultRecorder::start(settings, links);
    }

    /// Keeps an input that is handled next for the black box, and writes the recording whose window has
    /// ended.
    pub(super) fn keep(&mut self, input: Option<CanInput>, at: Now) {
        let Some(faults) = &mut self.faults else { return };
        if let Some(input) = input {
            faults.keep(input, at);
        }
        if let Some((start, name)) = faults.save_if_over(at) {
            self.history.recorded(start, at, name);
        }
    }

    /// Starts the statuses of the process, and the state of the configuration.
    pub(super) fn observe_process(&mut self, settings: &Settings) {
        self.node = Some(settings.gateway.node.clone());
        self.configuration =
            self.reload.is_taken().then(|| ConfigurationState::new(settings.in_effect.clone()));
    }

    /// Keeps the history over the end of the process, where there is a folder for black-box files.
    pub(super) fn keep_history(&mut self, settings: &Settings) {
        let folder = fault_recorder::folder(settings);
        self.view.earlier(&self.history.begin(folder.as_deref()));
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

    /// Handles what is due and passes on its outputs; frames to the vehicle go to `transmitters`, one for
    /// each bus. Errors of destinations are kept for [`Self::take_failure`].
    pub(super) fn emit_live(&mut self, live: &mut Live, transmitters: &[Transmitter], clock: &Clock) {
        let read = clock.now();
        self.record_call(GatewayCall::Look, read);
        live.look(read, &mut LiveEdges { io: self, transmitters, clock });
        self.announce_process(read);
    }

    /// Passes a batch of a bus to the gateway, and records it.
    pub(super) fn receive(&self, live: &mut Live, batch: Vec<CanInput>, read: Now) {
        self.record_call(GatewayCall::Read(u32::try_from(batch.len()).unwrap_or(u32::MAX)), read);
        live.take(batch, read, |input, at| {
            let Input::Can(input) = input else { return };
            match LogNote::of(input) {
                Some((bus, note)) => self.record_call(GatewayCall::Note(bus, note), read),
                None => self.record_received(*input, at.wall),
            }
        });
    }

    /// Passes a sample of ROS 2 to the gateway, and records it.
    pub(super) fn receive_sample(&self, live: &mut Live, arrival: Arrival, read: Now) {
        self.record_call(GatewayCall::of_sample(&arrival.input), read);
        self.record_sample(&arrival, read.wall);
        live.take([arrival.input], read, |_, _| ());
    }

    /// Records a call of the gateway, which is made next.
    pub(super) fn record_call(&self, call: GatewayCall, at: Now) {
        if let Some(mcap) = &self.mcap {
            mcap.call(call, at);
        }
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
        let output = Output::Diagnostics { diagnostics, stamp: now.wall };
        self.hand_on(&GivenOut { output, at: now, lag: Duration::ZERO, is_held: false });
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
            let (at, lag, is_held) = (now, Duration::ZERO, false);
            self.emit_output(GivenOut { output, at, lag, is_held });
        }
        self.keep(None, now);
        self.refresh(now);
        self.take_failure().map_or(Ok(()), Err)
    }

    /// Passes on an output.
    fn emit_output(&mut self, mut given_out: GivenOut) {
        let GivenOut { output, at, .. } = &mut given_out;
        if let Output::TrafficLights(TrafficLightOutput::CommandRefused(error)) = &output {
            tracing::warn!("a command was refused: {error}");
        }
        // Before the statuses of the process are added, which a replay does not have.
        if let Some(faults) = &mut self.faults {
            faults.decided(output, *at);
        }
        if let Output::Diagnostics { diagnostics, .. } = output
            && diagnostics.refresh
        {
            self.given_out = self.process_statuses();
            diagnostics.statuses.extend(self.given_out.iter().cloned());
        }
        self.hand_on(&given_out);
    }

    /// Publishes and shows an output.
    fn hand_on(&mut self, given_out: &GivenOut) {
        let GivenOut { output, at, lag, is_held } = given_out;
        self.history.given_out(output, at.mono);
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
        if !is_held {
            self.publish(output, Now { wall: at.wall.after(*lag), ..*at });
        }
        let shown = match &self.json {
            Some(json) => json.line(output, at.mono).map_or(Ok(()), |line| write_line(&line)),
            None => self.view.show(output, at.mono),
        };
        self.note(shown.map_err(DaemonError::from));
    }

    /// Publishes an output and records it. Frames to the vehicle are recorded when they are sent.
    fn publish(&mut self, output: &Output, at: Now) {
        self.publisher.send(output);
        if !matches!(output, Output::Command(CommandOutput::Transmit { .. })) {
            self.record_given_out(output, at);
        }
    }

    fn record_given_out(&mut self, output: &Output, at: Now) {
        if let Some(faults) = &mut self.faults {
            faults.given_out(output, at);
        }
        if let Some(mcap) = &self.mcap {
            mcap.given_out(output.clone(), at.wall);
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

    /// Takes a snapshot of the gateway if a story, a view or a client needs one.
    pub(super) fn show(&mut self, gateway: &Gateway, now: Now) {
        let checked = self.view.check(now.mono, || gateway.snapshot(now));
        self.note(checked.map_err(DaemonError::from));
        let is_view_due = self.view.is_due();
        if is_view_due || self.watching.is_due(&self.supervisor) {
            let process = self.process();
            let snapshot = self.watching.show(gateway, now, &mut self.supervisor, process);
            if is_view_due {
                self.view.snapshot(now.mono, snapshot);
            }
        }
    }

    fn process(&self) -> Process {
        let snapshot = ProcessSnapshot {
            configuration: self.configuration.clone(),
            black_box: self.faults.as_ref().map(FaultRecorder::state),
            next_change: self.history.next_number(),
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
        if let Some((start, name)) = faults.as_mut().and_then(FaultRecorder::save_open) {
            let end = Now { mono: MonoTime::MAX, ..start };
            self.history.recorded(start, end, name);
        }
        self.history.end();
        self.publisher.stop();
        faults.iter_mut().for_each(FaultRecorder::stop);
        self.mcap.iter().for_each(|mcap| mcap.stop(recording::STOP_PATIENCE));
        self.history.wait();
        tracing::info!("stopped");
    }
}

/// The edges of a live gateway.
struct LiveEdges<'a> {
    io: &'a mut GatewayIo,
    transmitters: &'a [Transmitter],
    clock: &'a Clock,
}

impl Edges for LiveEdges<'_> {
    fn handles(&mut self, input: &Input, at: Now) {
        if let Input::Can(CanInput::Frame { bus, frame, .. }) = input {
            tracing::debug!("received on bus {}: {frame}", bus.0);
        }
        let input = if let Input::Can(input) = input { Some(*input) } else { None };
        self.io.keep(input, at);
    }

    fn transmit(&mut self, output: &Output, frame: &CommandFrame, read: Now) -> (CommandInput, Now) {
        let result = transmit(frame, self.transmitters);
        if let CommandInput::Sent(_) = &result {
            self.io.record_given_out(output, read);
        }
        let known = self.clock.now();
        if let Some(call) = GatewayCall::of_result(&result) {
            self.io.record_call(call, known);
        }
        (result, known)
    }

    fn give_out(&mut self, given_out: GivenOut) {
        self.io.emit_output(given_out);
    }

    fn publish_late(&mut self, output: &Output, read: Now) {
        self.io.publish(output, read);
    }

    fn end_moment(&mut self, at: Now) {
        self.io.refresh(at);
    }
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
