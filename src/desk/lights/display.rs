//! Lights, groups, actions and happenings in short words.

use crate::core::time::MonoTime;
use crate::core::traffic_light::bulb::{Bulb, BulbSet, Color, Shape, Status};
use crate::core::traffic_light::emission::{Element, GroupState, Prediction};
use crate::core::traffic_light::engine::LightObservation;
use crate::core::traffic_light::event_log::{ActionSource, ScenarioEvent, ScenarioOutcome};
use crate::core::traffic_light::scenario::{Action, Scenario};
use crate::core::traffic_light::target::{Channel, Layer, StoreId, Target};

const RESET: &str = "\x1b[0m";

/// How words are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// Nothing but words.
    #[default]
    Plain,
    /// With terminal colours.
    Colored,
}

impl Style {
    /// A light: its bulbs, or `dark`; with how sure it is, unless fully.
    pub fn sight(self, sight: &LightObservation) -> String {
        self.bulbs(&sight.bulbs) + &unsure(sight.confidence)
    }

    /// Bulbs joined by ` + `.
    pub fn bulbs(self, bulbs: &BulbSet) -> String {
        let words: Vec<_> = bulbs.iter().map(|bulb| self.bulb(bulb)).collect();
        if words.is_empty() { "dark".to_owned() } else { words.join(" + ") }
    }

    /// A group as it was sent: its bulbs, and how it will look, when it was told.
    pub fn group(self, group: &GroupState) -> String {
        let now = self.elements(&group.elements);
        let next: Vec<_> = group.predictions.iter().map(|prediction| self.prediction(prediction)).collect();
        if next.is_empty() { now } else { format!("{now}, then {}", next.join(", ")) }
    }

    fn prediction(self, prediction: &Prediction) -> String {
        let at = u64::try_from(prediction.at.as_nanos()).map_or(MonoTime::ZERO, MonoTime::from_nanos);
        format!("{} at {}", self.elements(&prediction.elements), seconds(at))
    }

    fn elements(self, elements: &[Element]) -> String {
        let words: Vec<_> =
            elements.iter().map(|element| self.bulb(element.bulb) + &unsure(element.confidence)).collect();
        if words.is_empty() { "dark".to_owned() } else { words.join(" + ") }
    }

    /// As a state text says it: without what it means anyway.
    fn bulb(self, bulb: Bulb) -> String {
        let mut words = vec![bulb.color.name()];
        if bulb.status != Status::SolidOn || bulb.shape == Shape::Unknown {
            words.push(bulb.status.name());
        }
        if bulb.shape != Shape::Circle {
            words.push(bulb.shape.name());
        }
        let words = words.join(" ");
        match (self, color_code(bulb.color)) {
            (Self::Plain, _) => words,
            (Self::Colored, code) => format!("{code}{words}{RESET}"),
        }
    }
}

/// Seconds with three decimals.
pub fn seconds(at: MonoTime) -> String {
    // To the nearest, as a frame at 1/30 s is not quite 0.033 s.
    let millis = (at.as_nanos() + 500_000) / 1_000_000;
    format!("{}.{:03}", millis / 1_000, millis % 1_000)
}

/// The word for a store that scenarios use.
pub fn store(store: StoreId) -> &'static str {
    match (store.channel, store.layer) {
        (Channel::Conventional, Layer::GroundTruth) => "conventional",
        (Channel::Conventional, Layer::Detected) => "conventional_detected",
        (Channel::V2i, Layer::GroundTruth) => "v2i",
        (Channel::V2i, Layer::Detected) => "v2i_detected",
    }
}

/// What kind of happening it is, and what happened.
pub fn happening(what: &ScenarioEvent, scenario: &Scenario) -> (&'static str, String) {
    match what {
        ScenarioEvent::PhaseEntered { controller, phase } => {
            let controller = scenario.controllers.get(controller.0);
            let phase = controller.and_then(|controller| controller.phases.get(*phase));
            let name = controller.map_or("", |controller| &controller.name);
            ("phase", format!("{name}: {}", phase.map_or("", |phase| &phase.name)))
        }
        ScenarioEvent::ActStarted { act } => ("act", format!("{} begins", act_name(scenario, *act))),
        ScenarioEvent::ActEnded { act } => ("act", format!("{} ends", act_name(scenario, *act))),
        ScenarioEvent::EventStarted { act, event } => {
            let event = scenario.acts.get(*act).and_then(|act| act.events.get(*event));
            ("event", event.map(|event| event.name.clone()).unwrap_or_default())
        }
        ScenarioEvent::ActionDone(source) => {
            ("action", action_of(*source, scenario).map(|done| action(done, scenario)).unwrap_or_default())
        }
        ScenarioEvent::Ended(verdict) => ("end", verdict_words(verdict)),
    }
}

