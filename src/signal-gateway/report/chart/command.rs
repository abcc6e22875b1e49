//! Turn signals and hazard lights in a chart: sent, requested by a section, or expected.

use serde::Serialize;

use super::svg::{Area, Element, bordered, rect};
use crate::report::palette::{self, Meaning, Paint};
use gateway_base::names::named_by_variant;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CommandKind {
    Signal,
    /// A section in which a side may be signalled.
    Desired,
    /// A section in which a side must be signalled.
    Required,
    Expected,
}

/// State of turn indicators and hazard lights, named like the command for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum IndicatorState {
    Left,
    Right,
    /// Neither side of the vehicle blinks.
    #[serde(rename = "DISABLE")]
    Off,
    Hazard,
    #[serde(rename = "NO_COMMAND")]
    Nothing,
}

named_by_variant!(IndicatorState);

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

    /// Returns the box. A desired section leaves room above and below.
    pub(super) fn field(self, indicator: IndicatorState, area: Area) -> Element {
        let height = area.height * if self == Self::Desired { 0.6 } else { 1.0 };
        let field = rect(area.x, area.y + (area.height - height) / 2.0, area.width, height);
        let field = bordered(field.fill(indicator.fill()), area);
        match self {
            Self::Signal | Self::Required => field,
            Self::Desired => field.with("fill-opacity", 0.3),
            Self::Expected => field.with("fill-opacity", 0.3).with("stroke-dasharray", "3 2"),
        }
    }

    /// Returns the text in the box, after its sign.
    pub(super) fn label(self, indicator: IndicatorState) -> &'static str {
        if self == Self::Desired { "" } else { indicator.name() }
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

    pub(super) fn fill(self) -> Paint {
        self.meaning().map_or(palette::CARD, |meaning| meaning.fill)
    }

    pub(super) fn sign(self) -> &'static str {
        self.meaning().map_or("", |meaning| meaning.sign)
    }

    pub(super) const fn tint(self) -> Paint {
        match self {
            Self::Left => palette::LEFT_TINT,
            Self::Right => palette::RIGHT_TINT,
            Self::Off | Self::Hazard | Self::Nothing => palette::PAGE,
        }
    }
}
