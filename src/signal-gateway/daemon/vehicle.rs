//! Runs a simulated vehicle in real time, with requests from a script and from lines.

use std::io;
use std::time::{Duration, Instant};

use tokio::sync::mpsc::UnboundedReceiver;
use tokio::time::sleep_until;

use super::error::DaemonError;
use super::receivers::Receivers;
use super::runtime;
use super::signals::StopSignals;
use crate::config::Settings;
use crate::io::can::transmit::Transmitter;
use crate::io::clock::Clock;
use crate::io::optional_future::or_never;
use can_signal::can::{BusIndex, CanInput};
use gateway_base::time::MonoTime;
use gateway_core::command::sender::SendFailure;
use vehicle_bringup::simulated_vehicle::plan::VehiclePlan;
use vehicle_bringup::simulated_vehicle::request::{self, SimulationRequest};
use vehicle_bringup::simulated_vehicle::{SimulatedVehicle, SimulationSettings, VehicleOutput};

/// Settings of a simulated run.
pub struct VehicleRun {
    /// Messages to send, and commands to follow.
    pub plan: VehiclePlan,
    /// Reaction, timeouts, flash rate and seed.
    pub simulation: SimulationSettings,
    /// Requests with their times since the start.
    pub script: Vec<(Duration, SimulationRequest)>,
    /// End since the start; `None` runs until a stop signal arrives.
    pub until: Option<Duration>,
    /// Lines with further requests.
    pub lines: Option<UnboundedReceiver<String>>,
}

/// An event of a run.
#[derive(Debug)]
pub enum RunEvent<'a> {
    /// The vehicle has an output; a frame has been sent.
    Output(&'a VehicleOutput),
    /// A frame could not be sent. Repeated failures are not reported.
    SendFailed(BusIndex, SendFailure),
    /// A line is not a request.
    InvalidRequest(&'a request::RequestError),
}

/// Runs a vehicle on the configured interfaces until a stop signal arrives, its end, or an error of `take`.
pub fn run_vehicle(
    settings: &Settings,
    run: VehicleRun,
    mut take: impl FnMut(RunEvent<'_>, MonoTime) -> io::Result<()>,
) -> Result<(), DaemonError> {
    runtime()?.block_on(async {
        let mut stop = StopSignals::listen()?;
        let (mut receivers, transmitters) = Receivers::start(settings, |bus| Some(run.plan.command_ids(bus)));
        let mut transmitters: Vec<_> = transmitters.into_iter().map(|transmitter| BusChannel { transmitter, is_refusing: false }).collect();
        // From now on frames can be sent if the link is up.
        receivers.first_links(transmitters.len()).await?;
        let clock = Clock::start();
        let mut vehicle = SimulatedVehicle::new(run.plan, run.simulation, MonoTime::ZERO);
        for (at, request) in run.script {
            vehicle.schedule(MonoTime::ZERO.after(at), request);
        }
        let end = run.until.map(|until| MonoTime::ZERO.after(until));
        let mut lines = run.lines;
        loop {
            let now = clock.now().mono;
            vehicle.settle(now);
            while let Some(output) = vehicle.poll_output() {
                match send(&mut transmitters, &output) {
                    Ok(()) => take(RunEvent::Output(&output), now)?,
                    Err(Some((bus, failure))) => take(RunEvent::SendFailed(bus, failure), now)?,
                    Err(None) => {}
                }
            }
            if end.is_some_and(|end| now >= end) {
                return Ok(());
            }
            let next = vehicle.next_deadline(now).into_iter().chain(end).min();
            let wake = next.map_or_else(|| Instant::now() + Duration::from_secs(1), |next| clock.instant(next));
            tokio::select! {
                () = stop.requested() => return Ok(()),
                batch = receivers.recv() => {
                    let now = clock.now().mono;
                    for input in batch? {
                        if let CanInput::Frame { bus, frame, .. } = input {
                            vehicle.frame_arrived(bus, &frame, now);
                        }
                    }
                }
                line = or_never(lines.as_mut().map(UnboundedReceiver::recv)) => match line.as_deref().map(request::line) {
                    None => lines = None,
                    Some(Ok(None)) => {}
                    Some(Ok(Some((None, request)))) => vehicle.request(request, clock.now().mono),
                    Some(Ok(Some((Some(at), request)))) => vehicle.schedule(MonoTime::ZERO.after(at), request),
                    Some(Err(error)) => take(RunEvent::InvalidRequest(&error), clock.now().mono)?,
                },
                () = sleep_until(wake.into()) => {}
            }
        }
    })
}

struct BusChannel {
    transmitter: Transmitter,
    is_refusing: bool,
}

/// Sends a frame. A repeated failure is returned without its reason.
fn send(
    transmitters: &mut [BusChannel],
    output: &VehicleOutput,
) -> Result<(), Option<(BusIndex, SendFailure)>> {
    let (bus, channel) = match output {
        VehicleOutput::Frame { bus, .. } | VehicleOutput::Error { bus, .. } => {
            (*bus, transmitters.get_mut(usize::from(bus.0)).ok_or(None)?)
        }
        VehicleOutput::Happened(_) => return Ok(()),
    };
    let sent = match output {
        VehicleOutput::Frame { frame, .. } => channel.transmitter.send(frame),
        VehicleOutput::Error { error, .. } => channel.transmitter.send_error(*error),
        VehicleOutput::Happened(_) => Ok(()),
    };
    let was_refusing = std::mem::replace(&mut channel.is_refusing, sent.is_err());
    sent.map_err(|why| (!was_refusing).then_some((bus, why)))
}