/// The action that was done.
pub fn action_of(source: ActionSource, scenario: &Scenario) -> Option<&Action> {
    match source {
        ActionSource::Init(index) => scenario.init.get(index),
        ActionSource::Event { act, event, action } => {
            scenario.acts.get(act)?.events.get(event)?.actions.get(action)
        }
        ActionSource::Outside => None,
    }
}

/// An action in words.
pub fn action(action: &Action, scenario: &Scenario) -> String {
    let set = |target: &Target, text: &str| {
        if text.is_empty() { format!("set {target} to nothing") } else { format!("set {target} to {text}") }
    };
    match action {
        Action::SetState { target, state } => set(target, &state.text),
        Action::Clear { target } => format!("clear {target}"),
        Action::EnterPhase { controller, phase } => {
            let controller = scenario.controllers.get(controller.0).map_or("", |controller| &controller.name);
            format!("{controller} shall enter {phase}")
        }
        Action::SetV2iState { id, state, rate_hz } => {
            let store = StoreId { channel: Channel::V2i, layer: Layer::GroundTruth };
            let rate = rate_hz.map(|rate| format!(", v2i at {rate} Hz")).unwrap_or_default();
            set(&Target { id: *id, store }, &state.text) + &rate
        }
        Action::SetV2iRate { rate_hz } => format!("send v2i at {rate_hz} Hz"),
        Action::EnableV2i { ids } => format!("enable v2i of {}", list(ids)),
        Action::DisableV2i { ids } => format!("disable v2i of {}", list(ids)),
        Action::SetConfidence { target, confidence } => format!("confidence of {target} is {confidence}"),
        Action::End { success: true } => "end with success".to_owned(),
        Action::End { success: false } => "end with failure".to_owned(),
    }
}

/// How it ended, in words.
pub fn verdict_words(verdict: &ScenarioOutcome) -> String {
    match verdict {
        ScenarioOutcome::Success => "success".to_owned(),
        ScenarioOutcome::Failure => "failure".to_owned(),
        ScenarioOutcome::Stopped => "stopped by its stop trigger".to_owned(),
        ScenarioOutcome::Fault(refusal) => format!("cannot go on: {refusal}"),
    }
}

/// Ids joined by `, `.
pub fn list(ids: &[i64]) -> String {
    ids.iter().map(i64::to_string).collect::<Vec<_>>().join(", ")
}

fn act_name(scenario: &Scenario, act: usize) -> &str {
    scenario.acts.get(act).map_or("", |act| &act.name)
}

#[allow(clippy::float_cmp)] // 1.0 is what stands there when nobody said anything
fn unsure(confidence: f64) -> String {
    if confidence == 1.0 { String::new() } else { format!(" ({confidence})") }
}

const fn color_code(color: Color) -> &'static str {
    match color {
        Color::Green => "\x1b[32m",
        Color::Yellow => "\x1b[33m",
        Color::Red => "\x1b[31m",
        Color::White => "\x1b[1m",
        Color::Unknown => "\x1b[2m",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::traffic_light::text::parse_bulbs;

    #[test]
    fn every_bulb_is_written_as_a_state_text_that_means_it() {
        for color in Color::ALL {
            for status in Status::ALL {
                for shape in Shape::ALL {
                    let bulb = Bulb { color, status, shape };
                    let words = Style::Plain.bulb(bulb);
                    assert_eq!(parse_bulbs(&words), Ok([bulb].into_iter().collect()), "{words}");
                }
            }
        }
    }

    #[test]
    fn lights_are_written_in_short() {
        let cases = [
            ("red, green right", 1.0, "green right + red"),
            ("", 1.0, "dark"),
            ("yellow flashing", 0.5, "yellow flashing (0.5)"),
            ("unknown unknown unknown", 1.0, "unknown unknown unknown"),
        ];
        for (text, confidence, words) in cases {
            let bulbs = parse_bulbs(text).unwrap();
            assert_eq!(Style::Plain.sight(&LightObservation { bulbs, confidence }), words);
        }
        let red = parse_bulbs("red").unwrap();
        assert_eq!(Style::Colored.bulbs(&red), "\x1b[31mred\x1b[0m");
    }
}
