//! Diagnostics of the decider: command, winner and rule, distances, the outcome of each other candidate,
//! findings, agreement with Autoware.

use std::fmt;

use super::shadow_comparison::{CommandDisagreement, ComparableCommand, ShadowComparison};
use super::snapshot::{DeciderSnapshot, DeciderUse, DecisionSnapshot, rounded};
use super::{DeciderRole, TurnSignalFlow};
use crate::catalogue;
use crate::decision::{Basis, Decision};
use crate::inputs::InputFinding;
use crate::resolve::{CandidateSource, Resolution};
use crate::signal_judge::VerdictKind;
use gateway_base::diagnostics::{Level, MessagePart};
use gateway_base::time::{MonoTime, millis};

type Value = (&'static str, String);

impl TurnSignalFlow {
    fn role(&self) -> DeciderUse {
        match self.settings.role {
            DeciderRole::Command => DeciderUse::Command,
            DeciderRole::Shadow { .. } => DeciderUse::Shadow,
        }
    }

    /// Returns the present state.
    pub fn snapshot(&self, now: MonoTime) -> DeciderSnapshot {
        let message = self.summary();
        let verdicts = self.judge.counts().total();
        let percent = |percent| rounded(percent, 1e2);
        DeciderSnapshot {
            role: self.role(),
            level: message.level(),
            message: message.text,
            decision: self.decision.as_deref().map(DecisionSnapshot::of),
            route: self.route_text(),
            odometry_age_ms: self.latest.odometry.map(|odometry| millis(now.since(odometry.at))),
            cycles: self.cycles,
            changes: self.changes,
            shortened_signals: self.decider.shortened(),
            turn_agreement_percent: self.turn_comparison.percent().map(percent),
            hazard_agreement_percent: self.hazard_comparison.percent().map(percent),
            signal_verdicts: verdicts,
            signal_agreement_percent: verdicts.agreement_percent().map(percent),
            last_wrong_signal: self.last_wrong.clone(),
        }
    }

    /// Returns the message: the worst finding, otherwise the source of the command.
    pub(super) fn summary(&self) -> MessagePart {
        let Some(decision) = &self.decision else { return catalogue::nothing_decided() };
        let worst = decision.findings.iter().rev().map(InputFinding::message).max_by_key(MessagePart::level);
        let is_shown = |worst: &MessagePart| worst.level() > Level::Ok || decision.basis == Basis::NoInputs;
        let mut message = worst.filter(is_shown).unwrap_or_else(|| by_whom(decision));
        if message.level() == Level::Ok
            && (self.turn_comparison.differs() || self.hazard_comparison.differs())
        {
            message = catalogue::differs();
        }
        message.with_text(|text| format!("{}: {text}", decision.turn))
    }

    /// Returns the route: its id, `none` or `refused`.
    pub(super) fn route_text(&self) -> String {
        match &self.route {
            None => "none".to_owned(),
            Some(Ok(route)) => format!("{:032x}", route.id()),
            Some(Err(_)) => "refused".to_owned(),
        }
    }

    /// Returns the key/values in a fixed order.
    pub(super) fn values(&self, now: MonoTime) -> Vec<Value> {
        let mut values = vec![("role", self.role().to_string())];
        if let Some(decision) = &self.decision {
            decided(decision, &mut values);
        }
        values.push(("route", self.route_text()));
        let age_ms = self.latest.odometry.map(|odometry| now.since(odometry.at).as_millis());
        values.push(("odometry_age_ms", age_ms.map_or("none".to_owned(), |age| age.to_string())));
        let mode = self.latest.operation_mode;
        values.push(("operation_mode", mode.map_or("unknown".to_owned(), |mode| mode.mode.to_string())));
        values.push(("cycles", self.cycles.to_string()));
        values.push(("changes", self.changes.to_string()));
        values.push(("shortened_signals", self.decider.shortened().to_string()));
        if self.role() == DeciderUse::Shadow {
            let keys = ["turn_agreement_percent", "turn_disagreement", "turn_compared"];
            compared(&self.turn_comparison, keys, now, &mut values);
            let keys = ["hazard_agreement_percent", "hazard_disagreement", "hazard_compared"];
            compared(&self.hazard_comparison, keys, now, &mut values);
            let verdicts = self.judge.counts().total();
            let percent = verdicts.agreement_percent();
            values.push((
                "signal_agreement_percent",
                percent.map_or("nothing judged".to_owned(), |percent| format!("{percent:.2}")),
            ));
            let counts = VerdictKind::ALL.map(|kind| format!("{} {kind}", verdicts.of(kind)));
            values.push(("signal_verdicts", counts.join(", ")));
            let last = self.last_wrong.as_ref().map(ToString::to_string);
            values.push(("last_wrong_signal", last.unwrap_or("none".to_owned())));
        }
        values
    }
}

/// Returns the source of the command.
fn by_whom(decision: &Decision) -> MessagePart {
    let source = match &decision.basis {
        Basis::NoInputs => catalogue::no_inputs(),
        Basis::Hazard => catalogue::hazard_lights(),
        Basis::ManoeuvreAlone(_) => catalogue::manoeuvres_alone(),
        Basis::PathGenerator(_) => catalogue::path_generator(),
        Basis::Candidates(resolution) => match resolution.winner.map(|winner| winner.source) {
            Some(CandidateSource::Intersection) => catalogue::intersection(),
            Some(CandidateSource::Roundabout) => catalogue::roundabout(),
            Some(CandidateSource::Manoeuvre) => catalogue::manoeuvre(),
            None => catalogue::nothing_to_signal(),
        },
    };
    match decision.held {
        Some(_) => source.with_text(|text| text + ", held"),
        None => source,
    }
}

fn decided(decision: &Decision, values: &mut Vec<Value>) {
    values.push(("command", decision.turn.to_string()));
    values.push(("hazard", decision.hazard.to_string()));
    let held = decision.held.map_or("no".to_owned(), |held| held.to_string());
    values.push(("held", held));
    match &decision.basis {
        Basis::Candidates(resolution) => evaluated(resolution, values),
        Basis::PathGenerator(tagged) => {
            values.extend([("winner", "none".to_owned()), ("lanelet", tagged.to_string())]);
        }
        Basis::NoInputs | Basis::Hazard | Basis::ManoeuvreAlone(_) => {
            values.push(("winner", "none".to_owned()));
        }
    }
    let junction = decision.junction.as_ref().map(ToString::to_string);
    values.push(("junction", junction.unwrap_or("none".to_owned())));
    values.push(("manoeuvres", list(&decision.remarks)));
    values.push(("findings", list(&decision.findings)));
}

fn evaluated(resolution: &Resolution, values: &mut Vec<Value>) {
    let winner = resolution.winner;
    values.push(("winner", winner.map_or("none".to_owned(), |winner| winner.source.to_string())));
    values.push(("rule", resolution.case.map_or("none".to_owned(), |case| case.to_string())));
    if let Some(winner) = winner {
        let keys = ["desired_start_m", "desired_end_m", "required_start_m", "required_end_m"];
        let distances = winner.distances.values().map(|metres| format!("{metres:.2}"));
        values.extend(keys.into_iter().zip(distances));
    }
    for evaluated in &resolution.evaluated {
        values.push((evaluated.source.name(), evaluated.reason()));
    }
}

fn list(items: &[impl ToString]) -> String {
    if items.is_empty() {
        return "none".to_owned();
    }
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

fn compared<T: ComparableCommand + fmt::Display>(
    comparison: &ShadowComparison<T>,
    [share, present, counts]: [&'static str; 3],
    now: MonoTime,
    values: &mut Vec<Value>,
) {
    let percent = comparison.percent();
    values.push((share, percent.map_or("nothing compared".to_owned(), |percent| format!("{percent:.2}"))));
    let text = comparison.present.as_ref().map(|CommandDisagreement { ours, autoware, since, .. }| {
        format!("{ours} here, {autoware} of Autoware, for {} ms", now.since(*since).as_millis())
    });
    values.push((present, text.unwrap_or("none".to_owned())));
    let ShadowComparison { agreed, tolerated, disagreed, skipped, .. } = comparison;
    let text = format!("{agreed} alike, {tolerated} tolerated, {disagreed} different, {skipped} skipped");
    values.push((counts, text));
}
