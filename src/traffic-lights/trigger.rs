//! Triggers: tests, their edges and delays
//! (docs/spec/traffic-lights.md, "Conditions and triggers").
//!
//! The value of a test is first delayed and then checked for an edge, which is equivalent to the reverse
//! order. The first value of a test is not an edge. The exception is a test of the time in the first frame,
//! since a time has a value at the start.

use std::cmp::Ordering;
use std::collections::VecDeque;
use std::time::Duration;

use super::periodic_timer::ScenarioMoment;
use super::quirks::LightQuirks;
use super::refusal::ActionRefusal;
use super::scenario::{Condition, Edge, ElementState, Rule, Scenario, StateText, Test, Trigger};
use super::scenario_state::ScenarioState;
use super::store::Expected;
use super::target::SignalTarget;

/// The states of a trigger's conditions, group by group.
#[derive(Debug, Clone)]
pub(super) struct TriggerState {
    groups: Vec<Vec<ConditionState>>,
    /// The time before which it does not fire, nanoseconds since the start of the scenario.
    idle_until: u64,
}

#[derive(Debug, Clone, Default)]
struct ConditionState {
    /// The changes of the value within the delay, and the last one before it.
    history: VecDeque<(ScenarioMoment, bool)>,
    previous: Option<bool>,
    was_true: bool,
}

impl TriggerState {
    pub(super) fn new(trigger: &Trigger) -> Self {
        let groups = trigger.groups.iter();
        let groups = groups.map(|group| vec![ConditionState::default(); group.len()]).collect();
        Self { groups, idle_until: 0 }
    }

    /// Evaluates the trigger; returns whether it fires. `element` returns whether an act, event or action of
    /// a name is in a state.
    pub(super) fn fires(
        &mut self,
        trigger: &Trigger,
        scenario: &Scenario,
        scenario_state: &mut ScenarioState,
        element: impl Fn(&str, ElementState) -> bool,
    ) -> Result<bool, ActionRefusal> {
        if scenario_state.now.nanos < self.idle_until {
            return Ok(false);
        }
        let mut fires = false;
        for (group, states) in trigger.groups.iter().zip(&mut self.groups) {
            let mut all = true;
            // All conditions are evaluated, since their edges depend on every value.
            for (condition, state) in group.iter().zip(states) {
                if scenario_state.is_first_frame && !scenario_state.quirks.starts_without_time {
                    state.start(condition);
                }
                let value = value(&condition.test, scenario, scenario_state, &element)?;
                all &= state.is_true(condition, value, scenario_state.now, scenario_state.quirks);
            }
            fires |= all;
        }
        self.idle_until = if fires { 0 } else { self.next(trigger, scenario_state) };
        Ok(fires)
    }

    /// Returns the earliest time at which it can fire, if it does not fire now. After an edge, only a change
    /// of a value can make it fire, and the value of a time test changes when the time is reached, or
    /// directly after. Other values can change at any time, and upstream has a different clock.
    fn next(&self, trigger: &Trigger, scenario_state: &ScenarioState) -> u64 {
        let now = scenario_state.now.nanos;
        let conditions = trigger.groups.iter().flatten().zip(self.groups.iter().flatten());
        let is_exact = !scenario_state.quirks.slips_by_frames;
        let next = conditions.map(|(condition, state)| match &condition.test {
            Test::SimulationTime { value, .. } if is_exact && state.is_settled() => {
                let at = u64::try_from(value.as_nanos()).unwrap_or(u64::MAX);
                match now.cmp(&at) {
                    Ordering::Less => at,
                    Ordering::Equal => at.saturating_add(1),
                    Ordering::Greater => u64::MAX,
                }
            }
            Test::SimulationTime { .. }
            | Test::State { .. }
            | Test::Phase { .. }
            | Test::Variable { .. }
            | Test::Element { .. } => 0,
        });
        next.min().unwrap_or(0)
    }
}

impl ConditionState {
    /// Returns whether no change of the value is still delayed.
    fn is_settled(&self) -> bool {
        self.history.len() == 1 && self.previous.is_some()
    }

    /// Sets the value of a time test at the start of the scenario, before the first frame, where its edge
    /// counts.
    fn start(&mut self, condition: &Condition) {
        let Test::SimulationTime { rule, value } = &condition.test else { return };
        if matches!(condition.edge, Edge::Rising | Edge::Falling | Edge::RisingOrFalling) {
            let at_start = rule.holds(&Duration::ZERO, value);
            self.history.push_back((ScenarioMoment::default(), at_start));
            self.previous = condition.delay.is_zero().then_some(at_start);
        }
    }

    fn is_true(
        &mut self,
        condition: &Condition,
        value: bool,
        now: ScenarioMoment,
        quirks: LightQuirks,
    ) -> bool {
        if self.history.back().is_none_or(|(_, last)| *last != value) {
            self.history.push_back((now, value));
        }
        let is_over = |at: ScenarioMoment| at.has_lasted(condition.delay, now, quirks);
        while self.history.get(1).is_some_and(|(at, _)| is_over(*at)) {
            self.history.pop_front();
        }
        let Some(delayed) = self.history.front().filter(|(at, _)| is_over(*at)).map(|(_, value)| *value)
        else {
            return false;
        };
        let (rises, falls) =
            (self.previous == Some(false) && delayed, self.previous == Some(true) && !delayed);
        self.previous = Some(delayed);
        self.was_true |= delayed;
        match condition.edge {
            Edge::None => delayed,
            Edge::Rising => rises,
            Edge::Falling => falls,
            Edge::RisingOrFalling => rises || falls,
            Edge::Sticky => self.was_true,
        }
    }
}

