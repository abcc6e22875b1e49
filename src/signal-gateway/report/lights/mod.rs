//! Reports of a scenario of traffic lights.
//!
//! | file | what it is |
//! |---|---|
//! | `snapshot` | the state of a scenario at a time |
//! | `display` | lights and groups as short text |
//! | `entry` | events of the scenario |
//! | `text` | columns for people: events and changes |
//! | `json` | objects for programs: events and all states |
//! | [`chart`] | the states of each light as bars |

pub mod chart;
mod display;
mod entry;
mod json;
mod snapshot;
mod text;

use super::Form;
use crate::config::scenario::LightNames;
pub use display::Style;
pub(super) use display::bulbs_text;
use gateway_base::time::MonoTime;
pub use snapshot::{Snapshot, States};
use text::Columns;

/// Writes the snapshots of a scenario as lines.
#[derive(Debug)]
pub struct LightsWriter {
    form: Form,
    columns: Columns,
    names: LightNames,
    is_first: bool,
}

impl LightsWriter {
    /// Creates a writer that has written nothing; `style` applies to text. Ids with names in `names` are
    /// shown by name.
    pub fn new(form: Form, style: Style, names: LightNames) -> Self {
        Self { form, columns: Columns::new(style), names, is_first: true }
    }

    /// Returns the lines of a snapshot. Text has events and changes, or all states if `whole`; JSON has one
    /// line with all states if there are events or changes, or if `whole`.
    pub fn write(&mut self, snapshot: &Snapshot<'_>, whole: bool) -> Vec<String> {
        let is_first = std::mem::replace(&mut self.is_first, false);
        match self.form {
            Form::Text => {
                let lines = self.columns.lines(snapshot, whole);
                lines.iter().map(|line| self.names.in_text(line)).collect()
            }
            Form::Json if snapshot.has_changed || whole || is_first => {
                vec![json::object(snapshot, &self.names)]
            }
            Form::Json => Vec::new(),
        }
    }

    /// Returns the line for an unknown verdict, with the reason.
    pub fn undecided(&self, at: MonoTime, reason: &str) -> String {
        match self.form {
            Form::Text => text::line(at, "end", &format!("undecided: {reason}")),
            Form::Json => json::undecided(at, reason).to_string(),
        }
    }

    /// Returns the line for the end of a run whose scenario has not ended; only for text.
    pub fn until(&self, at: MonoTime, why: &str) -> Option<String> {
        (self.form == Form::Text).then(|| text::line(at, "until", why))
    }
}
