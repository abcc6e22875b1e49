//! `docs/vehicles.md`, made of the shipped profiles as they are bound, and of their provenance.

use std::fs;

use can_signal::validation::integrity::Protection;
use gateway_core::provenance::{FactSource, Provenance, Verification};
use gateway_core::vehicle_lights::binding::{HazardBinding, TurnBinding};
use signal_gateway::config::Settings;
use signal_gateway::config::car_models::models;
use vehicle_bringup::car_model::{CarModel, ModelProfile};

use crate::pure::vehicles::{profile, profile_names, project};

const HEAD: &str = "\
<!-- Made by `UPDATE_DOCS=1 cargo test --test pure vehicles::document` from config/vehicles and config/cars/models.toml. -->

# Vehicles

For integrators who want to know whether their vehicle is supported. This page tells you which profile to try, what it \
covers, and which of its facts have been verified.

`signal-gateway profiles find Kia EV6 2022` answers for one car, from the table of models at the end, \
`signal-gateway profiles list` prints the same profiles, `signal-gateway identify LOG` finds the ones that fit a recording, \
and `signal-gateway profiles show NAME --provenance` prints the facts of one profile. How facts are written is \
explained at the end of [config/gateway.toml](../config/gateway.toml) under `[[provenance]]`.

A fact is verified by a *car* on which it was tried, by a *recording* of such a car, or by a trial on a *bench*. A fact that \
is verified by *nothing* is as good as its source: check it on your car before you rely on it.

## Profiles

The gateway checks the protection in each frame before it uses a signal.

Velocity, steering, gear, mode (who is in control) and doors: what has verified that part of the status, `read` for one that is \
only read in the source, `–` for one that the profile does not have. A yaw rate sensor is a part of the velocity with a \
verification of its own.

| make | profile | models | turn | hazard | velocity | yaw rate | steering | gear | mode | doors | V2I | commands | protection | verified facts |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|
";

const FACTS: &str = "
## Facts and their sources

| profile | facts | verified by | source | since |
|---|---|---|---|---|
";

const MODELS: &str = "
## Models

Cars whose signals opendbc reads, cars that its documents list without a description of their frames, and cars that a \
profile names itself. A plug has the name of the harness connector in the documents of opendbc. A car that is not in the table \
may still fit a profile: `signal-gateway identify` compares all of them with its frames.

| make | model | years | profile | plug |
|---|---|---|---|---|
";

fn model(model: &CarModel) -> String {
    let (profile, plug) = match &model.profile {
        ModelProfile::Shipped { profile, plug } => (profile.clone(), plug.clone().unwrap_or_default()),
        ModelProfile::Missing { reason } => (format!("none: {reason}"), String::new()),
    };
    let note = model.note.as_ref().map_or(String::new(), |note| format!("; {note}"));
    format!("| {} | {} | {} | {profile}{note} | {plug} |\n", model.make, model.model, model.years_text())
}

fn yes(is_given: bool) -> &'static str {
    if is_given { "yes" } else { "–" }
}

fn protection(settings: &Settings) -> String {
    let gateway = &settings.gateway;
    let messages = gateway.lights.table.messages.iter().chain(&gateway.v2i.table.messages);
    let messages = messages.chain(&gateway.status.table.messages);
    let mut kinds = [("checksum", false), ("counter", false)];
    for check in messages.filter_map(|message| message.integrity.as_ref()) {
        let (has_checksum, has_counter) = match &check.protection {
            Protection::Fields { checksum, counter } => (checksum.is_some(), counter.is_some()),
            Protection::E2e { .. } => (true, true),
        };
        kinds[0].1 |= has_checksum;
        kinds[1].1 |= has_counter;
    }
    let given: Vec<_> = kinds.iter().filter(|(_, is_given)| *is_given).map(|(kind, _)| *kind).collect();
    if given.is_empty() { "–".to_owned() } else { given.join(", ") }
}

fn verified(provenance: &Provenance) -> String {
    let kinds = [Verification::Car, Verification::Recording, Verification::Bench];
    let counted = kinds.map(|kind| (provenance.facts_verified_by(kind).len(), kind));
    let counted = counted.iter().filter(|(count, _)| *count > 0);
    let counted: Vec<_> = counted.map(|(count, kind)| format!("{count} by {kind}")).collect();
    if counted.is_empty() {
        return "none".to_owned();
    }
    format!("{} of {}", counted.join(", "), provenance.facts.len())
}

