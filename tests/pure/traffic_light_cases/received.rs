//! States received over v2i for groups with the same heads (docs/spec/traffic-lights.md, "Received states"):
//! from inputs, and from a V2X unit on CAN.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::Level;
use gateway_base::time::WallStamp;
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use lanelet2_map::light_map::{GroupEntry, LampColor, LightMap, MapLamp};
use signal_gateway::config::{Overrides, load};
use traffic_lights::compat::Compat;
use traffic_lights::emission::{GroupElement, GroupState, LightsContent, LightsTopic, Prediction};
use traffic_lights::engine::{LightsSettings, TrafficLights};
use traffic_lights::output::TrafficLightOutput;
use traffic_lights::received::ReceivedState;
use traffic_lights::refusal::ActionRefusal;
use traffic_lights::scenario::{Act, Condition, Edge, Scenario, StateText, Test, Trigger};
use traffic_lights::target::{LightChannel, StoreId, StoreLayer};
use traffic_lights::text::parse_bulbs;

use super::scene::{BOTH, event, set, target};
use crate::support::clock::{EPOCH_NS, at_ms};
use crate::support::files::MemoryFiles;

const DETECTED: StoreId = StoreId { channel: LightChannel::V2i, layer: StoreLayer::Detected };

/// Two groups with the same heads, as maps have them for two directions of a lane.
fn engine(compat: Compat, change: impl FnOnce(&mut LightsSettings)) -> TrafficLights {
    let lamp = |color| MapLamp { color, position_m: [0.0; 3] };
    let lamps = [11, 12].map(|head| (head, vec![lamp(LampColor::Green), lamp(LampColor::Red)]));
    let groups = [GroupEntry::new(100, [11, 12]), GroupEntry::new(200, [11, 12])];
    let mut settings = LightsSettings {
        topics: [LightsTopic::V2i, LightsTopic::Markers].into(),
        ..LightsSettings::new(Arc::new(LightMap::new(lamps, &groups)), Scenario::default(), compat)
    };
    change(&mut settings);
    TrafficLights::new(settings, at_ms(0))
}

fn state(text: &str) -> ReceivedState {
    ReceivedState { bulbs: parse_bulbs(text).unwrap(), confidence: 0.5, predictions: Vec::new() }
}

/// A prediction this long after the origin.
fn predicted(ms: i64, text: &str) -> Prediction {
    let element = |bulb| GroupElement { bulb, confidence: 0.25 };
    Prediction {
        at: WallStamp::from_nanos(EPOCH_NS + ms * 1_000_000),
        elements: parse_bulbs(text).unwrap().iter().map(element).collect(),
        reliability: 0.75,
        source: "V2I".into(),
    }
}

fn text(groups: &[Arc<GroupState>]) -> String {
    let text = |group: &Arc<GroupState>| {
        let bulbs: Vec<_> = group.elements.iter().map(|element| element.bulb.to_string()).collect();
        let bulbs = bulbs.join(" + ").replace(" solidOn circle", "");
        format!("{}: {bulbs}", group.relation_id)
    };
    groups.iter().map(text).collect::<Vec<_>>().join("; ")
}

/// The last message of the V2I topics until then.
fn last(lights: &mut TrafficLights, ms: u64) -> Vec<Arc<GroupState>> {
    lights.advance(at_ms(ms));
    let sent = std::iter::from_fn(|| lights.poll_output()).filter(|sent| sent.topic == LightsTopic::V2i);
    let LightsContent::Groups(groups) = sent.last().unwrap().content else { panic!("groups") };
    groups.to_vec()
}

fn sent(lights: &mut TrafficLights, ms: u64) -> String {
    text(&last(lights, ms))
}

