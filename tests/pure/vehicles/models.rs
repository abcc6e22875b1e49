//! `config/cars/models.toml`: the list of models against the profiles, against opendbc's own list, and as
//! people search it.

use std::collections::BTreeMap;
use std::process::Command;

use serde::Deserialize;
use signal_gateway::config::car_models::models;
use vehicle_bringup::car_model::{CarModel, ListedDimensions, ModelProfile, ModelVerdict, find};

use crate::pure::vehicles::{profile, profile_names, project};
use crate::support::prerequisite::{opendbc_python, require};
use crate::support::vehicle_facts::VEHICLES;

/// A car as someone types it, with the answer: the profiles, or `other years`, `no profile`, `unknown`.
const TYPED: &[(&str, &str)] = &[
    ("Kia EV6 2022", "hyundai_canfd"),
    ("kia ev 6 gt", "hyundai_canfd"),
    ("vw golf 7", "vw_mqb"),
    ("golf 6", "vw_pq"),
    ("VW ID.4 2023", "vw_meb"),
    ("id4", "vw_meb"),
    ("Toyota RAV4 hybrid 2021", "toyota_nodsu"),
    ("Tesla model3", "tesla_model3 tesla_model3_party"),
    ("honda crv 2019", "honda_civic_hatchback_2017"),
    ("Honda Civic 2016", "honda_civic_touring_2016"),
    ("Hyundia Ioniq 5", "hyundai_canfd"),
    ("Škoda Superb 2018", "vw_mqb"),
    ("skoda octavia", "vw_mqb"),
    ("ford f150", "ford_lincoln"),
    ("mustang mach e", "ford_lincoln"),
    ("chevy bolt", "gm_global_a"),
    ("Mercedes E350", "mercedes_e350_2010"),
    ("nissan leaf 2015", "nissan_leaf_aze0"),
    ("mazda cx5 2019", "mazda_2017"),
    ("Subaru Forrester 2020", "subaru_global"),
    ("volvo xc90 2005", "volvo_s60_2002"),
    ("Toyota Prius 2005", "other years"),
    ("audi a4 2018", "no profile"),
    ("Kia", "unknown"),
    ("Kia Soul 1999 diesel automatic", "unknown"),
    ("Mitsubishi Outlander", "unknown"),
    ("Renault Zoe", "unknown"),
];

#[test]
fn cars_are_found_as_people_type_them() {
    let models = models().unwrap();
    for (typed, expected) in TYPED {
        let found = find(&models, typed);
        let answer = match found.verdict {
            ModelVerdict::Supported => {
                let mut profiles = found.profiles();
                profiles.sort_unstable();
                profiles.join(" ")
            }
            ModelVerdict::OtherYears => "other years".to_owned(),
            ModelVerdict::NoProfile => "no profile".to_owned(),
            ModelVerdict::Unknown => "unknown".to_owned(),
        };
        assert_eq!(answer, *expected, "{typed}: {:?}", found.models);
    }
}

/// Returns the profile of a model.
fn shipped(model: &CarModel) -> Option<&str> {
    match &model.profile {
        ModelProfile::Shipped { profile, .. } => Some(profile),
        ModelProfile::Missing { .. } => None,
    }
}

#[test]
fn every_model_names_a_shipped_profile_and_is_found_by_its_own_name() {
    let (models, names) = (models().unwrap(), profile_names());
    assert!(models.len() > 400, "{}", models.len());
    let mut without = Vec::new();
    for model in &models {
        let found = find(&models, &model.name());
        assert!(found.models.contains(&model), "{}: {found:?}", model.name());
        if let Some(profile) = shipped(model) {
            assert!(names.iter().any(|name| name == profile), "{}: {profile}", model.name());
        }
    }
    for name in names {
        let is_of_a_maker = !profile(&name).provenance.makes.is_empty();
        if is_of_a_maker && !models.iter().any(|model| shipped(model) == Some(&name)) {
            without.push(name);
        }
    }
    // Two are kits for any vehicle; the sources of the others name no model.
    assert!(without.len() <= 5, "config/cars/models.toml has no model for {without:?}");
}

/// What `tests/peer/opendbc_models.py` prints.
#[derive(Debug, Deserialize)]
struct OpendbcModels {
    models: Vec<[String; 7]>,
}

/// The pinned package is older than the commit that the list was made from: a model may have been built for
/// longer since.
#[test]
fn the_list_has_every_car_of_opendbc_with_the_profile_of_its_dbc() {
    let python = require!(opendbc_python());
    let script = project().join("tests/peer/opendbc_models.py");
    let printed = Command::new(python).arg(script).output().unwrap();
    assert!(printed.status.success(), "{}", String::from_utf8_lossy(&printed.stderr));
    let opendbc: OpendbcModels = serde_json::from_slice(&printed.stdout).unwrap();
    let counterparts = VEHICLES.iter().flat_map(|(profile, facts)| {
        let cars = facts.opendbc.iter().flat_map(|counterpart| &counterpart.cars);
        cars.filter_map(move |car| Some((car.split(' ').next()?, profile.as_str())))
    });
    let profiles: BTreeMap<&str, &str> = counterparts.collect();
    let models = models().unwrap();
    assert!(opendbc.models.len() > 300, "{}", opendbc.models.len());
    // Two models are rows of their profile, since newer lists do not have them.
    let with_dimensions = models.iter().filter(|model| model.unproven_dimensions.is_some()).count();
    assert!(with_dimensions > opendbc.models.len() - 3, "{with_dimensions} of {}", opendbc.models.len());
    let mut unlisted = Vec::new();
    for [make, model, years, dbc, _, wheel_base_m, steering_ratio] in &opendbc.models {
        let dimensions = ListedDimensions {
            wheel_base_m: wheel_base_m.parse().unwrap(),
            steering_ratio: steering_ratio.parse().unwrap(),
        };
        let name = format!("{make} {model} {years}");
        let profile = profiles.get(dbc.as_str()).unwrap_or_else(|| panic!("{name}: no profile for {dbc}"));
        let first: u16 = years[..4].parse().unwrap();
        let is_listed = models.iter().any(|listed| {
            let is_in_year = listed.years.iter().any(|(from, until)| (*from..=*until).contains(&first));
            let is_model = listed.make == *make && listed.model == *model && is_in_year;
            is_model
                && shipped(listed) == Some(profile)
                && listed.unproven_dimensions.is_none_or(|known| known == dimensions)
        });
        if !is_listed {
            unlisted.push(format!("{name} with {profile}, {dimensions:?}"));
        }
    }
    assert!(unlisted.is_empty(), "not in config/cars/models.toml: {unlisted:#?}");
}
