//! The gateway against a model of its reports, over random vehicles and random days.
//!
//! The gateway keeps what it needs and forgets the rest; the model keeps everything that happened
//! and looks at all of it each time. What they have in common is
//! docs/spec/vehicle-interface.md.

mod car;
mod history;
mod model;

use std::collections::BTreeMap;

use can_signal::can::link::LinkState;
use gateway_base::diagnostics::{Level, Status};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::Input;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_report::Step;
use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use crate::support::clock::at_ns;
use crate::support::property::for_all;
use car::{Car, Publish, any_car, settings};
use history::{Event, History, any_event};
use model::{Expected, FaultKind, awaits, judge, may_be_asleep};

/// Refresh of all statuses, as the generated configuration leaves it.
const REFRESH_NS: u64 = 250_000_000;

fn the_gateway_reports_what_the_model_reports_over(days: u32) {
    let day = proptest::collection::vec((1..260_000_000_u64, any_event()), 1..90);
    for_all(days, (any_car(), day), |(car, day)| {
        let mut trial = Trial::new(car);
        for (pause_ns, event) in day {
            trial.pass(pause_ns)?;
            trial.happen(event)?;
        }
        trial.pass(2_000_000_000)
    });
}

#[test]
fn the_gateway_reports_what_the_model_reports() {
    the_gateway_reports_what_the_model_reports_over(120);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn the_gateway_reports_what_the_model_reports() {
        super::the_gateway_reports_what_the_model_reports_over(600);
    }
}

/// A gateway, the history it was given, and its reports so far.
struct Trial {
    car: Car,
    gateway: Gateway,
    history: History,
    now_ns: u64,
    /// Turn, then hazard.
    topics: [Topic; 2],
    statuses: BTreeMap<String, (Level, String)>,
    refreshed_ns: u64,
}

/// What a topic carries: state, and when it was last published.
#[derive(Default, Clone, Copy)]
struct Topic {
    current: Option<(&'static str, u64)>,
}

const TASKS: [&str; 2] = ["turn_indicators", "hazard_lights"];

/// What the wall clock shows at that monotonic time.
fn wall(ns: u64) -> i64 {
    at_ns(ns).wall.as_nanos()
}

impl Trial {
    fn new(car: Car) -> Self {
        let gateway = Gateway::new(settings(&car), LinkState::Up, at_ns(0));
        let topics = [Topic::default(); 2];
        let history = History::default();
        let mut trial =
            Self { car, gateway, history, now_ns: 0, topics, statuses: BTreeMap::new(), refreshed_ns: 0 };
        trial.check().unwrap();
        trial
    }

    /// Time goes by; the gateway is called at each of its deadlines.
    fn pass(&mut self, pause_ns: u64) -> Result<(), TestCaseError> {
        let until = self.now_ns + pause_ns;
        loop {
            let deadline = self.gateway.next_deadline().as_nanos();
            prop_assert!(deadline > self.now_ns, "a deadline that does not move");
            let next = deadline.min(until);
            let before: Vec<_> = self.expected(self.now_ns).iter().map(Expected::essence).collect();
            let just_before: Vec<_> = self.expected(next - 1).iter().map(Expected::essence).collect();
            prop_assert_eq!(before, just_before, "nothing changes before the deadline {}", next);
            self.now_ns = next;
            if deadline > until {
                return Ok(());
            }
            self.gateway.handle(Input::Tick, at_ns(next));
            self.check()?;
        }
    }

    fn happen(&mut self, event: Event) -> Result<(), TestCaseError> {
        let stamp = self.history.add(self.now_ns, event);
        self.gateway.handle(event.input(stamp), at_ns(self.now_ns));
        self.check()
    }

    fn expected(&self, ns: u64) -> [Expected; 2] {
        judge(&self.car, &self.history, ns, wall(ns))
    }

