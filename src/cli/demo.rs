//! `demo`: runs the gateway on a built-in recording or simulation.

use std::io;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use clap::{Args, ValueEnum};

use super::arguments::speed;
use super::failure::Failure;
use super::live::{IsolationArgs, node_arguments};
use super::messages;
use super::ros_arguments::RosArgs;
use super::view::ViewArgs;
use super::web::WebArgs;
use crate::config::built_in::BuiltIn;
use crate::config::drive;
use crate::config::files::{DEMO_CONFIG, Disk, Embedded, Files};
use crate::config::{Overrides, Refused, Settings, load};
use crate::core::simulated_vehicle::request::{self, SimulationRequest};
use crate::core::time::MonoTime;
use crate::daemon::rehearsal::rehearse;
use crate::daemon::{self, DaemonError, Playback};
use crate::desk::drive::simulation::DriveSimulation;
use crate::desk::rehearsal::{Rehearsal, Surroundings};
use crate::io::can::log::Log;
use crate::io::clock::Clock;
use crate::replay::{Recording, Routes};
use crate::report::story;
use crate::report::view::View;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway demo                   45 s of an invented sedan, published on ROS 2
  signal-gateway demo --repeat
  signal-gateway demo --no-ros          without publishing
  signal-gateway demo --repeat --open   in a browser as well
  signal-gateway demo commands          a drive, its commands, and a simulated vehicle
  signal-gateway demo lights            the traffic lights of a scenario

commands and lights touch neither a bus nor ROS 2. On a terminal a live view shows the state, and ?
its keys; elsewhere, and with --plain, each change is a line.";

/// Commands that are listed after the summary.
const TRY_NEXT: &[(&str, &str)] = &[
    ("signal-gateway demo commands", "a drive, and a vehicle that obeys or not"),
    ("signal-gateway demo lights", "the traffic lights of a scenario"),
    ("signal-gateway demo --repeat --open", "in a browser, and published on ROS 2"),
    ("signal-gateway identify LOG", "the built-in profiles that fit your log"),
    ("signal-gateway init", "a configuration for your car"),
];

#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// Something other than the recording
    #[arg(value_enum)]
    what: Option<Rehearsed>,
    /// Start again at the end
    #[arg(long, conflicts_with = "what")]
    repeat: bool,
    /// Factor on the original timing
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Show only, do not publish
    #[arg(long)]
    no_ros: bool,
    #[command(flatten)]
    view: ViewArgs,
    #[command(flatten)]
    web: WebArgs,
    #[command(flatten)]
    isolation: IsolationArgs,
    #[command(flatten)]
    ros: RosArgs,
}

/// What is simulated instead of the recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Rehearsed {
    /// The decider on a drive, its commands, and a simulated vehicle
    Commands,
    /// The traffic lights of the bench scenario
    Lights,
}

