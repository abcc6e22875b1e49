//! Whatever is received for groups that share heads, in whatever order, each group is sent with its own last
//! valid state and its future predictions.

use std::collections::BTreeMap;
use std::sync::Arc;

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

use super::*;
use crate::compat::Compat;
use crate::emission::{Emission, GroupElement, GroupState, LightsContent, LightsTopic};
use crate::engine::{LightsSettings, TrafficLights};
use crate::scenario::Scenario;
use crate::target::{LightChannel, StoreId};
use crate::text::parse_bulbs;
use gateway_base::time::{MonoTime, Now};
use lanelet2_map::light_map::{GroupEntry, LightMap};

const STATES: [&str; 4] = ["red", "green", "red, green left", "yellow flashing"];
/// Longer than a period of the V2I topics.
const STEP_MS: u64 = 150;
const TIMEOUT_MS: u64 = 500;
const MS: u64 = 1_000_000;

fn now(ms: u64) -> Now {
    let wall = WallStamp::from_nanos(i64::try_from(ms * MS).unwrap());
    Now { mono: MonoTime::from_millis(ms), wall }
}

/// Group 7 has no heads of its own, group 9 none at all; group 8 is not on the map.
fn map() -> Arc<LightMap> {
    let groups = [(1, &[11, 12][..]), (2, &[11, 12]), (3, &[12, 13]), (7, &[13]), (9, &[])];
    Arc::new(LightMap::new([], &groups.map(|(id, heads)| GroupEntry::new(id, heads))))
}

fn lights(one_group_per_head: bool) -> TrafficLights {
    let settings = LightsSettings {
        v2i_timeout: Some(Duration::from_millis(TIMEOUT_MS)),
        topics: [LightsTopic::V2i].into(),
        one_group_per_head,
        ..LightsSettings::new(map(), Scenario::default(), Compat::Improved)
    };
    TrafficLights::new(settings, now(0))
}

/// One received state: a group, a layer, a state or none, and predictions by their offset in milliseconds and
/// their reliability.
#[derive(Debug, Clone)]
struct Arrival {
    id: i64,
    layer: StoreLayer,
    state: Option<(&'static str, f64)>,
    predictions: Vec<(i64, f64)>,
    expires: bool,
}

fn arrival() -> impl Strategy<Value = Arrival> {
    let layer = select(vec![StoreLayer::GroundTruth, StoreLayer::GroundTruth, StoreLayer::Detected]);
    let state = option::weighted(0.8, (select(&STATES[..]), select(vec![0.5, 1.0, 0.25, f64::NAN])));
    let prediction = (-200..2_000_i64, select(vec![0.0, 0.5, 1.0, 1.0, f64::NAN, 1.5, -0.5]));
    let predictions = prop_oneof![vec(prediction.clone(), 0..4), vec(prediction, 0..30)];
    (select(vec![1, 1, 2, 2, 3, 7, 8, 9]), layer, state, predictions, any::<bool>()).prop_map(
        |(id, layer, state, predictions, expires)| Arrival { id, layer, state, predictions, expires },
    )
}

impl Arrival {
    fn received(&self, ms: u64) -> Option<ReceivedState> {
        let prediction = |(offset_ms, reliability): &(i64, f64)| Prediction {
            at: WallStamp::from_nanos((i64::try_from(ms).unwrap() + offset_ms) * 1_000_000),
            elements: parse_bulbs("red")
                .unwrap()
                .iter()
                .map(|bulb| GroupElement { bulb, confidence: 1.0 })
                .collect(),
            reliability: *reliability,
            source: format!("{offset_ms}").into(),
        };
        self.state.map(|(text, confidence)| ReceivedState {
            bulbs: parse_bulbs(text).unwrap(),
            confidence,
            predictions: self.predictions.iter().map(prediction).collect(),
        })
    }
}

/// The last valid states, with the time at which each expires.
#[derive(Default)]
struct Model(BTreeMap<Key, (ReceivedState, Option<u64>)>);

impl Model {
    /// Processes a received state. Returns the number of rejected states and predictions.
    fn take(&mut self, arrival: &Arrival, ms: u64) -> usize {
        let key = (arrival.layer, arrival.id);
        if [8, 9].contains(&arrival.id) {
            return 1;
        }
        let Some(mut state) = arrival.received(ms) else {
            self.0.remove(&key);
            return 0;
        };
        if state.confidence.is_nan() {
            return 1;
        }
        let all = state.predictions.len();
        state.predictions.retain(|prediction| (0.0..=1.0).contains(&prediction.reliability));
        let unfit = all - state.predictions.len();
        state.predictions.retain(|prediction| prediction.at.as_nanos() > now(ms).wall.as_nanos());
        state.predictions.sort_by_key(|prediction| prediction.at.as_nanos());
        let superfluous = state.predictions.len().saturating_sub(MAX_PREDICTIONS);
        state.predictions.truncate(MAX_PREDICTIONS);
        self.0.insert(key, (state, arrival.expires.then_some(ms + TIMEOUT_MS)));
        unfit + superfluous
    }

    /// Returns the groups of a message with this stamp.
    fn sent(&self, stamp: WallStamp) -> BTreeMap<i64, GroupState> {
        let stamp_ms = u64::try_from(stamp.as_nanos()).unwrap() / MS;
        let mut groups = BTreeMap::new();
        // Detected states come second, and override truth.
        for ((_, relation_id), (state, until)) in &self.0 {
            if until.is_some_and(|until| until <= stamp_ms) {
                continue;
            }
            let elements =
                state.bulbs.iter().map(|bulb| GroupElement { bulb, confidence: state.confidence }).collect();
            let ahead = |prediction: &&Prediction| prediction.at.as_nanos() > stamp.as_nanos();
            let predictions = state.predictions.iter().filter(ahead).cloned().collect();
            let relation_id = *relation_id;
            groups.insert(relation_id, GroupState { relation_id, elements, predictions });
        }
        groups
    }
}

fn last_message(lights: &mut TrafficLights) -> Option<Emission> {
    std::iter::from_fn(|| lights.poll_output()).last()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn each_group_is_sent_with_its_own_last_valid_state(
        steps in vec(vec(arrival(), 0..4), 1..30),
        one_group_per_head in any::<bool>(),
    ) {
        let (mut lights, mut model) = (lights(one_group_per_head), Model::default());
        lights.advance(now(STEP_MS));
        for (step, arrivals) in (2..).zip(steps) {
            let ms = step * STEP_MS;
            for arrival in arrivals {
                let store = StoreId { channel: LightChannel::V2i, layer: arrival.layer };
                let states = [(arrival.id, arrival.received(ms))];
                let rejected = lights.set_states(store, states, arrival.expires, now(ms));
                prop_assert_eq!(rejected, model.take(&arrival, ms), "{:?}", arrival);
            }
            while lights.poll_output().is_some() {}
            lights.advance(now(ms + STEP_MS - 1));
            let message = last_message(&mut lights).unwrap();
            let LightsContent::Groups(groups) = &message.content else { unreachable!() };
            let sent: BTreeMap<_, _> = groups.iter().map(|group| (group.relation_id, (**group).clone())).collect();
            prop_assert_eq!(sent.len(), groups.len(), "once each");
            prop_assert_eq!(sent, model.sent(message.stamp));
            prop_assert!(lights.stores().received.states(StoreLayer::GroundTruth).count() <= 4);
        }
    }
}