#[test]
fn groups_with_the_same_heads_keep_their_own_states_in_any_order() {
    for compat in BOTH {
        for store in [StoreId::V2I, DETECTED] {
            for [first, second] in [[100, 200], [200, 100]] {
                for (of_100, of_200) in [("red", "green"), ("green", "red")] {
                    let mut lights = engine(compat, |_| {});
                    let of = |id| (id, Some(state(if id == 100 { of_100 } else { of_200 })));
                    lights.set_states(store, [of(first)], false, at_ms(0));
                    lights.set_states(store, [of(second)], false, at_ms(10));
                    let expected = format!("100: {of_100}; 200: {of_200}");
                    assert_eq!(sent(&mut lights, 500), expected, "{compat:?} {store}, {first} first");
                    assert_eq!(
                        lights.set_states(store, [(first, None::<ReceivedState>)], false, at_ms(500)),
                        0
                    );
                    let left = if second == 100 { of_100 } else { of_200 };
                    assert_eq!(sent(&mut lights, 1_000), format!("{second}: {left}"), "nothing of the other");
                }
            }
        }
    }
}

#[test]
fn a_received_state_hides_what_its_heads_have_and_a_sibling_keeps_to_the_heads() {
    for compat in BOTH {
        let mut lights = engine(compat, |_| {});
        lights.apply(&set("11 v2i", "green"), at_ms(0)).unwrap();
        lights.set_states(StoreId::V2I, [(100, Some(state("red")))], false, at_ms(0));
        let mut groups: Vec<_> = sent(&mut lights, 500).split("; ").map(str::to_owned).collect();
        groups.sort();
        assert_eq!(groups, ["100: red", "200: green"], "{compat:?}");
        lights.set_states(StoreId::V2I, [(100, None::<ReceivedState>)], false, at_ms(500));
        assert_eq!(sent(&mut lights, 1_000), "100: green; 200: green");
    }
}

#[test]
fn a_detected_head_replaces_what_it_would_show_of_the_group() {
    let mut lights = engine(Compat::Improved, |_| {});
    lights.set_states(StoreId::V2I, [(100, Some(state("red")))], false, at_ms(0));
    lights.apply(&set("11 v2i_detected", "yellow"), at_ms(0)).unwrap();
    assert_eq!(sent(&mut lights, 500), "100: yellow + red; 200: yellow");
    lights.apply(&set("12 v2i_detected", "unknown"), at_ms(500)).unwrap();
    assert_eq!(sent(&mut lights, 1_000), "100: yellow + unknown; 200: yellow + unknown");
    lights.set_states(DETECTED, [(100, Some(state("green")))], false, at_ms(1_000));
    assert_eq!(sent(&mut lights, 1_500), "100: green; 200: yellow + unknown");
}

#[test]
fn conditions_and_markers_follow_the_state_that_changed_last() {
    let mut lights = engine(Compat::Improved, |settings| {
        let watch = |at: &str, state: &str| {
            let test = Test::State { target: target(at), state: Some(StateText::new(state)), exact: true };
            let condition = Condition { name: at.to_owned(), test, edge: Edge::None, delay: Duration::ZERO };
            Trigger { groups: vec![vec![condition]] }
        };
        let done = |at: &str| set(at, "white");
        let events = vec![
            event("group 100", watch("100 v2i", "red"), vec![done("11 conventional_detected")]),
            event("group 200", watch("200 v2i", "green"), vec![done("12 conventional_detected")]),
            event("head", watch("11 v2i", "green"), vec![done("11 v2i_detected")]),
            event("never", watch("12 v2i", "red"), vec![done("12 v2i_detected")]),
        ];
        settings.scenario.acts.push(Act { name: "act".to_owned(), events, ..Act::default() });
    });
    let states = [(100, Some(state("red"))), (200, Some(state("green"))), (100, Some(state("red")))];
    lights.set_states(StoreId::V2I, states, false, at_ms(0));
    lights.advance(at_ms(500));
    let detected = |channel| {
        let store = StoreId { channel, layer: StoreLayer::Detected };
        lights.states(store).into_keys().collect::<Vec<_>>()
    };
    assert_eq!(detected(LightChannel::Conventional), [11, 12], "each group has its own");
    assert_eq!(detected(LightChannel::V2i), [11], "a head has what changed last");
    let markers =
        std::iter::from_fn(|| lights.poll_output()).filter(|sent| sent.topic == LightsTopic::Markers);
    let LightsContent::Markers(markers) = markers.last().unwrap().content else { panic!("markers") };
    let lit: Vec<_> =
        markers.iter().filter(|lamp| lamp.is_on).map(|lamp| (lamp.way_id, lamp.lamp.color)).collect();
    assert_eq!(lit, [(11, LampColor::Green), (12, LampColor::Green)]);
}

