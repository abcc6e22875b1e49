//! Colours. Green leans to blue and red to orange, and they differ in brightness, so that
//! colour-blind eyes distinguish them; letters repeat them.

use crate::core::diagnostics::Level;
use crate::core::traffic_light::bulb::Color;

/// Text and strong lines.
pub(super) const DARK: &str = "#1f2933";
/// Less important text.
pub(super) const SOFT: &str = "#52606d";
/// Lines of the grid.
pub(super) const GRID: &str = "#d9dfe6";
/// Behind every other lane.
pub(super) const SHADE: &str = "#f4f6f8";
/// Boxes with names, such as phases.
pub(super) const BOX: &str = "#dfe7f0";
/// Borders of boxes with names.
pub(super) const BOX_EDGE: &str = "#8a9bb0";
/// Curves.
pub(super) const CURVE: &str = "#2166ac";
/// Marks and their texts.
pub(super) const MARK: &str = "#7b3f98";

/// The inks of a colour.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ink {
    /// The colour itself.
    pub(super) fill: &'static str,
    /// Its border, and what stands for it where the fill is left out.
    pub(super) edge: &'static str,
    /// Signs on top of it.
    pub(super) sign: &'static str,
    /// Letter that repeats the colour.
    pub(super) letter: &'static str,
}

/// Fill and text of a status.
pub(super) fn of_level(level: Level) -> (&'static str, &'static str) {
    match level {
        Level::Ok => ("#d3eadf", DARK),
        Level::Warn => ("#f7c948", DARK),
        Level::Error | Level::Stale => ("#b2182b", "#ffffff"),
    }
}

/// The ink of a lamp.
pub(super) fn of(color: Color) -> Ink {
    match color {
        Color::Green => Ink { fill: "#1a9b76", edge: "#0b6b50", sign: "#ffffff", letter: "G" },
        Color::Yellow => Ink { fill: "#f7c948", edge: "#a87b00", sign: "#1f2933", letter: "Y" },
        Color::Red => Ink { fill: "#d3381c", edge: "#8f1f0b", sign: "#ffffff", letter: "R" },
        Color::White => Ink { fill: "#ffffff", edge: "#52606d", sign: "#1f2933", letter: "W" },
        Color::Unknown => Ink { fill: "#aeb6bf", edge: "#6b7680", sign: "#1f2933", letter: "?" },
    }
}
