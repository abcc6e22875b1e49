//! `discover`: finds the signals of an unknown vehicle, live or in a recording.

use std::fs::File;
use std::io::{self, BufRead as _, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use super::arguments::{ShowProgress, TimeArgs, open, seconds};
use super::failure::Failure;
use super::{inspect, messages};
use crate::config::draft::VehicleDraft;
use crate::config::files::read_text;
use crate::daemon::discover::{self, LiveEvent};
use crate::desk::proven_draft::proven_files;
use crate::desk::recorded_session::{RecordedSession, marks};
use crate::io::new_files::NewFiles;
use crate::io::process_log::LogForm;
use crate::report::discovery as texts;
use crate::report::text::counted;
use can_signal::can::{CanInput, DriverMark, LogNote};
use gateway_base::time::{MonoTime, Now, WallStamp};
use vehicle_bringup::discovery::machine::{Discovery, DiscoveryEvent};
use vehicle_bringup::discovery::session::{DriverRequest, SessionSettings};
use vehicle_bringup::discovery::timeline::ActionTimeline;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway discover --live can0 --name \"My car\"
  signal-gateway discover my_car/session.log --output again
  signal-gateway discover drive.log --marks drive.marks --name \"My car\"

Live, it asks for actions: hands off, then LEFT, off, RIGHT, off, HAZARD, off, and again. Park the
car, switch the ignition on, and let someone else read the screen if you can. Without a terminal
it begins at once.

Marks say what the driver did, one a line: SECONDS and quiet, left, right, hazard or off.
SECONDS count from the beginning of the recording, or are stamps as in it; # begins a comment.
A candump log may have them as notes: # (1436509052.249713) can0 mark left

The folder gets a DBC, a profile, gateway.toml, and live the recording session.log. Only what is
sure is written; then check runs on it. See docs/first-car.md.";

#[derive(Debug, Args)]
pub(super) struct DiscoverArgs {
    /// Recording with marks
    #[arg(required_unless_present = "live")]
    log: Option<PathBuf>,
    #[command(flatten)]
    time: TimeArgs,
    /// Discover on a CAN interface instead of a recording; repeatable
    #[arg(long, value_name = "INTERFACE", conflicts_with_all = ["log", "marks"])]
    live: Vec<String>,
    /// The driver's actions in the recording, if they are not noted in it
    #[arg(long, value_name = "FILE")]
    marks: Option<PathBuf>,
    /// Name of the vehicle
    #[arg(long, default_value = "New car")]
    name: String,
    /// New folder for the files; default: named after the vehicle
    #[arg(short, long, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Overwrite files in the folder
    #[arg(long)]
    force: bool,
    /// Time in which nothing is operated, at the beginning
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "10")]
    quiet_s: Duration,
    /// Time for which an action is kept
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "5")]
    hold_s: Duration,
    /// Time between two actions
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "4")]
    rest_s: Duration,
}

impl DiscoverArgs {
    pub(super) fn live(interface: String, output: PathBuf, force: bool) -> Self {
        let SessionSettings { quiet: quiet_s, hold: hold_s, rest: rest_s, .. } = SessionSettings::default();
        let (live, name, output) = (vec![interface], "New car".to_owned(), Some(output));
        let (log, time, marks) = (None, TimeArgs::default(), None);
        Self { log, time, live, marks, name, output, force, quiet_s, hold_s, rest_s }
    }
}

pub(super) fn run(args: &DiscoverArgs) -> Result<ExitCode, Failure> {
    messages::start_log("warn", LogForm::Messages)?;
    discover(args)
}

/// Runs the discovery. The log must have been started.
pub(super) fn discover(args: &DiscoverArgs) -> Result<ExitCode, Failure> {
    let folder =
        args.output.clone().unwrap_or_else(|| args.name.replace(['/', ' '], "_").to_lowercase().into());
    match &args.log {
        Some(log) => on_recording(args, log, &folder),
        None => live(args, &folder),
    }
}

