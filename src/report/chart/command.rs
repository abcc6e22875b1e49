//! Turn signals and hazard lights in a chart: as they were sent, wanted or expected.

use super::ink;
use super::svg::{Element, Place, rect};

/// What a command in a chart is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CommandKind {
    /// It was sent.
    Signal,
    /// A section in which a side may be signalled.
    Desired,
    /// A section in which a side must be signalled.
    Required,
    /// It was expected.
    Expected,
}

/// State of turn indicators and hazard lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum IndicatorState {
    /// Left.
    Left,
    /// Right.
    Right,
    /// Neither.
    Off,
    /// Hazard lights.
    Hazard,
    /// No command.
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
    pub(super) fn field(self, indicator: IndicatorState, place: Place) -> Element {
        let (fill, edge) = indicator.inks();
        let (share, opacity) = match self {
            Self::Signal => (1.0, None),
            Self::Desired => (0.5, Some(0.3)),
            Self::Required => (1.0, Some(0.75)),
            Self::Expected => (0.4, Some(0.6)),
        };
        let height = place.height * share;
        let field = rect(place.x, place.y + (place.height - height) / 2.0, place.width, height);
        let field = field.with("fill", fill);
        match opacity {
            None => field.with("stroke", edge).with("stroke-width", 0.75),
            Some(opacity) => field.with("fill-opacity", opacity).with("stroke", edge),
        }
    }

    /// What is written in the box, and its colour.
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
    /// As the command is called.
    const fn name(self) -> &'static str {
        match self {
            Self::Left => "LEFT",
            Self::Right => "RIGHT",
            Self::Off => "DISABLE",
            Self::Hazard => "hazard lights",
            Self::Nothing => "NO_COMMAND",
        }
    }

    /// Fill and edge. Blue and orange stay apart for colour-blind eyes.
    const fn inks(self) -> (&'static str, &'static str) {
        match self {
            Self::Left => ("#2166ac", "#123c66"),
            Self::Right => ("#d95f0e", "#8a3b06"),
            Self::Off => ("#e4e8ec", "#8a9bb0"),
            Self::Hazard => ("#b2182b", "#6d0d19"),
            Self::Nothing => ("#ffffff", "#52606d"),
        }
    }
}
