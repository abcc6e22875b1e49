//! The commands to the vehicle, the buses, the turn signal decider and the traffic lights.

use schemars::JsonSchema;
use serde::Serialize;

use super::value::{Fact, Section, Value, age_text};
use crate::report::counts;
use crate::report::text::counted;
use can_signal::can::{BusReception, BusSnapshot};
use gateway_base::diagnostics::Level;
use gateway_base::names::{state_word, words};
use gateway_core::command::snapshot::{CommandSnapshot, FunctionSnapshot, LightsValue};
use traffic_lights::bulb::{Bulb, BulbShape, BulbStatus, Color};
use traffic_lights::snapshot::{ChannelSnapshot, LightSnapshot, TrafficLightsSnapshot};
use traffic_lights::target::StoreLayer;
use turn_signal::flow::snapshot::{CandidateSnapshot, DeciderSnapshot, DecisionSnapshot};
use turn_signal::resolve::CandidateOutcome;

/// A bus.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct BusView {
    /// Its name in the vehicle profile, and its interface.
    pub name: String,
    /// The worst level of link, controller and reception.
    pub level: Level,
    /// Its state in a few words: the first of link, controller and reception that is not good.
    pub state: String,
    /// Link, controller and reception, as far as they are known.
    pub badges: Vec<Value>,
    /// Frames per second: all of the bus where they are counted, else the frames of the profile.
    pub rate_hz: f64,
    /// Load in percent; `None` without a bit rate.
    pub load_percent: Option<f64>,
    /// Frames dropped since start.
    pub drops: u64,
    /// Rates, silence, and what is counted since start.
    pub facts: Vec<Fact>,
}

/// The turn signal decider.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct DeciderView {
    /// Level of its diagnostic status.
    pub level: Level,
    /// Message of its diagnostic status.
    pub message: String,
    /// The turn command in words; `None` before the first decision.
    pub turn: Option<String>,
    /// The decision in a line, or why there is none.
    pub decision: String,
    /// The candidates, each with its outcome.
    pub candidates: Vec<CandidateView>,
    /// Manoeuvres and findings, a sentence each.
    pub remarks: Vec<String>,
    /// Its role, its inputs, and what is counted since start.
    pub facts: Vec<Fact>,
}

/// A candidate of a decision.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct CandidateView {
    /// What it is about.
    pub subject: String,
    /// Command that it requests, in words.
    pub turn: String,
    /// What became of it.
    pub outcome: String,
    /// True for the one that is signalled.
    pub has_won: bool,
    /// Distances to its desired start, desired end, required start and required end, m; `None` without a
    /// record.
    pub distances_m: Option<[f64; 4]>,
    /// These distances in a sentence; empty without a record.
    pub stretch: String,
}

/// The traffic lights.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct LightsView {
    /// The channels that anything is known of.
    pub channels: Vec<ChannelView>,
    /// The controllers of the scenario, each with its phase.
    pub controllers: Vec<Fact>,
}

/// The lights of one channel.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ChannelView {
    /// Name of the channel.
    pub name: String,
    /// How many lights there are, and how many of them are worth a remark.
    pub counts: String,
    /// The lights, as far as they are listed.
    pub lights: Vec<LightView>,
}

/// A traffic light.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct LightView {
    /// Its id, and whether it is the perception of it.
    pub name: String,
    /// Relation ids of the groups that it belongs to.
    pub groups: Vec<i64>,
    /// Its bulbs; empty when it is dark.
    pub bulbs: Vec<Bulb>,
    /// Its bulbs in words, and how sure they are.
    pub text: String,
}

pub(super) fn commanded(function: &FunctionSnapshot) -> Value {
    let or = |value: Option<LightsValue>, other: &str| {
        value.map_or_else(|| other.to_owned(), |value| value.to_string())
    };
    let age =
        function.command_age_ms.map_or_else(String::new, |age| format!(", received {} ago", age_text(age)));
    Value {
        level: Some(function.level),
        text: or(function.requested, "none"),
        lines: vec![
            format!("{}: {}", words(&function.compliance), function.reason.text()),
            format!("command: {}{age}", words(&function.command)),
            format!("feedback: {}", or(function.reported, "unknown")),
        ],
    }
}

