//! `decide`: a drive scenario of the turn signal decider on virtual time.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::arguments::{Every, NamedValue, draw, expect_folder_of, file_name, named_value, number, svg_path};
use super::failure::Failure;
use super::progress::ProgressDisplay;
use super::recorded_drive::{self, ReportForm};
use super::recordings::{Batch, DecideSummary, SeveralArgs, Wanted};
use super::{messages, survey};
use crate::config::drive::{self, DriveFile, MAX_SPEED_MPS};
use crate::config::files::Disk;
use crate::config::gateway::turn_signal::TurnSignalConfig;
use crate::config::{Overrides, Problem, Refused, load};
use crate::desk::drive::recorded::SignalSource;
use crate::desk::drive::run::DriveRun;
use crate::desk::drive::simulation::DriveSimulation;
use crate::desk::drive::survey::{RouteChoice, Surveyor, Sweep};
use crate::desk::drive::verdict::DriveVerdicts;
use crate::io::sample_log::SampleLog;
use crate::report::drive::chart::DriveChart;
use crate::report::drive::{DriveForm, DriveWriter};
use lanelet2_map::lane_network::LaneId;
use turn_signal::compat::DeciderCompat;
use turn_signal::flow::TurnSignalSettings;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway decide crossing.toml
  signal-gateway decide crossing.toml --compat upstream --json
  signal-gateway decide crossing.toml --picture crossing.svg
  signal-gateway decide crossing.toml --config gateway.toml
  signal-gateway decide --map lanelet2_map.osm --from 125 --to 412
  signal-gateway decide --map lanelet2_map.osm --all-routes 500
  signal-gateway decide --map lanelet2_map.osm --all-routes 500 --sweep country
  signal-gateway decide drive.mcap --map lanelet2_map.osm --picture drive.svg
  signal-gateway decide archive/ --map lanelet2_map.osm --json > results.jsonl

For each change of the signal a line gives the command, the position of the rear axle along
the route (and the time, where the vehicle stands), and the reason.

With --verbose the time, position, speed and basis stand below it, with every reason: the outcome of
each candidate, with its four distances in metres (ds, de: front to the desired start, rear axle to
the desired end; rs, re: the same for the required section; negative is behind), then the outcome
of each manoeuvre and what is wrong with the inputs.

