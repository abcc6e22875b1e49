//! `lights`: runs a scenario of traffic lights on virtual time.

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;

use super::arguments::{
    Every, NamedValue, draw, expect_folder_of, file_name, named_value, pair, seconds, svg_path,
};
use super::failure::Failure;
use super::messages;
use super::progress::ProgressDisplay;
use crate::config::files::Disk;
use crate::config::scenario::{self, BulbOrder, ReadOptions, ScenarioFile};
use crate::config::{Problem, Refused, find_map, read_lights};
use crate::desk::lights::run::ScenarioRun;
use crate::desk::lights::span::RunLength;
use crate::report::lights::chart::LightsChart;
use crate::report::lights::{LightsWriter, Style};
use crate::report::{self, Form};
use gateway_base::time::MonoTime;
use lanelet2_map::light_map::{GroupEntry, LampSource, LightMap};
use traffic_lights::compat::Compat;
use traffic_lights::engine::LightsSettings;
use traffic_lights::event_log::ScenarioOutcome;
use traffic_lights::periodic_timer::Rate;
use traffic_lights::scenario::Scenario;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway lights crossing.toml
  signal-gateway lights crossing.toml --until 30 --picture crossing.svg
  signal-gateway lights drive.xosc --map lanelet2_map.osm --compat upstream --json

A line of text is  seconds  where  what  for each change:
  phase, event, act, action, end            events of the scenario
  conventional, v2i                         ground truth of the channel, by way id
  conventional_detected, v2i_detected       states that are reported instead
  internal, external                        groups as they are sent for camera and V2I, by
                                            relation id; external ones with predictions
States are short: solidOn circles are named by their colour alone. `dark` is a light without
bulbs; `-` marks a removed entry. A confidence other than 1 follows in parentheses.

With --json each line is one object with all states at t, in seconds:
  {\"t\": 0.033,
   \"events\": [{\"what\": \"phase\", \"controller\": NAME, \"phase\": NAME}],
   \"ground_truth\": {\"conventional\": {WAY: {\"state\": TEXT, \"confidence\": 1.0}}, \"v2i\": {…}},
   \"detected\": {\"conventional\": {…}, \"v2i\": {…}},
   \"internal\": [{\"id\": GROUP, \"elements\": [{\"color\", \"status\", \"shape\", \"confidence\"}]}],
   \"external\": [{\"id\", \"elements\", \"predictions\": [{\"at\", \"elements\", \"reliability\", \"source\"}]}]}
Other events: act_begins and act_ends with act; event with act, event; action with event, does;
end with verdict (success, failure, stopped, fault, undecided), reason. internal and external are
null until the first message; at is on the same time line as t; the state of a dark light is empty.

With --without-map an id that is a text is that text, in JSON as well.

Without --until it ends with the scenario, within an hour; a scenario that does not end by itself
is shown for twice its longest cycle, or until 5 s after the last time a trigger names, else for a
minute.

The exit code is 5 when the scenario ends with exitFailure or cannot be carried out, and 6 when its
verdict is not known, because an event that could have ended it otherwise needs what is not
interpreted here.";

/// Maximum total number of shown light states: each change of one light shows those of all lights.
const MAX_SHOWN: usize = 20_000_000;

#[derive(Debug, Args)]
pub(super) struct LightsArgs {
    /// Scenario: OpenSCENARIO (.xosc), TIER IV's YAML, or a bench file (.toml)
    scenario: PathBuf,
    /// Lanelet2 map with the lights; default: the map or the groups that the scenario names
    #[arg(long, value_name = "NAME|FILE.osm")]
    map: Option<PathBuf>,
    /// Take each id of the scenario for a light that is a group of its own, for scenarios of other kinds of
    /// maps; an id may be a text
    #[arg(long, conflicts_with = "map")]
    without_map: bool,
    /// Folder of a package, for $(find-pkg-share NAME) in a scenario; may be repeated
    #[arg(long = "package", value_name = "NAME=FOLDER", value_parser = |text: &str| pair::<PathBuf>(text, "expected NAME=FOLDER"))]
    packages: Vec<(String, PathBuf)>,
    /// Bulbs by position, for states as in `on;off;off`, of all lights with as many or of those with these
    /// ids: for instance red,yellow,green or 21,22=red,green; may be repeated
    #[arg(long, value_name = "[IDS=]BULBS")]
    bulb_order: Vec<BulbOrder>,
    /// Value of a scenario modifier that has several, of which each is a run of the simulator; may be
    /// repeated
    #[arg(long = "modifier", value_name = "NAME=VALUE", value_parser = |text: &str| pair::<String>(text, "expected NAME=VALUE"))]
    modifiers: Vec<(String, String)>,
    /// Mode, where the simulator's rules have weaknesses
    #[arg(long, value_name = "MODE", value_parser = named_value(&COMPAT), default_value = "improved")]
    compat: Compat,
    /// Time at which to stop, from 0.001 to 86400
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    until: Option<Duration>,
    /// Rate at which controllers and events are evaluated, from 0.001 to 1000
    #[arg(long, value_name = "HZ", value_parser = rate, default_value = "30")]
    frame_rate: Rate,
    /// Number of the first frame: 1 as in the simulator, 0 for a frame at the very start
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(..=1), default_value_t = 1)]
    first_frame: u8,
    /// Rate at which external is sent, until the scenario changes it, from 0.001 to 1000
    #[arg(long, value_name = "HZ", value_parser = rate, default_value = "10")]
    v2i_rate: Rate,
    /// Copy the present state of a light when V2I is enabled; default: true, for upstream false
    #[arg(long, value_name = "BOOL")]
    copy_on_enable: Option<bool>,
    /// Send a group once for each of its lit heads; default: false, for upstream always
    #[arg(long, value_name = "BOOL")]
    one_group_per_head: Option<bool>,
    /// Print JSON lines
    #[arg(long)]
    json: bool,
    /// When to print: changes when they happen, or all states at every frame as well
    #[arg(long, value_name = "WHEN", value_enum, default_value_t)]
    every: Every,
    /// Draw the timeline as well
    #[arg(long, value_name = "FILE.svg", value_parser = svg_path)]
    picture: Option<PathBuf>,
}

