//! Charts: states over time or distance as reproducible SVG text, without external fonts and scripts.

mod axis;
mod command;
mod layout;
mod legend;
mod look;
mod mark;
mod plan;
mod svg;
mod text;

pub(crate) use axis::{Along, value_ticks};
pub(crate) use command::{CommandKind, IndicatorState};
pub(crate) use look::{CurvePoint, Look};
pub(crate) use plan::{Plan, PlanLane};

/// Lanes of bars over time or distance.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    pub title: String,
    /// Line below the title; may be empty.
    pub subtitle: String,
    /// Quantity from left to right, which determines the unit of `from`, `to` and all positions.
    pub along: Along,
    pub from: f64,
    pub to: f64,
    /// Lanes from top to bottom.
    pub lanes: Vec<Lane>,
    /// Marks across all lanes, in any order.
    pub marks: Vec<Mark>,
    /// The map, below the lanes.
    pub plan: Option<Plan>,
    /// Texts at the bottom.
    pub notes: Vec<Note>,
}

/// Lines of text with a heading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Note {
    pub heading: String,
    pub lines: Vec<String>,
}

/// A group of rows, such as the rows of one light.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lane {
    /// Name of the lane, shown left of all rows.
    pub label: String,
    pub rows: Vec<Row>,
}

/// Bars side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Name of the part of the lane that the row shows.
    pub label: String,
    /// Bars in ascending order, with gaps but without overlap; commands may have any order and overlap.
    pub bars: Vec<Bar>,
}

/// One state over an interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    pub from: f64,
    /// Position of its end, not before the start.
    pub to: f64,
    pub look: Look,
}

/// A position with a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    pub at: f64,
    pub text: String,
}
