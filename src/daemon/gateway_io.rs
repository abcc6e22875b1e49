//! Destinations of the outputs, and the duties of a process to its supervisor.

use std::future::pending;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::{Interval, MissedTickBehavior, interval, sleep_until};

use super::DaemonError;
use super::fault_recorder::FaultRecorder;
use super::late_reports::LateReports;
use super::live::Live;
use super::publisher::Publisher;
use crate::config::Settings;
use crate::core::can::link::LinkState;
use crate::core::command::allow_list::CommandFrame;
use crate::core::command::input::CommandInput;
use crate::core::command::output::CommandOutput;
use crate::core::command::sender::SendFailure;
use crate::core::diagnostics::Status;
use crate::core::gateway::event::{Input, Output};
use crate::core::time::Now;
use crate::core::traffic_light::output::TrafficLightOutput;
use crate::io::can::transmit::Transmitter;
use crate::io::clock::Clock;
use crate::io::process_log;
use crate::io::ros::inbox::Inbox;
use crate::io::systemd::Supervisor;
use crate::report::gateway::JsonTimeline;
use crate::report::view::View;

/// The destinations of the outputs, and the request to stop.
pub(super) struct GatewayIo {
    publisher: Publisher,
    view: View,
    json: Option<JsonTimeline>,
    pub(super) supervisor: Supervisor,
    pub(super) watchdog: Watchdog,
    pub(super) stop: StopSignals,
    faults: Option<FaultRecorder>,
    late_reports: LateReports,
    /// The node's name for statuses of the process itself; `None` leaves them out.
    node: Option<String>,
}

impl GatewayIo {
    pub(super) fn open(
        settings: &Settings,
        view: View,
        json: Option<JsonTimeline>,
    ) -> Result<Self, DaemonError> {
        // Signals first: from here on a stop is an orderly one.
        let stop = StopSignals::listen()?;
        let supervisor = Supervisor::from_env()?;
        let watchdog = Watchdog::new(supervisor.watchdog_period());
        let publisher = Publisher::start(settings)?;
        tracing::info!("{}: {}", settings.vehicle, publisher.graph());
        Ok(Self {
            publisher,
            view,
            json,
            supervisor,
            watchdog,
            stop,
            faults: None,
            late_reports: LateReports::default(),
            node: None,
        })
    }

    /// From now on keeps a black box, if the configuration names a folder, and adds the statuses of the process itself to
    /// the diagnostics.
    pub(super) fn observe_process(&mut self, settings: &Settings, links: &[LinkState]) {
        self.faults = FaultRecorder::start(settings, links);
        self.node = Some(settings.gateway.node.clone());
    }

    /// The queue of inputs received over ROS 2; `None` without ROS.
    pub(super) fn inbox(&self) -> Option<Arc<Inbox>> {
        self.publisher.inbox()
    }

    /// Takes the steps that are due and hands on what they give, frames to the vehicle over `transmitters`, one
    /// for each bus.
    pub(super) fn emit_live(
        &mut self,
        live: &mut Live,
        transmitters: &[Transmitter],
        clock: &Clock,
    ) -> Result<(), DaemonError> {
        let (read, started) = (clock.now(), live.now());
        // The outputs from before the first step belong to the start.
        self.emit_and_send(live, transmitters, clock, read, started)?;
        while let Some(at) = live.step(read.mono, |input, at| {
            if let (Some(faults), Input::Can(input)) = (&mut self.faults, input) {
                faults.keep(*input, at);
            }
        }) {
            if let Some(faults) = &mut self.faults {
                faults.save_if_over(at);
            }
            self.emit_and_send(live, transmitters, clock, read, at)?;
        }
        // All that was due at `read` is decided: what is held now is current.
        for output in self.late_reports.take() {
            self.publisher.send(&Output::VehicleLights(output));
        }
        live.settle_commands(read);
        self.emit_and_send(live, transmitters, clock, read, read)
    }

