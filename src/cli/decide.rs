//! `decide`: a drive scenario of the turn signal decider on virtual time.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};

use super::arguments::{Every, draw, file_name, svg_path};
use super::progress::Progress;
use super::{Failure, messages};
use crate::config::drive::{self, DriveFile};
use crate::config::files::Disk;
use crate::config::{Overrides, Problem, Refused, load};
use crate::core::turn_signal::compat::DeciderCompat;
use crate::core::turn_signal::flow::FlowSettings;
use crate::desk::drive::run::Run;
use crate::desk::drive::simulation::DriveSimulation;
use crate::desk::drive::verdict::Verdicts;
use crate::report::drive::chart::DriveChart;
use crate::report::drive::{DriveForm, DriveWriter};

pub(super) const HELP: &str = "\
Examples:
  signal-gateway decide crossing.toml
  signal-gateway decide crossing.toml --compat upstream --json
  signal-gateway decide crossing.toml --picture crossing.svg
  signal-gateway decide crossing.toml --config gateway.toml

For each change of the signal a line gives the command, the position of the rear axle along
the route (and the time, where the vehicle stands), and the reason.

With --verbose the time, position, speed and basis stand below it, with every reason: the outcome of
each candidate, with its four distances in metres (ds, de: front to the desired start, rear axle to
the desired end; rs, re: the same for the required section; negative is behind), then the outcome
of each manoeuvre and what is wrong with the inputs.

With --json each line is one object:
  {\"compat\": \"improved\", \"t\": 3.7, \"at_m\": 37.0, \"x_m\", \"y_m\", \"yaw_rad\", \"speed_mps\",
   \"turn\": \"LEFT\", \"hazard\": \"DISABLE\", \"basis\": \"candidates\", \"winner\": \"intersection\",
   \"case\": \"A2\", \"held\": TEXT, \"intersection\": {\"side\", \"active\", \"distance_m\"}, \"candidates\":
   [{\"source\", \"subject\", \"turn\", \"won\", \"why\": TEXT, \"lost_to\", \"lost_by\", \"distances\":
   {\"desired_start_m\", \"desired_end_m\", \"required_start_m\", \"required_end_m\"}}],
   \"manoeuvres\": [{\"kind\", \"why\"}], \"findings\": [TEXT]}
From \"turn\" on it is the form that a replay has; what does not apply is null. With --compat
path_generator the basis is \"path_generator\", without candidates, and a key more, \"lanelet\": TEXT,
names the tagged lanelet that decided. The last line of each compat is
  {\"compat\", \"expectations\": {\"met\": 5, \"failed\": [{\"expectation\": PLACE, \"what\": TEXT}]}}

The exit code is 5 when an expectation failed.";

#[derive(Debug, Args)]
pub(super) struct DecideArgs {
    /// Drive scenario (.toml)
    scenario: PathBuf,
    /// The decider of Autoware that is followed; default: those that the scenario is for
    #[arg(long, value_name = "COMPAT", value_enum)]
    compat: Option<DeciderCompat>,
    /// Configuration of a gateway whose decider's settings count, all but the map, instead of the scenario's
    #[arg(long, value_name = "FILE.toml")]
    config: Option<PathBuf>,
    /// Print JSON lines
    #[arg(long)]
    json: bool,
    /// When to print: changes of the decision, distances apart, or every cycle
    #[arg(long, value_name = "WHEN", value_enum, default_value_t)]
    every: Every,
    /// Draw the route with all sections and signals as well
    #[arg(long, value_name = "FILE.svg", value_parser = svg_path)]
    picture: Option<PathBuf>,
}

impl ValueEnum for DeciderCompat {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Improved => "Autoware's behavior path planner without its weaknesses",
            Self::Upstream => "Autoware's behavior path planner",
            Self::PathGenerator => "Autoware's core path generator",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

pub(super) fn run(args: &DecideArgs) -> Result<ExitCode, Failure> {
    let reading = Progress::spinner("reading the drive and its map");
    let mut file = drive::read(&Disk, &args.scenario)?;
    drop(reading);
    if let Some(path) = &args.config {
        take_settings(&mut file, path)?;
    }
    let simulation = DriveSimulation::new(file)?;
    let compats = args.compat.map_or_else(|| simulation.file().compats.clone(), |compat| vec![compat]);
    let form = match (args.json, messages::options().verbose) {
        (true, _) => DriveForm::Json,
        (false, true) => DriveForm::Numbers,
        (false, false) => DriveForm::Sentences,
    };
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut writer = DriveWriter::new(form);
    let mut chart = args.picture.as_ref().map(|_| DriveChart::new(simulation.file()));
    let mut has_failed = false;
    for compat in compats {
        let (mut run, mut verdicts) = (Run::new(&simulation, compat), Verdicts::new(&simulation, compat));
        if let Some(heading) = writer.begin(compat) {
            writeln!(out, "{heading}")?;
        }
        for cycle in simulation.cycles() {
            let decision = run.step(&cycle);
            verdicts.take(&cycle, &decision);
            let snapshot = cycle.snapshot(compat, &decision);
            if let Some(lines) = writer.write(&snapshot, args.every == Every::Step) {
                writeln!(out, "{lines}")?;
            }
            if let Some(chart) = &mut chart {
                chart.add(&snapshot);
            }
        }
        let verdict = verdicts.verdict();
        has_failed |= !verdict.failed.is_empty();
        writeln!(out, "{}", writer.end(&verdict))?;
    }
    out.flush()?;
    if let (Some(path), Some(chart)) = (&args.picture, chart) {
        let title = simulation.file().name.clone().unwrap_or_else(|| file_name(&args.scenario));
        draw(path, &chart.chart(title))?;
    }
    Ok(if has_failed { ExitCode::from(5) } else { ExitCode::SUCCESS })
}

/// Replaces the settings of a drive's decider by those of a gateway's configuration.
fn take_settings(file: &mut DriveFile, path: &Path) -> Result<(), Refused> {
    let turn_signal = load(&Disk, path, &Overrides::default())?.turn_signal.ok_or_else(|| {
        Problem::whole_file(
            path,
            "it has no [turn_signal]",
            "give the configuration of a turn signal decider",
        )
    })?;
    let FlowSettings { decider, period, .. } = turn_signal.flow;
    file.compats = vec![decider.compat];
    file.planning_hz = 1.0 / period.as_secs_f64();
    file.decider = decider;
    Ok(())
}
