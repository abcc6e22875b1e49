//! Charts: states over time or distance as SVG text, the same bytes each time. No outside fonts, no scripts.
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
    /// A line below it; may be empty.
    pub subtitle: String,
    /// The quantity from left to right, which gives `from`, `to` and all positions their unit.
    pub along: Along,
    /// Left end of the axis.
    pub from: f64,
    /// Right end of the axis.
    pub to: f64,
    /// From top to bottom.
    pub lanes: Vec<Lane>,
    /// Across all lanes, in any order.
    pub marks: Vec<Mark>,
    /// The map, below the lanes.
    pub plan: Option<Plan>,
    /// Texts at the bottom.
    pub notes: Vec<Note>,
}

/// Lanes from above, and the way that was driven on them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// The lanes near the way.
    pub lanes: Vec<PlanLane>,
    /// The way, part by part, with the signal on each.
    pub driven: Vec<(IndicatorState, Vec<PlanPoint>)>,
}

/// A lane from above.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanLane {
    /// Its name.
    pub name: String,
    /// The side that it turns to.
    pub side: Option<IndicatorState>,
    /// True if the vehicle was on it.
    pub is_driven: bool,
    /// Its bounds, as one closed line.
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

/// Rows that belong together, such as the rows of one light.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Lane {
    /// Its name, left of all rows.
    pub label: String,
    /// From top to bottom.
    pub rows: Vec<Row>,
}

/// Bars side by side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// The part of the lane that it shows.
    pub label: String,
    /// Ascending, without overlap; only commands may come in any order, and lie one over the other. Where
    /// there is none nothing is drawn.
    pub bars: Vec<Bar>,
}

/// One state over an interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Position of its begin.
    pub from: f64,
    /// Position of its end, not before the begin.
    pub to: f64,
    /// The state that it shows.
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
