//! The length of a run without `--until`.

use std::time::Duration;

use traffic_lights::scenario::{Action, Scenario, Test, TrafficSignalController, Trigger};

/// Limit for scenarios that end by themselves.
const MAX_LENGTH: Duration = Duration::from_secs(3_600);
/// Length for scenarios without a cycle or a time in a trigger.
const USUAL: Duration = Duration::from_secs(60);
/// Time after the last time named by a trigger.
const AFTERMATH: Duration = Duration::from_secs(5);

/// The length of a run with its reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunLength {
    /// End of the run, from the start.
    pub until: Duration,
    /// The reason for this end, as text.
    pub why: &'static str,
}

impl RunLength {
    /// Returns up to an hour for a scenario that ends by itself; otherwise twice the longest cycle, or 5 s
    /// after the last time named by a trigger; a minute if there is neither.
    pub fn of(scenario: &Scenario) -> Self {
        if ends_by_itself(scenario) {
            return Self { until: MAX_LENGTH, why: "an hour, and the scenario has not ended" };
        }
        let cycles =
            scenario.controllers.iter().filter_map(|controller| shown_cycles(scenario, controller)).max();
        let triggers = scenario.acts.iter().flat_map(|act| {
            let events = act.events.iter().map(|event| &event.start);
            [&act.start, &act.stop].into_iter().chain(events).flatten()
        });
        let named = triggers.filter_map(last_time).max().map(|last| last + AFTERMATH);
        let span = match (cycles, named) {
            (Some(cycles), named) if named.is_none_or(|named| named <= cycles) => {
                Self { until: cycles, why: "twice the longest cycle" }
            }
            (_, Some(named)) => Self { until: named, why: "5 s after the last time a trigger names" },
            (_, None) => Self { until: USUAL, why: "a minute" },
        };
        if span.until > MAX_LENGTH { Self { until: MAX_LENGTH, why: "an hour" } } else { span }
    }
}

fn ends_by_itself(scenario: &Scenario) -> bool {
    let events = scenario.acts.iter().flat_map(|act| &act.events);
    let mut actions = events.flat_map(|event| &event.actions).chain(&scenario.init);
    scenario.stop.is_some() || actions.any(|action| matches!(action, Action::End(_)))
}

/// Returns twice the cycle of a controller, with the delays of the controllers that it follows; `None` for a
/// cycle without end or length.
fn shown_cycles(scenario: &Scenario, controller: &TrafficSignalController) -> Option<Duration> {
    let cycle =
        controller.phases.iter().try_fold(Duration::ZERO, |sum, phase| sum.checked_add(phase.duration?))?;
    let mut shown = cycle.checked_mul(2).filter(|shown| !shown.is_zero())?;
    let mut follower = controller;
    // References may form a cycle.
    for _ in &scenario.controllers {
        let Some(reference) = follower.reference else { break };
        shown = shown.checked_add(reference.delay)?;
        follower = scenario.controllers.get(reference.controller.0)?;
    }
    Some(shown)
}

fn last_time(trigger: &Trigger) -> Option<Duration> {
    let conditions = trigger.groups.iter().flatten();
    let times = conditions.filter_map(|condition| match condition.test {
        Test::SimulationTime { value, .. } => value.checked_add(condition.delay),
        Test::State { .. } | Test::Phase { .. } | Test::Variable { .. } | Test::Element { .. } => None,
    });
    times.max().filter(|last| *last < MAX_LENGTH)
}

#[cfg(test)]
mod tests {
    use super::*;
    use traffic_lights::scenario::{Act, Condition, ControllerIndex, Edge, Event, Phase, Reference, Rule};

    fn controller(durations_s: &[Option<u64>], reference: Option<(usize, u64)>) -> TrafficSignalController {
        let phase = |duration: &Option<u64>| Phase {
            name: "p".into(),
            duration: duration.map(Duration::from_secs),
            entries: Vec::new(),
        };
        let reference = reference.map(|(controller, delay)| Reference {
            controller: ControllerIndex(controller),
            delay: Duration::from_secs(delay),
        });
        TrafficSignalController {
            name: "c".into(),
            reference,
            phases: durations_s.iter().map(phase).collect(),
        }
    }

    fn at(seconds: u64) -> Trigger {
        let test = Test::SimulationTime { rule: Rule::GreaterThan, value: Duration::from_secs(seconds) };
        let (name, edge, delay) = ("c".into(), Edge::None, Duration::from_secs(1));
        Trigger { groups: vec![vec![Condition { name, test, edge, delay }]] }
    }

    fn event(seconds: u64) -> Act {
        let event = Event { start: Some(at(seconds)), max_executions: 1, ..Event::default() };
        Act { events: vec![event], ..Act::default() }
    }

    #[test]
    fn the_longest_cycle_is_shown_twice_with_the_delays_before_it() {
        let endless = controller(&[Some(5), None], None);
        let empty = controller(&[], None);
        let following = controller(&[Some(4), Some(4)], Some((0, 3)));
        let controllers = vec![controller(&[Some(4), Some(4)], None), following, endless, empty];
        let span = RunLength::of(&Scenario { controllers, ..Scenario::default() });
        assert_eq!(span, RunLength { until: Duration::from_secs(19), why: "twice the longest cycle" });
    }

    #[test]
    fn late_events_are_shown_too() {
        let controllers = vec![controller(&[Some(4)], None)];
        let until = |seconds, controllers| {
            RunLength::of(&Scenario { controllers, acts: vec![event(seconds)], ..Scenario::default() })
                .until
                .as_secs()
        };
        assert_eq!((until(1, controllers.clone()), until(20, controllers)), (8, 26));
        assert_eq!((until(2, Vec::new()), until(9_999_999, Vec::new())), (8, 60));
    }

    #[test]
    fn a_scenario_with_an_end_has_an_hour_and_one_without_times_a_minute() {
        let stopped = Scenario { stop: Some(at(3)), ..Scenario::default() };
        let ended = Scenario { init: vec![Action::End(true)], ..Scenario::default() };
        let circle = vec![controller(&[Some(4)], Some((0, 900))); 9];
        let circle = Scenario { controllers: circle, ..Scenario::default() };
        let cases = [(stopped, 3_600), (ended, 3_600), (Scenario::default(), 60), (circle, 3_600)];
        for (scenario, until_s) in cases {
            assert_eq!(RunLength::of(&scenario).until.as_secs(), until_s);
        }
    }
}
