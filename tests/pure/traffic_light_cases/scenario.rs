//! Group O: a whole scenario at 30 Hz, and the frames in which phases begin.

use std::sync::Arc;

use gateway_base::time::MonoTime;
use lanelet2_map::light_map::{GroupEntry, LightMap};
use traffic_lights::bulb::{BulbSet, BulbShape, BulbStatus, Color};
use traffic_lights::compat::Compat::{self, Improved, Upstream};
use traffic_lights::emission::{Emission, GroupState, LightsContent, LightsTopic, Prediction};
use traffic_lights::engine::{LightsSettings, TrafficLights};
use traffic_lights::event_log::{ActionSource, LoggedEvent, ScenarioEvent, ScenarioOutcome};
use traffic_lights::scenario::{Act, Action, Rule, Scenario};

use super::scene::{BOTH, SECOND, controller, event, set, time_condition};
use crate::support::clock::{EPOCH_NS, at, at_ns};

fn map() -> Arc<LightMap> {
    Arc::new(LightMap::new([], &[GroupEntry::new(34806, [34836, 34802])]))
}

/// Upstream's clock runs late, so improved mode has to disable a little earlier to be before the second
/// phase.
fn four_phases(disabled_after: f64) -> Scenario {
    let phases = [
        ("phase-1", "3", "34802=green"),
        ("phase-2", "3", "34802=red;34802=red right"),
        ("phase-3", "3", "34802=green;34802 v2i_detected=yellow"),
        ("phase-4", "3", "34802=red;34802 v2i=green"),
    ];
    let ids = vec![34802];
    let after = |seconds| time_condition(Rule::GreaterThan, seconds);
    let events = vec![
        event("disable", after(disabled_after), vec![Action::DisableV2i(ids.clone())]),
        event("enable", time_condition(Rule::GreaterOrEqual, 6.0), vec![Action::EnableV2i(ids.clone())]),
        event("end", after(12.0), vec![Action::End(true)]),
    ];
    Scenario {
        controllers: vec![controller("signals", &phases)],
        init: vec![Action::EnableV2i(ids)],
        acts: vec![Act { name: "act".to_owned(), events, ..Act::default() }],
        ..Scenario::default()
    }
}

fn settings(compat: Compat) -> LightsSettings {
    let scenario = four_phases(if compat == Improved { 2.9 } else { 3.0 });
    LightsSettings {
        copy_on_enable: false,
        topics: [LightsTopic::GroundTruth, LightsTopic::Camera, LightsTopic::V2i].into(),
        ..LightsSettings::new(map(), scenario, compat)
    }
}

/// Runs a scenario from deadline to deadline.
fn run(settings: LightsSettings, seconds: u64) -> (TrafficLights, Vec<Emission>, Vec<LoggedEvent>) {
    let mut lights = TrafficLights::new(settings, at_ns(0));
    while lights.next_deadline() <= MonoTime::from_nanos(seconds * SECOND) {
        let deadline = lights.next_deadline();
        lights.advance(at(deadline));
        assert!(lights.next_deadline() > deadline, "a deadline is handled");
    }
    let emissions = std::iter::from_fn(|| lights.poll_output()).collect();
    let events = std::iter::from_fn(|| lights.poll_event()).collect();
    (lights, emissions, events)
}

/// The time of an emission, nanoseconds since the start.
fn since_start(emission: &Emission) -> i64 {
    emission.stamp.as_nanos() - EPOCH_NS
}

fn frame_of(logged: &LoggedEvent) -> u128 {
    (logged.at.as_nanos() * 30 + 500_000_000) / 1_000_000_000
}

fn groups(emissions: &[Emission]) -> Vec<&Arc<GroupState>> {
    let of_v2i = emissions.iter().filter(|emission| emission.topic == LightsTopic::V2i);
    let groups = of_v2i.map(|emission| match &emission.content {
        LightsContent::Groups(groups) => groups.iter(),
        LightsContent::Lights(_) | LightsContent::Markers(_) | LightsContent::Clock => {
            panic!("V2I sends groups")
        }
    });
    groups.flatten().inspect(|group| assert_eq!(group.relation_id, 34806)).collect()
}

/// The first colour of each prediction; `None` for a dark one.
fn first_colors(group: &GroupState) -> Vec<Option<Color>> {
    let first = |predicted: &Prediction| predicted.elements.first().map(|element| element.bulb.color);
    group.predictions.iter().map(first).collect()
}

#[test]
fn o_ground_truth() {
    for compat in BOTH {
        let (_, emissions, _) = run(settings(compat), 12);
        let mut states: Vec<BulbSet> = emissions
            .iter()
            .filter_map(|emission| match &emission.content {
                LightsContent::Lights(lights) => lights.iter().find(|light| light.way_id == 34802),
                LightsContent::Groups(_) | LightsContent::Markers(_) | LightsContent::Clock => None,
            })
            .map(|light| light.bulbs)
            .collect();
        states.dedup();
        assert_eq!(states.len(), 4, "O 193 {compat:?}");
        for (case, change) in [(195, 1), (197, 3)] {
            let bulb = states[change].iter().next().unwrap();
            let expected = (Color::Red, BulbShape::Circle, BulbStatus::SolidOn);
            assert_eq!((bulb.color, bulb.shape, bulb.status), expected, "O {case} {compat:?}");
        }
    }
}

