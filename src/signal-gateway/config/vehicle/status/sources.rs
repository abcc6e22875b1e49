//! The sources of a status quantity, described individually in a section.

use crate::config::reading::Fields;
use crate::config::vehicle::binder::Binder;

/// Reads the sources of a section: the section itself as the only source, with an empty name, or the sources
/// in its `source`, most trusted first.
pub(super) fn sources<S>(
    binder: &mut Binder<'_>,
    fields: &Fields<'_>,
    mut source: impl FnMut(&mut Binder<'_>, &Fields<'_>, String) -> Option<S>,
) -> Vec<S> {
    if !fields.has("source") {
        return source(binder, fields, String::new()).into_iter().collect();
    }
    fields.set_form("beside `source`");
    let mut names: Vec<String> = Vec::new();
    let sources = fields.read_tables("source", |part| {
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
        source(binder, part, name)
    });
    if names.is_empty() {
        fields.refuse("source", "no source is given", "describe at least one");
    }
    sources
}
