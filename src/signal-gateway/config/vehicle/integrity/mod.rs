//! The integrity checks of a message: length, checksum, counter, E2E protection, and a window over the latest
//! frames.

mod checksum;
mod counter;
mod e2e;
mod window;

use std::time::Duration;

use super::binder::Binder;
use crate::config::reading::Fields;
use can_signal::dbc::model::Message;
use can_signal::validation::integrity::{MessageIntegrity, Protection};
use checksum::checksum;
use counter::counter;
use e2e::e2e;
use window::window;

/// Reads the protection of a message by its fields or by an E2E profile; `None` if it has none, or if a
/// problem was recorded.
pub(super) fn protection(binder: &Binder<'_>, fields: &Fields<'_>, message: &Message) -> Option<Protection> {
    let checksum = fields.read_table("checksum", |section| checksum(binder, section, message));
    let counter = fields.read_table("counter", |section| counter(binder, section, message));
    let e2e = fields.read_table("e2e", |section| e2e(section, message.length));
    let has_fields = fields.has("checksum") || fields.has("counter");
    if has_fields && fields.has("e2e") {
        let reason = "an E2E profile has its own checksum and counter";
        return fields.refused("e2e", reason, "give `e2e`, or `checksum` and `counter`");
    }
    if has_fields { Some(Protection::Fields { checksum, counter }) } else { e2e }
}

/// Reads the integrity checks of a received message; `None` if it has none, or if a problem was recorded.
pub(super) fn integrity(
    binder: &Binder<'_>,
    fields: &Fields<'_>,
    message: &Message,
    forget_after: Option<Duration>,
) -> Option<MessageIntegrity> {
    let length = fields.number("length", 1..=64, "bytes");
    let window = fields.read_table("window", window);
    let protection = match protection(binder, fields, message) {
        Some(protection) => protection,
        None if length.is_some() => Protection::Fields { checksum: None, counter: None },
        None => {
            if fields.has("window") && !fields.has("e2e") {
                let reason = "a window needs checksum, counter or e2e";
                fields.refuse("window", reason, "give one of them, or remove it");
            }
            return None;
        }
    };
    Some(MessageIntegrity { length, protection, window, forget_after })
}
