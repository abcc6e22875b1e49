//! `[command]` of a profile: what may be sent to the vehicle, and how it says who drives.

mod control;
mod message;

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::binder::{Binder, split_bus};
use crate::core::command::allow_list::AllowList;
use crate::core::command::message::CommandMessage;
use crate::core::command::settings::CommandBinding;
use crate::core::validation::table::SignalTable;
use crate::core::vehicle_lights::binding::HazardBinding;
use control::{ControlModeFile, DriverFile, control_mode, driver_sign};
use message::{CommandMessageFile, command_message};

/// `[command]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CommandProfileFile {
    /// The messages the gateway sends.
    #[serde(default)]
    pub message: Vec<Spanned<CommandMessageFile>>,
    /// The signal that tells the control mode.
    pub control_mode: Option<Spanned<ControlModeFile>>,
    /// Signals that tell that the driver has taken over.
    #[serde(default)]
    pub driver: Vec<DriverFile>,
}

/// What the section comes to, still without received messages and signals; `None` when a problem was
/// noted.
pub(super) fn command(
    binder: &mut Binder<'_>,
    file: Option<&Spanned<CommandProfileFile>>,
    hazard: Option<&HazardBinding>,
) -> Option<CommandBinding> {
    let Some(file) = file else { return Some(CommandBinding::default()) };
    let (span, file) = (file.span(), file.get_ref());
    let before = binder.checker.problems.len();
    let mut allowed = AllowList::default();
    let compile = |file: &Spanned<CommandMessageFile>| command_message(binder, &mut allowed, file.get_ref());
    let messages: Vec<_> = file.message.iter().filter_map(compile).collect();
    if messages.len() == file.message.len() {
        ask_for_each_once(binder, file, &span, &messages);
        buttons_need_a_report(binder, file, hazard);
    }
    let control_mode = file.control_mode.as_ref().and_then(|file| control_mode(binder, file.get_ref()));
    let driver: Vec<_> = file.driver.iter().filter_map(|file| driver_sign(binder, file)).collect();
    for message in &file.message {
        refuse_received(binder, &allowed, message.get_ref());
    }
    let table = SignalTable::default();
    (binder.checker.problems.len() == before).then_some(CommandBinding {
        allowed,
        messages,
        table,
        control_mode,
        driver,
    })
}

/// Turn indicators and hazard lights are each asked for in one way.
fn ask_for_each_once(
    binder: &mut Binder<'_>,
    file: &CommandProfileFile,
    span: &Range<usize>,
    messages: &[CommandMessage],
) {
    let turns = messages.iter().map(|message| message.turn.is_some());
    let hazards = messages.iter().map(|message| {
        message.hazard.is_some() || message.turn.as_ref().is_some_and(|part| part.hazard.is_some())
    });
    let functions: [(&str, Vec<bool>, &str); 2] = [
        ("turn indicators", turns.collect(), "give one message `turn`"),
        (
            "hazard lights",
            hazards.collect(),
            "give one message `hazard`, or its `turn` a state `hazard`: Autoware's emergency needs them",
        ),
    ];
    for (what, asks, remedy) in functions {
        let mut asking = file.message.iter().zip(asks).filter(|(_, asks)| *asks).map(|(file, _)| file);
        match (asking.next(), asking.next()) {
            (None, _) => binder.refuse(span.clone(), format!("no message asks for {what}"), remedy),
            (Some(_), Some(second)) => {
                let at = second.get_ref().name.span();
                binder.refuse(at, format!("a second message asks for {what}"), "keep one of them");
            }
            (Some(_), None) => {}
        }
    }
}

/// A button is pressed until the report shows it.
fn buttons_need_a_report(binder: &mut Binder<'_>, file: &CommandProfileFile, hazard: Option<&HazardBinding>) {
    let is_reported = match hazard {
        Some(HazardBinding::From(_)) | None => true,
        Some(HazardBinding::NotFitted | HazardBinding::Unbound | HazardBinding::LeftOut) => false,
    };
    let parts = file.message.iter().filter_map(|message| message.get_ref().hazard.as_ref());
    for button in parts.filter_map(|part| part.get_ref().button.as_ref()).filter(|_| !is_reported) {
        let reason = "a button is pressed until the report shows the lights, and [hazard] binds no signal";
        binder.refuse(button.span(), reason, "bind one, or remove `button` when the switch stays");
    }
}

/// What the gateway sends cannot be what it receives.
fn refuse_received(binder: &mut Binder<'_>, allowed: &AllowList, file: &CommandMessageFile) {
    let (bus, name) = split_bus(file.name.get_ref());
    let received = binder.messages.iter().any(|(at, message)| {
        let known = &binder.buses[*at];
        allowed.contains(known.index, message.id)
            && message.name == name
            && bus.is_none_or(|bus| bus == known.name)
    });
    if received {
        let reason = format!("{name} is received as well: the gateway's own frames would count as the car's");
        binder.refuse(file.name.span(), reason, "bind signals of messages that the vehicle sends");
    }
}
