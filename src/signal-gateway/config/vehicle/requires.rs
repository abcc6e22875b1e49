//! `[[requires]]` of a profile: observations that distinguish its vehicle from variants, and are required
//! before anything is reported.

use std::time::Duration;

use super::binder::{Binder, Meanings, NOT_AVAILABLE, split_bus, unusable_values};
use super::message::MessageSections;
use super::raw_values::RawValues;
use crate::config::reading::Fields;
use can_signal::dbc::model::Message;
use can_signal::validation::meaning::Meaning;
use can_signal::validation::requirement::{Condition, Requirement};

/// Default time for which a bus is observed for a message that must not occur.
const OBSERVATION: Duration = Duration::from_secs(1);

/// Reads the requirements. Requirements with a problem, which is recorded, are omitted.
pub(super) fn requires(
    binder: &Binder<'_>,
    top: &Fields<'_>,
    sections: &MessageSections<'_>,
) -> Vec<Requirement> {
    if top.has("requires") && top.has("command") {
        let reason = "commands do not wait for requirements";
        top.refuse("requires", reason, "remove [command], or write it into a profile of its own");
    }
    top.read_tables("requires", |fields| requirement(binder, fields, sections))
}

fn requirement(
    binder: &Binder<'_>,
    fields: &Fields<'_>,
    sections: &MessageSections<'_>,
) -> Option<Requirement> {
    let form = fields.only_one_of(&["message", "signal"], "a requirement is of a message or of a signal");
    let read = match form {
        Some("signal") => value(binder, fields),
        Some(_) => presence(binder, fields),
        None => {
            fields.accept_rest();
            None
        }
    };
    let otherwise = fields.string("otherwise").map(|given| given.text).unwrap_or_default();
    let Observed { bus, message, name, condition } = read?;
    let ids = sections.ids(binder, (bus, message));
    Some(Requirement { bus: binder.buses[bus].index, ids, name, condition, otherwise })
}

/// The observation of a requirement.
struct Observed<'d> {
    /// Position of the bus of its message.
    bus: usize,
    message: &'d Message,
    name: String,
    condition: Condition,
}

/// Reads a message that must, or must not, be received.
fn presence<'d>(binder: &Binder<'d>, fields: &Fields<'_>) -> Option<Observed<'d>> {
    let given = fields.string("message");
    let seen = fields.flag("seen");
    let condition = if seen == Some(false) {
        fields.set_form("with seen = false");
        Condition::Unseen { observation: fields.limit("within_ms").unwrap_or(OBSERVATION) }
    } else {
        fields.set_form("with a message");
        Condition::Seen
    };
    fields.require(&["seen"], "write true if the message must come, false if it must not")?;
    let given = given?;
    let (bus, name) = split_bus(&given.text);
    let (bus, message) = binder.find_message(bus, name, &given.location)?;
    let name = binder.message_name(bus, message);
    Some(Observed { bus, message, name, condition })
}

/// Reads a signal with the values that it must have.
fn value<'d>(binder: &Binder<'d>, fields: &Fields<'_>) -> Option<Observed<'d>> {
    fields.set_form("with a signal");
    let is_complete = fields.require(&["values"], "give the raw values that the signal must have");
    let given = fields.string("signal");
    let values = RawValues::some_given(fields, "values");
    let unusable = unusable_values(fields, NOT_AVAILABLE);
    is_complete?;
    let (bus, message, signal) = binder.find_signal(&given?)?;
    let mut meanings: Meanings<bool> = vec![(values?, Meaning::Defined(true))];
    meanings.extend(unusable);
    let values = binder.values(&meanings, Some(signal))?;
    let condition = Condition::Value { codec: signal.codec.clone(), values };
    let name = format!("{}.{}", binder.message_name(bus, message), signal.name);
    Some(Observed { bus, message, name, condition })
}