    /// Hands on all outputs of a decision at `now` that was made at `read`. Whether a frame to the vehicle was sent goes
    /// back as an input.
    fn emit_and_send(
        &mut self,
        live: &mut Live,
        transmitters: &[Transmitter],
        clock: &Clock,
        read: Now,
        now: Now,
    ) -> Result<(), DaemonError> {
        while let Some(output) = live.poll_output() {
            if let Output::Command(CommandOutput::Transmit { frame, .. }) = &output {
                let result = transmit(frame, transmitters);
                live.take([result], clock.now());
            }
            self.emit_output(output, now, read.mono.since(now.mono))?;
        }
        self.refresh(now)
    }

    pub(super) fn emit(
        &mut self,
        mut poll: impl FnMut() -> Option<Output>,
        now: Now,
    ) -> Result<(), DaemonError> {
        while let Some(output) = poll() {
            self.emit_output(output, now, Duration::ZERO)?;
        }
        self.refresh(now)
    }

    /// Hands on an output that was decided at `now`, and is given out `lag` later.
    fn emit_output(&mut self, mut output: Output, now: Now, lag: Duration) -> Result<(), DaemonError> {
        if let Output::TrafficLights(TrafficLightOutput::CommandRefused(error)) = &output {
            tracing::warn!("a command was refused: {error}");
        }
        // Before the statuses of the process, which a replay of the recording has not.
        if let Some(faults) = &mut self.faults {
            faults.decided(&output, now);
        }
        if let Output::Diagnostics { diagnostics, .. } = &mut output
            && diagnostics.refresh
        {
            diagnostics.statuses.extend(self.process_statuses());
        }
        let output = &output;
        if !self.late_reports.holds(output, lag) {
            self.publisher.send(output);
        }
        match &self.json {
            Some(json) => {
                if let Some(line) = json.line(output, now.mono) {
                    write_line(&line)?;
                }
            }
            None => self.view.show(output, now.mono)?,
        }
        Ok(())
    }

    fn process_statuses(&self) -> Vec<Status> {
        // Asked for in any case, since it writes what is due.
        let log = process_log::state();
        let Some(node) = &self.node else { return Vec::new() };
        let recordings = self.faults.as_ref().map(|faults| faults.status(node));
        let network = self.publisher.network().map(|network| network.status(node));
        recordings.into_iter().chain(log.map(|log| log.status(node))).chain(network).collect()
    }

    fn refresh(&mut self, now: Now) -> Result<(), DaemonError> {
        if self.json.is_none() {
            self.view.refresh(now.mono, || self.publisher.describe())?;
        }
        if !self.publisher.is_healthy() {
            return Err(DaemonError::RosEnded);
        }
        Ok(())
    }

    /// Sleeps, feeding the watchdog; true when a stop was requested meanwhile, or before.
    pub(super) async fn stopped_before(&mut self, wake: Instant) -> bool {
        // Signals and timers are polled in between only, even when `wake` is past.
        tokio::task::yield_now().await;
        loop {
            tokio::select! {
                biased;
                () = self.stop.requested() => return true,
                () = self.watchdog.ping_due() => self.supervisor.feed_watchdog(),
                () = sleep_until(wake.into()) => return false,
            }
        }
    }

    pub(super) fn close(mut self) {
        self.supervisor.stopping();
        let mut faults = self.faults;
        // The disk works while the network says goodbye.
        faults.iter_mut().for_each(FaultRecorder::save_open);
        self.publisher.stop();
        faults.iter_mut().for_each(FaultRecorder::stop);
        tracing::info!("stopped");
    }
}

/// Sends a frame to the vehicle; gives the result for the command machine.
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

/// The times at which the service manager expects a sign of life from the loop. In real time, which that of a
/// recording is not.
pub(super) struct Watchdog(Option<Interval>);

impl Watchdog {
    /// Must be called within the runtime.
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

/// SIGTERM and SIGINT, which request an orderly stop.
pub(super) struct StopSignals {
    terminate: Signal,
    interrupt: Signal,
}

impl StopSignals {
    pub(super) fn listen() -> io::Result<Self> {
        Ok(Self { terminate: signal(SignalKind::terminate())?, interrupt: signal(SignalKind::interrupt())? })
    }

    pub(super) async fn requested(&mut self) {
        tokio::select! {
            _ = self.terminate.recv() => {}
            _ = self.interrupt.recv() => {}
        }
    }
}