fn value(
    test: &Test,
    scenario: &Scenario,
    scenario_state: &mut ScenarioState,
    element: impl Fn(&str, ElementState) -> bool,
) -> Result<bool, ActionRefusal> {
    match test {
        Test::SimulationTime { rule, value } => Ok(if scenario_state.quirks.slips_by_frames {
            rule.holds(&scenario_state.now.seconds, &value.as_secs_f64())
        } else {
            rule.holds(&u128::from(scenario_state.now.nanos), &value.as_nanos())
        }),
        Test::State { target, state, exact } => matches(scenario_state, *target, state.as_ref(), *exact),
        Test::Phase { controller, phase } => {
            let present = scenario_state.controllers.phase(scenario, *controller);
            Ok(present.is_some_and(|present| present.name == *phase))
        }
        Test::Variable { variable, rule, value } => {
            Ok(rule.holds(&scenario_state.variables[variable.0], value))
        }
        Test::Element { name, state } => Ok(element(name, *state)),
    }
}

fn matches(
    scenario_state: &mut ScenarioState,
    target: SignalTarget,
    state: Option<&StateText>,
    exact: bool,
) -> Result<bool, ActionRefusal> {
    let expected = match state {
        None => Expected::Dark,
        Some(state) if scenario_state.quirks.compares_single_bulbs => {
            let bulb = state.single.ok_or_else(|| ActionRefusal::State {
                text: state.text.clone(),
                mistake: "a light is compared with one bulb".to_owned(),
            })?;
            Expected::Contains([bulb].into_iter().collect())
        }
        Some(state) if exact => Expected::Exactly(state.bulbs),
        Some(state) => Expected::Contains(state.bulbs),
    };
    scenario_state.lights.stores.matches(target, expected)
}

impl Rule {
    fn holds<T: PartialOrd>(self, value: &T, other: &T) -> bool {
        match self {
            Self::EqualTo => value == other,
            Self::NotEqualTo => value != other,
            Self::GreaterThan => value > other,
            Self::GreaterOrEqual => value >= other,
            Self::LessThan => value < other,
            Self::LessOrEqual => value <= other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{LightsSettings, TrafficLights};
    use gateway_base::time::{MonoTime, Now, WallStamp};
    use lanelet2_map::light_map::LightMap;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use proptest::sample::select;
    use std::sync::Arc;

    fn condition(edge: Edge, delay_s: u64) -> Condition {
        let test = Test::SimulationTime { rule: Rule::EqualTo, value: Duration::ZERO };
        Condition { name: String::new(), test, edge, delay: Duration::from_secs(delay_s) }
    }

    /// Returns the results of a condition for values one second apart, `#` for true.
    fn run(edge: Edge, delay_s: u64, values: &str) -> String {
        let (condition, mut state) = (condition(edge, delay_s), ConditionState::default());
        let mut now = ScenarioMoment::default();
        values
            .chars()
            .map(|value| {
                let is_true = state.is_true(&condition, value == '#', now, LightQuirks::default());
                now = now.after(Duration::from_secs(1));
                if is_true { '#' } else { '.' }
            })
            .collect()
    }

    #[test]
    fn an_edge_is_true_once_and_the_first_value_is_no_edge() {
        for (edge, expected) in [
            (Edge::None, "##..##.#"),
            (Edge::Rising, "....#..#"),
            (Edge::Falling, "..#...#."),
            (Edge::RisingOrFalling, "..#.#.##"),
            (Edge::Sticky, "########"),
        ] {
            assert_eq!(run(edge, 0, "##..##.#"), expected, "{edge:?}");
        }
    }

    fn time_condition() -> impl Strategy<Value = Condition> {
        #[rustfmt::skip]
        let rules = vec![
            Rule::EqualTo, Rule::NotEqualTo, Rule::GreaterThan, Rule::GreaterOrEqual, Rule::LessThan,
            Rule::LessOrEqual,
        ];
        let edges = vec![Edge::None, Edge::Rising, Edge::Falling, Edge::RisingOrFalling, Edge::Sticky];
        (select(rules), 0..20_u64, select(edges), 0..5_u64).prop_map(|(rule, at, edge, delay)| {
            let test = Test::SimulationTime { rule, value: Duration::from_nanos(at) };
            Condition { name: String::new(), test, edge, delay: Duration::from_nanos(delay) }
        })
    }

    proptest! {
        #[test]
        fn idle_triggers_fire_when_busy_ones_do(
            groups in vec(vec(time_condition(), 1..3), 0..3),
            steps in vec(1..4_u64, 1..30),
        ) {
            let (trigger, scenario) = (Trigger { groups }, Scenario::default());
            let settings =
                LightsSettings::new(Arc::new(LightMap::default()), scenario.clone(), LightQuirks::default());
            let now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
            let mut scenario_state = TrafficLights::new(settings, now).scenario_state;
            let (mut idle, mut busy) = (TriggerState::new(&trigger), TriggerState::new(&trigger));
            for step in steps {
                scenario_state.now.nanos += step;
                busy.idle_until = 0;
                let [found, expected] = [&mut idle, &mut busy]
                    .map(|state| state.fires(&trigger, &scenario, &mut scenario_state, |_, _| false).unwrap());
                prop_assert_eq!(found, expected, "at {}", scenario_state.now.nanos);
                scenario_state.is_first_frame = false;
            }
        }

        #[test]
        fn a_delay_shifts_the_result(values in "[.#]{1,40}", delay in 0..5_usize) {
            for edge in [Edge::None, Edge::Rising, Edge::Falling, Edge::RisingOrFalling, Edge::Sticky] {
                let prompt = run(edge, 0, &values);
                let late = run(edge, delay as u64, &values);
                let expected: String = ".".repeat(delay) + &prompt;
                prop_assert_eq!(&late, &expected[..values.len()]);
            }
        }
    }
}
