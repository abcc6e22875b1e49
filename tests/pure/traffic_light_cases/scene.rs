//! A scenario on a small map, in a short notation, and its states second by second.
//!
//! Bulbs are G, Y, R (solid circles), GR and GL (green arrows), `?` (unknown unknown circle); any other is
//! written by its three initials. Bulbs of one light are joined by `+`, `{}` is dark, `-` is nothing.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use lanelet2_map::light_map::{GroupEntry, LightMap};
use traffic_lights::bulb::Bulb;
use traffic_lights::compat::Compat;
use traffic_lights::emission::{Emission, GroupState, LightsContent, LightsTopic};
use traffic_lights::engine::{LightsSettings, TrafficLights};
use traffic_lights::event_log::{LoggedEvent, ScenarioEvent, ScenarioOutcome};
use traffic_lights::periodic_timer::Rate;
use traffic_lights::scenario::{
    Act, Action, Condition, ControllerIndex, Edge, Event, Phase, PhaseEntry, Reference, Rule, Scenario,
    StateText, Test, TrafficSignalController, Trigger,
};

use crate::support::clock::{EPOCH_NS, at_ns};
use traffic_lights::target::{LightChannel, SignalTarget, StoreId, StoreLayer};

pub(crate) const BOTH: [Compat; 2] = [Compat::Improved, Compat::Upstream];
pub(crate) const SECOND: u64 = 1_000_000_000;

/// Relation 100 refers to heads 11 and 12, relation 200 to head 21.
pub(crate) fn small_map() -> Arc<LightMap> {
    Arc::new(LightMap::new([], &[GroupEntry::new(100, [11, 12]), GroupEntry::new(200, [21])]))
}

pub(crate) fn target(text: &str) -> SignalTarget {
    SignalTarget::parse(text).unwrap()
}

pub(crate) fn set(at: &str, state: &str) -> Action {
    Action::SetState { target: target(at), state: StateText::new(state) }
}

/// Phases as (name, seconds or `inf`, entries as `target=state; …`).
pub(crate) fn controller(name: &str, phases: &[(&str, &str, &str)]) -> TrafficSignalController {
    let entry = |text: &str| {
        let (at, state) = text.split_once('=').unwrap();
        PhaseEntry { target: target(at.trim()), state: StateText::new(state) }
    };
    let phase = |(name, duration, entries): &(&str, &str, &str)| Phase {
        name: (*name).to_owned(),
        duration: duration.parse().ok().filter(|s: &f64| s.is_finite()).map(Duration::from_secs_f64),
        entries: entries.split(';').filter(|text| !text.is_empty()).map(entry).collect(),
    };
    TrafficSignalController {
        name: name.to_owned(),
        reference: None,
        phases: phases.iter().map(phase).collect(),
    }
}

pub(crate) fn following(
    mut follower: TrafficSignalController,
    controller: usize,
    delay_s: f64,
) -> TrafficSignalController {
    let delay = Duration::from_secs_f64(delay_s);
    follower.reference = Some(Reference { controller: ControllerIndex(controller), delay });
    follower
}

pub(crate) fn time_condition(rule: Rule, seconds: f64) -> Trigger {
    let test = Test::SimulationTime { rule, value: Duration::from_secs_f64(seconds) };
    let condition = Condition { name: "time".to_owned(), test, edge: Edge::None, delay: Duration::ZERO };
    Trigger { groups: vec![vec![condition]] }
}

pub(crate) fn event(name: &str, start: Trigger, actions: Vec<Action>) -> Event {
    let action_names = (0..actions.len()).map(|number| format!("{name}/{number}")).collect();
    Event { name: name.to_owned(), start: Some(start), max_executions: 1, action_names, actions }
}

/// Actions at whole seconds.
pub(crate) fn script(actions: &[(u32, Action)]) -> Vec<Act> {
    let event = |(at, action): &(u32, Action)| {
        event(&format!("at {at}"), time_condition(Rule::GreaterOrEqual, f64::from(*at)), vec![action.clone()])
    };
    vec![Act { name: "script".to_owned(), events: actions.iter().map(event).collect(), ..Act::default() }]
}

/// One frame a second from 0 on, publications ten times as often.
pub(crate) fn settings(map: Arc<LightMap>, scenario: Scenario, compat: Compat) -> LightsSettings {
    LightsSettings {
        frame_rate: Rate::from_hz(1.0).unwrap(),
        first_frame: 0,
        ground_truth_rate: Rate::TEN_HZ,
        one_group_per_head: true,
        topics: [LightsTopic::GroundTruth, LightsTopic::Camera, LightsTopic::V2i].into(),
        ..LightsSettings::new(map, scenario, compat)
    }
}

pub(crate) struct Scene {
    pub(crate) lights: TrafficLights,
    pub(crate) events: Vec<LoggedEvent>,
    pub(crate) last: BTreeMap<LightsTopic, Emission>,
    second: u64,
}

impl Scene {
    pub(crate) fn new(settings: LightsSettings) -> Self {
        Self {
            lights: TrafficLights::new(settings, at_ns(0)),
            events: Vec::new(),
            last: BTreeMap::new(),
            second: 0,
        }
    }

    pub(crate) fn of(
        compat: Compat,
        controllers: Vec<TrafficSignalController>,
        actions: &[(u32, Action)],
    ) -> Self {
        let scenario = Scenario { controllers, acts: script(actions), ..Scenario::default() };
        Self::new(settings(small_map(), scenario, compat))
    }

