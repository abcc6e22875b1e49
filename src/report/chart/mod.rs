//! Charts: states over time or distance as SVG text, the same bytes each time. No outside fonts, no scripts.
//!
//! | file | what it is |
//! |---|---|
//! | `layout` | where everything lies |
//! | `style` | the measures of charts over time and over metres |
//! | `look` | one bar: bulbs, a name or a command |
//! | `command` | turn signals and hazard lights as bars |
//! | `mark` | vertical marks with their texts above the lanes |
//! | `legend` | what the looks mean |
//! | `axis` | values to pixels, ticks where people expect them |
//! | `ink` | colours that stay apart for colour-blind eyes |
//! | `text` | how wide a text is, and how much of it fits |
//! | `svg` | elements, attributes, escaping |

mod axis;
mod command;
mod ink;
mod layout;
mod legend;
mod look;
mod mark;
mod style;
mod svg;
mod text;

pub use axis::Along;
pub use command::{CommandKind, IndicatorState};
pub use look::Look;

/// Lanes of bars over time or distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Heading.
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
}

/// Rows that belong together, such as those of one light.
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
    /// What it shows of the lane.
    pub label: String,
    /// Ascending, without overlap; only commands may come in any order, and lie one over the other. Where
    /// there is none nothing is drawn.
    pub bars: Vec<Bar>,
}

/// One state over an interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Bar {
    /// Begin.
    pub from: f64,
    /// End, not before the begin.
    pub to: f64,
    /// How it looks.
    pub look: Look,
}

/// A position with a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    /// Position.
    pub at: f64,
    /// What happened there.
    pub text: String,
}
