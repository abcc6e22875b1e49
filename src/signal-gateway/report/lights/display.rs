//! Lights and groups as short text.

use super::snapshot::time_of;
use crate::report::palette::Lamp;
use gateway_base::time::MonoTime;
use traffic_lights::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};
use traffic_lights::emission::{GroupElement, GroupState, Prediction};
use traffic_lights::engine::LightObservation;

const RESET: &str = "\x1b[0m";

/// Style of text for a terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Style {
    #[default]
    Plain,
    Colored,
}

impl Style {
    /// Formats a light as its bulbs, or `dark`, with its confidence unless that is 1.
    pub(super) fn light(self, light: &LightObservation) -> String {
        self.bulbs(&light.bulbs) + &unsure(light.confidence)
    }

    fn bulbs(self, bulbs: &BulbSet) -> String {
        lit(bulbs.iter().map(|bulb| self.bulb(bulb)))
    }

    /// Formats a group as its bulbs, with its predictions if it has any.
    pub(super) fn group(self, group: &GroupState) -> String {
        let now = self.elements(&group.elements);
        let next: Vec<_> = group.predictions.iter().map(|prediction| self.prediction(prediction)).collect();
        if next.is_empty() { now } else { format!("{now}, then {}", next.join(", ")) }
    }

    fn prediction(self, prediction: &Prediction) -> String {
        format!("{} at {}", self.elements(&prediction.elements), seconds(time_of(prediction.at)))
    }

    fn elements(self, elements: &[GroupElement]) -> String {
        lit(elements.iter().map(|element| self.bulb(element.bulb) + &unsure(element.confidence)))
    }

    /// Formats a bulb as a state text without its defaults.
    fn bulb(self, bulb: Bulb) -> String {
        let mut parts = vec![bulb.color.name()];
        if bulb.status != BulbStatus::SolidOn || bulb.shape == BulbShape::Unknown {
            parts.push(bulb.status.name());
        }
        if bulb.shape != BulbShape::Circle {
            parts.push(bulb.shape.name());
        }
        let text = parts.join(" ");
        match self {
            Self::Plain => text,
            Self::Colored => format!("{}{text}{RESET}", color_code(bulb.color)),
        }
    }
}

/// Formats seconds with three decimals.
pub(super) fn seconds(at: MonoTime) -> String {
    // Rounded to the nearest, since a frame at 1/30 s is not exactly 0.033 s.
    let millis = (at.as_nanos() + 500_000) / 1_000_000;
    format!("{}.{:03}", millis / 1_000, millis % 1_000)
}

pub(super) fn list(ids: &[i64]) -> String {
    ids.iter().map(i64::to_string).collect::<Vec<_>>().join(", ")
}

/// Formats bulbs as state texts without their defaults, joined by ` + `; `dark` if there are none.
pub(in crate::report) fn bulbs_text(bulbs: &[Bulb]) -> String {
    lit(bulbs.iter().map(|bulb| Style::Plain.bulb(*bulb)))
}

fn lit(bulbs: impl Iterator<Item = String>) -> String {
    let bulbs: Vec<_> = bulbs.collect();
    if bulbs.is_empty() { "dark".to_owned() } else { bulbs.join(" + ") }
}

#[allow(clippy::float_cmp)] // 1.0 is the default
fn unsure(confidence: f64) -> String {
    if confidence == 1.0 { String::new() } else { format!(" ({confidence})") }
}

/// Begins a colour on a terminal: white is bold, and unknown is dim.
fn color_code(color: Color) -> String {
    match Lamp::of(color).terminal {
        Some(number) => format!("\x1b[3{number}m"),
        None if color == Color::Unknown => "\x1b[2m".to_owned(),
        None => "\x1b[1m".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use traffic_lights::text::parse_bulbs;

    #[test]
    fn every_bulb_is_written_as_its_state_text() {
        for color in Color::ALL {
            for status in BulbStatus::ALL {
                for shape in BulbShape::ALL {
                    let bulb = Bulb { color, status, shape };
                    let text = Style::Plain.bulb(bulb);
                    assert_eq!(parse_bulbs(&text), Ok([bulb].into_iter().collect()), "{text}");
                }
            }
        }
    }

    #[test]
    fn lights_are_written_without_defaults() {
        let cases = [
            ("red, green right", 1.0, "green right + red"),
            ("", 1.0, "dark"),
            ("yellow flashing", 0.5, "yellow flashing (0.5)"),
            ("unknown unknown unknown", 1.0, "unknown unknown unknown"),
        ];
        for (state, confidence, text) in cases {
            let bulbs = parse_bulbs(state).unwrap();
            assert_eq!(Style::Plain.light(&LightObservation { bulbs, confidence }), text);
        }
        let red = parse_bulbs("red").unwrap();
        assert_eq!(Style::Colored.bulbs(&red), "\x1b[31mred\x1b[0m");
    }
}
