//! Turn signals and hazard lights in a chart: sent, requested by a section, or expected.

use super::svg::{Area, Element, bordered, rect};
use crate::report::palette::{self, Meaning, Paint};

/// Kind of a command in a chart.
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

    /// Returns its share of the row's height. A desired section leaves room above and below.
    const fn height(self) -> f64 {
        match self {
            Self::Signal | Self::Required | Self::Expected => 1.0,
            Self::Desired => 0.6,
        }
    }

    /// Returns the box.
    pub(super) fn field(self, indicator: IndicatorState, area: Area) -> Element {
        let height = area.height * self.height();
        let field = rect(area.x, area.y + (area.height - height) / 2.0, area.width, height);
        let field = bordered(field.fill(indicator.fill()), area);
        match self {
            Self::Signal | Self::Required => field,
            Self::Desired => field.with("fill-opacity", 0.3),
            Self::Expected => field.with("fill-opacity", 0.3).with("stroke-dasharray", "3 2"),
        }
    }

    /// Returns the text in the box, after its sign.
    pub(super) const fn label(self, indicator: IndicatorState) -> &'static str {
        match self {
            Self::Signal | Self::Required | Self::Expected => indicator.name(),
            Self::Desired => "",
        }
    }

    /// Returns the colour of the text in the box, which depends on how much of the box is filled.
    pub(super) fn ink(self, indicator: IndicatorState) -> Paint {
        match self {
            Self::Signal | Self::Required => indicator.meaning().map_or(palette::TEXT, |meaning| meaning.on),
            Self::Desired | Self::Expected => palette::TEXT,
        }
    }
}

impl IndicatorState {
    /// Returns the name of the command.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Left => "LEFT",
            Self::Right => "RIGHT",
            Self::Off => "DISABLE",
            Self::Hazard => "HAZARD",
            Self::Nothing => "NO_COMMAND",
        }
    }

    /// Returns the colours and sign that show it; `None` without a command.
    pub(super) const fn meaning(self) -> Option<Meaning> {
        match self {
            Self::Left => Some(palette::LEFT),
            Self::Right => Some(palette::RIGHT),
            Self::Off => Some(palette::OFF),
            Self::Hazard => Some(palette::HAZARD),
            Self::Nothing => None,
        }
    }

    /// Returns the fill colour of a field with this state.
    pub(super) fn fill(self) -> Paint {
        self.meaning().map_or(palette::CARD, |meaning| meaning.fill)
    }

    /// Returns the sign that repeats the colour.
    pub(super) fn sign(self) -> &'static str {
        self.meaning().map_or("", |meaning| meaning.sign)
    }

    /// Returns the light colour for lanes that turn to a side.
    pub(super) const fn tint(self) -> Paint {
        match self {
            Self::Left => palette::LEFT_TINT,
            Self::Right => palette::RIGHT_TINT,
            Self::Off | Self::Hazard | Self::Nothing => palette::PAGE,
        }
    }
}
