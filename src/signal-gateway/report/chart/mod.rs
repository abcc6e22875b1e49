//! Charts: states over time or distance as SVG text, with reproducible bytes, no external fonts and no
//! scripts.
//!
//! | file | what it is |
//! |---|---|
//! | `layout` | the position of each part |
//! | `look` | one bar: bulbs, a name or a command |
//! | `command` | turn signals and hazard lights as bars |
//! | `mark` | vertical marks with their texts above the lanes |
//! | `plan` | lanes from above, and the way driven on them |
//! | `legend` | the meaning of the looks |
//! | `axis` | values to pixels, ticks at round values |
//! | `text` | the width of a text, and as much of it as fits |
//! | `svg` | elements, attributes, escaping |

mod axis;
mod command;
mod layout;
mod legend;
mod look;
mod mark;
mod plan;
mod svg;
mod text;

pub use axis::Along;
pub use command::{CommandKind, IndicatorState};
pub use look::Look;
pub use plan::PlanPoint;

/// Lanes of bars over time or distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Heading of the chart.
    pub title: String,
    /// Line below the title; may be empty.
    pub subtitle: String,
    /// Quantity from left to right, which determines the unit of `from`, `to` and all positions.
    pub along: Along,
    /// Left end of the axis.
    pub from: f64,
    /// Right end of the axis.
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

/// Lanes from above, and the driven way.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Lanes near the way.
    pub lanes: Vec<PlanLane>,
    /// Parts of the way, with the signal on each.
    pub driven: Vec<(IndicatorState, Vec<PlanPoint>)>,
}

/// A lane from above.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanLane {
    /// Name of the lane.
    pub name: String,
    /// Side to which the lane turns.
    pub side: Option<IndicatorState>,
    /// True if the vehicle was on it.
    pub is_driven: bool,
    /// Bounds of the lane, as one closed line.
    pub outline: Vec<PlanPoint>,
}

/// Lines of text with a heading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Note {
    /// Heading of the lines.
    pub heading: String,
    /// The lines.
    pub lines: Vec<String>,
}

/// A group of rows, such as the rows of one light.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lane {
    /// Name of the lane, shown left of all rows.
    pub label: String,
    /// Rows from top to bottom.
    pub rows: Vec<Row>,
}

/// Bars side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// Name of the part of the lane that the row shows.
    pub label: String,
    /// Bars in ascending order without overlap, except that commands may have any order and overlap. Gaps are
    /// left empty.
    pub bars: Vec<Bar>,
}

/// One state over an interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Position of its start.
    pub from: f64,
    /// Position of its end, not before the start.
    pub to: f64,
    /// State that the bar shows.
    pub look: Look,
}

/// A position with a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Position on the axis.
    pub at: f64,
    /// Text beside the mark.
    pub text: String,
}
