//! A scenario of traffic lights, written down.
//!
//! | file | what it is |
//! |---|---|
//! | `snapshot` | what there is to see at a time |
//! | `display` | lights and groups in short words |
//! | `entry` | what happens in the scenario |
//! | `text` | columns for people: what happens, and what is different |
//! | `json` | objects for programs: what happens, and all there is |
//! | [`chart`] | how long each light looked how |

pub mod chart;
mod display;
mod entry;
mod json;
mod snapshot;
mod text;

use super::Form;
use crate::core::time::MonoTime;
pub use display::Style;
pub use snapshot::{STORES, Snapshot, States};
use text::Columns;

/// Writes the snapshots of a scenario as lines.
#[derive(Debug)]
pub struct LightsWriter {
    form: Form,
    columns: Columns,
    is_first: bool,
}

impl LightsWriter {
    /// A writer that has written nothing; `style` is that of text.
    pub fn new(form: Form, style: Style) -> Self {
        Self { form, columns: Columns::new(style), is_first: true }
    }

    /// The lines of a snapshot: of text what happened and what is different, or all of it when `whole` is asked for;
    /// of JSON one with all there is, when anything is different or `whole` is asked for.
    pub fn write(&mut self, snapshot: &Snapshot<'_>, whole: bool) -> Vec<String> {
        let is_first = std::mem::replace(&mut self.is_first, false);
        match self.form {
            Form::Text => self.columns.lines(snapshot, whole),
            Form::Json if snapshot.has_changed || whole || is_first => {
                vec![json::object(snapshot).to_string()]
            }
            Form::Json => Vec::new(),
        }
    }

    /// The line that says where a scenario that has not ended is left; text only.
    pub fn until(&self, at: MonoTime, why: &str) -> Option<String> {
        (self.form == Form::Text).then(|| text::line(at, "until", why))
    }
}
