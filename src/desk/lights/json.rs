//! The timeline as JSON, one object a line.
//!
//! ```text
//! {"t": seconds, "events": [{"what": …}], "ground_truth": {"conventional": {way: light}, "v2i": {…}},
//!  "detected": {"conventional": {id: light}, "v2i": {…}}, "internal": [group], "external": [group]}
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Serialize;

use super::display;
use super::run::{Run, Shown, Step};
use crate::core::traffic_light::bulb::Bulb;
use crate::core::traffic_light::emission::{Element, GroupState, Prediction};
use crate::core::traffic_light::event_log::{ActionSource, ScenarioEvent, ScenarioOutcome};
use crate::core::traffic_light::scenario::Scenario;
use crate::core::traffic_light::target::{Channel, Layer, StoreId};

/// The line for a step, without line end: all there is to see, whether it changed or not.
pub fn line(step: &Step, run: &Run) -> String {
    let (shown, scenario) = (run.shown(), run.scenario());
    let line = Line {
        t: seconds(step.at.as_nanos()),
        events: step.notes.iter().map(|note| event(&note.what, scenario)).collect(),
        ground_truth: channels(shown, Layer::GroundTruth),
        detected: channels(shown, Layer::Detected),
        internal: shown.internal().map(|groups| groups.iter().map(InternalGroup::new).collect()),
        external: shown.external().map(|groups| groups.iter().map(ExternalGroup::new).collect()),
    };
    // Plain structs of numbers and strings: this cannot fail.
    serde_json::to_string(&line).unwrap_or_default()
}

#[derive(Serialize)]
struct Line<'a> {
    t: f64,
    events: Vec<EventOut<'a>>,
    ground_truth: Channels,
    detected: Channels,
    internal: Option<Vec<InternalGroup>>,
    external: Option<Vec<ExternalGroup>>,
}

#[derive(Serialize)]
#[serde(tag = "what", rename_all = "snake_case")]
enum EventOut<'a> {
    Phase { controller: &'a str, phase: &'a str },
    ActBegins { act: &'a str },
    ActEnds { act: &'a str },
    Event { act: &'a str, event: &'a str },
    Action { event: Option<&'a str>, does: String },
    End { verdict: &'static str, reason: Option<String> },
}

#[derive(Serialize)]
struct Channels {
    conventional: BTreeMap<i64, LightOut>,
    v2i: BTreeMap<i64, LightOut>,
}

#[derive(Serialize)]
struct LightOut {
    /// Empty = dark.
    state: String,
    confidence: f64,
}

#[derive(Serialize)]
struct InternalGroup {
    id: i64,
    elements: Vec<ElementOut>,
}

#[derive(Serialize)]
struct ExternalGroup {
    id: i64,
    elements: Vec<ElementOut>,
    predictions: Vec<PredictionOut>,
}

#[derive(Serialize)]
struct ElementOut {
    color: &'static str,
    status: &'static str,
    shape: &'static str,
    confidence: f64,
}

#[derive(Serialize)]
struct PredictionOut {
    /// On the same time line as `t`.
    at: f64,
    elements: Vec<ElementOut>,
    reliability: f64,
    source: &'static str,
}

impl InternalGroup {
    fn new(group: &Arc<GroupState>) -> Self {
        Self { id: group.relation_id, elements: elements(&group.elements) }
    }
}

impl ExternalGroup {
    fn new(group: &Arc<GroupState>) -> Self {
        let predictions = group.predictions.iter().map(PredictionOut::new).collect();
        Self { id: group.relation_id, elements: elements(&group.elements), predictions }
    }
}

impl PredictionOut {
    fn new(prediction: &Prediction) -> Self {
        Self {
            at: seconds(u64::try_from(prediction.at.as_nanos()).unwrap_or(0)),
            elements: elements(&prediction.elements),
            reliability: prediction.reliability,
            source: prediction.source,
        }
    }
}

fn elements(elements: &[Element]) -> Vec<ElementOut> {
    let element = |element: &Element| {
        let Bulb { color, status, shape } = element.bulb;
        let (color, status, shape) = (color.name(), status.name(), shape.name());
        ElementOut { color, status, shape, confidence: element.confidence }
    };
    elements.iter().map(element).collect()
}

fn channels(shown: &Shown, layer: Layer) -> Channels {
    let lights = |channel| {
        let lights = shown.store(StoreId { channel, layer });
        lights
            .map(|(id, sight)| {
                (id, LightOut { state: sight.bulbs.to_string(), confidence: sight.confidence })
            })
            .collect()
    };
    Channels { conventional: lights(Channel::Conventional), v2i: lights(Channel::V2i) }
}

fn event<'a>(what: &ScenarioEvent, scenario: &'a Scenario) -> EventOut<'a> {
    let act = |act: usize| scenario.acts.get(act).map_or("", |act| &act.name);
    let event_name = |act: usize, event: usize| {
        scenario.acts.get(act).and_then(|act| act.events.get(event)).map_or("", |event| &event.name)
    };
    match what {
        ScenarioEvent::PhaseEntered { controller, phase } => {
            let controller = scenario.controllers.get(controller.0);
            let phase = controller.and_then(|controller| controller.phases.get(*phase));
            EventOut::Phase {
                controller: controller.map_or("", |controller| &controller.name),
                phase: phase.map_or("", |phase| &phase.name),
            }
        }
        ScenarioEvent::ActStarted { act: index } => EventOut::ActBegins { act: act(*index) },
        ScenarioEvent::ActEnded { act: index } => EventOut::ActEnds { act: act(*index) },
        ScenarioEvent::EventStarted { act: index, event } => {
            EventOut::Event { act: act(*index), event: event_name(*index, *event) }
        }
        ScenarioEvent::ActionDone(source) => {
            let event = match source {
                ActionSource::Event { act, event, .. } => Some(event_name(*act, *event)),
                ActionSource::Init(_) | ActionSource::Outside => None,
            };
            EventOut::Action { event, does: display::happening(what, scenario).1 }
        }
        ScenarioEvent::Ended(verdict) => {
            let (verdict, reason) = match verdict {
                ScenarioOutcome::Success => ("success", None),
                ScenarioOutcome::Failure => ("failure", None),
                ScenarioOutcome::Stopped => ("stopped", None),
                ScenarioOutcome::Fault(refusal) => ("fault", Some(refusal.to_string())),
            };
            EventOut::End { verdict, reason }
        }
    }
}

#[allow(clippy::cast_precision_loss)] // exact to the nanosecond for 104 days
fn seconds(nanos: u64) -> f64 {
    nanos as f64 / 1e9
}
