//! `vehicle`: simulates a vehicle, on a virtual bus or as a log.

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use super::arguments::{ConfigArgs, seconds, settings};
use super::failure::Failure;
use super::messages;
use super::view::{self, ViewArgs};
use crate::config::Settings;
use crate::config::files::read_text;
use crate::daemon::vehicle::{RunEvent, VehicleRun, run_vehicle};
use crate::desk;
use crate::io::can::controller::has_controller;
use crate::io::process_log::LogForm;
use crate::report::Form;
use crate::report::terminal::vehicle::VehicleState;
use crate::report::terminal::view_model::Model;
use crate::report::vehicle::{CandumpLog, line, text};
use can_signal::can::BusIndex;
use gateway_base::diagnostics::Level;
use gateway_base::time::WallStamp;
use gateway_core::command::sender::SendFailure;
use vehicle_bringup::simulated_vehicle::plan::VehiclePlan;
use vehicle_bringup::simulated_vehicle::request::{self, SimulationRequest};
use vehicle_bringup::simulated_vehicle::{SimulationSettings, VehicleEvent, VehicleOutput};

pub(super) const HELP: &str = "\
Examples:
  signal-gateway vehicle --profile pacmod --interface vcan0
  signal-gateway vehicle --profile tesla_model3 \\
    --interface vcan0 --script day.txt
  signal-gateway vehicle --profile vw_mqb --candump \\
    --until 20 --script day.txt > day.log

Requests come from --script and from standard input, one a line; a number before it is the time
in seconds since the start, # begins a comment:
  stalk left|right|off       the driver moves the stalk all the way
  tap left|right             the driver taps it: three flashes
  hazard on|off|press        the driver's hazard button
  mode autonomous|steer_only|velocity_only|manual|disengaged|not_ready
                             who drives: the mode that is reported, and the commands it obeys
  gear park|reverse|neutral|drive      the driver engages a gear; it begins in park
  speed MPS                  it takes up this speed in the direction of the gear, by 2 m/s²
  steer DEGREES              the front wheels turn to this angle, left positive, by 23° a second
  brake                      it brakes to a standstill, by 8 m/s²
  door open|closed [NAME]    the door with this name in the profile, or all doors
  fault drop [P] [MESSAGE]   frames are lost, each with probability P (1)
  fault corrupt [P] [MESSAGE]          a random bit is wrong
  fault freeze-counter [MESSAGE]       the counter stops
  fault freeze-contents [MESSAGE]      the contents are frozen, counter and checksum continue
  fault false-report off|left|right|hazard  reports have this state, whatever the lamps do
  fault report not_available|fault|undefined   reports have such a value instead of a state
  fault bulb left|right      the side flashes twice as fast, fault signals report it
  fault ignore-commands      commands are ignored
  fault bus-off SECONDS      an error frame with bus-off; silence; another with restarted
  fault silent               nothing is sent or received
  clear                      all faults end
Without MESSAGE a fault is of all messages. The end of standard input does not end the vehicle.

