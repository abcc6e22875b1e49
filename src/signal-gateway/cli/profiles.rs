//! `profiles`: the vehicle profiles in the binary.

use std::fs::File;
use std::io::{self, Write};
use std::os::fd::AsFd as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Subcommand};

use super::failure::Failure;
use super::messages;
use crate::check;
use crate::config::built_in::BuiltIn;
use crate::config::files::{Disk, Files};
use crate::config::{Settings, load_profile};
use crate::report::car_models::{self, ModelAnswer, ProfileSummary};
use vehicle_bringup::car_model::{CarModel, ModelVerdict, find};

pub(super) const HELP: &str = "\
Examples:
  signal-gateway profiles find Kia EV6 2022
  signal-gateway profiles find \"vw golf 7\" --json
  signal-gateway profiles list
  signal-gateway profiles list --models
  signal-gateway profiles show hyundai_kia
  signal-gateway profiles show hyundai_kia --dbc > hyundai_kia.dbc
  signal-gateway profiles show hyundai_kia --provenance

A profile of the list can be named wherever one is needed: --profile hyundai_kia, or in the
configuration profile = \"hyundai_kia\". A file with this name wins.

`find` ends with exit code 0 if a profile reads the car, else with 4. A profile may still fit a car
that the list of models does not have: `signal-gateway identify` compares all with its frames.";

#[derive(Debug, Args)]
pub(super) struct ProfilesArgs {
    #[command(subcommand)]
    command: ProfilesCommand,
}

#[derive(Debug, Subcommand)]
enum ProfilesCommand {
    /// Answer whether a car is supported, and with which profile
    Find {
        /// Make, model and year, in any order and spelling
        #[arg(value_name = "CAR", required = true)]
        car: Vec<String>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// List the profiles with their vehicles, and which statuses each of them has
    List {
        /// List the models by make, with the profile of each, instead
        #[arg(long)]
        models: bool,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Print a profile, or its DBCs
    Show {
        /// Name of the profile
        #[arg(value_name = "NAME")]
        profile: String,
        /// Print the DBC of each of its buses instead
        #[arg(long)]
        dbc: bool,
        /// Print what has verified each of its facts instead, with their sources
        #[arg(long, conflicts_with = "dbc")]
        provenance: bool,
    },
}

pub(super) fn run(args: &ProfilesArgs) -> Result<ExitCode, Failure> {
    let mut out = io::BufWriter::new(io::stdout().lock());
    match &args.command {
        ProfilesCommand::Find { car, json } => {
            let (text, verdict) = found(&car.join(" "), *json)?;
            out.write_all(text.as_bytes())?;
            out.flush()?;
            let is_supported = verdict == ModelVerdict::Supported;
            return Ok(if is_supported { ExitCode::SUCCESS } else { ExitCode::from(4) });
        }
        ProfilesCommand::List { models: true, json } => {
            let models = models()?;
            let text = if *json { car_models::json(&models) } else { car_models::rows(&models) };
            out.write_all(text.as_bytes())?;
        }
        ProfilesCommand::List { json: true, .. } => {
            let profiles = BuiltIn::Profile.names().map(summary).collect::<Result<Vec<_>, _>>()?;
            out.write_all(car_models::json(&profiles).as_bytes())?;
        }
        ProfilesCommand::List { .. } => list(&mut out)?,
        ProfilesCommand::Show { profile, provenance: true, .. } => {
            let records = check::records(&load_profile(&Disk, &path(profile)?)?.provenance);
            out.write_all(records.facts_text(messages::layout(&io::stdout())).as_bytes())?;
        }
        ProfilesCommand::Show { profile, dbc, .. } => show(&mut out, profile, *dbc)?,
    }
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

pub(super) fn list(out: &mut impl Write) -> Result<(), Failure> {
    let width = BuiltIn::Profile.names().map(str::len).max().unwrap_or_default();
    writeln!(out, "{}\n", car_models::PARTS_LEGEND)?;
    for name in BuiltIn::Profile.names() {
        let profile = summary(name)?;
        writeln!(out, "{name:width$}  {}  {}", profile.letters(), profile.vehicle)?;
    }
    Ok(())
}

fn models() -> Result<Vec<CarModel>, Failure> {
    crate::config::car_models::models().map_err(Failure::Environment)
}

fn found(car: &str, json: bool) -> Result<(String, ModelVerdict), Failure> {
    let models = models()?;
    let search = find(&models, car);
    let profiles = search.profiles().into_iter().map(summary).collect::<Result<Vec<_>, _>>()?;
    let answer = ModelAnswer { car, search: &search, profiles };
    let text = if json { car_models::json(&answer) } else { answer.text() };
    Ok((text, search.verdict))
}

/// Returns the contents of a profile in the binary, and how much of it is verified.
fn summary(name: &str) -> Result<ProfileSummary, Failure> {
    let settings = load_profile(&Disk, &path(name)?)?;
    Ok(ProfileSummary {
        profile: name.to_owned(),
        describes: contents(&settings),
        requires: settings.gateway.lights.requirements.iter().map(ToString::to_string).collect(),
        buses: settings.gateway.buses.iter().map(|bus| bus.name.clone()).collect(),
        facts: settings.provenance.facts.len(),
        verified: settings.provenance.summary(),
        vehicle: settings.vehicle,
    })
}

fn show(out: &mut impl Write, profile: &str, dbc: bool) -> Result<(), Failure> {
    let path = path(profile)?;
    if !dbc && goes_into_a_file() {
        messages::note(&format!(
            "the DBC of {profile} is built in as well: a copy of the profile needs the file beside it and `dbc` naming it; \
             print it with signal-gateway profiles show {profile} --dbc"
        ));
    }
    let paths = if dbc {
        load_profile(&Disk, &path)?.dbcs.into_iter().map(|dbc| dbc.path).collect()
    } else {
        vec![path]
    };
    for path in &paths {
        out.write_all(&Disk.read(path)?)?;
    }
    Ok(())
}

fn goes_into_a_file() -> bool {
    let output = io::stdout().as_fd().try_clone_to_owned().map(File::from);
    output.and_then(|output| output.metadata()).is_ok_and(|output| output.is_file())
}

fn path(name: &str) -> Result<PathBuf, Failure> {
    BuiltIn::Profile.path(name).ok_or_else(|| {
        let advice = BuiltIn::Profile.did_you_mean(name.as_ref(), "see `signal-gateway profiles list`");
        Failure::Usage(format!("there is no built-in profile {name}; {advice}"))
    })
}

/// Returns the names of what a profile describes: its reports, traffic lights and commands.
fn contents(settings: &Settings) -> Vec<&'static str> {
    let others = [
        (!settings.gateway.v2i.is_empty(), "traffic_lights"),
        (!settings.command_binding.is_empty(), "commands"),
    ];
    let others = others.into_iter().filter_map(|(is_described, part)| is_described.then_some(part));
    check::report_names(settings).into_iter().chain(others).collect()
}