fn on_recording(args: &DiscoverArgs, log: &Path, folder: &Path) -> Result<ExitCode, Failure> {
    let mut given = Vec::new();
    if let Some(path) = &args.marks {
        let text = read_text(path).map_err(Failure::file(path))?;
        given = marks(&text).map_err(|why| Failure::Usage(format!("{}: {why}", path.display())))?;
    }
    let session = RecordedSession::read(open(log, args.time, ShowProgress::Always)?, &given)
        .map_err(Failure::file(log))?;
    if session.marks.is_empty() {
        return Err(Failure::Usage(format!(
            "{}: no mark says what the driver did: name a file with --marks, or record with discover --live",
            log.display()
        )));
    }
    let new = NewFiles::in_folder(folder, args.force).map_err(Failure::file(folder))?;
    let draft = VehicleDraft {
        name: &args.name,
        interfaces: &session.interfaces,
        capture: &session.capture,
        findings: &session.findings(),
    };
    finish(args, &draft, &session.timeline(), &new, log)
}

const SESSION_LOG: &str = "session.log";

fn live(args: &DiscoverArgs, folder: &Path) -> Result<ExitCode, Failure> {
    let new = NewFiles::in_folder(folder, args.force).map_err(Failure::file(folder))?;
    let path = new.path(SESSION_LOG);
    let log = new.create(SESSION_LOG).map_err(Failure::file(&path))?;
    let screen = DiscoveryScreen::new(io::stdout().is_terminal());
    let mut session = LiveSession { log, mark: None, interfaces: args.live.clone(), screen };
    if io::stdin().is_terminal() && io::stdout().is_terminal() {
        session.screen.line(
            "The car stands, the ignition is on,\n\
             the indicators are off.\n\
             It takes a minute and a half, or longer\n\
             if something is not sure.\n\
             Press Enter to begin, Ctrl-C to give up.",
        )?;
        io::stdin().lock().read_line(&mut String::new())?;
    }
    let (quiet, hold, rest) = (args.quiet_s, args.hold_s, args.rest_s);
    let settings = SessionSettings { quiet, hold, rest, ..SessionSettings::default() };
    let outcome = discover::discover(&args.live, settings, |event, discovery, now| {
        session.take(&event, discovery, now)
    });
    session.write_mark()?;
    session.log.flush()?;
    let Some((discovery, findings)) = outcome? else {
        messages::note(&format!("given up; the recording is {}", path.display()));
        return Ok(ExitCode::FAILURE);
    };
    if discovery.capture().frames() == 0 {
        return Err(Failure::Usage(format!(
            "{}: not one frame was received: is the ignition on, and the bit rate right?",
            args.live.join(", ")
        )));
    }
    let capture = discovery.capture();
    let (_, end) = capture.span().unwrap_or_default();
    let draft = VehicleDraft { name: &args.name, interfaces: &args.live, capture, findings: &findings };
    finish(args, &draft, &discovery.timeline(end), &new, &path)
}

/// Prints the findings, writes the files, and checks them on the recording.
fn finish(
    args: &DiscoverArgs,
    draft: &VehicleDraft<'_>,
    timeline: &ActionTimeline,
    new: &NewFiles,
    log: &Path,
) -> Result<ExitCode, Failure> {
    let mut out = io::stdout().lock();
    let (messages, frames) = (draft.capture.messages(), draft.capture.frames());
    let messages = counted(messages.try_into().unwrap_or(u64::MAX), "message");
    writeln!(out, "\n{frames} frames of {messages}\n\n{}", texts::result(draft.findings))?;
    let files = match proven_files(draft, timeline) {
        Ok(files) => files,
        Err(why) => {
            writeln!(out, "Nothing is written: {why}.")?;
            return Ok(ExitCode::from(4));
        }
    };
    let mut names = Vec::new();
    for (name, text) in &files {
        let path = new.path(name);
        new.create(name)
            .and_then(|mut file| file.write_all(text.as_bytes()))
            .map_err(Failure::file(&path))?;
        names.push(path.display().to_string());
    }
    writeln!(out, "written: {}\n", names.join(", "))?;
    drop(out);
    inspect::check_files(&new.path("gateway.toml"), log, args.time)
}

struct LiveSession {
    log: BufWriter<File>,
    /// The latest mark, which is written after the frames received before it.
    mark: Option<(WallStamp, DriverMark)>,
    interfaces: Vec<String>,
    screen: DiscoveryScreen,
}