#[test]
fn o_external() {
    for compat in BOTH {
        let (_, emissions, _) = run(settings(compat), 13);
        let groups = groups(&emissions);
        let mut colors: Vec<Vec<Color>> = groups
            .iter()
            .map(|group| group.elements.iter().map(|element| element.bulb.color).collect())
            .collect();
        colors.dedup();
        let last = match compat {
            Improved => vec![Color::Green],
            Upstream => vec![Color::Green, Color::Red],
        };
        assert_eq!(colors, [vec![Color::Green], vec![Color::Yellow], last], "O 199, 201 {compat:?}");
        let first = groups[0];
        assert_eq!(first.predictions.len(), 6, "O 203 {compat:?}");
        let cycle = [Color::Green, Color::Red, Color::Yellow].map(Some);
        assert_eq!(first_colors(first)[3..], cycle, "O 205 {compat:?}");
        // Half way through the second phase: ten messages a second from the first frame on.
        let second = groups[45];
        // V2I is disabled then, so that phase-1 says nothing of it.
        let of_first_phase = if compat == Improved { None } else { Some(Color::Green) };
        let cycle = [Some(Color::Yellow), Some(Color::Green), of_first_phase];
        assert_eq!(first_colors(second)[..3], cycle, "O 207 {compat:?}");
    }
}

#[test]
fn o_clock() {
    for (compat, phases, others, end) in
        [(Improved, [1, 91, 181, 271], [88, 180], 361), (Upstream, [1, 92, 183, 274], [91, 181], 361)]
    {
        let (lights, _, events) = run(settings(compat), 13);
        let entered = |logged: &&LoggedEvent| matches!(logged.event, ScenarioEvent::PhaseEntered { .. });
        let frames: Vec<_> = events.iter().filter(entered).map(frame_of).collect();
        assert_eq!(frames[..4], phases, "{compat:?}");
        let of_event = |event| {
            let started = ScenarioEvent::EventStarted { act: 0, event };
            events.iter().find(|logged| logged.event == started).map(frame_of)
        };
        assert_eq!([of_event(0), of_event(1), of_event(2)], [Some(others[0]), Some(others[1]), Some(end)]);
        assert_eq!(lights.verdict(), Some(&ScenarioOutcome::Success));
        assert_eq!(events[0].event, ScenarioEvent::ActionDone(ActionSource::Init(0)));
        assert_eq!(events.last().unwrap().event, ScenarioEvent::Ended(ScenarioOutcome::Success));
    }
}

#[test]
fn messages_have_their_periods() {
    for compat in BOTH {
        let (_, emissions, _) = run(settings(compat), 2);
        let stamps = |topic| {
            let of_topic = emissions.iter().filter(move |emission| emission.topic == topic);
            of_topic.map(since_start).collect::<Vec<_>>()
        };
        let camera = stamps(LightsTopic::Camera);
        assert_eq!((camera.len(), camera[0], camera[1]), (60, 33_333_333, 66_666_667));
        assert_eq!((camera[29], camera[59]), (1_000_000_000, 2_000_000_000));
        let truth = stamps(LightsTopic::GroundTruth);
        assert_eq!((truth.len(), truth[0]), (59, 66_666_666), "one period after the first frame");
        let v2i = stamps(LightsTopic::V2i);
        assert_eq!((v2i.len(), v2i[0], v2i[18]), (19, 133_333_333, 1_933_333_333));
    }
}

#[test]
fn an_init_action_with_a_rate_starts_v2i_early_and_keeps_its_rate() {
    for compat in BOTH {
        let Action::SetState { state, .. } = set("34802", "red") else { unreachable!() };
        let mut settings = settings(compat);
        settings.scenario = Scenario {
            init: vec![Action::SetV2iState { id: 34802, state, rate_hz: Some(100.0) }],
            ..Scenario::default()
        };
        let (_, emissions, _) = run(settings, 1);
        let of_v2i: Vec<_> = emissions.iter().filter(|emission| emission.topic == LightsTopic::V2i).collect();
        assert_eq!((of_v2i.len(), since_start(of_v2i[0])), (100, 10_000_000));
        assert_eq!(groups(&emissions).len(), 100);
    }
}

#[test]
fn while_nothing_changes_the_same_content_is_sent() {
    let (_, emissions, _) = run(settings(Improved), 2);
    for topic in [LightsTopic::GroundTruth, LightsTopic::Camera, LightsTopic::V2i] {
        let of_topic: Vec<_> = emissions.iter().filter(|emission| emission.topic == topic).collect();
        assert!(
            of_topic.windows(2).all(|pair| pair[0].content.is_shared_with(&pair[1].content)),
            "{topic:?}"
        );
    }
}

#[test]
fn an_id_that_the_map_does_not_have_ends_the_scenario_when_it_is_needed() {
    let phases = [("p1", "1", "34802=green"), ("p2", "1", "1000003=red")];
    let scenario = Scenario { controllers: vec![controller("A", &phases)], ..Scenario::default() };
    let settings = LightsSettings::new(map(), scenario, Upstream);
    let (lights, _, events) = run(settings, 3);
    assert!(matches!(lights.verdict(), Some(ScenarioOutcome::Fault(_))));
    let last = events.last().unwrap();
    assert!(
        frame_of(last) >= 31 && matches!(last.event, ScenarioEvent::Ended(ScenarioOutcome::Fault(_))),
        "{last:?}"
    );
}