#[test]
fn predictions_go_out_as_received_until_their_time_and_with_their_state() {
    let mut lights = engine(Compat::Improved, |settings| {
        settings.v2i_timeout = Some(Duration::from_secs(2));
    });
    let with = |text, predictions| Some(ReceivedState { predictions, ..state(text) });
    let (red, green) = (predicted(1_000, "red"), predicted(4_000, "green"));
    let passed = predicted(-1, "red");
    let states = [(100, with("green", vec![green.clone(), red.clone(), passed])), (200, Some(state("red")))];
    assert_eq!(lights.set_states(StoreId::V2I, states, true, at_ms(0)), 0);
    let predictions = |lights: &mut TrafficLights, ms| {
        let groups = last(lights, ms);
        groups.iter().map(|group| group.predictions.clone()).collect::<Vec<_>>()
    };
    assert_eq!(predictions(&mut lights, 990), [vec![red, green.clone()], vec![]]);
    assert_eq!(
        predictions(&mut lights, 1_050),
        [vec![green], vec![]],
        "not in a message at its time or later"
    );
    assert_eq!(predictions(&mut lights, 2_100).len(), 0, "the states are stale");
}

#[test]
fn unfit_predictions_are_left_out_and_counted() {
    let mut lights = engine(Compat::Improved, |_| {});
    let good = predicted(1_000, "red");
    let many = good.elements.repeat(9);
    let unfit = [
        Prediction { reliability: f64::NAN, ..good.clone() },
        Prediction { reliability: 1.01, ..good.clone() },
        Prediction { elements: many, ..good.clone() },
        Prediction { source: "x".repeat(65).into(), ..good.clone() },
        Prediction { source: "V2I\n".into(), ..good.clone() },
        predicted(3_600_001, "red"),
    ];
    let count = unfit.len();
    let predictions = unfit.into_iter().chain(vec![good.clone(); 20]).collect();
    let received = Some(ReceivedState { predictions, ..state("green") });
    assert_eq!(lights.set_states(StoreId::V2I, [(100, received)], false, at_ms(0)), count + 4);
    assert_eq!(last(&mut lights, 500)[0].predictions, vec![good; 16]);
    let status = lights.statuses(None, at_ms(500).mono).remove(1);
    assert_eq!((status.level, status.message.as_str()), (Level::Warn, "an input for 100 was rejected"));
}

#[test]
fn a_change_of_one_group_leaves_the_others_as_they_are() {
    let mut lights = engine(Compat::Improved, |_| {});
    let of_200 = ReceivedState { predictions: vec![predicted(2_000, "green")], ..state("red") };
    lights.set_states(StoreId::V2I, [(100, Some(state("red"))), (200, Some(of_200.clone()))], true, at_ms(0));
    let first = last(&mut lights, 500);
    lights.set_states(StoreId::V2I, [(100, Some(state("green"))), (200, Some(of_200))], true, at_ms(500));
    let second = last(&mut lights, 1_000);
    assert_eq!((text(&first), text(&second)), ("100: red; 200: red".into(), "100: green; 200: red".into()));
    assert!(Arc::ptr_eq(&first[1], &second[1]), "its bytes are used again");
    let third = last(&mut lights, 1_500);
    assert!(second.iter().zip(&third).all(|(before, after)| Arc::ptr_eq(before, after)));
}

