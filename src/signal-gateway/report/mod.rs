//! Results as text for users, as JSON for programs, and as charts.
//!
//! Text and JSON are lines, written as events occur. An event is an [`Entry`], with text and fields; a state
//! is a `chart::Bar` in a chart for its duration.

pub(crate) mod car_models;
pub(crate) mod chart;
mod counts;
pub mod decision;
pub mod discovery;
pub mod drive;
pub mod gateway;
pub mod gateway_view;
pub mod history;
pub(crate) mod lights;
pub(crate) mod live_page;
pub mod metrics;
pub(crate) mod output_budget;
pub(crate) mod page;
pub mod palette;
pub(crate) mod refusal;
pub mod schema;
pub mod status;
pub mod story;
pub mod table;
pub mod terminal;
pub mod text;
pub(crate) mod timeline;
pub mod vehicle;
pub(crate) mod view;

use serde_json::Value;

use gateway_base::time::MonoTime;

/// Format of lines.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Columns of text, for users.
    Text,
    /// One object per line, for programs.
    Json,
}

impl Form {
    /// Returns JSON if `json` is set, otherwise text.
    pub fn json_if(json: bool) -> Self {
        if json { Self::Json } else { Self::Text }
    }
}

/// One event, in both formats.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Subject of the event, in a column of the text.
    pub subject: &'static str,
    /// The event in words, for users.
    pub text: String,
    /// An object for programs.
    pub fields: Value,
}

impl Entry {
    fn new(subject: &'static str, text: impl Into<String>, fields: Value) -> Self {
        Self { subject, text: text.into(), fields }
    }
}

/// Returns an object with the fields of both.
pub(crate) fn joined(mut object: Value, more: Value) -> Value {
    if let (Value::Object(fields), Value::Object(more)) = (&mut object, more) {
        fields.extend(more);
    }
    object
}

/// Converts to seconds on the time line, exact to the nanosecond for 104 days.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn seconds(at: MonoTime) -> f64 {
    at.as_nanos() as f64 / 1e9
}
