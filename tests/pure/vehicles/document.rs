//! `docs/vehicles.md`, made of the shipped profiles as they are bound, and of their provenance.

use std::fs;

use can_signal::validation::integrity::Protection;
use gateway_core::provenance::{FactSource, Provenance, Verification};
use gateway_core::vehicle_lights::binding::{HazardBinding, TurnBinding};
use signal_gateway::config::Settings;
use signal_gateway::config::car_models::models;
use vehicle_bringup::car_model::ModelProfile;

use crate::pure::vehicles::{profile, profile_names, project};

const HEAD: &str = "\
<!-- Made by `UPDATE_DOCS=1 cargo test --test pure vehicles::document` from config/vehicles and config/cars/models.toml. -->

# Vehicles

For integrators who want to know whether their vehicle is supported. This page tells you which profile to try, what it \
covers, and which of its facts have been verified.

`signal-gateway profiles find Kia EV6 2022` answers for one car. `identify LOG` finds the profiles that fit a recording, and \
`profiles show NAME --provenance` prints each fact of a profile with its source, date and assumptions.

A fact is verified by a *car* on which it was tried, by a *recording* of such a car, or by a trial on a *bench*. All other \
facts are only as good as their sources: check them on your car before you rely on them.

## Profiles

The column *signals* has a letter for each: `t`urn indicators, `h`azard lights, `v`elocity, `y`aw rate, `s`teering, `g`ear, \
control `m`ode, `d`oors. A capital is verified at least in part (lights: beyond *off*), a small letter only read in a source, \
`-` not in the profile. *Protection* is checked in each frame before a signal is used.

| make | profile | models | signals | protection | more | verified facts |
|---|---|---|---|---|---|---|
";

const FACTS: &str = "
## Verified facts

| profile | facts | evidence | source |
|---|---|---|---|
";

const MODELS: &str = "
## Models

Cars whose signals opendbc reads, cars that its documents list without a description of their frames, and cars that a \
profile names itself. A plug has the name of the harness connector in the documents of opendbc. A car that is not in the table \
may still fit a profile: `signal-gateway identify` compares all of them with its frames.

| make | profile | plug | models |
|---|---|---|---|
";

const KINDS: [Verification; 3] = [Verification::Car, Verification::Recording, Verification::Bench];

/// Cars of one make with the same profile and plug: the cells of a row.
struct ModelGroup {
    cells: [String; 3],
    /// Names of the models, each with the years of its entries.
    models: Vec<(String, Vec<String>)>,
}

impl ModelGroup {
    fn row(&self) -> String {
        let model = |(name, years): &(String, Vec<String>)| format!("{name} {}", years.join(", "));
        let models: Vec<_> = self.models.iter().map(|entry| model(entry).trim_end().to_owned()).collect();
        format!("| {} | {} |\n", self.cells.join(" | "), models.join("; "))
    }
}

/// The table of models; models that differ only in name and years share a row.
fn model_rows() -> String {
    let mut groups: Vec<ModelGroup> = Vec::new();
    for model in models().unwrap() {
        let (profile, plug) = match &model.profile {
            ModelProfile::Shipped { profile, plug } => (profile.clone(), plug.clone().unwrap_or_default()),
            ModelProfile::Missing { reason } => (format!("none: {reason}"), String::new()),
        };
        let note = model.note.as_ref().map_or(String::new(), |note| format!("; {note}"));
        let cells = [model.make.clone(), profile + &note, plug];
        let at = groups.iter().position(|group| group.cells == cells).unwrap_or_else(|| {
            groups.push(ModelGroup { cells, models: Vec::new() });
            groups.len() - 1
        });
        let (name, years) = (model.model.clone(), model.years_text());
        match groups[at].models.iter_mut().find(|(known, _)| *known == name) {
            Some((_, known)) => known.push(years),
            None => groups[at].models.push((name, vec![years])),
        }
    }
    groups.iter().map(ModelGroup::row).collect()
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
    let counted = KINDS.map(|kind| (provenance.facts_verified_by(kind).len(), kind));
    let counted = counted.iter().filter(|(count, _)| *count > 0);
    let counted: Vec<_> = counted.map(|(count, kind)| format!("{count} by {kind}")).collect();
    if counted.is_empty() {
        return "none".to_owned();
    }
    format!("{} of {}", counted.join(", "), provenance.facts.len())
}

/// Facts of the status and their letters.
const STATUS_FACTS: [(&str, char); 6] = [
    ("velocity.speed", 'v'),
    ("velocity.heading_rate", 'y'),
    ("steering", 's'),
    ("gear", 'g'),
    ("control_mode", 'm'),
    ("doors", 'd'),
];

/// The letters of a profile's signals.
fn signals(settings: &Settings) -> String {
    let (lights, provenance) = (&settings.gateway.lights, &settings.provenance);
    let is_verified = |name: &str| {
        let verified = KINDS.iter().flat_map(|kind| provenance.facts_verified_by(*kind));
        verified
            .filter(|fact| !["turn.off", "hazard.off"].contains(fact))
            .any(|fact| Provenance::covers(name, fact))
    };
    let letter = |name: &str, letter: char, is_given: bool| match (is_given, is_verified(name)) {
        (false, _) => '-',
        (true, false) => letter,
        (true, true) => letter.to_ascii_uppercase(),
    };
    let turn = letter("turn", 't', matches!(lights.turn, TurnBinding::From(_)));
    let hazard = letter("hazard", 'h', matches!(lights.hazard, HazardBinding::From(_)));
    let status = STATUS_FACTS
        .map(|(name, sign)| letter(name, sign, provenance.facts.iter().any(|fact| fact.name == name)));
    [turn, hazard].into_iter().chain(status).collect()
}

fn overview(name: &str) -> String {
    let settings = profile(name);
    let provenance = &settings.provenance;
    let makes = provenance.makes.join(", ");
    let more =
        [("commands", !settings.command_binding.is_empty()), ("V2I", !settings.gateway.v2i.is_empty())];
    let more: Vec<_> = more.iter().filter(|(_, is_given)| *is_given).map(|(what, _)| *what).collect();
    format!(
        "| {} | [{name}](../config/vehicles/{name}.toml) | {} | `{}` | {} | {} | {} |\n",
        if makes.is_empty() { "–" } else { &makes },
        provenance.models,
        signals(settings),
        protection(settings),
        more.join(", "),
        verified(provenance),
    )
}

/// A file and its repository, without the note.
fn source(source: &FactSource) -> String {
    let file = source.file.as_ref().map_or(String::new(), |file| format!("`{file}`"));
    let Some(repository) = &source.repository else { return file };
    let commit = source.commit.as_ref().map_or(String::new(), |commit| format!("/tree/{commit}"));
    let version = source.version.as_ref().map_or(String::new(), |version| format!(" {version}"));
    format!("{file} of [{repository}](https://github.com/{repository}{commit}){version}")
        .trim_start()
        .to_owned()
}

fn facts(name: &str) -> String {
    let records = profile(name).provenance.records.iter();
    let rows = records.filter(|record| record.verified != Verification::Nothing).map(|record| {
        let facts: Vec<_> = record.facts.iter().map(|fact| format!("`{fact}`")).collect();
        let (kind, evidence) = (record.verified, &record.evidence);
        format!("| {name} | {} | {kind}: {evidence} | {} |\n", facts.join(", "), source(&record.source))
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
    let made = format!("{HEAD}{overviews}{FACTS}{facts}{MODELS}{}", model_rows());
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