pub(super) fn commands(commands: &CommandSnapshot) -> Section {
    let dry = if commands.is_transmitting { "" } else { ", dry run: nothing is sent" };
    let mode = match (commands.control_mode, commands.undefined_control_mode) {
        (Some(mode), _) => state_word(&mode),
        (None, Some(raw)) => format!("undefined ({raw})"),
        (None, None) => "unknown".to_owned(),
    };
    let functions =
        [("turn_indicators", &commands.turn_indicators), ("hazard_lights", &commands.hazard_lights)];
    let functions = functions.into_iter().map(|(name, function)| {
        let Value { text, lines, .. } = commanded(function);
        Fact::new(name, format!("requested: {text}; {}", lines.join("; ")))
    });
    let messages = commands.messages.iter().map(|message| {
        let counts = &message.counts;
        let failed = counts.queue_full + counts.refused;
        let text = format!("{} sent, {failed} failed, {} foreign", counts.sent, counts.foreign);
        Fact::new(&message.name, text)
    });
    Section {
        title: format!("commands (from {}, control mode {mode}{dry})", words(&commands.source)),
        facts: functions.chain(messages).collect(),
    }
}

impl BusView {
    pub(super) fn of(bus: &BusSnapshot) -> Self {
        let states: Vec<_> = bus.states().collect();
        let state = states.iter().find(|(level, _)| *level > Level::Ok).or(states.last());
        let is_silent = bus.reception != Some(BusReception::Receiving);
        let load_percent = bus.traffic.and_then(|traffic| traffic.load_percent);
        let rates = [
            Some(("bound frames", format!("{:.1} /s", bus.rate_hz))),
            bus.traffic.map(|traffic| ("all frames", format!("{:.0} /s", traffic.rate_hz))),
            load_percent.map(|load| ("load", format!("{load:.1} %"))),
            bus.silence_ms.filter(|_| is_silent).map(|silence| ("silent for", age_text(silence))),
        ];
        let counts = counts::BUS.iter().filter_map(|row| {
            let count = (row.value)(bus);
            Some((row.label?, count.to_string())).filter(|_| count > 0)
        });
        let facts = rates.into_iter().flatten().chain(counts);
        Self {
            name: format!("{} ({})", bus.name, bus.interface),
            level: bus.worst(),
            state: state.map_or_else(String::new, |(_, text)| text.clone()),
            badges: bus.details().map(|(level, text)| Value::new(Some(level), text)).collect(),
            rate_hz: bus.traffic.map_or(bus.rate_hz, |traffic| traffic.rate_hz.max(bus.rate_hz)),
            load_percent,
            drops: bus.drops,
            facts: facts.map(|(name, text)| Fact::new(name, text)).collect(),
        }
    }

    /// Creates a bus of which only the state is known.
    pub fn plain(name: String, level: Level, state: &str, rate_hz: f64) -> Self {
        let badges = vec![Value::new(Some(level), state)];
        Self { name, level, state: state.to_owned(), badges, rate_hz, ..Self::default() }
    }

    /// Returns link, controller and reception in a line.
    pub fn details(&self) -> String {
        self.badges.iter().map(|badge| badge.text.as_str()).collect::<Vec<_>>().join(", ")
    }
}

impl DeciderView {
    pub(super) fn of(decider: &DeciderSnapshot) -> Self {
        let percent = |percent: Option<f64>| percent.map(|percent| format!("{percent:.1} %"));
        let odometry = decider.odometry_age_ms;
        let odometry = odometry.map_or_else(|| "none".to_owned(), |age| format!("{} old", age_text(age)));
        let decision = decider.decision.as_ref();
        let facts = [
            ("role", Some(decider.role.to_string())),
            ("basis", decision.map(|decision| words(&decision.basis))),
            ("route", Some(decider.route.clone())),
            ("odometry", Some(odometry)),
            ("decisions changed", Some(decider.changes.to_string())),
            ("agreement with Autoware, turn", percent(decider.turn_agreement_percent)),
            ("agreement with Autoware, hazard", percent(decider.hazard_agreement_percent)),
            ("signals by the rules", percent(decider.signal_agreement_percent)),
            ("last wrong signal", decider.last_wrong_signal.as_ref().map(ToString::to_string)),
        ];
        let facts = facts.into_iter().filter_map(|(name, text)| Some(Fact::new(name, text?)));
        let remarks = |decision: &DecisionSnapshot| {
            let manoeuvres = decision.manoeuvres.iter().map(ToString::to_string);
            manoeuvres.chain(decision.findings.iter().cloned()).collect()
        };
        let candidates =
            |decision: &DecisionSnapshot| decision.candidates.iter().map(CandidateView::of).collect();
        Self {
            level: decider.level,
            message: decider.message.clone(),
            turn: decision.map(|decision| state_word(&decision.turn)),
            decision: decision.map_or_else(|| decider.message.clone(), decision_text),
            candidates: decision.map(candidates).unwrap_or_default(),
            remarks: decision.map(remarks).unwrap_or_default(),
            facts: facts.collect(),
        }
    }
}

