//! Compares received commands with the drive: their order, and the positions at which they come.

use std::fmt::{Debug, Write as _};

use serde_json::Value;
use signal_gateway::config::drive::ExpectedDecision;

use crate::support::drive_script::Step;

/// Longest time from the position of a decision to the arrival of its command, seconds: a cycle of the peer,
/// one of the gateway, and the transport of a message.
const LATENCY_S: f64 = 0.25;
/// Distance between the points of a published path, metres.
const SPACING_M: f64 = 1.0;

/// Number of cycles that are affected by a delay.
const LINGERS: usize = 5;
/// Number of cycles over which small delays add up, where a decision follows a time after an event: the
/// longest one is 3 s.
const ADDS_UP: usize = 50;

/// A command as it was received; times of day, nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReceivedCommand {
    stamp: i64,
    command: u8,
    arrival: i64,
}

/// Measured values, for people.
#[derive(Debug, Clone, Default)]
pub(super) struct Figures {
    /// Distance of each change behind the position of its decision, metres.
    pub(super) off_m: Vec<f64>,
    /// Time from the newest odometry before a command was made to its arrival, milliseconds.
    pub(super) latency_ms: Vec<f64>,
}

/// The times at which cycles were published, and the commands received meanwhile.
pub(super) struct Driven<'a> {
    pub(super) steps: &'a [Step],
    published: Vec<i64>,
    received: &'a Value,
    /// Longest delay around each cycle, seconds.
    late_s: Vec<f64>,
    /// Delays of the cycles before each cycle, added up, seconds.
    stretch_s: Vec<f64>,
}

/// One of the two commands.
pub(super) struct Kind<C> {
    pub(super) name: &'static str,
    pub(super) decided: fn(&Step, usize) -> C,
    pub(super) expected: fn(&ExpectedDecision) -> Option<C>,
    pub(super) number: fn(C) -> u8,
}

impl<'a> Driven<'a> {
    /// The period is that of both sides.
    pub(super) fn new(steps: &'a [Step], line: &'a Value, period_s: f64) -> Self {
        let published: Vec<i64> =
            line["cycles"].as_array().unwrap().iter().map(|at| at.as_i64().unwrap()).collect();
        assert_eq!(published.len(), steps.len());
        let (late_s, stretch_s) = (vec![0.0; steps.len()], stretch_s(&published, period_s));
        let mut driven = Self { steps, published, received: &line["received"], late_s, stretch_s };
        driven.measure(period_s);
        driven
    }

    /// Notes the delays of the peer's cycles, the gateways' cycles and the messages.
    fn measure(&mut self, period_s: f64) {
        let published = self.published.clone();
        self.note_gaps(&published, period_s);
        for name in self.received.as_object().unwrap().keys() {
            let received = self.commands(name);
            let stamps: Vec<i64> = received.iter().map(|received| received.stamp).collect();
            self.note_gaps(&stamps, period_s);
            for one in received {
                self.note(one.stamp, seconds(one.arrival - one.stamp));
            }
        }
    }

    fn note_gaps(&mut self, stamps: &[i64], period_s: f64) {
        for pair in stamps.windows(2) {
            self.note(pair[1], seconds(pair[1] - pair[0]) - period_s);
        }
    }

    /// Notes a delay for the cycles around it.
    fn note(&mut self, at: i64, late_s: f64) {
        let here = self.step(at);
        let around = here.saturating_sub(2 * LINGERS)..self.late_s.len().min(here + LINGERS);
        for worst_s in &mut self.late_s[around] {
            *worst_s = worst_s.max(late_s);
        }
    }

    /// All commands received on a topic from just before the first cycle on.
    pub(super) fn commands(&self, name: &str) -> Vec<ReceivedCommand> {
        let number = |value: &Value| value.as_i64().unwrap();
        let all: Vec<ReceivedCommand> = self.received[name]
            .as_array()
            .unwrap()
            .iter()
            .map(|received| ReceivedCommand {
                stamp: number(&received[0]),
                command: u8::try_from(number(&received[1])).unwrap(),
                arrival: number(&received[2]),
            })
            .collect();
        let first = all.partition_point(|received| received.stamp < self.published[0]);
        all[first.saturating_sub(1)..].to_vec()
    }

    /// The longest that anything was late, seconds: what a busy machine does to a drive.
    pub(super) fn stall_s(&self) -> f64 {
        self.late_s.iter().copied().fold(0.0, f64::max)
    }

    /// The most that small delays of some cycles add up to, seconds.
    pub(super) fn stretch_s(&self) -> f64 {
        self.stretch_s.iter().copied().fold(0.0, f64::max)
    }