pub(super) fn demo(args: &DemoArgs) -> Result<ExitCode, Failure> {
    let ros = node_arguments(&args.ros, "warn")?;
    if ros.config.is_some() || ros.profile.is_some() {
        return Err(Failure::Usage(
            "--ros-args: demo has its own configuration and profile; use run".to_owned(),
        ));
    }
    let config = match args.what {
        None => DEMO_CONFIG,
        Some(Rehearsed::Commands) => "config/demo_commands.toml",
        Some(Rehearsed::Lights) => "config/demo_lights.toml",
    };
    let overrides = Overrides { profile: None, ros: ros.overrides };
    let mut settings = load(&Embedded, Path::new(config), &overrides)?;
    args.web.apply(&mut settings.http);
    match args.what {
        None => play(args, settings)?,
        Some(what) => simulate(args, what, &settings)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn play(args: &DemoArgs, mut settings: Settings) -> Result<(), Failure> {
    settings.ros.enabled &= !args.no_ros;
    settings.ros.isolated = !args.isolation.no_isolation;
    let (file, stamps) = match &settings.recording {
        Some(recording) => (recording.file.clone(), recording.stamps),
        None => return Err(DaemonError::NoRecording.into()),
    };
    let title = format!("demo · {}, built-in recording", settings.vehicle);
    let view = args.view.open(title, settings.http.url(), View::lines)?;
    let view = view.with_story(story::DEMO, TRY_NEXT, messages::layout(&io::stdout()).width);
    let reopen = || Log::new(Box::new(io::Cursor::new(Embedded.read(&file)?))).map(Recording::from);
    let routes = Routes::by_interface(&settings.gateway);
    let playback = Playback { speed: args.speed, repeat: args.repeat, stamps, stay: false };
    Ok(daemon::play(settings, view, None, ("the built-in recording", &reopen, routes), playback)?)
}

fn crossing() -> Result<DriveSimulation, Refused> {
    let path = BuiltIn::Drive.path("crossing_left").unwrap_or_default();
    DriveSimulation::new(drive::read(&Disk, &path)?)
}

/// Returns the actions of driver and vehicle in `demo commands`.
fn script() -> Vec<(MonoTime, SimulationRequest)> {
    let request = |(at, text): &(MonoTime, &str)| Some((*at, request::line(text).ok()??.1));
    story::COMMANDS_SCRIPT.iter().filter_map(request).collect()
}

fn simulate(args: &DemoArgs, what: Rehearsed, settings: &Settings) -> Result<(), Failure> {
    let start = Clock::start().now().wall;
    let (title, story, length, laps) = match what {
        Rehearsed::Commands => (
            format!("demo commands · {}, simulated", settings.vehicle),
            story::COMMANDS,
            Duration::from_secs(42),
            2,
        ),
        Rehearsed::Lights => {
            ("demo lights · bench scenario".to_owned(), story::LIGHTS, Duration::from_secs(40), 0)
        }
    };
    let drive = if laps > 0 { Some(crossing()?) } else { None };
    let plan = || settings.vehicle_plan().map_err(|error| Failure::Usage(error.to_string()));
    let surroundings = match &drive {
        Some(drive) => Some(Surroundings::new(plan()?, script(), drive, laps)),
        None => None,
    };
    let rehearsal = Rehearsal::new(settings.gateway.clone(), surroundings, start, length);
    let view = args.view.open(title, settings.http.url(), View::lines)?;
    let view = view.with_story(story, TRY_NEXT, messages::layout(&io::stdout()).width);
    Ok(rehearse(settings, view, rehearsal, args.speed)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::command::snapshot::LightsValue;
    use crate::core::diagnostics::Level;

    /// What is commanded and what is reported when each caption of `demo commands` has been read for a while.
    #[test]
    fn each_caption_of_the_commands_tells_what_happens_in_both_laps() {
        let settings =
            load(&Embedded, Path::new("config/demo_commands.toml"), &Overrides::default()).unwrap();
        let drive = crossing().unwrap();
        let surroundings = Surroundings::new(settings.vehicle_plan().unwrap(), script(), &drive, 2);
        let start = Clock::start().now().wall;
        let mut rehearsal =
            Rehearsal::new(settings.gateway.clone(), Some(surroundings), start, Duration::from_secs(42));
        let expected = [
            ("Autoware drives towards a crossing", "off", "off", Level::Ok),
            ("60 m ahead is a left turn", "left", "left", Level::Ok),
            ("the driver holds the stalk right", "left", "right", Level::Warn),
            ("the driver lets go", "left", "left", Level::Ok),
            ("the turn is driven", "off", "off", Level::Ok),
            ("the vehicle does not hear commands", "off", "off", Level::Ok),
            ("the same drive once more", "off", "off", Level::Ok),
            ("left is commanded, but off is reported", "left", "off", Level::Warn),
            ("the vehicle hears commands again", "left", "left", Level::Ok),
            ("off to the end", "off", "off", Level::Ok),
        ];
        assert_eq!(expected.len(), story::COMMANDS.len());
        let (mut wrong, mut shown) = (Vec::new(), Vec::new());
        for ((at, caption), (begins, commanded, reported, level)) in story::COMMANDS.iter().zip(expected) {
            assert!(caption.starts_with(begins), "{caption}");
            let read = at.after(Duration::from_millis(1_300));
            while rehearsal.next_time().is_some_and(|next| next <= read) {
                rehearsal.step();
            }
            let snapshot = rehearsal.gateway().snapshot(rehearsal.now());
            let turn = snapshot.commands.unwrap().turn_indicators;
            let name = |value: Option<LightsValue>| value.unwrap().to_string();
            let found = (name(turn.commanded), name(turn.reported), turn.level);
            shown.push((*caption, found.clone()));
            if found != (commanded.to_owned(), reported.to_owned(), level) {
                wrong.push((*caption, found));
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?} in {shown:#?}");
    }
}
