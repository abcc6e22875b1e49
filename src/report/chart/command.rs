//! Turn signals and hazard lights in a chart: sent, requested by a section, or expected.

use super::ink;
use super::svg::{Area, Element, rect};

/// The meaning of a command in a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CommandKind {
    /// The command that was sent.
    Signal,
    /// A section in which a side may be signalled.
    Desired,
    /// A section in which a side must be signalled.
    Required,
    /// The command that was expected.
    Expected,
}

/// State of turn indicators and hazard lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum IndicatorState {
    /// The left indicators blink.
    Left,
    /// The right indicators blink.
    Right,
    /// Neither side of the vehicle blinks.
    Off,
    /// The hazard lights are on.
    Hazard,
    /// There is no command.
    Nothing,
}

impl CommandKind {
    pub(super) fn description(self, indicator: IndicatorState) -> String {
        let name = indicator.name();
        match self {
            Self::Signal => format!("signal: {name}"),
            Self::Desired => format!("desired section, {name}"),
            Self::Required => format!("required section, {name}"),
            Self::Expected => format!("expected: {name}"),
        }
    }

    /// The box; desired sections and expectations leave room above and below.
    pub(super) fn field(self, indicator: IndicatorState, area: Area) -> Element {
        let (fill, edge) = indicator.inks();
        let (share, opacity) = match self {
            Self::Signal => (1.0, None),
            Self::Desired => (0.5, Some(0.3)),
            Self::Required => (1.0, Some(0.75)),
            Self::Expected => (0.4, Some(0.6)),
        };
        let height = area.height * share;
        let field = rect(area.x, area.y + (area.height - height) / 2.0, area.width, height);
        let field = field.with("fill", fill);
        match opacity {
            None => field.with("stroke", edge).with("stroke-width", 0.75),
            Some(opacity) => field.with("fill-opacity", opacity).with("stroke", edge),
        }
    }

    /// The text in the box, and its colour.
    pub(super) fn label(self, indicator: IndicatorState) -> (&'static str, &'static str) {
        let name = match self {
            Self::Signal | Self::Required => indicator.name(),
            Self::Desired | Self::Expected => "",
        };
        let fill = match indicator {
            IndicatorState::Left | IndicatorState::Right | IndicatorState::Hazard => "#ffffff",
            IndicatorState::Off | IndicatorState::Nothing => ink::DARK,
        };
        (name, fill)
    }
}

impl IndicatorState {
    /// The name of the command.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Left => "LEFT",
            Self::Right => "RIGHT",
            Self::Off => "DISABLE",
            Self::Hazard => "hazard lights",
            Self::Nothing => "NO_COMMAND",
        }
    }

    /// Light colour for what turns to a side.
    pub(super) const fn tint(self) -> &'static str {
        match self {
            Self::Left => "#cfe0f1",
            Self::Right => "#f8dcc6",
            Self::Off | Self::Hazard | Self::Nothing => ink::SHADE,
        }
    }

    /// Fill and edge. Blue and orange stay apart for colour-blind eyes.
    pub(super) const fn inks(self) -> (&'static str, &'static str) {
        match self {
            Self::Left => ("#2166ac", "#123c66"),
            Self::Right => ("#d95f0e", "#8a3b06"),
            Self::Off => ("#e4e8ec", "#8a9bb0"),
            Self::Hazard => ("#b2182b", "#6d0d19"),
            Self::Nothing => ("#ffffff", "#52606d"),
        }
    }
}
