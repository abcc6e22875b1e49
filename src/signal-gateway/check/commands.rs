//! Checks the commands to the vehicle: whether they are a dry run, and which frames can be sent.

use super::report::CheckReport;
use crate::config::Settings;
use crate::config::gateway::SourceKind;
use gateway_core::command::message::CommandMessage;
use gateway_core::command::settings::{CommandSource, ModeFrom, Transmit};

pub(super) fn commands(settings: &Settings, report: &mut CheckReport) {
    let binding = &settings.command_binding;
    if binding.is_empty() {
        return;
    }
    let Some(command) = &settings.command else {
        report.line("commands", "the profile describes them; without [command] nothing is sent");
        return needed_consent(settings, report);
    };
    let sent = match (command.settings.transmit, settings.source) {
        (Transmit::Off, _) => "dry run, nothing is sent",
        (Transmit::On, SourceKind::Recording) => "dry run with a recording, nothing is sent",
        (Transmit::On, SourceKind::Socketcan) => "frames are sent",
    };
    let source = match command.settings.source {
        CommandSource::Topic => command.topics.name("turn_indicators_cmd"),
        CommandSource::Decider => "the decider",
    };
    let mode = match command.settings.mode_from {
        ModeFrom::Topic { .. } => command.topics.name("control_mode"),
        ModeFrom::Signal => "the vehicle's signals",
    };
    report.line("commands", format!("{sent}; turn commands of {source}, control mode of {mode}"));
    for message in &binding.messages {
        let bus = settings.gateway.buses.get(usize::from(message.permission.bus().0));
        let bus = bus.map_or("?", |bus| bus.name.as_str());
        let (name, id, period) = (&message.name, message.permission.id(), message.timing.period.as_millis());
        report.line("", format!("{name} ({id}) on {bus}: {}, every {period} ms", lights_of(message)));
    }
    needed_consent(settings, report);
}

/// Adds the warnings that a user must read before frames are sent, if the profile requires consent.
fn needed_consent(settings: &Settings, report: &mut CheckReport) {
    if let Some(needed) = &settings.command_binding.needs_consent {
        report.line("", format!("tx = \"on\" needs consent = {:?}: {needed}", settings.vehicle));
    }
}

fn lights_of(message: &CommandMessage) -> &'static str {
    let turn = message.turn.as_ref();
    let hazard = message.hazard.is_some() || turn.is_some_and(|part| part.hazard.is_some());
    match (turn.is_some(), hazard) {
        (true, true) => "turn indicators and hazard lights",
        (true, false) => "turn indicators",
        (false, true) => "hazard lights",
        (false, false) => "no request, beside the others",
    }
}
