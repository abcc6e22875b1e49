//! Commands beside the drive: in the right order, at the right places.

use std::fmt::{Debug, Write as _};

use serde_json::Value;
use signal_gateway::config::drive::ExpectedDecision;

use crate::support::drive_script::Step;

/// A command belongs to a place that the vehicle passed within this, seconds: a cycle of the peer, one of the
/// gateway, and the way of a message.
const LATENCY_S: f64 = 0.25;
/// Paths are told as points a metre apart.
const SPACING_M: f64 = 1.0;

/// So many cycles around it feel that something was late.
const LINGERS: usize = 5;

/// A command as it was heard; times of day, nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Heard {
    stamp: i64,
    command: u8,
    received: i64,
}

/// Numbers to look at.
#[derive(Debug, Clone, Default)]
pub(super) struct Figures {
    /// How far behind the place of the decision each change was, metres.
    pub(super) off_m: Vec<f64>,
    /// From the newest odometry before a command was made to its arrival, milliseconds.
    pub(super) latency_ms: Vec<f64>,
}

/// When the cycles were said, and what was heard meanwhile.
pub(super) struct Driven<'a> {
    pub(super) steps: &'a [Step],
    said: Vec<i64>,
    heard: &'a Value,
    /// How late something was around each cycle, seconds.
    late_s: Vec<f64>,
}

/// One of the two commands.
pub(super) struct Kind<C> {
    pub(super) name: &'static str,
    pub(super) decided: fn(&Step, usize) -> C,
    pub(super) expected: fn(&ExpectedDecision) -> Option<C>,
    pub(super) number: fn(C) -> u8,
}

impl<'a> Driven<'a> {
    /// Both sides have this period.
    pub(super) fn new(steps: &'a [Step], line: &'a Value, period_s: f64) -> Self {
        let said: Vec<i64> =
            line["cycles"].as_array().unwrap().iter().map(|at| at.as_i64().unwrap()).collect();
        assert_eq!(said.len(), steps.len());
        let mut driven = Self { steps, said, heard: &line["heard"], late_s: vec![0.0; steps.len()] };
        driven.measure(period_s);
        driven
    }

    /// How late the peer's cycles, the gateways' cycles and the messages were.
    fn measure(&mut self, period_s: f64) {
        let said = self.said.clone();
        self.note_gaps(&said, period_s);
        for name in self.heard.as_object().unwrap().keys() {
            let heard = self.commands(name);
            let stamps: Vec<i64> = heard.iter().map(|heard| heard.stamp).collect();
            self.note_gaps(&stamps, period_s);
            for one in heard {
                self.note(one.stamp, seconds(one.received - one.stamp));
            }
        }
    }

    fn note_gaps(&mut self, stamps: &[i64], period_s: f64) {
        for pair in stamps.windows(2) {
            self.note(pair[1], seconds(pair[1] - pair[0]) - period_s);
        }
    }

    /// What is late matters a little before and a little longer.
    fn note(&mut self, at: i64, late_s: f64) {
        let here = self.step(at);
        let around = here.saturating_sub(2 * LINGERS)..self.late_s.len().min(here + LINGERS);
        for worst_s in &mut self.late_s[around] {
            *worst_s = worst_s.max(late_s);
        }
    }

    /// All that was heard on a topic from just before the first cycle on.
    pub(super) fn commands(&self, name: &str) -> Vec<Heard> {
        let number = |value: &Value| value.as_i64().unwrap();
        let all: Vec<Heard> = self.heard[name]
            .as_array()
            .unwrap()
            .iter()
            .map(|heard| Heard {
                stamp: number(&heard[0]),
                command: u8::try_from(number(&heard[1])).unwrap(),
                received: number(&heard[2]),
            })
            .collect();
        let first = all.partition_point(|heard| heard.stamp < self.said[0]);
        all[first.saturating_sub(1)..].to_vec()
    }

    /// The longest that anything was late, seconds: what a busy machine does to a drive.
    pub(super) fn stall_s(&self) -> f64 {
        self.late_s.iter().copied().fold(0.0, f64::max)
    }

    /// The last cycle that was said at a time.
    fn step(&self, stamp: i64) -> usize {
        self.said.partition_point(|said| *said <= stamp).max(1) - 1
    }

    /// Where the vehicle was at a time, metres.
    fn at_m(&self, stamp: i64) -> f64 {
        let step = self.step(stamp);
        let here_m = self.steps[step].at_m;
        let Some((next, then)) = self.steps.get(step + 1).zip(self.said.get(step + 1)) else { return here_m };
        let share = seconds(stamp - self.said[step]) / seconds(then - self.said[step]);
        here_m + (next.at_m - here_m) * share.clamp(0.0, 1.0)
    }

