//! Results as text for users, as JSON for programs, and as charts.
//!
//! | module | results |
//! |---|---|
//! | [`gateway`] | outputs of the gateway: messages, statuses, frames |
//! | [`car_models`] | cars by make and model, and whether a profile reads one |
//! | [`decision`] | a decision of the turn signal decider |
//! | [`discovery`] | requests to the driver, and what was found |
//! | [`drive`] | the decisions of a drive |
//! | [`lights`] | a scenario of traffic lights |
//! | [`vehicle`] | events and frames of a simulated vehicle |
//! | [`view`] | what happens while a command runs: lines, log records, or the next one |
//! | [`gateway_view`] | everything that a person is shown of the present state |
//! | [`terminal`] | that on a terminal |
//! | [`live_page`] | that in a browser |
//! | [`status`] | that as text |
//! | [`metrics`] | the present state for Prometheus |
//! | [`schema`] | JSON Schemas of the status and of the page's feed |
//! | [`story`] | captions and the summary of the demo |
//! | [`timeline`] | a recording: states over time, each with the frame behind it |
//! | [`refusal`] | problems of a configuration, with pictures of their places |
//! | [`text`] | counts, names and paths in texts |
//! | [`chart`] | the chart of a drive or a scenario |
//! | [`palette`] | colours by meaning, for all of them |
//!
//! Text and JSON are lines, written as events occur. An event is an [`Entry`], with text and fields; a state
//! is a [`chart::Bar`] in a chart for its duration.

pub mod car_models;
pub mod chart;
mod counts;
pub mod decision;
pub mod discovery;
pub mod drive;
pub mod gateway;
pub mod gateway_view;
pub mod history;
pub mod lights;
pub mod live_page;
pub mod metrics;
pub mod page;
pub mod palette;
pub mod refusal;
pub mod schema;
pub mod status;
pub mod story;
pub mod terminal;
pub mod text;
pub mod timeline;
pub mod vehicle;
pub mod view;

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
fn joined(mut object: Value, more: Value) -> Value {
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