A line of text is  seconds  subject  event. With --json each line is one object
{\"t\": SECONDS, \"what\": …}:
  commanded          turn (left, right, off; null: nothing requested), hazard (true, false, null)
  command_timed_out  message
  command_rejected   message, why
  lights             lights (off, left, right, hazard), who (nobody, command, driver)
  lamps              left, right: lit
  bus_off            on
  not_possible       why

On a terminal a live view shows the vehicle, and its keys move stalk and button; with --plain the
lines do, as elsewhere.

The driver comes before the commands, hazard lights before turn indicators. A command ends with
its frames. An interface with a controller, which may be a real vehicle's, is refused.";

#[derive(Debug, Args)]
pub(super) struct VehicleArgs {
    #[command(flatten)]
    config: ConfigArgs,
    /// Use INTERFACE instead of the configured one, for BUS of the profile or its only bus; repeatable
    #[arg(short, long, value_name = "[BUS=]INTERFACE")]
    interface: Vec<String>,
    /// Requests, one a line
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Time at which to end; default: with SIGTERM or SIGINT, of a log 10
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    until: Option<Duration>,
    /// Time from a command to the lights
    #[arg(long, value_name = "MS", default_value_t = 50, value_parser = clap::value_parser!(u64).range(0..=60_000))]
    reaction_ms: u64,
    /// Time for which a command holds after its last frame; default: five periods of its message
    #[arg(long, value_name = "MS", value_parser = clap::value_parser!(u64).range(1..=60_000))]
    command_timeout_ms: Option<u64>,
    /// Flashes a minute
    #[arg(long, value_name = "RATE", default_value_t = 90, value_parser = clap::value_parser!(u64).range(30..=240))]
    flashes: u64,
    /// Seed of the random faults
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Print JSON lines
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    view: ViewArgs,
    /// Print what it sends as a candump log, on virtual time and without a bus
    #[arg(long, conflicts_with = "json")]
    candump: bool,
}

pub(super) fn run(args: &VehicleArgs) -> Result<ExitCode, Failure> {
    messages::start_log("warn", LogForm::Messages)?;
    let mut settings = settings(&args.config)?;
    choose_interfaces(args, &mut settings)?;
    let plan = settings.vehicle_plan().map_err(|error| Failure::Usage(error.to_string()))?;
    let simulation = SimulationSettings {
        reaction: Duration::from_millis(args.reaction_ms),
        command_timeout: args.command_timeout_ms.map(Duration::from_millis),
        flash_period: Duration::from_secs(60) / u32::try_from(args.flashes).unwrap_or(90),
        seed: args.seed,
    };
    let script = args.script.as_deref().map(read_script).transpose()?.unwrap_or_default();
    let run = VehicleRun { plan, simulation, script, until: args.until, lines: None };
    if args.candump {
        return write_log(&settings, run);
    }
    for bus in &settings.gateway.buses {
        refuse_controller(&bus.interface)?;
    }
    if !args.json && args.view.is_live() {
        drive_in_view(&settings, run)
    } else {
        drive(&settings, run, Form::json_if(args.json))
    }
}

/// 2023-11-14, so that the same script gives the same log.
const LOG_START: WallStamp = WallStamp::from_nanos(1_700_000_000_000_000_000);
const LOG_LENGTH: Duration = Duration::from_secs(10);

fn drive(settings: &Settings, mut run: VehicleRun, form: Form) -> Result<ExitCode, Failure> {
    if form == Form::Text && io::stdout().is_terminal() && !messages::options().quiet {
        messages::say(&title(settings, &run.plan));
    }
    run.lines = Some(lines_of_stdin());
    let mut out = io::stdout().lock();
    run_vehicle(settings, run, |event, now| {
        match event {
            RunEvent::Output(VehicleOutput::Happened(event)) => {
                writeln!(out, "{}", line(form, event, now))?;
                out.flush()?;
            }
            RunEvent::Output(VehicleOutput::Frame { .. } | VehicleOutput::Error { .. }) => {}
            RunEvent::SendFailed(bus, why) => messages::warn(&not_sent(settings, bus, why)),
            RunEvent::InvalidRequest(error) => messages::warn(&format!("request: {error}")),
        }
        Ok(())
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Runs the vehicle on its interfaces with the live view, whose keys operate stalk and button.
fn drive_in_view(settings: &Settings, mut run: VehicleRun) -> Result<ExitCode, Failure> {
    let (sender, lines) = unbounded_channel();
    run.lines = Some(lines);
    let buses = settings.gateway.buses.iter().map(|bus| format!("{} ({})", bus.name, bus.interface));
    let mut state = VehicleState::new(buses);
    let driver = move |line: &str| drop(sender.send(line.to_owned()));
    let title = format!("vehicle · {}, simulated", settings.vehicle);
    let mut view = view::start(Model { title, ..Model::default() }, Some(Box::new(driver)))?;
    run_vehicle(settings, run, |event, now| {
        match event {
            RunEvent::Output(output) => {
                state.update(output, now);
                if let VehicleOutput::Happened(event) = output
                    && !matches!(event, VehicleEvent::Lamps { .. })
                {
                    view.line(Level::Ok, now, &text(event));
                }
            }
            RunEvent::SendFailed(bus, why) => {
                view.line(Level::Error, now, &not_sent(settings, bus, why));
                state.cannot_send(bus);
            }
            RunEvent::InvalidRequest(error) => {
                view.line(Level::Warn, now, &format!("request: {error}"));
            }
        }
        if view.is_due() {
            view.picture(state.picture(now));
        }
        Ok(())
    })?;
    Ok(ExitCode::SUCCESS)
}

fn write_log(settings: &Settings, run: VehicleRun) -> Result<ExitCode, Failure> {
    let interfaces = settings.gateway.buses.iter().map(|bus| bus.interface.clone()).collect();
    let log = CandumpLog { interfaces, start: LOG_START };
    let mut out = io::BufWriter::new(io::stdout().lock());
    let length = run.until.unwrap_or(LOG_LENGTH);
    desk::vehicle::run(run.plan, run.simulation, run.script, length, |output, at| {
        if let Some(line) = log.line(output, at) {
            return writeln!(out, "{line}");
        }
        if let VehicleOutput::Happened(VehicleEvent::NotPossible(why)) = output {
            messages::warn(&format!("without effect on the bus: {why}"));
        }
        Ok(())
    })?;
    out.flush()?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses an interface with a controller, behind which there may be a real vehicle.
fn refuse_controller(interface: &str) -> Result<(), Failure> {
    Err(Failure::Usage(match has_controller(interface) {
        Ok(false) => return Ok(()),
        Ok(true) => {
            format!(
                "{interface} has a CAN controller, and a real vehicle may listen: use a virtual interface"
            )
        }
        Err(error) => format!(
            "{interface}: {error}; make a virtual one: ip link add dev vcan0 type vcan && ip link set vcan0 up, \
             and name it with --interface"
        ),
    }))
}

fn choose_interfaces(args: &VehicleArgs, settings: &mut Settings) -> Result<(), Failure> {
    let buses = &mut settings.gateway.buses;
    for given in &args.interface {
        let (name, interface) =
            given.split_once('=').map_or((None, given.as_str()), |(name, interface)| (Some(name), interface));
        let only = buses.len() == 1;
        let found = buses.iter_mut().find(|bus| name.map_or(only, |name| bus.name == name));
        match found {
            Some(bus) => interface.clone_into(&mut bus.interface),
            None => {
                let names = buses.iter().map(|bus| bus.name.as_str()).collect::<Vec<_>>().join(", ");
                let text = format!("--interface {given}: write BUS=INTERFACE, the buses are {names}");
                return Err(Failure::Usage(text));
            }
        }
    }
    Ok(())
}

/// Reads a script; requests without a time apply at the start.
fn read_script(path: &Path) -> Result<Vec<(Duration, SimulationRequest)>, Failure> {
    let text = read_text(path).map_err(Failure::file(path))?;
    let mut script = Vec::new();
    for (number, line) in (1_u32..).zip(text.lines()) {
        let wrong = |error| Failure::Usage(format!("{}:{number}: {error}", path.display()));
        if let Some((at, request)) = request::line(line).map_err(wrong)? {
            script.push((at.unwrap_or_default(), request));
        }
    }
    Ok(script)
}

/// Reads standard input in a thread, which ends with the process: there is no other way to wait for it.
fn lines_of_stdin() -> UnboundedReceiver<String> {
    let (sender, lines) = unbounded_channel();
    std::thread::spawn(move || {
        for line in io::stdin().lock().split(b'\n') {
            // An error ends the input. A line that is not text is reported as an invalid request.
            let line = line.map(|line| String::from_utf8_lossy(&line).into_owned());
            if line.ok().is_none_or(|line| sender.send(line).is_err()) {
                break;
            }
        }
    });
    lines
}

fn title(settings: &Settings, plan: &VehiclePlan) -> String {
    let buses = settings.gateway.buses.iter().map(|bus| format!("{} on {}", bus.name, bus.interface));
    let commands = plan.follows_commands().collect::<Vec<_>>().join(", ");
    let follows_commands = if commands.is_empty() { "no commands" } else { &commands };
    format!(
        "{}, simulated: {}\nsends {}; obeys {follows_commands}\nrequests: {}",
        settings.vehicle,
        buses.collect::<Vec<_>>().join(", "),
        plan.sends().collect::<Vec<_>>().join(", "),
        request::REQUESTS,
    )
}

fn not_sent(settings: &Settings, bus: BusIndex, why: SendFailure) -> String {
    let bus = settings.gateway.buses.get(usize::from(bus.0));
    let interface = bus.map_or("?", |bus| bus.interface.as_str());
    let reason = match why {
        SendFailure::QueueFull => "the queue is full".to_owned(),
        SendFailure::Refused(errno) => io::Error::from_raw_os_error(errno).to_string(),
    };
    format!("nothing can be sent on {interface}: {reason}")
}
