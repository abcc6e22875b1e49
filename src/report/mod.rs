//! What came out, written down: as text for people, as JSON for programs, as a chart.
//!
//! | module | what came out |
//! |---|---|
//! | [`gateway`] | outputs of the gateway: messages, statuses, frames |
//! | [`decision`] | a decision of the turn signal decider |
//! | [`drive`] | the decisions of a drive |
//! | [`lights`] | a scenario of traffic lights |
//! | [`vehicle`] | what a simulated vehicle does |
//! | [`view`] | the present state, on a terminal |
//! | [`chart`] | the chart of a drive or a scenario |
//!
//! Text and JSON are lines, written as they come. What happens is an [`Entry`], with its text and its fields; what
//! lasts is a state, and a chart has a [`chart::Bar`] for as long as it does.

pub mod chart;
pub mod decision;
pub mod drive;
pub mod gateway;
pub mod lights;
pub mod vehicle;
pub mod view;

use serde_json::Value;

use crate::core::time::MonoTime;

/// How lines are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Columns for people.
    Text,
    /// An object a line, for programs.
    Json,
}

impl Form {
    /// JSON when it is asked for, else text.
    pub fn json_if(json: bool) -> Self {
        if json { Self::Json } else { Self::Text }
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The column of text that says what it is about.
    pub subject: &'static str,
    /// For people.
    pub text: String,
    /// For programs: an object.
    pub fields: Value,
}

impl Entry {
    fn new(subject: &'static str, text: impl Into<String>, fields: Value) -> Self {
        Self { subject, text: text.into(), fields }
    }
}

/// The fields of an object, then those of another.
fn joined(mut object: Value, more: Value) -> Value {
    if let (Value::Object(fields), Value::Object(more)) = (&mut object, more) {
        fields.extend(more);
    }
    object
}

/// Seconds of a time line, exact to the nanosecond for 104 days.
#[allow(clippy::cast_precision_loss)]
fn seconds(at: MonoTime) -> f64 {
    at.as_nanos() as f64 / 1e9
}