static COMPAT: [NamedValue<Compat>; 2] = [
    (Compat::Improved, "improved", "The improved rules"),
    (Compat::Upstream, "upstream", "The rules of `scenario_simulator_v2` 25.0.20"),
];

pub(super) fn run(args: &LightsArgs) -> Result<ExitCode, Failure> {
    args.picture.as_deref().map_or(Ok(()), expect_folder_of)?;
    let options = ReadOptions {
        compat: args.compat,
        packages: args.packages.iter().cloned().collect(),
        bulb_orders: args.bulb_order.clone(),
        modifiers: args.modifiers.iter().cloned().collect(),
        takes_text_ids: args.without_map,
    };
    let file = scenario::read(&Disk, &args.scenario, options)?;
    let map = Arc::new(light_map(args, &file)?);
    let (uncertain_ends, names) = (file.uncertain_ends.clone(), file.light_names.clone());
    let unknown = file.check_against(&map, args.compat);
    if !unknown.is_empty() {
        return Err(Refused(unknown).into());
    }
    file.not_interpreted.iter().for_each(|part| messages::note(&part.to_string()));
    let span = match args.until {
        Some(until) => RunLength { until, why: "given by --until" },
        None => RunLength::of(&file.scenario),
    };
    let settings = settings(args, Arc::clone(&map), file.scenario);
    let mut run = ScenarioRun::new(settings, span.until);
    let mut chart = args.picture.as_ref().map(|_| LightsChart::new(map, names.clone()));
    let style = if messages::layout(&io::stdout()).has_color { Style::Colored } else { Style::Plain };
    let mut writer = LightsWriter::new(Form::json_if(args.json), style, names.clone());
    let mut out = messages::result_lines(args.json);
    let (mut shown, mut outcome) = (0, Ok(()));
    while let Some(snapshot) = run.step() {
        let is_whole = args.every == Every::Step && snapshot.is_frame;
        if snapshot.has_changed || is_whole {
            shown += snapshot.states.count();
        }
        if shown > MAX_SHOWN {
            let seconds = report::seconds(snapshot.at);
            outcome = Err(io::Error::other(format!(
                "the scenario is shown to {seconds:.3} s only, with {MAX_SHOWN} states of lights: give a smaller --until, or \
                 a map with fewer lights"
            )));
            break;
        }
        let lines = writer.write(&snapshot, is_whole);
        lines.iter().try_for_each(|line| writeln!(out, "{line}"))?;
        if let Some(chart) = &mut chart {
            chart.add(&snapshot);
        }
    }
    let until = MonoTime::ZERO.after(span.until);
    let is_to_the_end = run.verdict().is_none() && outcome.is_ok();
    let open_end = is_to_the_end.then(|| writer.until(until, span.why)).flatten();
    open_end.iter().try_for_each(|line| writeln!(out, "{line}"))?;
    for (store, id, at) in run.contradictions() {
        let text = format!("{id} {} shows red and green from {:.3} s", store.name(), report::seconds(at));
        messages::warn(&names.in_text(&text));
    }
    let verdict = run.verdict();
    let is_fault = matches!(verdict, Some(ScenarioOutcome::Fault(_)));
    // A verdict at a different time is still the same verdict.
    let decided = match verdict {
        Some(ScenarioOutcome::Success) => Some(true),
        Some(ScenarioOutcome::Failure) => Some(false),
        Some(ScenarioOutcome::Stopped | ScenarioOutcome::Fault(_)) | None => None,
    };
    let undecided = uncertain_ends.iter().find(|end| end.success != decided);
    let undecided = undecided.filter(|_| outcome.is_ok() && !is_fault);
    if let Some(end) = undecided {
        writeln!(out, "{}", writer.undecided(run.at().min(until), &end.to_string()))?;
    }
    out.flush()?;
    if let (Some(path), Some(chart)) = (&args.picture, chart) {
        let end = if verdict.is_some() || outcome.is_err() { run.at() } else { until };
        draw(path, &chart.chart(file_name(&args.scenario), subtitle(args), end, run.scenario()))?;
    }
    outcome?;
    let has_failed = is_fault || decided == Some(false);
    Ok(match undecided {
        Some(_) => ExitCode::from(6),
        None if has_failed => ExitCode::from(5),
        None => ExitCode::SUCCESS,
    })
}

