//! `makes`, `models` and `[[provenance]]` of a profile: the source of each fact, and its verification.

use super::binder::LoadedDbc;
use crate::config::reading::{Fields, LocatedText};
use can_signal::can::IdMatch;
use can_signal::validation::integrity::Protection;
use can_signal::validation::table::BoundMessage;
use gateway_base::near_miss::did_you_mean;
use gateway_core::command::settings::CommandBinding;
use gateway_core::provenance::{
    Date, FactSource, ProfileFact, Provenance, ProvenanceRecord, SOURCES, VERIFICATIONS, Verification,
};
use gateway_core::v2i_reception::binding::V2iSource;
use gateway_core::vehicle_lights::binding::{LightsBinding, StateBinding};
use gateway_core::vehicle_status::binding::StatusBinding;
use gateway_core::vehicle_status::velocity::binding::DirectionSource;

/// The bound parts of a profile, which state its facts.
pub(super) struct BoundParts<'v> {
    pub(super) lights: &'v LightsBinding,
    pub(super) status: &'v StatusBinding,
    pub(super) messages: &'v [BoundMessage],
    pub(super) dbcs: &'v [LoadedDbc],
    pub(super) heartbeats: &'v [Vec<IdMatch>],
    pub(super) v2i: &'v [V2iSource],
    pub(super) command: &'v CommandBinding,
}

impl BoundParts<'_> {
    /// Names the facts that the profile states.
    fn facts(&self) -> Vec<String> {
        let lights = self.lights;
        let fact = |name: &str, is_given: bool| is_given.then(|| name.to_owned());
        let mut facts = states("turn", &lights.turn, &["off", "left", "right"]);
        facts.extend(fact("turn.fault_signal", !lights.turn_faults.signals.is_empty()));
        facts.extend(states("hazard", &lights.hazard, &["off", "on"]));
        facts.extend(fact("hazard.fault_signal", !lights.hazard_faults.signals.is_empty()));
        facts.extend(status_facts(self.status).map(str::to_owned));
        facts.extend(self.messages.iter().flat_map(message_facts));
        let buses = self.dbcs.iter().zip(self.heartbeats).filter(|(_, heartbeats)| !heartbeats.is_empty());
        facts.extend(buses.map(|(dbc, _)| format!("bus.{}.heartbeat_messages", dbc.bus)));
        facts.extend(fact("requires", !lights.requirements.is_empty()));
        facts.extend(fact("v2i", !self.v2i.is_empty()));
        facts.extend(fact("command", !self.command.is_empty()));
        facts
    }
}

fn states<S>(section: &str, binding: &StateBinding<S>, states: &[&str]) -> Vec<String> {
    match binding {
        StateBinding::From(_) => states.iter().map(|state| format!("{section}.{state}")).collect(),
        StateBinding::NotVisible { .. } => vec![section.to_owned()],
        StateBinding::LeftOut | StateBinding::NotFitted => Vec::new(),
    }
}

/// Names the sections of the status that the profile has; for the velocity also direction and heading rate,
/// if they have their own signals.
fn status_facts(status: &StatusBinding) -> impl Iterator<Item = &'static str> {
    let velocity = status.velocity.as_ref();
    let has_yaw_rate = velocity.is_some_and(|velocity| velocity.yaw_rates().next().is_some());
    let is_told = |direction: &DirectionSource| matches!(direction, DirectionSource::Signal(_));
    let sections = [
        ("velocity.speed", velocity.is_some()),
        ("velocity.direction", velocity.is_some_and(|velocity| velocity.directions.iter().any(is_told))),
        ("velocity.heading_rate", has_yaw_rate),
        ("steering", !status.steering.is_empty()),
        ("gear", status.gear.is_some()),
        ("control_mode", status.control_mode.is_some()),
        ("doors", !status.doors.is_empty()),
    ];
    sections.into_iter().filter(|(_, is_given)| *is_given).map(|(section, _)| section)
}

