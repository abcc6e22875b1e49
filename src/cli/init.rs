//! `init`: a new configuration.

use std::io::{self, BufRead as _, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;

use super::discover::{self, DiscoverArgs};
use super::{Failure, messages};
use crate::config::built_in::BuiltIn;
use crate::config::draft::{BusInterface, gateway_toml};
use crate::config::files::Disk;
use crate::config::load_profile;
use crate::io::can::interfaces::can_interfaces;
use crate::io::new_files::write_new;
use crate::io::process_log::LogForm;

pub(super) const HELP: &str = "\
Examples:
  signal-gateway init
  signal-gateway init --interface can0 --profile hyundai_kia
  signal-gateway init --interface can0 --profile discover
  signal-gateway init -i body=can0 -i chassis=can1 -p my_car.toml -o new.toml

On a terminal it asks for what is not given. A profile is a name of `signal-gateway profiles list`, a
file, or `discover` for a car that nobody knows.";

#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// Interface of the vehicle's only bus, or of BUS in the profile; repeatable
    #[arg(short, long, value_name = "[BUS=]INTERFACE")]
    interface: Vec<String>,
    /// Vehicle profile: its name, a file, or `discover`
    #[arg(short, long, value_name = "PROFILE")]
    profile: Option<String>,
    /// The new configuration
    #[arg(short, long, value_name = "FILE", default_value = "gateway.toml")]
    output: PathBuf,
    /// Overwrite a file that exists
    #[arg(long)]
    force: bool,
}

/// The word for a vehicle without a profile.
const DISCOVER: &str = "discover";

pub(super) fn run(args: &InitArgs) -> Result<ExitCode, Failure> {
    messages::start_log("warn", LogForm::Messages)?;
    if args.output.exists() && !args.force {
        return Err(Failure::Usage(format!(
            "{} exists, and nothing is overwritten unasked: give another --output, or --force",
            args.output.display()
        )));
    }
    let mut interfaces = args.interface.clone();
    if interfaces.is_empty() {
        let found = can_interfaces();
        let default = found.first().map_or("can0", String::as_str);
        let listed = if found.is_empty() { "none is here now".to_owned() } else { found.join(", ") };
        let question = format!("CAN interface ({listed})");
        interfaces.push(ask(&question, default, "--interface")?);
    }
    let profile = match &args.profile {
        Some(profile) => profile.clone(),
        None => {
            let names: Vec<_> = BuiltIn::Profile.names().collect();
            let known = names.join(", ");
            let question =
                format!("Known vehicles: {known}\nVehicle: one of them, a profile file, or discover");
            ask(&question, DISCOVER, "--profile")?
        }
    };
    if profile == DISCOVER {
        let folder = args.output.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.map_or_else(|| PathBuf::from("new_car"), Path::to_owned);
        let [interface] = interfaces.as_slice() else {
            return Err(Failure::Usage("one interface is discovered at a time: give one".to_owned()));
        };
        return discover::discover(&DiscoverArgs::live(interface.clone(), folder, args.force));
    }
    let settings = load_profile(&Disk, Path::new(&profile))?;
    let names: Vec<_> = settings.gateway.buses.iter().map(|bus| bus.name.clone()).collect();
    let buses = assigned(&names, &interfaces)?;
    // A file is found from the configuration's folder as well.
    let is_file = Path::new(&profile).exists();
    let named = if is_file { std::path::absolute(&profile)?.display().to_string() } else { profile };
    write_new(&args.output, &gateway_toml(&named, &buses), args.force)
        .map_err(Failure::file(&args.output))?;
    let path = args.output.display();
    let mut out = io::stdout().lock();
    writeln!(out, "{path}: {}, on {}", settings.vehicle, interfaces.join(", "))?;
    writeln!(
        out,
        "next: signal-gateway check --config {path}\n      signal-gateway decode --live --config {path}"
    )?;
    Ok(ExitCode::SUCCESS)
}

/// The interface of each bus.
fn assigned(buses: &[String], interfaces: &[String]) -> Result<Vec<BusInterface>, Failure> {
    let known = buses.join(", ");
    let mut assigned: Vec<BusInterface> = Vec::new();
    for given in interfaces {
        let (bus, interface) = match (given.split_once('='), buses) {
            (Some((bus, interface)), _) => (bus.to_owned(), interface.to_owned()),
            (None, [only]) => (only.clone(), given.clone()),
            (None, _) => {
                let text = format!("--interface {given}: write BUS=INTERFACE, the buses are {known}");
                return Err(Failure::Usage(text));
            }
        };
        if !buses.contains(&bus) {
            let text = format!("--interface {given}: the profile has no bus {bus}; it has {known}");
            return Err(Failure::Usage(text));
        }
        assigned.push(BusInterface { bus, interface });
    }
    match buses.iter().find(|bus| !assigned.iter().any(|known| known.bus == **bus)) {
        Some(missing) => Err(Failure::Usage(format!("--interface {missing}=INTERFACE is missing"))),
        None => Ok(assigned),
    }
}

/// Asks on the terminal; an empty answer is the default. Without a terminal the option has to be given.
fn ask(question: &str, default: &str, option: &str) -> Result<String, Failure> {
    if !io::stdin().is_terminal() {
        return Err(Failure::Usage(format!("{option} is missing, and there is no terminal to ask on")));
    }
    let mut out = io::stdout().lock();
    write!(out, "{question} [{default}]: ")?;
    out.flush()?;
    let mut answer = String::new();
    io::stdin().lock().read_line(&mut answer)?;
    let answer = answer.trim();
    Ok(if answer.is_empty() { default.to_owned() } else { answer.to_owned() })
}
