//! `decide`: a drive scenario of the turn signal decider on virtual time.

use std::io::{self, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use super::Failure;
use super::arguments::{draw, file_name};
use crate::config::drive;
use crate::config::files::Disk;
use crate::core::turn_signal::compat::DeciderCompat;
use crate::desk::drive::course::Course;
use crate::desk::drive::run::Run;
use crate::desk::drive::verdict::Verdicts;
use crate::report::Form;
use crate::report::drive::DriveWriter;
use crate::report::drive::chart::DriveChart;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway decide crossing.toml
  signal-gateway decide crossing.toml --compat upstream --json
  signal-gateway decide crossing.toml --picture crossing.svg

For each change of the decision a line of text is  seconds  metres  m/s  command  ground, with every
reason below it: what became of each candidate, with its four distances in metres (ds, de: front to
the desired start, rear axle to the desired end; rs, re: the same for the required section; negative
is behind), then what each manoeuvre came to and what is wrong with the inputs.

With --json each line is one object:
  {\"compat\": \"improved\", \"t\": 3.7, \"at_m\": 37.0, \"x_m\", \"y_m\", \"yaw_rad\", \"speed_mps\",
   \"turn\": \"LEFT\", \"hazard\": \"DISABLE\", \"basis\": \"candidates\", \"winner\": \"intersection\", \"case\": \"A2\",
   \"held\": TEXT, \"intersection\": {\"side\", \"active\", \"distance_m\"}, \"candidates\": [{\"source\", \"turn\", \"won\",
   \"why\": TEXT, \"lost_to\", \"lost_by\", \"distances\": {\"desired_start_m\", \"desired_end_m\",
   \"required_start_m\", \"required_end_m\"}}], \"manoeuvres\": [{\"kind\", \"why\"}], \"findings\": [TEXT]}
From \"turn\" on it is the form that a replay has; what there is none of is null. With path_generator the
basis is \"path_generator\", without candidates. The last line of each behaviour is
  {\"compat\", \"expectations\": {\"met\": 5, \"failed\": [{\"expectation\": PLACE, \"what\": TEXT}]}}

The exit code is 5 when an expectation failed.";

#[derive(Debug, Args)]
pub(super) struct DecideArgs {
    /// Drive scenario (.toml)
    scenario: PathBuf,
    /// Behaviour of the decider; default: those that the scenario is for
    #[arg(long, value_name = "COMPAT", value_enum)]
    compat: Option<CompatArg>,
    /// Print JSON lines
    #[arg(long)]
    json: bool,
    /// When to print
    #[arg(long, value_name = "WHEN", value_enum, default_value_t)]
    every: Every,
    /// Draw the way with all sections and signals as well
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CompatArg {
    /// Autoware's behavior path planner without its weaknesses
    Improved,
    /// Autoware's behavior path planner
    Upstream,
    /// Autoware's core path generator
    #[value(name = "path_generator")]
    PathGenerator,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Every {
    /// When the decision is another one, distances apart
    #[default]
    Change,
    /// At every cycle
    Cycle,
}

pub(super) fn run(args: &DecideArgs) -> Result<ExitCode, Failure> {
    let course = Course::new(drive::read(&Disk, &args.scenario)?)?;
    let modes = match args.compat {
        None => course.file().modes.clone(),
        Some(CompatArg::Improved) => vec![DeciderCompat::Improved],
        Some(CompatArg::Upstream) => vec![DeciderCompat::Upstream],
        Some(CompatArg::PathGenerator) => vec![DeciderCompat::PathGenerator],
    };
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut writer = DriveWriter::new(Form::json_if(args.json));
    let mut chart = args.picture.as_ref().map(|_| DriveChart::new(course.file()));
    let mut has_failed = false;
    for mode in modes {
        let (mut run, mut verdicts) = (Run::new(&course, mode), Verdicts::new(&course, mode));
        if let Some(heading) = writer.begin(mode) {
            writeln!(out, "{heading}")?;
        }
        for cycle in course.cycles() {
            let decision = run.step(&cycle);
            verdicts.take(&cycle, &decision);
            let snapshot = cycle.snapshot(mode, &decision);
            if let Some(lines) = writer.write(&snapshot, args.every == Every::Cycle) {
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
        let title = course.file().name.clone().unwrap_or_else(|| file_name(&args.scenario));
        draw(path, &chart.chart(title))?;
    }
    Ok(if has_failed { ExitCode::from(5) } else { ExitCode::SUCCESS })
}