    /// To the end of that second.
    pub(crate) fn run_to(&mut self, second: u64) {
        while self.second <= second {
            self.lights.advance(at_ns(self.second * SECOND + SECOND * 9 / 10));
            while let Some(emission) = self.lights.poll_output() {
                self.last.insert(emission.topic, emission);
            }
            self.events.extend(std::iter::from_fn(|| self.lights.poll_event()));
            self.second += 1;
        }
    }

    /// Checks rows of a second and `what=value` pairs, see [`Scene::value`].
    pub(crate) fn check(mut self, case: &str, rows: &[(u64, &str)]) -> Self {
        for (second, expected) in rows {
            self.run_to(*second);
            for pair in expected.split_whitespace() {
                let (what, value) = pair.split_once('=').unwrap();
                let (found, verdict) = (self.value(what, *second), self.lights.verdict());
                assert_eq!(found, value, "{case} at {second}: {what} in {expected}, {verdict:?}");
            }
        }
        self
    }

    /// A state by its short name. `gt21`, `v2i21`: ground truth of a head. `det`, `v2idet`: all detections.
    /// `int`, `ext`: groups as sent. `p200`: predictions of group 200, seconds from now. `A`: phase of
    /// controller A.
    pub(crate) fn value(&self, what: &str, second: u64) -> String {
        match what {
            "det" => self.detections(LightChannel::Conventional),
            "v2idet" => self.detections(LightChannel::V2i),
            "int" => self.groups(LightsTopic::Camera).iter().map(group_text).collect::<Vec<_>>().join(","),
            "ext" => self.groups(LightsTopic::V2i).iter().map(group_text).collect::<Vec<_>>().join(","),
            _ if what.starts_with("gt") => self.truth(StoreId::CONVENTIONAL, &what[2..]),
            _ if what.starts_with("v2i") => self.truth(StoreId::V2I, &what[3..]),
            _ if what.starts_with('p') => self.predictions(what[1..].parse().unwrap(), second),
            name => {
                let scenario = self.lights.scenario();
                let index = scenario.controllers.iter().position(|known| known.name == name).unwrap();
                let phase = self.lights.phase(ControllerIndex(index));
                phase.map_or("-".to_owned(), |phase| scenario.controllers[index].phases[phase].name.clone())
            }
        }
    }

    /// The entered phases, for frames of this length, nanoseconds: (controller, phase, frame).
    pub(crate) fn entries(&self, frame_nanos: f64) -> Vec<(usize, usize, u64)> {
        let entry = |logged: &LoggedEvent| {
            let ScenarioEvent::PhaseEntered { controller, phase } = logged.event else { return None };
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // small and positive
            let frame = (logged.at.as_secs_f64() * 1e9 / frame_nanos).round() as u64;
            Some((controller.0, phase, frame))
        };
        self.events.iter().filter_map(entry).collect()
    }

    pub(crate) fn verdict(&self) -> Option<&ScenarioOutcome> {
        self.lights.verdict()
    }

    fn groups(&self, topic: LightsTopic) -> &[Arc<GroupState>] {
        match self.last.get(&topic).map(|emission| &emission.content) {
            Some(LightsContent::Groups(groups)) => groups,
            Some(LightsContent::Lights(_) | LightsContent::Markers(_) | LightsContent::Clock) => {
                panic!("{topic:?} sends groups")
            }
            None => &[],
        }
    }

    fn truth(&self, store: StoreId, id: &str) -> String {
        let light = self.lights.states(store).remove(&id.parse().unwrap());
        light.map_or("-".to_owned(), |light| bulbs_text(light.bulbs.iter()))
    }

    fn detections(&self, channel: LightChannel) -> String {
        let states = self.lights.states(StoreId { channel, layer: StoreLayer::Detected });
        let texts: Vec<_> =
            states.iter().map(|(id, light)| format!("{id}:{}", bulbs_text(light.bulbs.iter()))).collect();
        if texts.is_empty() { "-".to_owned() } else { texts.join(",") }
    }

    fn predictions(&self, relation_id: i64, second: u64) -> String {
        let groups = self.groups(LightsTopic::V2i).iter();
        let of_group = groups.filter(|group| group.relation_id == relation_id);
        let predictions = of_group.flat_map(|group| &group.predictions);
        let texts: Vec<_> = predictions
            .map(|predicted| {
                let nanos = (predicted.at.as_nanos() - EPOCH_NS).cast_unsigned() - second * SECOND;
                let offset = Duration::from_nanos(nanos).as_secs_f64();
                format!("{offset}{}", bulbs_text(predicted.elements.iter().map(|element| element.bulb)))
            })
            .collect();
        texts.join(",")
    }
}

fn group_text(group: &Arc<GroupState>) -> String {
    format!("{}:{}", group.relation_id, bulbs_text(group.elements.iter().map(|element| element.bulb)))
}

fn bulbs_text(bulbs: impl Iterator<Item = Bulb>) -> String {
    let texts: Vec<_> = bulbs.map(bulb_text).collect();
    if texts.is_empty() { "{}".to_owned() } else { texts.join("+") }
}

fn bulb_text(bulb: Bulb) -> String {
    match bulb.to_string().as_str() {
        "green solidOn circle" => "G".to_owned(),
        "yellow solidOn circle" => "Y".to_owned(),
        "red solidOn circle" => "R".to_owned(),
        "green solidOn right" => "GR".to_owned(),
        "green solidOn left" => "GL".to_owned(),
        "unknown unknown circle" => "?".to_owned(),
        other => other.split(' ').filter_map(|part| part.chars().next()).collect(),
    }
}
