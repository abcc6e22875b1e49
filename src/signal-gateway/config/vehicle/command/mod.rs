//! `[command]` of a profile: the messages that may be sent to the vehicle, and signals that show who is
//! driving.

mod control;
mod message;

use super::binder::{Binder, split_bus};
use crate::config::reading::Fields;
use can_signal::validation::table::SignalTable;
use control::driver_sign;
use gateway_core::command::allow_list::AllowList;
use gateway_core::command::settings::CommandBinding;
use gateway_core::vehicle_lights::binding::HazardBinding;
use message::command_message;

/// Reads the section, if there is one, to a binding without received messages and signals; `None` if a
/// problem was recorded.
pub(super) fn command(
    binder: &mut Binder<'_>,
    fields: Option<Fields<'_>>,
    hazard: Option<&HazardBinding>,
) -> Option<CommandBinding> {
    let Some(fields) = fields else { return Some(CommandBinding::default()) };
    let before = binder.checker.count();
    let mut allowed = AllowList::default();
    let files: Vec<_> = fields.tables("message").collect();
    let compiled = files.iter().filter_map(|file| command_message(binder, &mut allowed, file));
    let messages: Vec<_> = compiled.collect();
    each_is_requested_once(&fields, &files);
    buttons_need_a_report(&files, hazard);
    let driver = fields.read_tables("driver", |section| driver_sign(binder, section));
    let needs_consent = needs_consent(&fields);
    fields.done();
    for file in files {
        refuse_received(binder, &allowed, &file);
        file.done();
    }
    let table = SignalTable::default();
    let binding = CommandBinding { allowed, messages, table, driver, needs_consent };
    (binder.checker.count() == before).then_some(binding)
}

/// Reads the warning that a user must consent to before frames are sent.
fn needs_consent(fields: &Fields<'_>) -> Option<String> {
    let reason = fields.string("needs_consent")?.text;
    if reason.trim().is_empty() {
        let remedy = "say what a user must know before frames are sent";
        fields.refuse("needs_consent", "the text is empty", remedy);
    }
    Some(reason)
}

/// Refuses profiles that do not request turn indicators and hazard lights by one message each. `files` are
/// the tables of the messages, which may have been refused for other reasons.
fn each_is_requested_once(fields: &Fields<'_>, files: &[Fields<'_>]) {
    let is_requested_once = |what: &str, requests: &dyn Fn(&Fields<'_>) -> bool, remedy: &str| {
        let mut requesting = files.iter().filter(|file| requests(file));
        match (requesting.next(), requesting.next()) {
            (None, _) => {
                fields.checker.refuse(fields.location(), format!("no message requests {what}"), remedy);
            }
            (Some(_), None) => {}
            (Some(_), Some(second)) => {
                second.refuse("name", format!("a second message requests {what}"), "keep one of them");
            }
        }
    };
    is_requested_once("the turn indicators", &|file| file.has("turn"), "give one message `turn`");
    let hazards = |file: &Fields<'_>| file.has("hazard") || has_within(file, "turn", "hazard");
    let remedy = "give one message `hazard`, or its `turn` a state `hazard`: Autoware's emergency needs them";
    is_requested_once("the hazard lights", &hazards, remedy);
}

/// Returns true if a subtable of a table has a key.
fn has_within(file: &Fields<'_>, table: &'static str, key: &str) -> bool {
    file.value(table)
        .and_then(|value| Fields::of_table(file.checker, value))
        .is_some_and(|table| table.has(key))
}

/// Refuses a button without a report, since a button is pressed until the report shows the effect. `files`
/// are the tables of the messages.
fn buttons_need_a_report(files: &[Fields<'_>], hazard: Option<&HazardBinding>) {
    let is_reported = match hazard {
        Some(HazardBinding::From(_)) | None => true,
        Some(HazardBinding::NotFitted | HazardBinding::NotVisible { .. } | HazardBinding::LeftOut) => false,
    };
    for file in files.iter().filter(|file| !is_reported && has_within(file, "hazard", "button")) {
        let reason = "a button is pressed until the report shows the lights, but [hazard] binds no signal";
        let remedy = "bind one, or remove `button` when the switch stays";
        file.section("hazard").refuse("button", reason, remedy);
    }
}

/// Refuses to receive messages that the gateway sends.
fn refuse_received(binder: &Binder<'_>, allowed: &AllowList, file: &Fields<'_>) {
    let Some(given) = file.string("name") else { return };
    let (bus, name) = split_bus(&given.text);
    let is_received = binder.messages.iter().any(|(at, message)| {
        let known = &binder.buses[*at];
        allowed.contains(known.index, message.id)
            && message.name == name
            && bus.is_none_or(|bus| bus == known.bus)
    });
    if is_received {
        let reason =
            format!("{name} is received as well: the gateway's own frames would be taken for the vehicle's");
        binder.refuse(&given.location, reason, "bind signals of messages that the vehicle sends");
    }
}