/// The facts of the status, in the order of the columns.
const STATUS_FACTS: [&str; 6] =
    ["velocity.speed", "velocity.heading_rate", "steering", "gear", "control_mode", "doors"];

/// What has verified a fact of the status.
fn status(provenance: &Provenance, name: &str) -> String {
    if !provenance.facts.iter().any(|fact| fact.name == name) {
        return "–".to_owned();
    }
    let kinds = [Verification::Car, Verification::Recording, Verification::Bench];
    let is_verified = |kind: &Verification| provenance.facts_verified_by(*kind).contains(&name);
    kinds.into_iter().find(is_verified).map_or("read".to_owned(), |kind| kind.to_string())
}

fn overview(name: &str) -> String {
    let settings = profile(name);
    let (lights, provenance) = (&settings.gateway.lights, &settings.provenance);
    let makes = provenance.makes.join(", ");
    format!(
        "| {} | [{}](../config/vehicles/{name}.toml) | {} | {} | {} | {} | {} | {} | {} | {} |\n",
        if makes.is_empty() { "–" } else { &makes },
        settings.vehicle,
        provenance.models,
        yes(matches!(lights.turn, TurnBinding::From(_))),
        yes(matches!(lights.hazard, HazardBinding::From(_))),
        STATUS_FACTS.map(|fact| status(provenance, fact)).join(" | "),
        yes(!settings.gateway.v2i.is_empty()),
        yes(!settings.command_binding.is_empty()),
        protection(settings),
        verified(provenance),
    )
}

fn source(source: &FactSource) -> String {
    let mut text = source.kind.to_string();
    if let Some(file) = &source.file {
        text += &format!(" `{file}`");
    }
    if let Some(repository) = &source.repository {
        let commit = source.commit.as_ref().map_or(String::new(), |commit| format!("/tree/{commit}"));
        text += &format!(" of [{repository}](https://github.com/{repository}{commit})");
    }
    if let Some(version) = &source.version {
        text += &format!(" {version}");
    }
    source.note.as_ref().map_or(text.clone(), |note| format!("{text}: {note}"))
}

fn facts(name: &str) -> String {
    let provenance = &profile(name).provenance;
    let rows = provenance.records.iter().map(|record| {
        let facts: Vec<_> = record.facts.iter().map(|fact| format!("`{fact}`")).collect();
        let evidence = match record.verified {
            Verification::Nothing => "nothing".to_owned(),
            Verification::Bench | Verification::Recording | Verification::Car => {
                format!("{}: {}", record.verified, record.evidence)
            }
        };
        let (facts, source) = (facts.join(", "), source(&record.source));
        format!("| {name} | {facts} | {evidence} | {source} | {} |\n", record.since)
    });
    rows.collect()
}

#[test]
fn the_document_of_vehicles_is_what_the_profiles_give() {
    let mut names = profile_names();
    names.sort_by_key(|name| {
        (profile(name).provenance.makes.is_empty(), profile(name).provenance.makes.clone())
    });
    let overviews: String = names.iter().map(|name| overview(name)).collect();
    let facts: String = profile_names().iter().map(|name| facts(name)).collect();
    let models: String = models().unwrap().iter().map(model).collect();
    let made = format!("{HEAD}{overviews}{FACTS}{facts}{MODELS}{models}");
    let path = project().join("docs/vehicles.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, made).unwrap();
    } else {
        let again = "run `UPDATE_DOCS=1 cargo test --test pure vehicles::document`";
        let written = fs::read_to_string(&path).unwrap_or_default();
        assert!(written == made, "docs/vehicles.md is not what config/vehicles gives: {again}\n{made}");
    }
}

#[test]
fn every_fact_of_a_shipped_profile_has_a_source() {
    for name in profile_names() {
        let facts = profile(&name).provenance.facts.iter();
        let without: Vec<_> = facts.filter(|fact| fact.records.is_empty()).map(|fact| &fact.name).collect();
        assert!(without.is_empty(), "{name} gives no source for {without:?}");
    }
}