fn message_facts(message: &BoundMessage) -> Vec<String> {
    let mut keys = vec!["timing"];
    match message.integrity.as_ref().map(|integrity| &integrity.protection) {
        Some(Protection::Fields { checksum, counter }) => {
            keys.extend(checksum.is_some().then_some("checksum"));
            keys.extend(counter.is_some().then_some("counter"));
        }
        Some(Protection::E2e { .. }) => keys.push("e2e"),
        None => {}
    }
    keys.into_iter().map(|key| format!("message.{}.{key}", message.name)).collect()
}

/// Reads the provenance. `parts` is `None` if one of them was refused; the names of facts are then not
/// checked.
pub(super) fn provenance(top: &Fields<'_>, parts: Option<&BoundParts<'_>>) -> Provenance {
    let makes = top.list("makes", "give a list of makes").iter();
    let makes = makes.filter_map(|make| Some(top.checker.string(make)?.text)).collect();
    let models = top.string("models").map(|models| models.text).unwrap_or_default();
    let names = parts.map(BoundParts::facts).unwrap_or_default();
    let mut records = Vec::new();
    for fields in top.tables("provenance") {
        let facts = fields.list("facts", "give a list of facts, e.g. [\"turn\", \"hazard\"]").iter();
        let facts: Vec<_> = facts.filter_map(|fact| top.checker.string(fact)).collect();
        if parts.is_some() {
            for fact in &facts {
                expect_fact(top, fact, &names);
            }
        }
        records.extend(fields.read_all(|fields| record(fields, facts)));
    }
    let facts = names.into_iter().map(|name| {
        let covers =
            |record: &ProvenanceRecord| record.facts.iter().any(|fact| Provenance::covers(fact, &name));
        let covering = (0..).zip(&records).filter(|(_, record)| covers(record));
        ProfileFact { records: covering.map(|(index, _)| index).collect(), name }
    });
    Provenance { makes, models, facts: facts.collect(), records }
}

/// Refuses a name that covers none of the facts.
fn expect_fact(top: &Fields<'_>, given: &LocatedText, names: &[String]) {
    if !names.iter().any(|name| Provenance::covers(&given.text, name)) {
        let known = names.iter().map(String::as_str);
        let all = format!("name facts of the profile: {}", names.join(", "));
        let reason = format!("the profile states no fact {}", given.text);
        top.checker.refuse(&given.location, reason, &did_you_mean(&given.text, known, all));
    }
}

fn record(fields: &Fields<'_>, facts: Vec<LocatedText>) -> Option<ProvenanceRecord> {
    let required = fields.require(&["facts", "source", "verified", "since"], "");
    let source = fields.read_table("source", source);
    let verified = fields.keyword("verified", VERIFICATIONS);
    let evidence = fields.string("evidence").map(|given| given.text).unwrap_or_default();
    match (verified, evidence.is_empty()) {
        (Some(Verification::Nothing), false) => {
            fields.refuse("evidence", "nothing has verified these facts", "remove it, or change `verified`");
        }
        (Some(Verification::Bench | Verification::Recording | Verification::Car), true) => {
            fields.refuse("verified", "missing key: evidence", "say in `evidence` what was seen, and where");
        }
        (Some(_) | None, _) => {}
    }
    let since = fields.text("since").and_then(|given| {
        let date = Date::parse(&given.text);
        if date.is_none() {
            fields.refuse("since", format!("{:?} is not a date", given.text), "write a day as 2026-11-21");
        }
        date
    });
    required?;
    let facts = facts.into_iter().map(|fact| fact.text).collect();
    Some(ProvenanceRecord { facts, source: source?, verified: verified?, evidence, since: since? })
}

fn source(fields: &Fields<'_>) -> Option<FactSource> {
    let required = fields.require(&["kind"], "");
    let kind = fields.keyword("kind", SOURCES);
    let [file, repository, commit, version, note] = ["file", "repository", "commit", "version", "note"]
        .map(|key| fields.string(key).map(|given| given.text));
    let is_commit = |commit: &String| {
        (7..=40).contains(&commit.len()) && commit.bytes().all(|byte| byte.is_ascii_hexdigit())
    };
    if commit.as_ref().is_some_and(|commit| !is_commit(commit)) {
        fields.refuse("commit", "not the hash of a commit", "give 7 to 40 hexadecimal digits");
    }
    required?;
    Some(FactSource { kind: kind?, file, repository, commit, version, note })
}
