//! One recording: the gateway's reports held against the oracle.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::Cursor;

use can_log::Log;
use can_signal::can::link::BusIndex;
use gateway_core::gateway::GatewaySettings;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::output::VehicleLightsOutput as Lights;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_report::Step;
use signal_gateway::replay::{Replay, Routes};

use super::oracle::{Belief, Oracle};
use super::recording::{BUS, Content, Line};
use super::vehicle::{MS, Turn, Vehicle};

/// The longest time from one periodic report to the next.
const PERIOD_NS: u64 = 100 * MS;

/// The reports by the position of their topic.
const TOPICS: [&str; 2] = ["turn", "hazard"];

/// What the gateway did with a topic: published a state with a stamp, or withdrew it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Report {
    topic: usize,
    published: Option<(&'static str, i64)>,
}

/// How a recording came out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Verdict {
    /// Reports that were published.
    pub(crate) reports: u64,
    /// Instants at which nothing may be published, and nothing was.
    pub(crate) withheld: u64,
    /// The first thing that was wrong.
    pub(crate) wrong: Option<Wrong>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A state, or a stamp, that the oracle does not allow.
    Publication,
    /// No report, or not a new one, where there must be one.
    Withholding,
}

#[derive(Debug, Clone)]
pub(crate) struct Wrong {
    pub(crate) kind: Kind,
    at_ns: u64,
    topic: &'static str,
    got: String,
    allowed: Vec<Belief>,
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, at_ns, topic, got, allowed } = self;
        let kind = if *kind == Kind::Publication { "wrong publication" } else { "wrong withholding" };
        let (seconds, nanos) = (at_ns / 1_000_000_000, at_ns % 1_000_000_000);
        write!(f, "{kind} at {seconds}.{nanos:09} s, {topic}: {got}; allowed: {allowed:?}")
    }
}

