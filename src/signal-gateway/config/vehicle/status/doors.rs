//! `[[doors.door]]` of a profile.

use crate::config::reading::Fields;
use crate::config::vehicle::binder::{Binder, UNUSABLE};
use gateway_core::vehicle_status::doors::{Door, DoorState, MAX_DOORS};

/// Reads the doors; omits doors with a problem.
pub(super) fn doors(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Vec<Door> {
    let mut names: Vec<String> = Vec::new();
    let doors = fields.read_tables("door", |part| {
        part.require(&["name"], "name the door, e.g. \"front left\"");
        let name = part.string("name").map(|name| name.text).unwrap_or_default();
        if part.has("name") && (name.is_empty() || names.contains(&name)) {
            let reason = if name.is_empty() { "the name is empty" } else { "another door has this name" };
            part.refuse("name", reason, "give each door a name of its own");
        }
        names.push(name.clone());
        let is_entrance = part.flag("entrance").unwrap_or_default();
        let is_exit = part.flag("exit").unwrap_or_default();
        let required = [("open", DoorState::Opened), ("closed", DoorState::Closed)];
        let optional = [("opening", DoorState::Opening), ("closing", DoorState::Closing)];
        let role =
            binder.states(part, [&required, &optional], UNUSABLE, "a door needs signal, open and closed");
        Some(Door { name, is_entrance, is_exit, role: role? })
    });
    if names.is_empty() || names.len() > MAX_DOORS {
        let reason = format!("expected 1 to {MAX_DOORS} doors, found {}", names.len());
        fields.refuse("door", reason, "describe each door in a [[doors.door]]");
    }
    doors
}