    /// Takes all outputs and compares them with what the model believes.
    fn check(&mut self) -> Result<(), TestCaseError> {
        let expected = self.expected(self.now_ns);
        let mut published: [Vec<(&'static str, i64)>; 2] = Default::default();
        let mut withdrawn = [0, 0];
        while let Some(output) = self.gateway.poll_output() {
            match output {
                Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) => match step {
                    Step::Publish(report, stamp) => published[0].push((report.name(), stamp.as_nanos())),
                    Step::Withdraw => withdrawn[0] += 1,
                },
                Output::VehicleLights(VehicleLightsOutput::HazardLights(step)) => match step {
                    Step::Publish(report, stamp) => published[1].push((report.name(), stamp.as_nanos())),
                    Step::Withdraw => withdrawn[1] += 1,
                },
                Output::VehicleStatus(_)
                | Output::TrafficLights(_)
                | Output::TurnSignal(_)
                | Output::Command(_) => {
                    panic!("nothing but reports on the lights here")
                }
                Output::Diagnostics { diagnostics, stamp } => {
                    prop_assert_eq!(stamp.as_nanos(), wall(self.now_ns));
                    if diagnostics.refresh {
                        prop_assert_eq!(diagnostics.statuses.len(), 4, "two tasks and two buses");
                        self.refreshed_ns = self.now_ns;
                    }
                    for status in diagnostics.statuses {
                        self.check_change(status, diagnostics.refresh)?;
                    }
                }
            }
        }
        prop_assert!(self.now_ns - self.refreshed_ns <= REFRESH_NS);
        for (index, expected) in expected.iter().enumerate() {
            self.check_topic(index, expected, &published[index], withdrawn[index])?;
            self.check_status(index, expected)?;
        }
        Ok(())
    }

    /// A status goes out as a change only when it is one, and a refresh brings no news.
    fn check_change(&mut self, status: Status, refresh: bool) -> Result<(), TestCaseError> {
        let (task, now) = (status.task, (status.level, status.message));
        let before = self.statuses.insert(task, now.clone());
        prop_assert_eq!(before == Some(now.clone()), refresh, "{:?} after {:?}", now, before);
        Ok(())
    }

    fn check_topic(
        &mut self,
        index: usize,
        expected: &Expected,
        published: &[(&'static str, i64)],
        withdrawn: u32,
    ) -> Result<(), TestCaseError> {
        let before = std::mem::take(&mut self.topics[index].current);
        let Some((state, stamp)) = expected.publish else {
            prop_assert!(published.is_empty(), "{:?} published although {:?}", published, expected);
            prop_assert_eq!(withdrawn, u32::from(before.is_some()), "{:?}", expected);
            return Ok(());
        };
        prop_assert_eq!(withdrawn, 0, "{:?}", expected);
        let mut last_ns = before.map_or(0, |(_, at)| at);
        if before.is_none_or(|(shown, _)| shown != state) {
            prop_assert_eq!(published, &[(state, stamp)], "a change goes out at once, and once");
            last_ns = self.now_ns;
        } else if let Publish::Periodic(period) = self.car.publish {
            prop_assert!(self.now_ns - last_ns <= period, "slower than the period");
            if self.now_ns - last_ns == period {
                prop_assert_eq!(published, &[(state, stamp)], "a periodic report carries the newest stamp");
                last_ns = self.now_ns;
            } else {
                prop_assert!(published.is_empty(), "faster than the period");
            }
        } else {
            prop_assert!(published.is_empty(), "nothing changed");
        }
        self.topics[index].current = Some((state, last_ns));
        Ok(())
    }

    fn check_status(&self, index: usize, expected: &Expected) -> Result<(), TestCaseError> {
        let (level, message) = &self.statuses[TASKS[index]];
        let (may_be_starting, is_starting) = awaits(&self.car, &self.history, self.now_ns)[index];
        match expected.problem() {
            None => prop_assert_eq!((*level, message.as_str()), (Level::Ok, "publishing")),
            Some(FaultKind::Unknown) if message.starts_with("starting: ") => {
                prop_assert_eq!(*level, Level::Warn, "{}", message);
                prop_assert!(may_be_starting, "{}", message);
            }
            Some(FaultKind::Unknown) if message.starts_with("asleep: ") => {
                prop_assert_eq!(*level, Level::Warn, "{}", message);
                prop_assert!(may_be_asleep(&self.car, &self.history, self.now_ns), "{}", message);
            }
            Some(FaultKind::Unknown) if is_starting => {
                prop_assert!(!is_starting, "an error at the start: {}", message);
            }
            Some(problem) => {
                let expected_level =
                    if problem == FaultKind::NotVisible { Level::Warn } else { Level::Error };
                prop_assert_eq!(*level, expected_level, "{} {:?}", message, expected);
                let start = match problem {
                    FaultKind::NotVisible => "not visible: ",
                    FaultKind::HardwareFault => "hardware fault: ",
                    FaultKind::Invalid => "invalid: ",
                    FaultKind::Unknown => "unknown: ",
                };
                prop_assert!(message.starts_with(start), "{} for {:?}", message, expected);
                let named = |name: &String| message.contains(name.as_str());
                prop_assert!(
                    expected.names.iter().all(named),
                    "{} does not name {:?}",
                    message,
                    expected.names
                );
            }
        }
        Ok(())
    }
}