#[test]
fn a_group_that_is_received_red_and_green_is_named() {
    let mut lights = engine(Compat::Improved, |_| {});
    lights.set_states(StoreId::V2I, [(200, Some(state("red, green")))], false, at_ms(0));
    let status = lights.statuses(None, at_ms(0).mono).remove(1);
    assert_eq!((status.level, status.message.as_str()), (Level::Warn, "200 shows red and green"));
    for counted in [("lights", "1"), ("contradictory", "1"), ("dark", "0")] {
        assert!(status.values.contains(&(counted.0, counted.1.to_owned())), "{:?}", status.values);
    }
    assert_eq!(
        lights.apply(&set("300 v2i", "red"), at_ms(0)),
        Err(ActionRefusal::UnknownId(300)),
        "actions are for heads as before"
    );
}

const DBC: &str = "BU_: V2X\nBO_ 1440 NEXT: 2 V2X\n SG_ A : 0|4@1+ (1,0) [0|15] \"\" X\n\
     SG_ B : 4|4@1+ (1,0) [0|15] \"\" X\n";

/// The states that are sent of a unit that tells both values for 3 s.
fn unit(ids: [i64; 2], payload: [u8; 2]) -> String {
    let bound = |id, signal| {
        format!("[[v2i]]\nid = {id}\nsignal = \"NEXT.{signal}\"\nstates = {{ red = [1], green = [3] }}\n")
    };
    let profile = format!(
        "name = \"unit\"\nbus.v2x.dbc = \"u.dbc\"\nmessage.NEXT.timeout_ms = 500\n{}{}",
        bound(ids[0], "A"),
        bound(ids[1], "B")
    );
    let gateway =
        "profile = \"u.toml\"\ncan.v2x.interface = \"can0\"\ntraffic_lights.scenario = \"s.toml\"\n";
    let groups = "[groups]\n100 = [11, 12]\n200 = [11, 12]\n300 = [13]\n";
    let files = MemoryFiles::new([
        ("gateway.toml", gateway),
        ("s.toml", groups),
        ("u.toml", profile.as_str()),
        ("u.dbc", DBC),
    ]);
    let settings = load(&files, Path::new("gateway.toml"), &Overrides::default());
    let settings = settings.unwrap_or_else(|refused| panic!("{refused}"));
    let mut gateway = Gateway::new(settings.gateway, LinkState::Up, at_ms(0));
    let frame = Frame::classic(CanId::standard(0x5A0).unwrap(), &payload).unwrap();
    let mut sent = String::new();
    for ms in (0..3_000).step_by(100) {
        let input = CanInput::Frame { bus: BusIndex(0), frame, stamp: at_ms(ms).wall };
        gateway.handle(Input::Can(input), at_ms(ms));
        while let Some(output) = gateway.poll_output() {
            if let Output::TrafficLights(TrafficLightOutput::Publish(emission)) = output
                && let (LightsTopic::V2i, LightsContent::Groups(groups)) = (emission.topic, emission.content)
            {
                sent = text(&groups);
            }
        }
    }
    sent
}

#[test]
fn a_unit_on_can_sends_each_group_its_own_state() {
    assert_eq!(unit([100, 200], [0x31, 0]), "100: red; 200: green");
    assert_eq!(unit([100, 200], [0x13, 0]), "100: green; 200: red");
    assert_eq!(unit([200, 100], [0x31, 0]), "100: green; 200: red");
    assert_eq!(unit([200, 300], [0x31, 0]), "200: red; 300: green", "100 has no signal");
    assert_eq!(unit([11, 300], [0x31, 0]), "100: red; 200: red; 300: green", "a head is of both groups");
}

#[test]
fn states_of_actions_belong_to_heads_as_in_the_simulator() {
    let mut lights = engine(Compat::Improved, |_| {});
    for (at, state) in [("100 v2i", "red"), ("200 v2i", "green")] {
        lights.apply(&set(at, state), at_ms(0)).unwrap();
    }
    assert_eq!(sent(&mut lights, 500), "100: green; 200: green");
}
