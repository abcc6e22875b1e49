//! The time of a simulator, a camera pipeline for the arbiter, and rates that change while a scenario runs.

use std::sync::Arc;
use std::time::Duration;

use gateway_base::diagnostics::Level;
use gateway_base::time::{MonoTime, Now, WallStamp};
use traffic_lights::arbiter::ArbiterSettings;
use traffic_lights::compat::Compat::{Improved, Upstream};
use traffic_lights::emission::{Emission, GroupElement, GroupState, LightsContent, LightsTopic};
use traffic_lights::engine::LightsSettings;
use traffic_lights::flow::{LightsFlowSettings, TrafficLightFlow};
use traffic_lights::input::TrafficLightInput;
use traffic_lights::output::TrafficLightOutput;
use traffic_lights::scenario::Scenario;
use traffic_lights::text::parse_bulb;

use super::scene::{controller, settings, small_map};
use crate::support::clock::at_ms;

/// A simulation that began long before this gateway.
const SIMULATION_S: i64 = 5_000;

/// The flow with what it has sent.
struct Bench {
    flow: TrafficLightFlow,
    now: Now,
    sent: Vec<Emission>,
}

impl Bench {
    /// One phase of 3 s, then one of 60 s, and these settings.
    fn new(change: impl FnOnce(&mut LightsFlowSettings)) -> Self {
        let scenario = Scenario {
            controllers: vec![controller("A", &[("go", "3", "21=green"), ("stop", "60", "21=red")])],
            ..Scenario::default()
        };
        let topics = [LightsTopic::Camera, LightsTopic::GroundTruth, LightsTopic::Clock].into();
        let lights = LightsSettings { topics, first_frame: 0, ..settings(small_map(), scenario, Improved) };
        let mut settings = LightsFlowSettings::new(lights);
        change(&mut settings);
        let flow = TrafficLightFlow::new(settings, at_ms(0));
        Self { flow, now: at_ms(0), sent: Vec::new() }
    }

    fn simulated() -> Self {
        Self::new(|settings| settings.use_sim_time = true)
    }

    fn settle(&mut self) {
        self.flow.settle(self.now);
        while let Some(output) = self.flow.poll_output() {
            if let TrafficLightOutput::Publish(emission) = output {
                self.sent.push(emission);
            }
        }
    }

    /// Lets time of the gateway pass, from deadline to deadline.
    fn pass(&mut self, ms: u64) {
        let end = self.now.mono.after(Duration::from_millis(ms));
        loop {
            let due = self.flow.next_deadline(self.now.mono).min(end);
            let nanos = i64::try_from(due.as_nanos() - self.now.mono.as_nanos()).unwrap();
            self.now = Now { mono: due, wall: WallStamp::from_nanos(self.now.wall.as_nanos() + nanos) };
            self.settle();
            if due == end {
                return;
            }
        }
    }

    fn input(&mut self, input: TrafficLightInput) {
        self.flow.handle_input(input, self.now);
        self.settle();
    }

    /// The simulator's clock, ms since the beginning of the simulation.
    fn clock(&mut self, ms: i64) {
        self.input(TrafficLightInput::Clock(WallStamp::from_nanos((SIMULATION_S * 1_000 + ms) * 1_000_000)));
    }

    fn phase(&self) -> Option<usize> {
        self.flow.engine().phase(traffic_lights::scenario::ControllerIndex(0))
    }

    /// Level and message of the scenario's status.
    fn finding(&self) -> (Level, String) {
        let statuses = self.flow.statuses(self.now.mono);
        let status = statuses.into_iter().find(|status| status.task.ends_with("_scenario")).unwrap();
        (status.level, status.message)
    }

    fn stamps_ms(&self, topic: LightsTopic) -> Vec<i64> {
        let of_topic = self.sent.iter().filter(|emission| emission.topic == topic);
        of_topic.map(|emission| emission.stamp.as_nanos() / 1_000_000 - SIMULATION_S * 1_000).collect()
    }
}

#[test]
fn phases_follow_the_simulators_clock_and_stand_still_with_it() {
    let mut bench = Bench::simulated();
    bench.pass(60_000);
    assert_eq!((bench.phase(), bench.sent.len()), (None, 0), "nothing happens before the first time");
    assert_eq!(bench.finding(), (Level::Warn, "waiting for /clock".to_owned()));
    bench.clock(0);
    bench.clock(2_900);
    bench.pass(4_000);
    assert_eq!(bench.phase(), Some(0), "the clock stands still");
    bench.clock(3_000);
    assert_eq!(bench.phase(), Some(1));
    assert_eq!(bench.finding(), (Level::Ok, "running".to_owned()));
    let stamps = bench.stamps_ms(LightsTopic::Camera);
    assert_eq!((stamps.first(), stamps.last(), stamps.len()), (Some(&0), Some(&3_000), 4), "one each second");
}

#[test]
fn a_clock_that_stops_is_reported_by_the_gateways_own_clock() {
    let mut bench = Bench::simulated();
    bench.clock(0);
    bench.pass(5_000);
    assert_eq!(bench.finding().0, Level::Ok);
    bench.pass(1);
    assert_eq!(bench.finding(), (Level::Warn, "/clock is no longer received".to_owned()));
    bench.clock(10);
    assert_eq!(bench.finding().0, Level::Ok);
}

