//! The gateway's side of tests with traffic lights and subscriptions: its topics, what it sends, and
//! its reports of received messages.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use gateway_base::time::WallStamp;
use gateway_core::gateway::event::Input;
use gateway_core::gateway::event::Output;
use lanelet2_map::light_map::{LampColor, MapLamp};
use serde_json::{Value, json};
use signal_gateway::io::ros::inbox::{Arrival, Inbox};
use signal_gateway::io::ros::messages::LightsType;
use signal_gateway::io::ros::session::{
    Durability, LightsTopicSettings, Reliability, RosSession, Subscription, SubscriptionKind,
};
use traffic_lights::bulb::BulbSet;
use traffic_lights::bulb::{Bulb, BulbShape, BulbStatus, Color};
use traffic_lights::compat::Compat;
use traffic_lights::emission::{
    Emission, GroupElement, GroupState, LampMarker, LightState, LightsContent, LightsTopic, Prediction,
};
use traffic_lights::input::TrafficLightInput;
use traffic_lights::output::TrafficLightOutput;
use traffic_lights::received::ReceivedState;
use traffic_lights::target::{LightChannel, StoreId, StoreLayer};

use super::autoware_topics;
use crate::support::waiting::Pace;

const RED: Bulb = Bulb { color: Color::Red, status: BulbStatus::SolidOn, shape: BulbShape::Circle };

/// Topics in the order of the status.
pub(crate) fn outlets() -> Vec<LightsTopicSettings> {
    let outlet = |topic, name: &str, lights| LightsTopicSettings {
        topic,
        name: name.to_owned(),
        lights,
        compat: Compat::Improved,
    };
    vec![
        outlet(LightsTopic::GroundTruth, "/simulation/traffic_lights", LightsType::ArrayV1),
        outlet(LightsTopic::Camera, "/camera/traffic_signals", LightsType::SignalArray),
        outlet(LightsTopic::V2i, "/external/traffic_signals", LightsType::GroupArray),
        outlet(LightsTopic::V2i, "/v2x/traffic_signals", LightsType::GroupArray),
        outlet(LightsTopic::Markers, "/traffic_light/marker", LightsType::MarkerArray),
    ]
}

/// Subscriptions 0 to 3.
pub(crate) fn subscriptions() -> Vec<Subscription> {
    let groups =
        SubscriptionKind::Groups(StoreId { channel: LightChannel::V2i, layer: StoreLayer::Detected });
    let subscription = |name: &str, kind, reliability, durability| Subscription {
        name: name.to_owned(),
        kind,
        reliability,
        durability,
        // However long the machine keeps the session from taking them.
        depth: 1000,
    };
    vec![
        subscription("/groups", groups, Reliability::Reliable, Durability::Volatile),
        subscription("/commands", SubscriptionKind::Command, Reliability::Reliable, Durability::Volatile),
        subscription("/lossy_groups", groups, Reliability::BestEffort, Durability::Volatile),
        subscription(
            "/kept_commands",
            SubscriptionKind::Command,
            Reliability::Reliable,
            Durability::TransientLocal,
        ),
    ]
}

/// `lights TOPIC SEC` sends one emission with a stamp of SEC s; `lights TOPIC SEC COUNT TIMES` sends so
/// many of COUNT groups each, 30 a second, stamps ascending from SEC, and reports when it is done.
pub(crate) fn send(session: &RosSession, command: &str) {
    let arguments: Vec<&str> = command.split(' ').collect();
    let (first, topic): (i64, _) = (arguments[2].parse().unwrap(), arguments[1]);
    let count = arguments.get(3).map_or(1, |count| count.parse().unwrap());
    let times = arguments.get(4).map_or(1, |times| times.parse().unwrap());
    let (topic, content) = content(topic, count);
    let mut pace = Pace::every(Duration::from_secs(1) / 30);
    let mut longest = Duration::ZERO;
    for (number, sec) in (0_u32..times).zip(first..) {
        if number > 0 {
            pace.wait();
        }
        let content = content.clone();
        let stamp = WallStamp::from_nanos(sec * 1_000_000_000);
        let (output, sent_at) = (
            Output::TrafficLights(TrafficLightOutput::Publish(Emission { topic, stamp, content })),
            Instant::now(),
        );
        session.send(&output);
        longest = longest.max(sent_at.elapsed());
    }
    if times > 1 {
        println!("{}", json!({"event": "sent", "longest_call_us": longest.as_micros()}));
    }
}

fn content(topic: &str, count: i64) -> (LightsTopic, LightsContent) {
    let bulbs = [RED].into_iter().collect();
    let elements = vec![GroupElement { bulb: RED, confidence: 0.5 }];
    let prediction = Prediction {
        at: WallStamp::from_nanos(9_000_000_001),
        elements: elements.clone(),
        reliability: 1.0,
        source: "SIMULATION".into(),
    };
    let group =
        |relation_id, predictions| GroupState { relation_id, elements: elements.clone(), predictions };
    let lamp = MapLamp { color: LampColor::Red, position_m: [1.0, 2.0, 3.0] };
    match topic {
        "truth" => (
            LightsTopic::GroundTruth,
            LightsContent::lights((0..count).map(|way_id| LightState { way_id, bulbs, confidence: 0.5 })),
        ),
        "camera" => (LightsTopic::Camera, LightsContent::groups((0..count).map(|id| group(id, vec![])))),
        "v2i" => (
            LightsTopic::V2i,
            LightsContent::groups((0..count).map(|id| group(id, vec![prediction.clone()]))),
        ),
        "markers" => {
            (LightsTopic::Markers, LightsContent::markers([LampMarker { way_id: 1, lamp, is_on: true }]))
        }
        other => panic!("unknown topic {other}"),
    }
}

/// Prints each arrival, with the time of day.
pub(crate) fn print_arrivals(inbox: &Inbox) {
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(async {
        while let Some(Arrival { subscription, input, .. }) = inbox.take().await {
            let at = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64();
            println!("{}", shown(subscription, &input, at));
        }
    });
}

fn shown(subscription: usize, input: &Input, at: f64) -> Value {
    let what = match input {
        Input::TrafficLight(TrafficLightInput::Command(text)) if text.len() > 100 => {
            json!({"length": text.len()})
        }
        Input::TrafficLight(TrafficLightInput::Command(text)) => json!({"text": text}),
        Input::TrafficLight(TrafficLightInput::States { stamp, states, rejected, .. }) => {
            let listed = states.iter().map(|(id, state)| {
                let shown = |state: &ReceivedState| (state.bulbs, state.confidence);
                let (bulbs, confidence) = state.as_ref().map_or((BulbSet::EMPTY, 1.0), shown);
                json!([id, bulbs.to_string(), confidence])
            });
            json!({"sec": stamp.sec(), "groups": listed.collect::<Vec<_>>(), "rejected": rejected})
        }
        Input::TrafficLight(TrafficLightInput::Camera { stamp, groups, rejected }) => {
            json!({"sec": stamp.sec(), "groups": groups.len(), "rejected": rejected})
        }
        Input::TrafficLight(TrafficLightInput::Clock(stamp)) => {
            json!({"sec": stamp.sec(), "nanosec": stamp.nanosec()})
        }
        Input::Planner(_) | Input::Command(_) | Input::Can(_) | Input::Tick => autoware_topics::shown(input),
    };
    json!({"event": "arrived", "at": at, "subscription": subscription, "what": what})
}
