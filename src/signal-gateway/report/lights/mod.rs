//! Reports of a scenario of traffic lights.

pub(crate) mod chart;
mod display;
mod entry;
mod json;
mod snapshot;
mod text;

use super::Form;
use crate::config::scenario::LightNames;
pub(crate) use display::Style;
pub(super) use display::bulbs_text;
use gateway_base::time::MonoTime;
pub(crate) use snapshot::{Snapshot, States};
use text::Columns;

/// Writes the snapshots of a scenario as lines.
#[derive(Debug)]
pub(crate) struct LightsWriter {
    form: Form,
    columns: Columns,
    names: LightNames,
    is_first: bool,
}

impl LightsWriter {
    /// Creates a writer that has written nothing; `style` applies to text, and `names` has names of ids.
    pub(crate) fn new(form: Form, style: Style, names: LightNames) -> Self {
        Self { form, columns: Columns::new(style), names, is_first: true }
    }

    /// Returns the lines of a snapshot. Text has events and changes, or all states if `whole`; JSON has one
    /// line with all states if there are events or changes, or if `whole`.
    pub(crate) fn write(&mut self, snapshot: &Snapshot<'_>, whole: bool) -> Vec<String> {
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
    pub(crate) fn undecided(&self, at: MonoTime, reason: &str) -> String {
        match self.form {
            Form::Text => text::line(at, "end", &format!("undecided: {reason}")),
            Form::Json => json::undecided(at, reason).to_string(),
        }
    }

    /// Returns the line for the end of a run whose scenario has not ended; only for text.
    pub(crate) fn until(&self, at: MonoTime, why: &str) -> Option<String> {
        (self.form == Form::Text).then(|| text::line(at, "until", why))
    }
}