#[test]
fn a_clock_that_begins_anew_begins_the_scenario_anew() {
    let mut bench = Bench::simulated();
    bench.clock(0);
    bench.clock(4_000);
    assert_eq!(bench.phase(), Some(1));
    bench.clock(3_500);
    assert_eq!(bench.phase(), Some(1), "a message that was overtaken");
    bench.sent.clear();
    bench.clock(-1_000);
    bench.clock(500);
    assert_eq!(bench.phase(), Some(0));
    assert_eq!(bench.stamps_ms(LightsTopic::Camera), [-1_000, 0]);
    let statuses = bench.flow.statuses(bench.now.mono);
    let values = &statuses.last().unwrap().values;
    let value = |key| values.iter().find(|(name, _)| *name == key).map(|(_, value)| value.as_str());
    assert_eq!((value("clock_restarts"), value("clock_overtaken")), (Some("1"), Some("1")));
}

#[test]
fn commands_before_the_first_time_are_refused() {
    let mut bench = Bench::simulated();
    bench.input(TrafficLightInput::Command("TrafficSignalStateAction(21, red)".to_owned()));
    bench.clock(0);
    let statuses = bench.flow.statuses(bench.now.mono);
    assert!(statuses.last().unwrap().values.contains(&("refused_commands", "1".to_owned())));
}

#[test]
fn a_clock_goes_out_with_each_frame() {
    let mut bench = Bench::new(|_| ());
    bench.input(TrafficLightInput::Clock(WallStamp::from_nanos(0)));
    bench.pass(3_000);
    let clocks: Vec<_> = bench.sent.iter().filter(|emission| emission.topic == LightsTopic::Clock).collect();
    let stamps: Vec<_> = clocks.iter().map(|emission| emission.stamp).collect();
    assert_eq!(stamps, [0, 1_000, 2_000, 3_000].map(|ms| at_ms(ms).wall));
    assert!(clocks.iter().all(|emission| emission.content == LightsContent::Clock));
}

#[test]
fn the_rate_of_the_ground_truth_changes_with_a_command() {
    let mut bench = Bench::new(|_| ());
    let count = |bench: &mut Bench| {
        bench.sent.clear();
        bench.pass(2_000);
        bench.sent.iter().filter(|emission| emission.topic == LightsTopic::GroundTruth).count()
    };
    let before = count(&mut bench);
    bench.input(TrafficLightInput::Command("SetGroundTruthRate(50)".to_owned()));
    assert_eq!((before, count(&mut bench)), (20, 100));
    bench.input(TrafficLightInput::Command("SetGroundTruthRate(0)".to_owned()));
    assert_eq!(count(&mut bench), 100, "a rate of zero is refused");
}

#[test]
fn the_arbiter_takes_the_camera_pipeline_instead_of_the_own_camera_topic() {
    for external_camera in [false, true] {
        let mut bench = Bench::new(|settings| {
            settings.arbiter = Some(ArbiterSettings::default());
            settings.external_camera = external_camera;
        });
        bench.pass(1_000);
        let own = bench.sent.iter().filter(|emission| emission.topic == LightsTopic::Arbiter).count();
        assert_eq!(own > 0, !external_camera);
        bench.sent.clear();
        let element = GroupElement { bulb: parse_bulb("red").unwrap(), confidence: 0.5 };
        let group = GroupState { relation_id: 200, elements: vec![element], predictions: Vec::new() };
        let (stamp, groups) = (bench.now.wall, Arc::new(vec![Arc::new(group.clone())]));
        bench.input(TrafficLightInput::Camera { stamp, groups, rejected: 1 });
        let merged = bench.sent.iter().find(|emission| emission.topic == LightsTopic::Arbiter).unwrap();
        assert_eq!((merged.stamp, &merged.content), (stamp, &LightsContent::groups([group])));
        let status = &bench.flow.statuses(MonoTime::from_millis(1_000))[0];
        assert_eq!(status.message, "an unreadable input was rejected");
    }
}

#[test]
fn a_camera_pipeline_that_stops_is_not_repeated() {
    for (compat, ends_ms) in [(Improved, Some(1_000..=1_100)), (Upstream, None)] {
        let mut bench = Bench::new(|settings| {
            settings.lights.quirks = compat.into();
            settings.arbiter = Some(ArbiterSettings::default());
            settings.external_camera = true;
            settings.lights.topics = [LightsTopic::V2i].into();
        });
        let element = GroupElement { bulb: parse_bulb("green").unwrap(), confidence: 0.5 };
        let group = GroupState { relation_id: 200, elements: vec![element], predictions: Vec::new() };
        let camera = |bench: &Bench| TrafficLightInput::Camera {
            stamp: bench.now.wall,
            groups: Arc::new(vec![Arc::new(group.clone())]),
            rejected: 0,
        };
        let sent = bench.now.wall.as_nanos();
        bench.input(camera(&bench));
        bench.settle();
        bench.pass(5_000);
        let empty = LightsContent::groups([]);
        let merged = bench.sent.iter().filter(|emission| emission.topic == LightsTopic::Arbiter);
        let end = merged.clone().find(|emission| emission.content == empty);
        let end_ms = end.map(|emission| (emission.stamp.as_nanos() - sent) / 1_000_000);
        assert_eq!(end_ms.is_some(), ends_ms.is_some(), "{end_ms:?}");
        assert!(ends_ms.is_none_or(|range| range.contains(&end_ms.unwrap())), "{end_ms:?}");
        assert!(merged.count() > 40, "one with each message of V2I");
        bench.sent.clear();
        bench.input(camera(&bench));
        bench.settle();
        let merged = bench.sent.iter().find(|emission| emission.topic == LightsTopic::Arbiter).unwrap();
        assert_eq!(merged.content, LightsContent::groups([group.clone()]), "it counts again");
    }
}