/// A recording as text.
pub(crate) fn text(lines: &[Line]) -> String {
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// What the gateway publishes over a recording, by virtual time.
fn replay(settings: &GatewaySettings, lines: &[Line]) -> Vec<(u64, Report)> {
    let log = Log::new(Box::new(Cursor::new(text(lines).into_bytes()))).unwrap();
    let routes = Routes(vec![(BUS.to_owned(), BusIndex(0))]);
    let mut replay = Replay::new(settings.clone(), log, routes).unwrap();
    let mut reports = Vec::new();
    loop {
        let at = replay.now().mono.as_nanos();
        while let Some(output) = replay.poll_output() {
            let Output::VehicleLights(output) = output else { continue };
            let (topic, published) = match output {
                Lights::TurnIndicators(step) => (0, published(step, TurnIndicators::name)),
                Lights::HazardLights(step) => (1, published(step, HazardLights::name)),
            };
            reports.push((at, Report { topic, published }));
        }
        if !replay.step().unwrap() {
            return reports;
        }
    }
}

/// Name and stamp of a state that is published; `None` when the report is withdrawn.
fn published<T>(step: Step<T>, name: fn(T) -> &'static str) -> Option<(&'static str, i64)> {
    match step {
        Step::Publish(state, stamp) => Some((name(state), stamp.as_nanos())),
        Step::Withdraw => None,
    }
}

/// Runs a recording through the gateway and the oracle.
pub(crate) fn run(vehicle: &Vehicle, settings: &GatewaySettings, lines: &[Line]) -> Verdict {
    let mut oracle = Oracle::new(vehicle);
    let mut instants = BTreeMap::<u64, Vec<&Line>>::new();
    for line in lines {
        instants.entry(oracle.time_of(line)).or_default().push(line);
    }
    // A replay ends with the last line that concerns the gateway.
    let concerns = |line: &&Line| {
        line.interface == BUS && !matches!(line.content, Content::Remote { .. } | Content::Garbage)
    };
    let concerning = instants.iter().filter(|(_, lines)| lines.iter().any(concerns));
    let Some(end) = concerning.map(|(at, _)| *at).next_back() else { return Verdict::default() };
    instants.retain(|at, _| *at <= end);
    let mut limits: BTreeSet<u64> =
        vehicle.messages.iter().filter_map(|message| message.timeout_ns).collect();
    limits.insert(vehicle.alive_ns);
    if let Turn::Sides { hold_ns: Some(hold), .. } = vehicle.turn {
        limits.insert(hold);
    }
    for at in instants.keys().copied().collect::<Vec<_>>() {
        for after in limits.iter().map(|limit| at + limit + 1).filter(|after| *after < end) {
            instants.entry(after).or_default();
        }
    }
    let mut reports = replay(settings, lines).into_iter().peekable();
    let mut checker = Checker { current: [None, None], verdict: Verdict::default() };
    while checker.verdict.wrong.is_none() {
        let next_report = reports.peek().map(|(at, _)| *at);
        let next_instant = instants.first_key_value().map(|(at, _)| *at);
        let Some(at) = next_report.into_iter().chain(next_instant).min() else { break };
        let mut allowed = vec![oracle.beliefs(at)];
        for line in instants.remove(&at).unwrap_or_default() {
            oracle.on_line(line, at);
            allowed.push(oracle.beliefs(at));
        }
        while let Some((_, report)) = reports.next_if(|(of, _)| *of == at) {
            checker.on_report(at, report, &allowed);
        }
        checker.on_end_of_instant(at, &allowed);
    }
    checker.verdict
}

/// What stands on the topics.
struct Checker {
    /// State and time of the newest report, unless it was withdrawn.
    current: [Option<(&'static str, u64)>; 2],
    verdict: Verdict,
}

impl Checker {
    fn on_report(&mut self, at: u64, Report { topic, published }: Report, allowed: &[[Belief; 2]]) {
        self.verdict.reports += u64::from(published.is_some());
        self.current[topic] = published.map(|(state, _)| (state, at));
        let is_allowed = allowed.iter().any(|beliefs| match (&beliefs[topic], published) {
            (Some((state, stamps)), Some((published, stamp))) => {
                *state == published && stamps.contains(&stamp)
            }
            (None, None) => true,
            (Some(_), None) | (None, Some(_)) => false,
        });
        if !is_allowed {
            let kind = if published.is_some() { Kind::Publication } else { Kind::Withholding };
            self.fail(kind, at, topic, format!("{published:?} is published"), allowed);
        }
    }

    /// Everything at that instant has been handled: what stands on a topic is what the last of it leaves.
    fn on_end_of_instant(&mut self, at: u64, allowed: &[[Belief; 2]]) {
        let Some(last) = allowed.last() else { return };
        for (topic, belief) in last.iter().enumerate() {
            match (belief, self.current[topic]) {
                (None, None) => self.verdict.withheld += 1,
                (None, Some((state, _))) => {
                    self.fail(
                        Kind::Publication,
                        at,
                        topic,
                        format!("{state} is not withdrawn"),
                        &allowed[allowed.len() - 1..],
                    );
                }
                (Some(_), None) => {
                    self.fail(Kind::Withholding, at, topic, "nothing is published".to_owned(), allowed);
                }
                (Some((state, _)), Some((current, _))) if *state != current => {
                    self.fail(Kind::Publication, at, topic, format!("{current} still stands"), allowed);
                }
                (Some(_), Some((_, published))) if at - published > PERIOD_NS => {
                    self.fail(
                        Kind::Withholding,
                        at,
                        topic,
                        "no new report for longer than its period".to_owned(),
                        allowed,
                    );
                }
                (Some(_), Some(_)) => {}
            }
        }
    }

    fn fail(&mut self, kind: Kind, at_ns: u64, topic: usize, got: String, allowed: &[[Belief; 2]]) {
        let allowed = allowed.iter().map(|beliefs| beliefs[topic].clone()).collect();
        self.verdict.wrong.get_or_insert(Wrong { kind, at_ns, topic: TOPICS[topic], got, allowed });
    }
}

/// The shortest recording found that still goes wrong in the same way.
pub(crate) fn shrink(
    vehicle: &Vehicle,
    settings: &GatewaySettings,
    lines: &[Line],
    kind: Kind,
) -> (Vec<Line>, Wrong) {
    let fails = |lines: &[Line]| run(vehicle, settings, lines).wrong.filter(|wrong| wrong.kind == kind);
    let mut shortest = lines.to_vec();
    let mut wrong = fails(lines).unwrap();
    let mut chunk = lines.len() / 2;
    while chunk > 0 {
        let mut from = 0;
        while from < shortest.len() {
            let mut shorter = shortest.clone();
            shorter.drain(from..(from + chunk).min(shortest.len()));
            match fails(&shorter) {
                Some(still) => (shortest, wrong) = (shorter, still),
                None => from += chunk,
            }
        }
        chunk /= 2;
    }
    (shortest, wrong)
}
