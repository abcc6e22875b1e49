//! Requests for which the vehicle has no signal. They are performed as far as possible and reported.

use super::encoder::ReportedSubject;
use super::measured::Measured;
use super::plan::PlannedMessage;
use super::request::{FrameFault, SimulatedFault, SimulationRequest};

/// Returns the text for the signal that a request lacks; `None` when it lacks none.
pub(super) fn missing_signal(
    request: &SimulationRequest,
    messages: &[PlannedMessage],
) -> Option<&'static str> {
    let encoders = messages.iter().flat_map(|message| &message.pages).flat_map(|page| &page.encoders);
    let reports = |is_wanted| encoders.clone().any(|encoder| encoder.encodes_any(is_wanted));
    let measures = |is_wanted| encoders.clone().any(|encoder| encoder.measures_any(is_wanted));
    let (is_there, text) = match request {
        SimulationRequest::Mode(_) => (
            reports(|subject| matches!(subject, ReportedSubject::Mode | ReportedSubject::OnIn(_))),
            "no signal reports the control mode",
        ),
        SimulationRequest::Gear(_) => {
            (reports(|subject| subject == ReportedSubject::Gear), "no signal reports the gear")
        }
        SimulationRequest::Speed { .. } | SimulationRequest::Brake => (
            measures(|measured| matches!(measured, Measured::Speed | Measured::Wheel(_))),
            "no signal reports the speed",
        ),
        SimulationRequest::Steer { .. } => (
            measures(|measured| {
                matches!(measured, Measured::SteeringWheel | Measured::FrontWheels | Measured::YawRate)
            }),
            "no signal reports the steering",
        ),
        SimulationRequest::Fault(SimulatedFault::Report(quality)) => (
            encoders.clone().any(|encoder| encoder.can_have(*quality)),
            "no signal of the lights has such a value",
        ),
        SimulationRequest::Fault(SimulatedFault::Bulb(_)) => (
            reports(|subject| {
                matches!(subject, ReportedSubject::Fault { .. } | ReportedSubject::Lamp { .. })
            }),
            "no signal shows lamps or their faults",
        ),
        SimulationRequest::Fault(SimulatedFault::Frames(_, Some(name))) => (
            messages.iter().any(|message| message.name == *name),
            "the vehicle sends no message with that name",
        ),
        SimulationRequest::Fault(SimulatedFault::Frames(FrameFault::FreezeCounter, None)) => {
            (messages.iter().any(|message| message.protection.is_some()), "no message has a counter")
        }
        SimulationRequest::Stalk(_)
        | SimulationRequest::Tap(_)
        | SimulationRequest::Hazard(_)
        | SimulationRequest::Door { .. }
        | SimulationRequest::Clear
        | SimulationRequest::Fault(_) => return None,
    };
    (!is_there).then_some(text)
}