With --json each line is one object:
  {\"compat\": \"improved\", \"t\": 3.7, \"at_m\": 37.0, \"x_m\", \"y_m\", \"yaw_rad\", \"speed_mps\",
   \"turn\": \"LEFT\", \"hazard\": \"DISABLE\", \"basis\": \"candidates\", \"winner\": \"intersection\",
   \"case\": \"A2\", \"held\": TEXT, \"intersection\": {\"side\", \"active\", \"distance_m\"},
   \"junction\": {\"lanelet\", \"side\", \"why\", \"least_m\", \"law\"}, \"candidates\":
   [{\"source\", \"subject\", \"turn\", \"won\", \"why\": TEXT, \"lost_to\", \"lost_by\", \"distances\":
   {\"desired_start_m\", \"desired_end_m\", \"required_start_m\", \"required_end_m\"}}],
   \"manoeuvres\": [{\"kind\", \"why\"}], \"findings\": [TEXT]}
From \"turn\" on it is the form that a replay has; what does not apply is null. With --compat
path_generator the basis is \"path_generator\", without candidates, and a key more, \"lanelet\": TEXT,
names the tagged lanelet that decided. The last line of each compat is
  {\"compat\", \"expectations\": {\"met\": 5, \"failed\": [{\"expectation\": PLACE, \"what\": TEXT}]}}

With --all-routes each line is a turn whose signal is wrong:
  {\"compat\", \"lanelet\": 111, \"side\": \"left\", \"at_m\": 59.0, \"from\": 101, \"to\": 402,
   \"fault\": \"missed\", \"map_flaw\": TEXT}
\"map_flaw\" is null where the map is right, so that the fault is the decider's. The last line is
  {\"compat\", \"routes\": 500, \"turns\": 620, \"by_map\": the same,
   \"by_decider\": {\"missed\": 0, \"short\", \"opposite\", \"flickering\"}}
With --sweep there are only such lines, one for each value, which have two keys more:
\"sweep\": KEY, \"value\": TEXT.

With a recording (MCAP, or the file or folder of a bag) the decider runs over what Autoware sent,
and each manoeuvre is a line with the verdict on the signal that was given: agrees, early, late,
missing, wrong side or needless. With --json a line is one object:
  {\"manoeuvre\": {\"what\": \"left turn on 111\", \"kind\": \"turn\", \"side\", \"verdict\": \"agree\" or
   {\"late\": {\"by_ms\": 1400}}, \"received\", \"from_s\", \"required_s\", \"to_s\", \"at_m\", \"x_m\", \"y_m\",
   \"speed_mps\", \"decider\": TEXT, \"reason\": {…}}}
and the last one {\"summary\": {\"signal\", \"topic\", \"samples\", \"length_s\", \"driven_m\",
   \"agreement_percent\", \"counts\": {\"by_kind\": {KIND: {VERDICT: NUMBER}}, \"unjudged\"}}}.
Then the exit code is 5 when a signal does not agree.

The exit code is 5 when an expectation failed, or with --all-routes when a signal is wrong, also
by the map.";

#[derive(Debug, Args)]
pub(super) struct DecideArgs {
    /// Drive scenario (.toml), or recording of a drive: MCAP, or the file or folder of a bag
    #[arg(value_name = "SCENARIO|RECORDING", required_unless_present = "map")]
    scenario: Option<PathBuf>,
    #[command(flatten)]
    several: SeveralArgs,
    /// lanelet2 map of a recording; or instead of a scenario: the shortest way from one lanelet to another is
    /// driven, without a change of lane
    #[arg(long, value_name = "MAP.osm")]
    map: Option<PathBuf>,
    /// Signal of a recording that is judged; default: the first of which it has samples
    #[arg(long, value_name = "SIGNAL", value_enum, requires = "scenario")]
    signal: Option<SignalSource>,
    /// Lanelet at which the drive begins
    #[arg(long, value_name = "LANELET", requires_all = ["map", "to"], conflicts_with = "scenario", group = "way")]
    from: Option<LaneId>,
    /// Lanelet at whose end it ends
    #[arg(long, value_name = "LANELET", requires_all = ["map", "from"])]
    to: Option<LaneId>,
    /// Drive so many routes all over the map, the same each time, and list the turns whose signals are
    /// missed, short, opposite or flickering: by their tags, and by the geometry where it contradicts these,
    /// which is a fault of the map. Exit code 5 if there is one
    #[arg(long, value_name = "NUMBER", requires = "map", conflicts_with = "scenario", group = "way")]
    all_routes: Option<usize>,
    /// Use only routes that meet themselves: that come within 10 m of an earlier part, or whose last lanelet
    /// leads to one of theirs
    #[arg(long, requires = "all_routes", conflicts_with_all = ["from", "to"])]
    loops: bool,
    /// Drive all routes once for each value and print a table: five values of a parameter by Autoware's name,
    /// KEY=FROM..TO, or KEY=FROM..TO:STEP, or `country`: the rules of each shipped country
    #[arg(long, value_name = "SWEEP", requires = "all_routes", conflicts_with_all = ["from", "to"])]
    sweep: Option<Sweep>,
    /// Speed of the vehicle, m/s
    #[arg(long, value_name = "M/S", value_parser = speed_mps, default_value = "8", requires = "map")]
    speed: f64,
    /// The decider of Autoware that is followed; default: those that the scenario is for
    #[arg(long, value_name = "COMPAT", value_parser = named_value(&COMPAT))]
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

static COMPAT: [NamedValue<DeciderCompat>; 3] = [
    (
        DeciderCompat::Improved,
        DeciderCompat::Improved.name(),
        "Autoware's behavior path planner without its weaknesses",
    ),
    (DeciderCompat::Upstream, DeciderCompat::Upstream.name(), "Autoware's behavior path planner"),
    (DeciderCompat::PathGenerator, DeciderCompat::PathGenerator.name(), "Autoware's core path generator"),
];

fn speed_mps(text: &str) -> Result<f64, String> {
    number(text, "a speed in m/s", 0.0..=MAX_SPEED_MPS)
}

pub(super) fn run(args: &DecideArgs) -> Result<ExitCode, Failure> {
    args.picture.as_deref().map_or(Ok(()), expect_folder_of)?;
    if let (Some(map), Some(routes)) = (&args.map, args.all_routes) {
        return survey_map(args, map, routes);
    }
    if let Some(recordings) = args.several.all(args.scenario.as_deref())? {
        return report_each(args, recordings);
    }
    if let Some(recording) = &args.scenario
        && SampleLog::is_for(recording).map_err(Failure::file(recording))?
    {
        return report_recording(args, recording);
    }
    let reading = ProgressDisplay::spinner("reading the drive and its map");
    let (mut file, title) = match (&args.scenario, &args.map, args.from, args.to) {
        (Some(_), Some(_), ..) => {
            return Err(Failure::Usage(
                "--map goes with a recording or with --from, --to or --all-routes; a scenario names its map itself"
                    .to_owned(),
            ));
        }
        (Some(scenario), None, ..) => (drive::read(&Disk, scenario)?, file_name(scenario)),
        (None, Some(map), Some(from), Some(to)) => (
            drive::way(&Disk, map, [from, to], args.speed)?,
            format!("{}, from {from} to {to}", file_name(map)),
        ),
        (None, ..) => {
            let reason =
                "give a drive scenario, a recording, or a map with --from and --to or with --all-routes";
            return Err(Failure::Usage(reason.to_owned()));
        }
    };
    drop(reading);
    if let Some(path) = &args.config {
        take_settings(&mut file, &turn_signal(path)?.flow);
    }
    let simulation = DriveSimulation::new(file)?;
    let compats = args.compat.map_or_else(|| simulation.file().compats.clone(), |compat| vec![compat]);
    let form = match (args.json, messages::options().verbose) {
        (true, _) => DriveForm::Json,
        (false, true) => DriveForm::Numbers,
        (false, false) => DriveForm::Sentences,
    };
    let mut out = messages::result_lines(args.json);
    let mut writer = DriveWriter::new(form);
    let mut chart = args.picture.as_ref().map(|_| DriveChart::new(simulation.file()));
    let mut has_failed = false;
    for compat in compats {
        let mut run = DriveRun::new(&simulation, compat);
        let mut verdicts = DriveVerdicts::new(&simulation, compat);
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
        let title = simulation.file().name.clone().unwrap_or(title);
        draw(path, &chart.chart(title))?;
    }
    Ok(if has_failed { ExitCode::from(5) } else { ExitCode::SUCCESS })
}

/// Compares the signals of several recordings, after the map that they have in common.
fn report_each(args: &DecideArgs, recordings: Vec<PathBuf>) -> Result<ExitCode, Failure> {
    if args.picture.is_some() {
        return Err(Failure::Usage("--picture draws one recording: give it alone".to_owned()));
    }
    read_map(args)?;
    let read = DecideSummary::read;
    let batch = Batch { wanted: Wanted::Messages, car: None, tables: None, as_json: args.json, read };
    args.several.run(recordings, &batch)
}

/// Reads the map and the decider's settings for a recording.
fn read_map(args: &DecideArgs) -> Result<(DriveFile, Option<TurnSignalConfig>), Failure> {
    let config = args.config.as_ref().map(|path| turn_signal(path)).transpose()?;
    let map = args.map.as_deref().or_else(|| config.as_ref().map(|config| config.map.as_path()));
    let map = map.ok_or_else(|| {
        Failure::Usage("a recording needs --map, or --config with the map of its [turn_signal]".to_owned())
    })?;
    let mut file = drive::anywhere(&Disk, map, args.speed)?;
    if let Some(config) = &config {
        take_settings(&mut file, &config.flow);
    }
    Ok((file, config))
}

fn report_recording(args: &DecideArgs, recording: &Path) -> Result<ExitCode, Failure> {
    let (mut file, config) = read_map(args)?;
    file.decider.compat = args.compat.unwrap_or(file.decider.compat);
    let (is_json, every, picture, signal) = (args.json, args.every, args.picture.as_deref(), args.signal);
    let form = ReportForm { is_json, every, picture, signal };
    recorded_drive::run(recording, &file, config.as_ref().map(|config| &config.inputs), &form)
}

fn survey_map(args: &DecideArgs, map: &Path, count: usize) -> Result<ExitCode, Failure> {
    let choice = if args.loops { RouteChoice::Loops(count) } else { RouteChoice::Any(count) };
    let surveyor = || {
        let mut file = drive::anywhere(&Disk, map, args.speed)?;
        if let Some(path) = &args.config {
            take_settings(&mut file, &turn_signal(path)?.flow);
        }
        Ok(Surveyor::new(file, choice))
    };
    survey::run(surveyor, args.compat, args.sweep.as_ref(), args.json)
}

/// Reads the section of the decider of a gateway's configuration.
fn turn_signal(path: &Path) -> Result<TurnSignalConfig, Refused> {
    let remedy = "give the configuration of a turn signal decider";
    let settings = load(&Disk, path, &Overrides::default())?;
    settings.turn_signal.ok_or_else(|| Problem::whole_file(path, "it has no [turn_signal]", remedy).into())
}

/// Replaces a drive's decider settings by those in a gateway's configuration.
fn take_settings(file: &mut DriveFile, settings: &TurnSignalSettings) {
    file.compats = vec![settings.decider.compat];
    file.planning_hz = 1.0 / settings.period.as_secs_f64();
    file.decider = settings.decider.clone();
}
