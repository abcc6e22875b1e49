//! `demo`: runs the gateway on a built-in recording or simulation.

use std::fs::DirBuilder;
use std::io;
use std::net::Ipv4Addr;
use std::os::unix::fs::DirBuilderExt as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::{Args, ValueEnum};

use super::arguments::{ConfigArgs, speed};
use super::black_box_report::black_box_report;
use super::failure::Failure;
use super::live::{IsolationArgs, node_arguments};
use super::messages;
use super::ros_arguments::RosArgs;
use super::view::ViewArgs;
use super::web::WebArgs;
use crate::config::built_in::{self, BuiltIn};
use crate::config::drive;
use crate::config::files::{DEMO_CONFIG, Disk, Embedded, Files};
use crate::config::{Overrides, Refused, Settings, load};
use crate::daemon::rehearsal::rehearse;
use crate::daemon::{self, DaemonError, Playback, PlayedRecording, ReportPage};
use crate::desk::drive::simulation::DriveSimulation;
use crate::desk::rehearsal::{Rehearsal, Surroundings};
use crate::io::clock::Clock;
use crate::replay::{Recording, Routes};
use crate::report::story::{self, Story};
use crate::report::view::View;
use can_log::Log;
use gateway_base::time::MonoTime;
use vehicle_bringup::simulated_vehicle::request::{self, SimulationRequest};

pub(super) const HELP: &str = "\
Examples:
  signal-gateway demo                   a minute of an invented sedan, published on ROS 2
  signal-gateway demo --repeat
  signal-gateway demo --no-ros          without publishing
  signal-gateway demo --domain 0        published where other computers see it
  signal-gateway demo --repeat --open   in a browser as well
  signal-gateway demo commands          a drive, its commands, and a simulated vehicle
  signal-gateway demo lights            the traffic lights of a scenario

What is published is invented: it stays on this computer, in a ROS domain of its own, unless
--domain is given; ROS_DOMAIN_ID is not followed. commands and lights touch neither a bus nor
ROS 2. On a terminal a live view shows the state, and ? its keys; elsewhere, and with --plain, each
change is a line. Each caption is checked: the demo ends with an error when one does not hold.";

/// Default ROS domain of the demo: its messages are invented, and must not reach a vehicle.
const DEMO_DOMAIN: u16 = 100;

/// Setting that makes Cyclone DDS listen on the loopback interface, where Fast DDS listens by default.
const CYCLONE_ON_LOOPBACK: &str =
    r#"<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>"#;

/// Commands listed after the summary.
const TRY_NEXT: &[(&str, &str)] = &[
    ("signal-gateway demo commands", "a drive, and a vehicle that obeys or not"),
    ("signal-gateway demo lights", "the traffic lights of a scenario"),
    ("signal-gateway demo --repeat --open", "in a browser, and published on ROS 2"),
    ("signal-gateway identify LOG", "the built-in profiles that fit your log"),
    ("signal-gateway init", "a configuration for your car"),
];

/// Time from an error to the writing of its black box, in the time of the recording.
const AFTER_ERROR: Duration = Duration::from_secs(2);

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
    /// Publish on all networks in ROS domain ID, instead of on this computer alone in domain 100
    #[arg(long, value_name = "ID", conflicts_with = "no_ros", value_parser = clap::value_parser!(u16).range(..=232))]
    domain: Option<u16>,
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
    let ros = node_arguments(&args.ros, "warn", args.view.log_form())?;
    if ros.config.is_some() || ros.profile.is_some() {
        return Err(Failure::Usage(
            "--ros-args: demo has its own configuration and profile; use run".to_owned(),
        ));
    }
    let config = args.what.map_or(DEMO_CONFIG, |what| what.row().config);
    let overrides = Overrides { profile: None, ros: ros.overrides };
    let mut settings = load(&Embedded, Path::new(config), &overrides)?;
    args.web.apply(&mut settings.http)?;
    match args.what {
        None => play(args, settings)?,
        Some(what) => simulate(args, what, &settings)?,
    }
    Ok(ExitCode::SUCCESS)
}

