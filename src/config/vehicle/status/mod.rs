//! `[velocity]`, `[steering]`, `[gear]`, `[control_mode]` and `[[doors.door]]` of a profile: the status of the vehicle beside its lights.

mod control_mode;
mod doors;
mod gear;
mod quantity;
mod steering;
mod velocity;

use super::binder::Binder;
use crate::config::reading::Fields;
use crate::core::vehicle_status::binding::StatusBinding;
use control_mode::control_mode;
use doors::doors;
use gear::gear;
use steering::steering;
use velocity::velocity;

/// Reads the sections to a binding without messages and signals; `None` when a problem was noted.
pub(super) fn status(binder: &mut Binder<'_>, top: &Fields<'_>) -> Option<StatusBinding> {
    let before = binder.checker.count();
    let binding = StatusBinding {
        velocity: top.table("velocity").and_then(|fields| velocity(binder, fields)),
        steering: top.table("steering").and_then(|fields| steering(binder, fields)),
        gear: top.table("gear").and_then(|fields| gear(binder, fields)),
        control_mode: top.table("control_mode").and_then(|fields| control_mode(binder, fields)),
        doors: top.table("doors").map_or_else(Vec::new, |fields| doors(binder, fields)),
        ..StatusBinding::default()
    };
    (binder.checker.count() == before).then_some(binding)
}

/// Reads the sources of a section: the section itself as the only one, whose name is empty, or those in its `source`, the most
/// trusted first.
fn sources<S>(
    binder: &mut Binder<'_>,
    fields: &Fields<'_>,
    mut source: impl FnMut(&mut Binder<'_>, &Fields<'_>, String) -> Option<S>,
) -> Vec<S> {
    if !fields.has("source") {
        return source(binder, fields, String::new()).into_iter().collect();
    }
    fields.set_form("beside `source`");
    let mut names: Vec<String> = Vec::new();
    let mut sources = Vec::new();
    for part in fields.tables("source") {
        part.require(&["name"], "name the source for diagnostics");
        let name = part.string("name").map(|name| name.text).unwrap_or_default();
        if part.has("name") && (name.is_empty() || names.contains(&name)) {
            let reason = if name.is_empty() {
                "the name is empty"
            } else {
                "another source of the section has this name"
            };
            part.refuse("name", reason, "give each source a name of its own");
        }
        names.push(name.clone());
        sources.extend(source(binder, &part, name));
        part.done();
    }
    if names.is_empty() {
        fields.refuse("source", "no source is given", "describe at least one");
    }
    sources
}
