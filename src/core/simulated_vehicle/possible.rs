//! Requests that a vehicle has no signal for: they are carried out as far as possible, and those who
//! watch are told.

use super::plan::PlannedMessage;
use super::request::{Fate, Fault, Request};
use super::says::{Says, Speaker};

/// What is missing for a request, if anything is.
pub(super) fn missing(request: &Request, messages: &[PlannedMessage]) -> Option<&'static str> {
    let any = |of: &dyn Fn(&Speaker) -> bool| messages.iter().any(|message| message.has_speaker(of));
    let says = |of: &dyn Fn(&Says) -> bool| any(&|speaker| speaker.says_any(of));
    let (is_there, text) = match request {
        Request::Mode(_) => (says(&|says| matches!(says, Says::Mode(_))), "no signal tells the control mode"),
        Request::Fault(Fault::Report(fate)) => {
            (any(&|speaker| speaker.can_have(*fate)), "no signal of the lights has such a value")
        }
        Request::Fault(Fault::Bulb(_)) => (
            says(&|says| matches!(says, Says::Fault { .. } | Says::Lamp { .. })),
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
            | Fault::Lie(_)
            | Fault::Deaf
            | Fault::BusOff(_)
            | Fault::Silent,
        ) => return None,
    };
    (!is_there).then_some(text)
}

impl PlannedMessage {
    fn has_speaker(&self, of: &dyn Fn(&Speaker) -> bool) -> bool {
        self.pages.iter().flat_map(|page| &page.speakers).any(of)
    }
}

impl Speaker {
    /// Whether it tells the lights and has a value of that fate.
    fn can_have(&self, fate: Fate) -> bool {
        let about_lights = |says: &Says| match says {
            Says::Turn(_)
            | Says::Side { .. }
            | Says::Lamp { .. }
            | Says::Stalk(_)
            | Says::Hazard(_)
            | Says::Button(_) => true,
            Says::Fault { .. } | Says::Mode(_) | Says::Driver { .. } => false,
        };
        self.says_any(&|says| about_lights(says) && self.has_value_of(says, fate))
    }
}