/// Returns a decision in a line: the commands, the winner and the rule.
fn decision_text(decision: &DecisionSnapshot) -> String {
    let won = decision.candidates.iter().find(|candidate| candidate.outcome == CandidateOutcome::Won);
    let subject =
        won.and_then(|won| won.subject.clone()).or(decision.winner.map(|winner| winner.to_string()));
    let subject = subject.map_or_else(String::new, |subject| format!(": {subject}"));
    let rule = decision.rule.map_or_else(String::new, |rule| format!(", rule {rule}"));
    let held = decision.held.map_or_else(String::new, |held| format!(", held: {held}"));
    let [turn, hazard] = [state_word(&decision.turn), state_word(&decision.hazard)];
    format!("turn {turn}, hazard {hazard}{subject}{rule}{held}")
}

impl CandidateView {
    fn of(candidate: &CandidateSnapshot) -> Self {
        let stretch = candidate.distances_m.map(|[start, end, required, _]| {
            format!("on from {start:.0} m to {end:.0} m, required from {required:.0} m")
        });
        Self {
            subject: candidate.subject.clone().unwrap_or_else(|| candidate.source.to_string()),
            turn: state_word(&candidate.turn),
            outcome: candidate.outcome.to_string(),
            has_won: candidate.outcome == CandidateOutcome::Won,
            distances_m: candidate.distances_m,
            stretch: stretch.unwrap_or_default(),
        }
    }
}

impl LightsView {
    pub(super) fn of(lights: &TrafficLightsSnapshot) -> Self {
        let is_known = |channel: &&ChannelSnapshot| {
            channel.lights > 0 || channel.rejected > 0 || !channel.states.is_empty()
        };
        let phase = |phase: &Option<String>| phase.clone().unwrap_or_else(|| "no phase yet".to_owned());
        let controllers = lights.controllers.iter();
        let controllers = controllers.map(|controller| Fact::new(&controller.name, phase(&controller.phase)));
        Self {
            channels: lights.channels.iter().filter(is_known).map(ChannelView::of).collect(),
            controllers: controllers.collect(),
        }
    }
}

impl ChannelView {
    fn of(channel: &ChannelSnapshot) -> Self {
        let remarks = [
            ("dark", channel.dark.into()),
            ("unknown", channel.unknown.into()),
            ("detected", channel.detected.into()),
            ("contradictory", channel.contradictory.into()),
            ("stale", channel.stale),
            ("rejected", channel.rejected),
        ];
        let remarks = remarks.into_iter().filter(|(_, count): &(_, u64)| *count > 0);
        let remarks = remarks.map(|(name, count)| format!(", {count} {name}"));
        Self {
            name: channel.channel.name().to_owned(),
            counts: counted(channel.lights.into(), "light") + &remarks.collect::<String>(),
            lights: channel.states.iter().map(LightView::of).collect(),
        }
    }
}

impl LightView {
    fn of(light: &LightSnapshot) -> Self {
        let layer = if light.layer == StoreLayer::Detected { ", detected" } else { "" };
        let bulbs: Vec<_> = light.bulbs.iter().map(bulb_text).collect();
        let bulbs = if bulbs.is_empty() { "dark".to_owned() } else { bulbs.join(", ") };
        let confidence = light.confidence;
        let confidence =
            if confidence < 1.0 { format!(", confidence {confidence:.2}") } else { String::new() };
        Self {
            name: format!("{}{layer}", light.id),
            groups: light.groups.clone(),
            bulbs: light.bulbs.clone(),
            text: bulbs + &confidence,
        }
    }
}

/// Returns a bulb in words, without the usual circle and solidOn: `green left` for `green solidOn left`.
pub fn bulb_text(bulb: &Bulb) -> String {
    let (color, status, shape) = (bulb.color, bulb.status, bulb.shape);
    let is_unknown = color == Color::Unknown;
    let status = (status != BulbStatus::SolidOn && !is_unknown).then(|| status.name());
    let shape = (shape != BulbShape::Circle && !is_unknown).then(|| shape.name());
    [color.name()].into_iter().chain(status).chain(shape).collect::<Vec<_>>().join(" ")
}