fn settings(args: &LightsArgs, map: Arc<LightMap>, scenario: Scenario) -> LightsSettings {
    let settings = LightsSettings::new(map, scenario, args.compat);
    LightsSettings {
        frame_rate: args.frame_rate,
        first_frame: args.first_frame,
        v2i_rate: args.v2i_rate,
        copy_on_enable: args.copy_on_enable.unwrap_or(settings.copy_on_enable),
        one_group_per_head: args.one_group_per_head.unwrap_or(settings.one_group_per_head),
        ..settings
    }
}

fn light_map(args: &LightsArgs, file: &ScenarioFile) -> Result<LightMap, Refused> {
    if args.without_map {
        let ids: BTreeSet<_> = file.ids.iter().map(|used| used.id).collect();
        let groups: Vec<_> = ids.into_iter().map(|id| GroupEntry::new(id, [id])).collect();
        return Ok(LightMap::new([], &groups));
    }
    if let Some(path) = &args.map {
        let remedy = "give a lanelet2 map with --map, by path or by the name of a built-in one";
        let (path, remedy) = find_map(&Disk, path, remedy);
        return read_map(&path, &remedy);
    }
    if let Some(path) = &file.map {
        return read_map(path, "it is the map that the scenario names: give another one with --map FILE.osm");
    }
    if let Some(reason) = &file.unresolved_map {
        let remedy = "or give the map with --map FILE.osm, or --without-map";
        return Err(Problem::whole_file(&args.scenario, reason, remedy).into());
    }
    if file.groups.is_empty() {
        let reason = "it names no map and no groups, so its lights are not known";
        let remedy = "give the lanelet2 map with --map FILE.osm, or --without-map; in a bench file [groups] as in 100 = [11, 12]";
        return Err(Problem::whole_file(&args.scenario, reason, remedy).into());
    }
    Ok(LightMap::new([], &file.groups))
}

fn read_map(path: &Path, remedy: &str) -> Result<LightMap, Refused> {
    let _progress = ProgressDisplay::spinner("reading the map");
    // Positions of lamps are for viewers.
    read_lights(&Disk, path, LampSource::Drawn)
        .map(|map| map.lights)
        .map_err(|problem| problem.or_remedy(remedy).into())
}

fn subtitle(args: &LightsArgs) -> String {
    let compat = match args.compat {
        Compat::Improved => "",
        Compat::Upstream => "compat upstream, ",
    };
    format!("{compat}frames at {} Hz, v2i at {} Hz", args.frame_rate.as_hz(), args.v2i_rate.as_hz())
}

fn rate(text: &str) -> Result<Rate, String> {
    let rate = text.parse().ok().and_then(Rate::from_hz);
    rate.ok_or_else(|| "give a rate from 0.001 to 1000 Hz".to_owned())
}