    /// The last cycle that was published at a time.
    fn step(&self, stamp: i64) -> usize {
        self.published.partition_point(|published| *published <= stamp).max(1) - 1
    }

    /// Position of the vehicle at a time, metres along its drive.
    fn at_m(&self, stamp: i64) -> f64 {
        let step = self.step(stamp);
        let here_m = self.steps[step].at_m;
        let Some((next, then)) = self.steps.get(step + 1).zip(self.published.get(step + 1)) else {
            return here_m;
        };
        let share = seconds(stamp - self.published[step]) / seconds(then - self.published[step]);
        here_m + (next.at_m - here_m) * share.clamp(0.0, 1.0)
    }

    /// Longest distance that the vehicle may drive before a command arrives, metres; more where the machine
    /// was late.
    fn slack_m(&self, step: usize, more_m: f64) -> f64 {
        let near = &self.steps[step.saturating_sub(2)..self.steps.len().min(step + 4)];
        let fastest_mps = near.iter().map(|step| step.speed_mps.abs()).fold(0.0, f64::max);
        fastest_mps * (LATENCY_S + self.late_s[step] + self.stretch_s[step]) + SPACING_M + more_m
    }

    /// Objections to the commands of a mode, with `more_m` metres of additional tolerance.
    pub(super) fn judge<C: Copy + PartialEq + Debug>(
        &self,
        mode: usize,
        kind: &Kind<C>,
        topic: &str,
        more_m: f64,
        figures: &mut Figures,
    ) -> Vec<String> {
        let received = self.commands(topic);
        let while_driving = |one: &&ReceivedCommand| {
            (self.published[0]..self.published[self.published.len() - 1]).contains(&one.stamp)
        };
        for one in received.iter().filter(while_driving) {
            figures.latency_ms.push(seconds(one.arrival - self.published[self.step(one.stamp)]) * 1e3);
        }
        let mut objections = self.unexpected(mode, kind, &received, more_m);
        let mut planned: Vec<(usize, u8)> = self
            .steps
            .iter()
            .enumerate()
            .map(|(index, step)| (index, (kind.number)((kind.decided)(step, mode))))
            .collect();
        planned.dedup_by_key(|(_, command)| *command);
        let mut shown = received;
        shown.dedup_by_key(|received| received.command);
        let numbers =
            |shown: &[ReceivedCommand]| shown.iter().map(|received| received.command).collect::<Vec<_>>();
        if numbers(&shown) != planned.iter().map(|(_, command)| *command).collect::<Vec<_>>() {
            let mut text = format!("{} was", kind.name);
            for received in &shown {
                write!(text, " {} from {:.1} m,", received.command, self.at_m(received.stamp)).unwrap();
            }
            text.push_str(" expected");
            for (step, command) in planned {
                write!(text, " {command} from {:.1} m,", self.steps[step].at_m).unwrap();
            }
            objections.push(text);
            return objections;
        }
        for (received, (step, command)) in shown.iter().zip(planned).skip(1) {
            let (at_m, planned_m) = (self.at_m(received.stamp), self.steps[step].at_m);
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
        received: &[ReceivedCommand],
        more_m: f64,
    ) -> Vec<String> {
        let fits = |step: &Step, command: u8| {
            let mut expected = step.expected[mode].iter().filter_map(kind.expected);
            expected.all(|expected| (kind.number)(expected) == command)
        };
        let wrong = received.iter().find(|received| {
            let here = self.step(received.stamp);
            let (at_m, slack_m) = (self.at_m(received.stamp), self.slack_m(here, more_m));
            // Standing still, many cycles are at one position.
            let near = self.steps.iter().filter(|step| (step.at_m - at_m).abs() <= slack_m);
            !near.into_iter().any(|step| fits(step, received.command))
        });
        let text = |wrong: &ReceivedCommand| {
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

/// The delays of cycles up to each of them, added up from wherever that is the most.
fn stretch_s(published: &[i64], period_s: f64) -> Vec<f64> {
    let delays: Vec<f64> = published.windows(2).map(|pair| seconds(pair[1] - pair[0]) - period_s).collect();
    let most = |end: usize| {
        let sums = delays[end.saturating_sub(ADDS_UP)..end].iter().rev().scan(0.0, |sum, delay| {
            *sum += delay;
            Some(*sum)
        });
        sums.fold(0.0, f64::max)
    };
    (0..published.len()).map(most).collect()
}

#[allow(clippy::cast_precision_loss)] // of a drive
fn seconds(nanos: i64) -> f64 {
    nanos as f64 / 1e9
}
