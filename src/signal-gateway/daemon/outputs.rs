//! Passes outputs to their destinations: ROS 2, the view, and the recorders.

use std::time::Duration;

use super::error::DaemonError;
use super::fault_recorder::{self, FaultRecorder};
use super::history::HistoryKeeper;
use super::publisher::Publisher;
use super::recording;
use crate::config::Settings;
use crate::io::mcap::recorder::McapRecorder;
use crate::io::ros::inbox::Arrival;
use crate::report::decision::reasons;
use crate::report::view::View;
use can_signal::can::CanInput;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::command::output::CommandOutput;
use gateway_core::gateway::event::Output;
use gateway_core::gateway::live::GivenOut;
use traffic_lights::output::TrafficLightOutput;
use turn_signal::output::TurnSignalOutput;

/// The destinations of outputs. Their first error is stored until [`Self::take_failure`] returns it.
pub(super) struct Outputs {
    pub(super) publisher: Publisher,
    pub(super) view: View,
    pub(super) recorders: Recorders,
    /// The first error that has not been returned yet.
    failure: Option<DaemonError>,
}

impl Outputs {
    /// Joins ROS 2 and starts the MCAP recording.
    pub(super) fn open(settings: &Settings, view: View) -> Result<Self, DaemonError> {
        let publisher = Publisher::start(settings)?;
        let version = env!("SIGNAL_GATEWAY_VERSION");
        tracing::info!("{}: {}; signal-gateway {version}", settings.vehicle, publisher.graph());
        let recorders =
            Recorders { history: HistoryKeeper::new(), black_box: None, mcap: recording::start(settings) };
        Ok(Self { publisher, view, recorders, failure: None })
    }

    /// Continues the history of the previous process, if there is a folder for black-box files.
    pub(super) fn restore_history(&mut self, settings: &Settings) {
        let folder = fault_recorder::folder(settings);
        self.view.earlier(&self.recorders.history.begin(folder.as_deref()));
    }

    /// Applies the settings of another configuration.
    pub(super) fn reconfigure(&mut self, settings: &Settings) {
        if let Some(black_box) = &mut self.recorders.black_box {
            black_box.reconfigure(&settings.black_box);
        }
        self.publisher.show_configuration(settings);
    }

    /// Records, publishes and shows an output.
    pub(super) fn handle(&mut self, given_out: &GivenOut) {
        let GivenOut { output, at, lag, is_held } = given_out;
        self.recorders.history.given_out(output, at.mono);
        log(output, *lag);
        if !is_held {
            self.publish(output, Now { wall: at.wall.after(*lag), ..*at });
        }
        let shown = self.view.show(output, at.mono);
        self.note(shown);
    }

    /// Publishes an output and records it. Frames to the vehicle are recorded when they are sent.
    pub(super) fn publish(&mut self, output: &Output, at: Now) {
        self.publisher.send(output);
        if !matches!(output, Output::Command(CommandOutput::Transmit { .. })) {
            self.recorders.published(output, at);
        }
    }

    /// Signals that all outputs of a time have been handled.
    pub(super) fn end_moment(&mut self, at: MonoTime) {
        let shown = self.view.end_moment(at);
        self.note(shown);
        if !self.publisher.is_healthy() {
            self.note(Err(DaemonError::RosEnded));
        }
    }

    /// Stores the error of a destination.
    pub(super) fn note(&mut self, outcome: Result<(), impl Into<DaemonError>>) {
        if let (Err(error), None) = (outcome, &self.failure) {
            self.failure = Some(error.into());
        }
    }

    /// Returns the first error of a destination since the last call.
    pub(super) fn take_failure(&mut self) -> Option<DaemonError> {
        self.failure.take()
    }

    /// Leaves ROS 2 while remaining data is written to the disk, and stops the recorders.
    pub(super) fn close(mut self) {
        self.recorders.end();
        self.publisher.stop();
        self.recorders.stop();
        tracing::info!("stopped");
    }
}

/// Records inputs and outputs: in the history, in black-box files and in the MCAP recording.
pub(super) struct Recorders {
    pub(super) history: HistoryKeeper,
    pub(super) black_box: Option<FaultRecorder>,
    pub(super) mcap: Option<McapRecorder>,
}

impl Recorders {
    /// Passes an input that is handled next to the black box, and writes a recording if its window has ended.
    pub(super) fn handled(&mut self, input: Option<CanInput>, at: Now) {
        let Some(black_box) = &mut self.black_box else { return };
        if let Some((start, name)) = black_box.handled(input, at) {
            self.history.recorded(start..=at.mono, name);
        }
    }

    /// Passes a decision of the gateway to the black box, without the statuses of the process, which a replay
    /// does not have.
    pub(super) fn decided(&mut self, output: &Output, at: Now) {
        if let Some(black_box) = &mut self.black_box {
            black_box.decided(output, at);
        }
    }

    /// Records an output that is published or sent at this time.
    pub(super) fn published(&mut self, output: &Output, at: Now) {
        if let Some(black_box) = &mut self.black_box {
            black_box.black_box.given_out(output.clone(), at);
        }
        self.record(|mcap| mcap.given_out(output.clone(), at.wall));
    }

    /// Calls `record` with the MCAP recording, if there is one.
    pub(super) fn record(&self, record: impl FnOnce(&McapRecorder)) {
        if let Some(mcap) = &self.mcap {
            record(mcap);
        }
    }

    /// Records a ROS 2 sample that is passed to the gateway now.
    pub(super) fn sample(&self, arrival: &Arrival, at: WallStamp) {
        self.record(|mcap| mcap.sample(arrival.subscription, arrival.bytes.clone(), arrival.endian, at));
    }

    /// Starts writing the remaining data while other parts of the process end. [`Self::stop`] waits for it.
    pub(super) fn end(&mut self) {
        if let Some((start, name)) = self.black_box.as_mut().and_then(FaultRecorder::save_open) {
            self.history.recorded(start..=MonoTime::MAX, name);
        }
        self.history.end();
    }

    /// Waits until everything is written, at most a few seconds.
    pub(super) fn stop(self) {
        if let Some(mut black_box) = self.black_box {
            black_box.stop();
        }
        if let Some(mcap) = self.mcap {
            mcap.stop(recording::STOP_PATIENCE);
        }
        self.history.wait();
    }
}

fn log(output: &Output, lag: Duration) {
    match output {
        Output::TrafficLights(TrafficLightOutput::CommandRefused(error)) => {
            tracing::warn!("a command was refused: {error}");
        }
        Output::VehicleLights(report) => tracing::debug!("{report:?}, {lag:?} after its decision was due"),
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
}
