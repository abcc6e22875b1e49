//! The three parts of the process around a gateway, and the operations that need more than one of them.

use super::error::DaemonError;
use super::outputs::Outputs;
use super::pages::ReportPage;
use super::process_state::ProcessState;
use super::service::Service;
use super::signals::{ReloadSignal, StopSignals};
use super::watching::serve_clients;
use crate::config::Settings;
use crate::io::can::transmit::Transmitter;
use crate::io::clock::Clock;
use crate::io::ros::inbox::Arrival;
use crate::io::systemd::Supervisor;
use crate::report::view::View;
use can_signal::can::{CanInput, LogNote};
use gateway_base::time::Now;
use gateway_core::command::allow_list::CommandFrame;
use gateway_core::command::input::CommandInput;
use gateway_core::command::sender::SendFailure;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::call::GatewayCall;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::gateway::live::{Edges, GivenOut, Live};

/// The process around a gateway.
pub(super) struct GatewayIo {
    pub(super) outputs: Outputs,
    pub(super) service: Service,
    pub(super) process: ProcessState,
}

impl GatewayIo {
    pub(super) fn open(
        settings: &Settings,
        view: View,
        report: Option<ReportPage>,
    ) -> Result<Self, DaemonError> {
        // Signals first, so that every stop from here on is orderly.
        let (stop, reload) = (StopSignals::of_service()?, ReloadSignal::listen()?);
        let supervisor = Supervisor::from_env()?;
        let outputs = Outputs::open(settings, view)?;
        let clients = serve_clients(settings, outputs.recorders.history.shared.clone(), report);
        let service = Service::new(stop, reload, supervisor, clients);
        Ok(Self { outputs, service, process: ProcessState::new(settings) })
    }

    /// Handles an output of the gateway. Errors of destinations are stored, see [`Outputs::take_failure`].
    pub(super) fn handle(&mut self, mut given_out: GivenOut) {
        let GivenOut { output, at, .. } = &mut given_out;
        self.outputs.recorders.decided(output, *at);
        self.process.complete(output, &self.outputs);
        self.outputs.handle(&given_out);
    }

    /// Handles everything that is due, and the statuses of the process. Frames to the vehicle go to
    /// `transmitters`, one per bus.
    pub(super) fn look(&mut self, live: &mut Live, transmitters: &[Transmitter], clock: &Clock) {
        let read = clock.now();
        self.outputs.recorders.record(|mcap| mcap.call(GatewayCall::Look, read));
        live.look(read, &mut LiveEdges { io: self, transmitters, clock });
        if let Some(output) = self.process.changes(&self.outputs, read) {
            self.outputs.handle(&GivenOut::on_time(output, read));
        }
    }

    /// Passes a batch of a bus to the gateway, and records it.
    pub(super) fn receive(&self, live: &mut Live, batch: Vec<CanInput>, read: Now) {
        let recorders = &self.outputs.recorders;
        let size = u32::try_from(batch.len()).unwrap_or(u32::MAX);
        recorders.record(|mcap| mcap.call(GatewayCall::Read(size), read));
        live.take(batch, read, |input, at| {
            let Input::Can(input) = input else { return };
            recorders.record(|mcap| match LogNote::of(input) {
                Some((bus, note)) => mcap.call(GatewayCall::Note(bus, note), read),
                None => mcap.received(*input, at.wall),
            });
        });
    }

    /// Passes a sample of ROS 2 to the gateway, and records it.
    pub(super) fn receive_sample(&self, live: &mut Live, arrival: Arrival, read: Now) {
        self.outputs.recorders.record(|mcap| mcap.call(GatewayCall::of_sample(&arrival.input), read));
        self.outputs.recorders.sample(&arrival, read.wall);
        live.take([arrival.input], read, |_, _| ());
    }

    /// Handles all outputs of a moment, and fails with the first error of a destination.
    pub(super) fn handle_moment(
        &mut self,
        mut poll: impl FnMut() -> Option<Output>,
        now: Now,
    ) -> Result<(), DaemonError> {
        while let Some(output) = poll() {
            self.handle(GivenOut::on_time(output, now));
        }
        self.outputs.recorders.handled(None, now);
        self.outputs.end_moment(now.mono);
        self.outputs.take_failure().map_or(Ok(()), Err)
    }

    /// Announces that start-up or a reload is done.
    pub(super) fn ready(&mut self, gateway: &Gateway, now: Now) {
        self.service.ready(&self.process.snapshot(gateway, now, &self.outputs));
    }

    /// Takes a snapshot of the gateway if a story, a view or a client needs one.
    pub(super) fn show(&mut self, gateway: &Gateway, now: Now) {
        let checked = self.outputs.view.check(now.mono, || gateway.snapshot(now));
        self.outputs.note(checked);
        let is_view_due = self.outputs.view.is_due();
        if is_view_due || self.service.is_due() {
            let snapshot = self.process.snapshot(gateway, now, &self.outputs);
            self.service.show(&snapshot);
            if is_view_due {
                self.outputs.view.snapshot(now.mono, snapshot);
            }
        }
    }

    pub(super) fn close(self) {
        self.service.supervisor.stopping();
        self.outputs.close();
    }
}

/// Input and output of a live gateway.
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
        self.io.outputs.recorders.handled(input, at);
    }

    fn transmit(&mut self, output: &Output, frame: &CommandFrame, read: Now) -> (CommandInput, Now) {
        let result = transmit(frame, self.transmitters);
        let recorders = &mut self.io.outputs.recorders;
        if let CommandInput::Sent(_) = &result {
            recorders.published(output, read);
        }
        let known = self.clock.now();
        if let Some(call) = GatewayCall::of_result(&result) {
            recorders.record(|mcap| mcap.call(call, known));
        }
        (result, known)
    }

    fn give_out(&mut self, given_out: GivenOut) {
        self.io.handle(given_out);
    }

    fn publish_late(&mut self, output: &Output, read: Now) {
        self.io.outputs.publish(output, read);
    }

    fn end_moment(&mut self, at: Now) {
        self.io.outputs.end_moment(at.mono);
    }
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