fn play(args: &DemoArgs, mut settings: Settings) -> Result<(), Failure> {
    settings.ros.enabled &= !args.no_ros;
    settings.ros.isolated = !args.isolation.no_isolation;
    settings.ros.domain_id = Some(args.domain.unwrap_or(DEMO_DOMAIN));
    if args.domain.is_none() {
        settings.ros.only_networks = vec![Ipv4Addr::LOCALHOST.into()];
    }
    if settings.ros.enabled {
        for note in listen_notes(args.domain) {
            messages::note(&note);
        }
    }
    let recording = settings.recording.as_ref().ok_or(DaemonError::NoRecording)?;
    let (file, stamps) = (recording.file.clone(), recording.stamps);
    let title = format!("demo · {}, built-in recording", settings.vehicle);
    let view = args.view.open(title, settings.http.url(), View::lines)?;
    let view = view.with_story(story::DEMO, TRY_NEXT, messages::layout(&io::stdout()).width);
    let reopen = || Log::new(Box::new(io::Cursor::new(Embedded.read(&file)?))).map(Recording::from);
    let routes = Routes::by_interface(&settings.gateway);
    let playback = Playback { speed: args.speed, repeat: args.repeat, stamps, stay: false };
    // The page links from an error to its frames.
    let black_box = if args.web.is_on() { BlackBoxFolder::create(&mut settings) } else { None };
    let report = black_box.is_some().then(|| -> ReportPage {
        let config = ConfigArgs { config: Some(built_in::path(DEMO_CONFIG)), profile: None };
        Arc::new(move |log, opened_at| black_box_report(&config, log, opened_at))
    });
    let recording = PlayedRecording { name: "the built-in recording", reopen: &reopen, routes };
    Ok(daemon::play(settings, view, report, recording, playback)?)
}

/// A folder for the black boxes of a demo, removed when this is dropped.
struct BlackBoxFolder(PathBuf);

impl BlackBoxFolder {
    /// Creates a folder and configures it; `None` if that is impossible, so that errors have no link.
    fn create(settings: &mut Settings) -> Option<Self> {
        let folder = std::env::temp_dir().join(format!("signal-gateway-demo-{}", std::process::id()));
        DirBuilder::new().mode(0o700).create(&folder).ok()?;
        settings.black_box.folder = Some(folder.clone());
        settings.black_box.after = AFTER_ERROR;
        Some(Self(folder))
    }
}