impl LiveSession {
    fn take(&mut self, event: &LiveEvent<'_>, discovery: &Discovery, now: Now) -> io::Result<()> {
        match event {
            LiveEvent::Input(CanInput::Frame { bus, frame, stamp }) => {
                if self.mark.is_some_and(|(marked, _)| marked.as_nanos() <= stamp.as_nanos()) {
                    self.write_mark()?;
                }
                let interface = self.interfaces.get(usize::from(bus.0)).map_or("can0", String::as_str);
                writeln!(self.log, "({}) {interface} {frame}", stamp.candump_text())
            }
            LiveEvent::Input(_) => Ok(()),
            LiveEvent::Tick => self.screen.tick(now.mono),
            LiveEvent::Discovery(event) => {
                if let DiscoveryEvent::Request(DriverRequest { mark, .. }) = event {
                    self.write_mark()?;
                    self.mark = Some((now.wall, *mark));
                }
                self.screen.show(event, discovery, now.mono)
            }
        }
    }

    fn write_mark(&mut self) -> io::Result<()> {
        let Some((stamp, mark)) = self.mark.take() else { return Ok(()) };
        let interface = self.interfaces.first().map_or("can0", String::as_str);
        writeln!(self.log, "# ({}) {interface} {}", stamp.candump_text(), LogNote::Mark(mark))
    }
}

/// Shows the requests on standard output: with a countdown on a terminal, as lines elsewhere.
struct DiscoveryScreen {
    is_terminal: bool,
    /// The current request with its start, and the number that precedes it.
    request: Option<(DriverRequest, MonoTime, String)>,
}

impl DiscoveryScreen {
    fn new(is_terminal: bool) -> Self {
        Self { is_terminal, request: None }
    }

    fn line(&mut self, text: &str) -> io::Result<()> {
        let mut out = io::stdout().lock();
        let erase = if self.is_terminal { "\r\x1b[K" } else { "" };
        writeln!(out, "{erase}{text}")?;
        out.flush()
    }

    fn show(&mut self, event: &DiscoveryEvent, discovery: &Discovery, now: MonoTime) -> io::Result<()> {
        if let Some((request, _, step)) = self.request.take().filter(|_| self.is_terminal) {
            let text = format!("  {step}{}", Self::request_and_next(&request));
            self.line(text.chars().take(Self::width()).collect::<String>().trim_end())?;
        }
        match event {
            DiscoveryEvent::Request(request) => {
                let (done, all) = discovery.progress();
                let step = match request.mark {
                    DriverMark::Quiet | DriverMark::Off => "     ".to_owned(),
                    DriverMark::Left | DriverMark::Right | DriverMark::Hazard => format!("{done}/{all}  "),
                };
                if !self.is_terminal {
                    self.line(&format!("{step}{}", Self::request_and_next(request)))?;
                }
                self.request = Some((*request, now, step));
                Ok(())
            }
            DiscoveryEvent::Seen { action, messages, bits } => {
                self.line(&format!("       {}", texts::seen(*action, messages, *bits)))
            }
            DiscoveryEvent::Repeats(actions) => self.line(&texts::repeats(actions)),
            DiscoveryEvent::Finished(_) => Ok(()),
        }
    }

    fn tick(&mut self, now: MonoTime) -> io::Result<()> {
        let Some((DriverRequest { mark, until, .. }, from, step)) =
            self.request.as_ref().filter(|_| self.is_terminal)
        else {
            return Ok(());
        };
        let mut out = io::stdout().lock();
        let countdown = texts::countdown(*from, *until, now);
        // A wrapped line cannot be erased, so the request is shortened and the next one omitted.
        let request = format!("{step}{}", texts::request(*mark, Self::width()));
        let room = Self::width().saturating_sub(countdown.chars().count() + 5);
        let request: String = request.chars().take(room).collect();
        write!(out, "\r\x1b[K\x1b[1m> {request}\x1b[0m  {countdown}")?;
        out.flush()
    }

    fn request_and_next(request: &DriverRequest) -> String {
        texts::request_and_next(request.mark, request.next, Self::width())
    }

    fn width() -> usize {
        messages::layout(&io::stdout()).width.unwrap_or(80)
    }
}