    /// How far the vehicle may have come before a command is there, metres; farther where the machine was late.
    fn slack_m(&self, step: usize, more_m: f64) -> f64 {
        let near = &self.steps[step.saturating_sub(2)..self.steps.len().min(step + 4)];
        let fastest_mps = near.iter().map(|step| step.speed_mps.abs()).fold(0.0, f64::max);
        fastest_mps * (LATENCY_S + self.late_s[step]) + SPACING_M + more_m
    }

    /// What is wrong with the commands of a behaviour, `more_m` metres of tolerance on top.
    pub(super) fn judge<C: Copy + PartialEq + Debug>(
        &self,
        mode: usize,
        kind: &Kind<C>,
        topic: &str,
        more_m: f64,
        figures: &mut Figures,
    ) -> Vec<String> {
        let heard = self.commands(topic);
        let while_driving =
            |one: &&Heard| (self.said[0]..self.said[self.said.len() - 1]).contains(&one.stamp);
        for one in heard.iter().filter(while_driving) {
            figures.latency_ms.push(seconds(one.received - self.said[self.step(one.stamp)]) * 1e3);
        }
        let mut objections = self.unexpected(mode, kind, &heard, more_m);
        let mut planned: Vec<(usize, u8)> = self
            .steps
            .iter()
            .enumerate()
            .map(|(index, step)| (index, (kind.number)((kind.decided)(step, mode))))
            .collect();
        planned.dedup_by_key(|(_, command)| *command);
        let mut shown = heard;
        shown.dedup_by_key(|heard| heard.command);
        let numbers = |shown: &[Heard]| shown.iter().map(|heard| heard.command).collect::<Vec<_>>();
        if numbers(&shown) != planned.iter().map(|(_, command)| *command).collect::<Vec<_>>() {
            let mut text = format!("{} was", kind.name);
            for heard in &shown {
                write!(text, " {} from {:.1} m,", heard.command, self.at_m(heard.stamp)).unwrap();
            }
            text.push_str(" expected");
            for (step, command) in planned {
                write!(text, " {command} from {:.1} m,", self.steps[step].at_m).unwrap();
            }
            objections.push(text);
            return objections;
        }
        for (heard, (step, command)) in shown.iter().zip(planned).skip(1) {
            let (at_m, planned_m) = (self.at_m(heard.stamp), self.steps[step].at_m);
            let (off_m, slack_m) = (at_m - planned_m, self.slack_m(step, more_m));
            figures.off_m.push(off_m);
            if off_m.abs() > slack_m {
                objections.push(format!(
                    "{} {command} at {at_m:.2} m, expected at {planned_m:.2} m, within {slack_m:.2} m",
                    kind.name
                ));
            }
        }
        objections
    }

    /// The first command that no expectation around it agrees with.
    fn unexpected<C: Copy + PartialEq + Debug>(
        &self,
        mode: usize,
        kind: &Kind<C>,
        heard: &[Heard],
        more_m: f64,
    ) -> Vec<String> {
        let fits = |step: &Step, command: u8| {
            let expected = step.expected[mode].iter().filter_map(kind.expected);
            expected.into_iter().all(|expected| (kind.number)(expected) == command)
        };
        let wrong = heard.iter().find(|heard| {
            let here = self.step(heard.stamp);
            let (at_m, slack_m) = (self.at_m(heard.stamp), self.slack_m(here, more_m));
            // Standing still, many cycles are at one place.
            let near = self.steps.iter().filter(|step| (step.at_m - at_m).abs() <= slack_m);
            !near.into_iter().any(|step| fits(step, heard.command))
        });
        let text = |wrong: &Heard| {
            let at_m = self.at_m(wrong.stamp);
            format!("{} {} at {at_m:.2} m is not expected", kind.name, wrong.command)
        };
        wrong.map(text).into_iter().collect()
    }
}

impl Figures {
    pub(super) fn append(&mut self, other: Self) {
        self.off_m.extend(other.off_m);
        self.latency_ms.extend(other.latency_ms);
    }
}

/// Number, median and largest value by size, for people.
pub(super) fn summary(values: &[f64]) -> String {
    let mut values = values.to_vec();
    values.sort_by(|one, other| one.abs().total_cmp(&other.abs()));
    let at = |index: usize| values.get(index).copied().unwrap_or_default();
    format!("{}: median {:.2}, worst {:.2}", values.len(), at(values.len() / 2), at(values.len().max(1) - 1))
}

#[allow(clippy::cast_precision_loss)] // of a drive
fn seconds(nanos: i64) -> f64 {
    nanos as f64 / 1e9
}
