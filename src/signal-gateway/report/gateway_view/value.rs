//! Values, facts and ages, as used in all parts of the view.

use schemars::JsonSchema;
use serde::Serialize;

use gateway_base::diagnostics::Level;

/// A value, and the lines below it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Value {
    /// How bad it is; `None` where there is nothing to judge.
    pub level: Option<Level>,
    /// The value in a word.
    pub text: String,
    /// The lines below it.
    pub lines: Vec<String>,
}

impl Value {
    /// Creates a value without lines below it.
    pub fn new(level: Option<Level>, text: impl Into<String>) -> Self {
        Self { level, text: text.into(), lines: Vec::new() }
    }
}

/// A name, and what is known of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Fact {
    /// Its name; empty for a further line of the fact before it.
    pub name: String,
    /// What is known.
    pub text: String,
}

impl Fact {
    pub(super) fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        Self { name: name.into(), text: text.into() }
    }
}

/// Facts under a heading.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Section {
    /// The heading.
    pub title: String,
    /// The facts.
    pub facts: Vec<Fact>,
}

/// Returns a time in its largest unit, or in its two largest from a minute on.
#[allow(clippy::cast_precision_loss)] // far from the limits
pub fn age_text(ms: u64) -> String {
    let seconds = ms / 1000;
    match (seconds / 86_400, seconds / 3600 % 24, seconds / 60 % 60) {
        _ if ms < 1000 => format!("{ms} ms"),
        (0, 0, 0) => format!("{:.1} s", ms as f64 / 1000.0),
        (0, 0, minutes) => format!("{minutes} min {} s", seconds % 60),
        (0, hours, minutes) => format!("{hours} h {minutes} min"),
        (days, hours, _) => format!("{days} d {hours} h"),
    }
}