impl Drop for BlackBoxFolder {
    fn drop(&mut self) {
        // If the folder cannot be removed, it is left to the cleaning of temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Describes where the demo publishes, and the commands that subscribe to it.
fn listen_notes(domain: Option<u16>) -> Vec<String> {
    let (domain_id, place) = match domain {
        Some(domain_id) => (domain_id, "on all networks"),
        None => (DEMO_DOMAIN, "on this computer alone"),
    };
    let mut notes = vec![
        format!("invented reports are published {place}, in ROS domain {domain_id}; to listen:"),
        format!("ROS_DOMAIN_ID={domain_id} ros2 topic echo /vehicle/status/turn_indicators_status"),
    ];
    if domain.is_none() {
        notes.push(format!("with rmw_cyclonedds_cpp, first: export CYCLONEDDS_URI='{CYCLONE_ON_LOOPBACK}'"));
    }
    notes
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

struct RehearsalRow {
    config: &'static str,
    story: Story,
    length: Duration,
}

impl Rehearsed {
    fn row(self) -> RehearsalRow {
        let (config, story, seconds) = match self {
            Self::Commands => ("config/demo_commands.toml", story::COMMANDS, 42),
            Self::Lights => ("config/demo_lights.toml", story::LIGHTS, 22),
        };
        RehearsalRow { config, story, length: Duration::from_secs(seconds) }
    }

    fn title(self, vehicle: &str) -> String {
        match self {
            Self::Commands => format!("demo commands · {vehicle}, simulated"),
            Self::Lights => "demo lights · bench scenario".to_owned(),
        }
    }
}

/// The drives over the crossing in `demo commands`.
const LAPS: u32 = 2;

fn rehearsal<'a>(
    what: Rehearsed,
    settings: &Settings,
    drive: &'a DriveSimulation,
) -> Result<Rehearsal<'a>, Failure> {
    let surroundings = match what {
        Rehearsed::Commands => {
            let plan = settings.vehicle_plan().map_err(|error| Failure::Usage(error.to_string()))?;
            Some(Surroundings::new(plan, script(), drive, LAPS))
        }
        Rehearsed::Lights => None,
    };
    let start = Clock::start().now().wall;
    Ok(Rehearsal::new(settings.gateway.clone(), surroundings, start, what.row().length))
}

fn simulate(args: &DemoArgs, what: Rehearsed, settings: &Settings) -> Result<(), Failure> {
    let drive = crossing()?;
    let rehearsal = rehearsal(what, settings, &drive)?;
    let view = args.view.open(what.title(&settings.vehicle), settings.http.url(), View::lines)?;
    let view = view.with_story(what.row().story, TRY_NEXT, messages::layout(&io::stdout()).width);
    Ok(rehearse(settings, view, rehearsal, args.speed)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::process_status::snapshot::Snapshot;
    use crate::replay::Replay;
    use crate::report::story::{Caption, Claim, ClaimedReport, Observed, Story, Teller, WrongCaption};
    use gateway_base::time::Now;

    fn settings(config: &str) -> Settings {
        load(&Embedded, Path::new(config), &Overrides::default()).unwrap()
    }

    /// Checks the state like the commands at each moment of a demo, and counts the checks during which each
    /// caption was shown.
    struct Audience {
        teller: Teller,
        looks: Vec<usize>,
    }

    impl Audience {
        fn new(story: Story) -> Self {
            Self { teller: Teller::new(story), looks: Vec::new() }
        }

        fn look(&mut self, now: Now, snapshot: impl FnOnce() -> Snapshot) -> Result<(), WrongCaption> {
            while self.teller.next_caption(now.mono).is_some() {
                self.looks.push(0);
            }
            if self.teller.is_check_due(now.mono) {
                self.teller.check(&snapshot(), now.mono)?;
                *self.looks.last_mut().unwrap() += 1;
            }
            Ok(())
        }

        /// Returns true if each caption was shown for at least half a second.
        fn has_seen_all(self, story: Story, rounds: usize) {
            assert_eq!(self.looks.len(), rounds * story.len());
            assert!(self.looks.iter().all(|looks| *looks >= 10), "{:?}", self.looks);
        }
    }

    /// Plays two rounds, as with `--repeat`.
    fn watch_recording(story: Story) -> Result<Audience, WrongCaption> {
        let settings = settings(DEMO_CONFIG);
        let file = settings.recording.unwrap().file;
        let open = || Log::new(Box::new(io::Cursor::new(Embedded.read(&file).unwrap()))).unwrap();
        let routes = Routes::by_interface(&settings.gateway);
        let mut replay = Replay::new(settings.gateway, Recording::from(open()), routes).unwrap();
        let (mut audience, mut rounds) = (Audience::new(story), 1);
        loop {
            while replay.poll_output().is_some() {}
            audience.look(replay.now(), || replay.gateway().snapshot(replay.now()))?;
            if replay.next_time().is_none() {
                if rounds == 2 {
                    return Ok(audience);
                }
                rounds += 1;
                replay.rewind(Recording::from(open())).unwrap();
                audience.teller.restart(replay.now().mono);
            }
            replay.step().unwrap();
        }
    }

    fn watch_simulation(what: Rehearsed, story: Story) -> Result<Audience, WrongCaption> {
        let settings = settings(what.row().config);
        let drive = crossing().unwrap();
        let mut rehearsal = rehearsal(what, &settings, &drive).unwrap();
        let mut audience = Audience::new(story);
        while rehearsal.next_time().is_some() {
            rehearsal.step();
            while rehearsal.poll_output().is_some() {}
            audience.look(rehearsal.now(), || rehearsal.gateway().snapshot(rehearsal.now()))?;
        }
        Ok(audience)
    }

    #[test]
    fn each_caption_of_the_recording_holds_while_it_is_shown() {
        watch_recording(story::DEMO).unwrap().has_seen_all(story::DEMO, 2);
    }

    #[test]
    fn each_caption_of_the_simulations_holds_while_it_is_shown() {
        for what in [Rehearsed::Commands, Rehearsed::Lights] {
            let story = what.row().story;
            watch_simulation(what, story).unwrap().has_seen_all(story, 1);
        }
    }

    const TURN: ClaimedReport = ClaimedReport::TurnIndicators;
    const WRONG: Caption =
        Caption { holds: &[Claim(Observed::Report(TURN), "ENABLE_RIGHT")], ..story::DEMO[3] };

    #[test]
    fn each_caption_claims_something_and_a_wrong_one_is_told_with_what_is_found() {
        for story in [story::DEMO, story::COMMANDS, story::LIGHTS] {
            assert!(story.iter().all(|caption| !caption.holds.is_empty()));
        }
        let is_short = |caption: &Caption| caption.text.chars().count() <= 77;
        assert!(story::DEMO.iter().all(is_short), "each is one line of a terminal of 80 columns");
        let wrong = watch_recording(&[WRONG]).err().unwrap().to_string();
        let expected = "the caption “the driver pulls the stalk left” is wrong 9302 ms after the start: the report \
                        turn_indicators should be ENABLE_RIGHT, and is ENABLE_LEFT";
        assert_eq!(wrong, expected);
    }
}
