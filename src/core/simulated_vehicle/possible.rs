//! Requests that a vehicle has no signal for: they are carried out as far as possible, and those who
//! watch are told.

use super::encoder::{SignalContent, SignalEncoder};
use super::plan::PlannedMessage;
use super::request::{Fault, ReportQuality, Request};

/// What is missing for a request, if anything is.
pub(super) fn missing(request: &Request, messages: &[PlannedMessage]) -> Option<&'static str> {
    let any = |of: &dyn Fn(&SignalEncoder) -> bool| messages.iter().any(|message| message.has_encoder(of));
    let content = |of: &dyn Fn(&SignalContent) -> bool| any(&|encoder| encoder.encodes_any(of));
    let (is_there, text) = match request {
        Request::Mode(_) => (
            content(&|content| matches!(content, SignalContent::Mode(_))),
            "no signal tells the control mode",
        ),
        Request::Fault(Fault::Report(quality)) => {
            (any(&|encoder| encoder.can_have(*quality)), "no signal of the lights has such a value")
        }
        Request::Fault(Fault::Bulb(_)) => (
            content(&|content| matches!(content, SignalContent::Fault { .. } | SignalContent::Lamp { .. })),
            "no signal shows lamps or their faults",
        ),
        Request::Fault(
            Fault::Drop(_, Some(name))
            | Fault::Corrupt(_, Some(name))
            | Fault::FreezeCounter(Some(name))
            | Fault::FreezeContents(Some(name)),
        ) => (
            messages.iter().any(|message| message.name == *name),
            "the vehicle sends no message of that name",
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

impl PlannedMessage {
    fn has_encoder(&self, of: &dyn Fn(&SignalEncoder) -> bool) -> bool {
        self.pages.iter().flat_map(|page| &page.encoders).any(of)
    }
}

impl SignalEncoder {
    /// Whether it tells the lights and has a value of that fate.
    fn can_have(&self, quality: ReportQuality) -> bool {
        let about_lights = |content: &SignalContent| match content {
            SignalContent::Turn(_)
            | SignalContent::Side { .. }
            | SignalContent::Lamp { .. }
            | SignalContent::Stalk(_)
            | SignalContent::Hazard(_)
            | SignalContent::Button(_) => true,
            SignalContent::Fault { .. } | SignalContent::Mode(_) | SignalContent::Driver { .. } => false,
        };
        self.encodes_any(&|content| about_lights(content) && self.has_value_of(content, quality))
    }
}
