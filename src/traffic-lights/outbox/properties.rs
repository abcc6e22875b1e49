//! Updated lists equal lists built from scratch, whatever changes in whatever order; so do the diagnostics'
//! counts.

use std::collections::BTreeMap;
use std::time::Duration;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

use super::*;
use crate::bulb_counts::BulbCounts;
use crate::compat::Compat;
use crate::engine::{LightObservation, LightsSettings, TrafficLights};
use crate::scenario::{
    Action, ControllerIndex, Phase, PhaseEntry, Scenario, StateText, TrafficSignalController,
};
use crate::target::{SignalTarget, StoreId};
use crate::text::parse_bulbs;
use gateway_base::time::{MonoTime, Now};
use lanelet2_map::light_map::{GroupEntry, LampColor, LightMap, MapLamp};

const HEADS: i64 = 12;
const STATES: [&str; 5] = ["green", "red, green right", "yellow flashing", "red solidOff", "unknown"];
const TOPICS: [LightsTopic; 4] =
    [LightsTopic::GroundTruth, LightsTopic::Camera, LightsTopic::V2i, LightsTopic::Markers];

#[derive(Debug, Clone)]
enum OutboxStep {
    States(Vec<(i64, Option<&'static str>, u8)>, StoreId),
    Done(Action),
    /// More changes than the change log keeps.
    Storm,
}

fn store() -> impl Strategy<Value = StoreId> {
    select(&StoreId::ALL[..])
}

/// Generates the id of a head, or of the relation of it and the next head.
fn id() -> impl Strategy<Value = i64> {
    (0..HEADS, any::<bool>()).prop_map(|(head, group)| if group { 100 + head } else { head })
}

fn step() -> impl Strategy<Value = OutboxStep> {
    let state = (id(), proptest::option::of(select(&STATES[..])), 0..=4_u8);
    let target = || (id(), store()).prop_map(|(id, store)| SignalTarget { id, store });
    let controller = (0..2_usize).prop_map(ControllerIndex);
    prop_oneof![
        4 => (vec(state, 1..4), store()).prop_map(|(states, store)| OutboxStep::States(states, store)),
        1 => target().prop_map(|target| OutboxStep::Done(Action::Clear(target))),
        1 => (target(), 0..=4_u8).prop_map(|(target, quarters)| {
            OutboxStep::Done(Action::SetConfidence { target, confidence: f64::from(quarters) / 4.0 })
        }),
        3 => (controller, select(vec!["one", "two", "three"])).prop_map(|(controller, phase)| {
            OutboxStep::Done(Action::EnterPhase { controller, phase: phase.to_owned() })
        }),
        2 => vec(id(), 1..4).prop_map(|ids| OutboxStep::Done(Action::EnableV2i(ids))),
        1 => vec(id(), 1..4).prop_map(|ids| OutboxStep::Done(Action::DisableV2i(ids))),
        1 => Just(OutboxStep::Storm),
    ]
}

/// Returns two controllers with a head in common; each relation has two heads, each head two lamps.
fn lights() -> TrafficLights {
    let lamp = |color| MapLamp { color, position_m: [1.0, 2.0, 3.0] };
    let lamps = (0..HEADS).map(|head| (head, vec![lamp(LampColor::Green), lamp(LampColor::Red)]));
    let group = |head| GroupEntry::new(100 + head, [head, (head + 1) % HEADS]);
    let groups: Vec<_> = (0..HEADS).map(group).collect();
    let phase = |name: &str, first: i64, store, state| Phase {
        name: name.to_owned(),
        duration: Some(Duration::from_secs(3_600)),
        entries: (first..first + 4)
            .map(|id| PhaseEntry { target: SignalTarget { id, store }, state: StateText::new(state) })
            .collect(),
    };
    let controller = |first| TrafficSignalController {
        name: String::new(),
        reference: None,
        phases: vec![
            phase("one", first, StoreId::CONVENTIONAL, "green"),
            phase("two", first, StoreId::V2I, "red"),
            phase("three", first + 1, StoreId::CONVENTIONAL, "yellow"),
        ],
    };
    let scenario = Scenario { controllers: vec![controller(0), controller(3)], ..Scenario::default() };
    let settings = LightsSettings {
        topics: BTreeSet::from(TOPICS),
        ..LightsSettings::new(Arc::new(LightMap::new(lamps, &groups)), scenario, Compat::Improved)
    };
    TrafficLights::new(settings, now(0))
}

fn now(millis: u64) -> Now {
    Now { mono: MonoTime::from_millis(millis), wall: WallStamp::default() }
}

fn observation(state: &str, quarters: u8) -> LightObservation {
    LightObservation { bulbs: parse_bulbs(state).unwrap(), confidence: f64::from(quarters) / 4.0 }
}

fn take(lights: &mut TrafficLights, step: OutboxStep, now: Now) {
    match step {
        OutboxStep::States(states, store) => {
            let states =
                states.into_iter().map(|(id, state, sure)| (id, state.map(|state| observation(state, sure))));
            assert_eq!(lights.set_states(store, states, true, now), 0);
        }
        OutboxStep::Done(action) => lights.apply(&action, now).unwrap(),
        OutboxStep::Storm => {
            for state in ["red", "green", "red", "yellow"].repeat(2) {
                let states = (0..HEADS).map(|id| (id, Some(observation(state, 4))));
                lights.set_states(StoreId::V2I, states, true, now);
            }
        }
    }
}

/// Returns the lists of all topics, built by a new outbox.
fn made_anew(lights: &TrafficLights) -> BTreeMap<LightsTopic, LightsContent> {
    let (mut outbox, stamp) = (Outbox::new(false), WallStamp::default());
    let (stores, predictions) = (lights.stores(), &lights.scenario_state.predictions);
    outbox.send_ground_truth(stores, stamp);
    outbox.send_camera(stores, stamp);
    outbox.send_v2i(stores, predictions, stamp);
    outbox.send_markers(stores, LightChannel::Conventional, stamp);
    outbox.waiting.into_iter().map(|emission| (emission.topic, emission.content)).collect()
}

/// Returns equal content that shares nothing with the original.
fn copy(content: &LightsContent) -> LightsContent {
    match content {
        LightsContent::Lights(lights) => LightsContent::lights(lights.iter().copied()),
        LightsContent::Groups(groups) => LightsContent::groups(groups.iter().map(|group| (**group).clone())),
        LightsContent::Markers(markers) => LightsContent::markers(markers.iter().copied()),
        LightsContent::Clock => LightsContent::Clock,
    }
}

fn counted(lights: impl Iterator<Item = BulbCounts>) -> BulbCounts {
    lights.fold(BulbCounts::default(), |sum, light| BulbCounts {
        lights: sum.lights + light.lights,
        dark: sum.dark + light.dark,
        unknown: sum.unknown + light.unknown,
        contradictory: sum.contradictory + light.contradictory,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn updated_lists_equal_new_ones(steps in vec((step(), any::<bool>()), 1..30)) {
        let mut lights = lights();
        let mut held: Vec<(LightsContent, LightsContent)> = Vec::new();
        for (index, (step, hold)) in (0..).zip(steps) {
            take(&mut lights, step, now(50 + index * 100));
            lights.advance(now(149 + index * 100));
            let mut sent = BTreeMap::new();
            while let Some(emission) = lights.poll_output() {
                sent.insert(emission.topic, emission.content);
            }
            prop_assert_eq!(&sent, &made_anew(&lights));
            if hold {
                held.extend(sent.values().map(|content| (content.clone(), copy(content))));
            }
            for channel in LightChannel::ALL {
                let (truth, detected) = (lights.stores().truth(channel), lights.stores().detected(channel));
                let counts = truth.lights().iter().map(|light| BulbCounts::of(light.bulbs));
                prop_assert_eq!(truth.counts, counted(counts));
                let counts = detected.entries().map(|(_, entry)| BulbCounts::of(entry.light.bulbs));
                prop_assert_eq!(detected.counts, counted(counts));
            }
        }
        for (shared, then) in held {
            prop_assert_eq!(&shared, &then, "a sent list does not change");
        }
    }
}
