//! Requests for which the vehicle has no signal. They are performed as far as possible and reported.

use super::encoder::{SignalEncoder, Subject};
use super::plan::PlannedMessage;
use super::request::{Fault, Request};

/// Text for the signal that a request lacks; `None` when it lacks none.
pub(super) fn missing_signal(request: &Request, messages: &[PlannedMessage]) -> Option<&'static str> {
    let mut encoders = messages.iter().flat_map(|message| &message.pages).flat_map(|page| &page.encoders);
    let (is_there, text) = match request {
        Request::Mode(_) => (
            encoders.any(|encoder| encoder.encodes_any(|subject| matches!(subject, Subject::Mode))),
            "no signal reports the control mode",
        ),
        Request::Fault(Fault::Report(quality)) => {
            (encoders.any(|encoder| encoder.can_have(*quality)), "no signal of the lights has such a value")
        }
        Request::Fault(Fault::Bulb(_)) => {
            (encoders.any(shows_bulbs), "no signal shows lamps or their faults")
        }
        Request::Fault(
            Fault::Drop(_, Some(name))
            | Fault::Corrupt(_, Some(name))
            | Fault::FreezeCounter(Some(name))
            | Fault::FreezeContents(Some(name)),
        ) => (
            messages.iter().any(|message| message.name == *name),
            "the vehicle sends no message with that name",
        ),
        Request::Fault(Fault::FreezeCounter(None)) => {
            (messages.iter().any(|message| message.protection.is_some()), "no message has a counter")
        }
        Request::Stalk(_)
        | Request::Tap(_)
        | Request::Hazard(_)
        | Request::Clear
        | Request::Fault(
            Fault::Drop(_, None)
            | Fault::Corrupt(_, None)
            | Fault::FreezeContents(None)
            | Fault::FalseReport(_)
            | Fault::IgnoreCommands
            | Fault::BusOff(_)
            | Fault::Silent,
        ) => return None,
    };
    (!is_there).then_some(text)
}

fn shows_bulbs(encoder: &SignalEncoder) -> bool {
    encoder.encodes_any(|subject| matches!(subject, Subject::Fault { .. } | Subject::Lamp { .. }))
}
