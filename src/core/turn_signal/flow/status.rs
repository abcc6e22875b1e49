//! What the decider says of itself: command, winner and rule, distances, why each other candidate lost,
//! what is wrong with the inputs, how far it agrees with Autoware.

use super::agreement::{Agreement, Disagreement};
use super::{Role, TurnSignalFlow};
use crate::core::diagnostics::Level;
use crate::core::time::MonoTime;
use crate::core::turn_signal::decision::{Decision, Ground};
use crate::core::turn_signal::inputs::Weight;
use crate::core::turn_signal::resolve::{Resolution, Source};

type Value = (&'static str, String);

const TURNS: [&str; 4] = ["NO_COMMAND", "DISABLE", "LEFT", "RIGHT"];
const HAZARDS: [&str; 3] = ["NO_COMMAND", "DISABLE", "ENABLE"];

impl TurnSignalFlow {
    /// Level and message: what is worst, else what is commanded by whom.
    pub(super) fn summary(&self) -> (Level, String) {
        let Some(decision) = &self.decision else { return (Level::Ok, "nothing decided yet".to_owned()) };
        let (mut level, mut text) = (Level::Ok, by_whom(decision));
        if let Some(worst) = decision.findings.iter().rev().max_by_key(|finding| finding.weight()) {
            level = match worst.weight() {
                Weight::Normal => Level::Ok,
                Weight::Doubt => Level::Warn,
                Weight::Failure => Level::Error,
            };
            if level > Level::Ok || decision.ground == Ground::Blind {
                text = worst.situation();
            }
        }
        let differs = |agreement: &Agreement| agreement.present.is_some_and(|present| present.counts);
        if level == Level::Ok && (differs(&self.turn_agreement) || differs(&self.hazard_agreement)) {
            (level, text) = (Level::Warn, "Autoware commands something else".to_owned());
        }
        (level, format!("{}: {text}", decision.turn))
    }

    /// Key/values in a fixed order.
    pub(super) fn values(&self, now: MonoTime) -> Vec<Value> {
        let mut values = vec![(
            "role",
            match self.settings.role {
                Role::Command => "command".to_owned(),
                Role::Shadow { .. } => "shadow".to_owned(),
            },
        )];
        if let Some(decision) = &self.decision {
            decided(decision, &mut values);
        }
        let route = match &self.route {
            None => "none".to_owned(),
            Some(Ok(route)) => format!("{:032x}", route.id()),
            Some(Err(_)) => "refused".to_owned(),
        };
        values.push(("route", route));
        let age_ms = self.heard.odometry.map(|odometry| now.since(odometry.at).as_millis());
        values.push(("odometry_age_ms", age_ms.map_or("none".to_owned(), |age| age.to_string())));
        let mode = self.heard.operation_mode;
        values.push(("operation_mode", mode.map_or("unknown".to_owned(), |mode| mode.mode.to_string())));
        values.push(("cycles", self.cycles.to_string()));
        values.push(("changes", self.changes.to_string()));
        if matches!(self.settings.role, Role::Shadow { .. }) {
            agreement(
                &self.turn_agreement,
                ["turn_agreement_percent", "turn_disagreement"],
                &TURNS,
                now,
                &mut values,
            );
            counts(&self.turn_agreement, "turn_compared", &mut values);
            agreement(
                &self.hazard_agreement,
                ["hazard_agreement_percent", "hazard_disagreement"],
                &HAZARDS,
                now,
                &mut values,
            );
            counts(&self.hazard_agreement, "hazard_compared", &mut values);
        }
        values
    }
}

/// Who has the say.
fn by_whom(decision: &Decision) -> String {
    let who = match &decision.ground {
        Ground::Blind => "nothing to go by".to_owned(),
        Ground::Hazard => "hazard lights".to_owned(),
        Ground::BehaviourAlone(_) => "manoeuvres alone".to_owned(),
        Ground::Weighed(resolution) => match resolution.winner {
            Some(winner) => winner.source.to_string(),
            None => "nothing to signal".to_owned(),
        },
    };
    match decision.held {
        Some(_) => format!("{who}, held"),
        None => who,
    }
}

fn decided(decision: &Decision, values: &mut Vec<Value>) {
    values.push(("command", decision.turn.to_string()));
    values.push(("hazard", decision.hazard.to_string()));
    let held = decision.held.map_or("no".to_owned(), |held| held.to_string());
    values.push(("held", held));
    match &decision.ground {
        Ground::Weighed(resolution) => weighed(resolution, values),
        Ground::Blind | Ground::Hazard | Ground::BehaviourAlone(_) => {
            values.push(("winner", "none".to_owned()));
        }
    }
    values.push(("manoeuvres", list(&decision.remarks)));
    values.push(("findings", list(&decision.findings)));
}

fn weighed(resolution: &Resolution, values: &mut Vec<Value>) {
    let winner = resolution.winner;
    values.push(("winner", winner.map_or("none".to_owned(), |winner| winner.source.to_string())));
    values.push(("rule", resolution.case.map_or("none".to_owned(), |case| case.to_string())));
    if let Some(winner) = winner {
        let metres = |metres: f64| format!("{metres:.2}");
        values.push(("desired_start_m", metres(winner.distances.desired_start_m)));
        values.push(("desired_end_m", metres(winner.distances.desired_end_m)));
        values.push(("required_start_m", metres(winner.distances.required_start_m)));
        values.push(("required_end_m", metres(winner.distances.required_end_m)));
    }
    for weighed in &resolution.weighed {
        let key = match weighed.source {
            Source::Intersection => "intersection",
            Source::Roundabout => "roundabout",
            Source::Behaviour => "behaviour",
        };
        let text = weighed.to_string();
        let why = text.split_once(": ").map_or(text.as_str(), |(_, why)| why);
        values.push((key, why.to_owned()));
    }
}

fn list(items: &[impl ToString]) -> String {
    if items.is_empty() {
        return "none".to_owned();
    }
    items.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

fn agreement(
    agreement: &Agreement,
    [share, present]: [&'static str; 2],
    names: &[&str],
    now: MonoTime,
    values: &mut Vec<Value>,
) {
    let percent = agreement.percent();
    values.push((share, percent.map_or("nothing compared".to_owned(), |percent| format!("{percent:.2}"))));
    let named =
        |number: u8| names.get(usize::from(number)).map_or(number.to_string(), |name| (*name).to_owned());
    let text = agreement.present.map(|Disagreement { ours, autoware, since, .. }| {
        let ms = now.since(since).as_millis();
        format!("{} here, {} of Autoware, for {ms} ms", named(ours), named(autoware))
    });
    values.push((present, text.unwrap_or("none".to_owned())));
}

fn counts(agreement: &Agreement, key: &'static str, values: &mut Vec<Value>) {
    let Agreement { agreed, tolerated, disagreed, skipped, .. } = agreement;
    let text = format!("{agreed} alike, {tolerated} tolerated, {disagreed} different, {skipped} skipped");
    values.push((key, text));
}
