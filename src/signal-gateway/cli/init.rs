//! `init`: writes a new configuration.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;

use super::arguments::{TimeArgs, expect_folder_of};
use super::discover::{self, DiscoverArgs};
use super::failure::Failure;
use super::questions::{ask, ask_or_default, yes_or_no};
use super::{identify, messages, profiles};
use crate::check::identify::ProfileCandidate;
use crate::check::identify_text;
use crate::config::built_in::BuiltIn;
use crate::config::car_models;
use crate::config::draft::{BusInterface, DimensionsDraft, DraftCar, gateway_toml};
use crate::config::files::Disk;
use crate::config::{Settings, interface_name, load_profile};
use crate::io::can::interfaces::{can_interfaces, interfaces};
use crate::io::new_files::write_new;
use crate::io::process_log::LogForm;
use vehicle_bringup::car_model::{
    CarModel, DimensionRange, ListedDimensions, ModelProfile, ModelVerdict, find,
};

pub(super) const HELP: &str = "\
Examples:
  signal-gateway init
  signal-gateway init --interface can0 --profile hyundai_kia
  signal-gateway init --interface can0 --car \"Kia Niro EV 2020\"
  signal-gateway init --interface can0 --profile identify
  signal-gateway init --interface can0 --profile discover
  signal-gateway init -i body=can0 -i chassis=can1 -p my_car.toml -o new.toml

It asks for what is not given; answers can come through a pipe as well. A profile is a name of
`signal-gateway profiles list`, a file, `identify` to choose among those that fit the bus or a
recording, or `discover` for an unknown car. A car by make, model and year has its profile from the
list of models, as `signal-gateway profiles find` shows it, and its wheel base and steering ratio
from opendbc's list: as comments, unless you say that they are to be used, since no one has measured
them on your car. Unattended, `identify` listens to the interface for up to 30 s and takes the
profile that fits.";

#[derive(Debug, Args)]
pub(super) struct InitArgs {
    /// Interface of the vehicle's only bus, or of BUS in the profile; repeatable
    #[arg(short, long, value_name = "[BUS=]INTERFACE")]
    interface: Vec<String>,
    /// Vehicle profile: its name, a file, `identify` or `discover`
    #[arg(short, long, value_name = "PROFILE")]
    profile: Option<String>,
    /// Make, model and year of the car, for its profile and dimensions
    #[arg(long, value_name = "CAR")]
    car: Option<String>,
    /// The new configuration
    #[arg(short, long, value_name = "FILE", default_value = "gateway.toml")]
    output: PathBuf,
    /// Overwrite a file that exists
    #[arg(long)]
    force: bool,
}

const IDENTIFY: &str = "identify";
const DISCOVER: &str = "discover";
const LIST: &str = "list";
const LISTEN: &str = "listen";
const LISTENING: Duration = Duration::from_secs(30);
const PROPOSED: usize = 3;
/// Maximum number of times that the user is asked for a vehicle.
const MAX_ROUNDS: usize = 10;

/// Names of a profile that can be chosen by number, and of its vehicle.
type Proposal = (&'static str, String);

enum VehicleAnswer {
    Profile(String, Box<Settings>),
    Identify,
    Discover,
    List,
}

pub(super) fn run(args: &InitArgs) -> Result<ExitCode, Failure> {
    messages::start_log("warn", LogForm::Messages)?;
    // A wrong name is reported before the first question.
    args.profile.as_deref().map_or(Ok(()), |given| vehicle(given, &[]).map(drop))?;
    let models = car_models::models().map_err(Failure::Environment)?;
    let car = args.car.as_deref().map(|car| listed(&models, car)).transpose()?;
    let given = match &car {
        Some(car) if args.profile.is_none() => Some(car.profile()?),
        Some(_) | None => args.profile.as_deref(),
    };
    if let (Some(car), Some(given)) = (&car, &args.profile) {
        car.expect_profile(given)?;
    }
    // A discovery makes its own folder.
    if args.profile.as_deref() != Some(DISCOVER) {
        expect_folder_of(&args.output)?;
    }
    let overwrite = args.force || args.output.exists() && is_overwriting_allowed(&args.output)?;
    let interfaces = if args.interface.is_empty() {
        vec![ask_interface("CAN interface", None)?]
    } else {
        args.interface.iter().map(|given| usable(given)).collect::<Result<_, _>>()?
    };
    let Some((profile, settings)) = profile(given, &interfaces[0])? else {
        let folder = args.output.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.map_or_else(|| PathBuf::from("new_car"), Path::to_owned);
        let [interface] = interfaces.as_slice() else {
            return Err(Failure::Usage("one interface is discovered at a time: give one".to_owned()));
        };
        return discover::discover(&DiscoverArgs::live(interface.clone(), folder, args.force));
    };
    car.as_ref().map_or(Ok(()), |car| car.expect_profile(&profile))?;
    let buses = settings.gateway.buses.iter().map(|bus| bus.name.as_str()).collect::<Vec<_>>();
    let buses = match buses.as_slice() {
        [_, _, ..] if args.interface.is_empty() => {
            let of_bus = |bus: &&str| {
                let interface = ask_interface(&format!("Interface of the bus {bus}"), Some(&interfaces[0]))?;
                Ok(BusInterface { bus: (*bus).to_owned(), interface })
            };
            buses.iter().map(of_bus).collect::<Result<_, Failure>>()?
        }
        buses => assigned(buses, &interfaces)?,
    };
    let dimensions = dimensions(&profile, &settings, &models, car.as_ref())?;
    let text = gateway_toml(&named(&profile, &args.output)?, &buses, dimensions.as_ref());
    write_new(&args.output, &text, overwrite).map_err(Failure::written(&args.output))?;
    let path = args.output.display();
    let interfaces: Vec<_> = buses.iter().map(|bus| bus.interface.as_str()).collect();
    let mut out = io::stdout().lock();
    writeln!(out, "{path}: {}, on {}", settings.vehicle, interfaces.join(", "))?;
    writeln!(out, "next: signal-gateway check --config {path}")?;
    writeln!(out, "      signal-gateway decode --live --config {path}")?;
    Ok(ExitCode::SUCCESS)
}

struct ListedCar<'a> {
    name: &'a str,
    models: Vec<&'a CarModel>,
    profiles: Vec<String>,
}

impl ListedCar<'_> {
    /// Returns the only profile of the car.
    fn profile(&self) -> Result<&str, Failure> {
        let [only] = self.profiles.as_slice() else {
            let profiles = self.profiles.join(" or ");
            return Err(Failure::Usage(format!("{} may need {profiles}: give --profile", self.name)));
        };
        Ok(only)
    }

    /// Fails for a built-in profile that is not one of this car. A file may describe any car.
    fn expect_profile(&self, given: &str) -> Result<(), Failure> {
        let profile = BuiltIn::Profile.path(given);
        if profile.is_none() || self.profiles.iter().any(|known| BuiltIn::Profile.path(known) == profile) {
            return Ok(());
        }
        let (car, profiles) = (self.name, self.profiles.join(" or "));
        Err(Failure::Usage(format!(
            "--profile {given} is not a profile of the {car}: give {profiles}, or leave out --car"
        )))
    }
}

fn listed<'a>(models: &'a [CarModel], car: &'a str) -> Result<ListedCar<'a>, Failure> {
    if BuiltIn::Profile.path(car).is_some() {
        let text = format!("--car {car}: this is a profile, not a car; give it with --profile {car}");
        return Err(Failure::Usage(text));
    }
    let search = find(models, car);
    let profiles: Vec<_> = search.profiles().into_iter().map(str::to_owned).collect();
    if search.verdict == ModelVerdict::Unknown || profiles.is_empty() {
        let text = format!("no profile reads the {car}; `signal-gateway profiles find {car}` says more");
        return Err(Failure::Usage(text));
    }
    Ok(ListedCar { name: car, models: search.models, profiles })
}

/// Returns the listed dimensions of the car, or of all models of a profile; `None` if it needs none. Asks
/// whether the dimensions of a single car are to be used until they are measured.
fn dimensions(
    profile: &str,
    settings: &Settings,
    models: &[CarModel],
    car: Option<&ListedCar<'_>>,
) -> Result<Option<DimensionsDraft>, Failure> {
    let status = &settings.gateway.status;
    if status.velocity.is_none() && status.steering.is_empty() {
        return Ok(None);
    }
    let is_of_profile = |model: &&CarModel| matches!(&model.profile, ModelProfile::Shipped { profile: of, .. } if of == profile);
    let (subject, listed) = match car {
        Some(car) => (car.name.to_owned(), DimensionRange::of(car.models.iter().copied())),
        None => (format!("the models of {profile}"), DimensionRange::of(models.iter().filter(is_of_profile))),
    };
    let only = listed.filter(|range| range.least == range.greatest).map(|range| range.least);
    let car = match (car.and_then(|car| car.models.first()), only) {
        (Some(model), Some(ListedDimensions { wheel_base_m, steering_ratio })) => {
            let name = model.name();
            let question = format!(
                "Use the wheel base of {wheel_base_m} m and the steering ratio of {steering_ratio} that opendbc lists for \
                 {name}, with a warning until they are measured on this car? yes or no"
            );
            let is_used = !status.steering.is_empty() && ask_or_default(&question, "no", yes_or_no)?;
            Some(DraftCar { name, is_used })
        }
        _ => None,
    };
    Ok(Some(DimensionsDraft { subject, car, listed }))
}

/// Asks whether an existing file may be overwritten; fails if not.
fn is_overwriting_allowed(output: &Path) -> Result<bool, Failure> {
    let output = output.display();
    let question = format!("{output} exists. Overwrite it? yes or no");
    if ask(&question, "no", "another --output, or --force", yes_or_no)? {
        return Ok(true);
    }
    Err(Failure::Usage(format!("{output} is left as it is; give another --output")))
}

/// Asks for an interface. Without a default, the first CAN interface of the machine is proposed.
fn ask_interface(question: &str, default: Option<&str>) -> Result<String, Failure> {
    let found = can_interfaces();
    let default = default.or(found.first().map(String::as_str)).unwrap_or("can0");
    let listed = if found.is_empty() { "none is here now".to_owned() } else { found.join(", ") };
    ask(&format!("{question} ({listed})"), default, "--interface", usable)
}

/// Checks `[BUS=]INTERFACE`. The interface may be missing on this machine.
fn usable(given: &str) -> Result<String, Failure> {
    let interface = interface_of(given);
    interface_name(interface).map_err(|refusal| Failure::Usage(refusal.to_string()))?;
    let is_here = interfaces().iter().any(|known| known == interface);
    if is_here && !can_interfaces().iter().any(|known| known == interface) {
        return Err(Failure::Usage(format!("{interface} is not a CAN interface")));
    }
    if !is_here {
        messages::note(&format!("there is no interface {interface} on this machine now"));
    }
    Ok(given.to_owned())
}

fn interface_of(given: &str) -> &str {
    given.split_once('=').map_or(given, |(_, interface)| interface)
}

/// Returns the profile's name as given, with its settings; `None` if the vehicle is to be discovered.
fn profile(given: Option<&str>, interface: &str) -> Result<Option<(String, Settings)>, Failure> {
    let mut vehicle = match given {
        Some(given) => vehicle(given, &[])?,
        None => ask_vehicle()?,
    };
    for _ in 0..MAX_ROUNDS {
        vehicle = match vehicle {
            VehicleAnswer::Profile(named, settings) => return Ok(Some((named, *settings))),
            VehicleAnswer::Discover => return Ok(None),
            VehicleAnswer::List => {
                profiles::list(&mut io::stdout().lock())?;
                ask_vehicle()?
            }
            VehicleAnswer::Identify => {
                let (found, is_first_fitting) = identified(interface_of(interface))?;
                choose_vehicle(&found, is_first_fitting)?
            }
        };
    }
    Err(Failure::Usage("no vehicle was chosen; give --profile".to_owned()))
}

fn ask_vehicle() -> Result<VehicleAnswer, Failure> {
    show_menu(&[])?;
    ask("Vehicle", IDENTIFY, "--profile", |answer| vehicle(answer, &[]))
}

/// Asks for one of the profiles that were identified. The first one is the default if it fits.
fn choose_vehicle(found: &[Proposal], is_first_fitting: bool) -> Result<VehicleAnswer, Failure> {
    show_menu(found)?;
    match found.first().filter(|_| is_first_fitting) {
        Some((name, _)) => ask_or_default("Vehicle", name, |answer| vehicle(answer, found)),
        None => ask("Vehicle", DISCOVER, "--profile, since no profile fits for sure", |answer| {
            vehicle(answer, found)
        }),
    }
}

/// Lists the possible answers; `found` are the profiles that can be chosen by number.
fn show_menu(found: &[Proposal]) -> io::Result<()> {
    let mut menu = String::new();
    for (number, (name, vehicle)) in (1..).zip(found) {
        menu += &format!("  {number:<9} {name}, {vehicle}\n");
    }
    menu += "  NAME      a profile by its name, or a profile file\n  \
             list      show the names\n  \
             identify  find the profiles that fit the bus or a recording\n  \
             discover  find the indicators of an unknown car\n";
    write!(io::stdout().lock(), "\n{menu}")
}

fn vehicle(given: &str, found: &[Proposal]) -> Result<VehicleAnswer, Failure> {
    let number = given.parse::<usize>().ok().and_then(|number| found.get(number.checked_sub(1)?));
    let given = number.map_or(given, |(name, _)| name);
    Ok(match given {
        IDENTIFY => VehicleAnswer::Identify,
        DISCOVER => VehicleAnswer::Discover,
        LIST => VehicleAnswer::List,
        _ => VehicleAnswer::Profile(given.to_owned(), Box::new(load_profile(&Disk, Path::new(given))?)),
    })
}

/// Shows the profiles that fit a recording or a bus. Returns the best ones, and whether the first one fits.
fn identified(interface: &str) -> Result<(Vec<Proposal>, bool), Failure> {
    let seconds = LISTENING.as_secs();
    let question = format!("A recording of the vehicle, or listen to {interface} for {seconds} s");
    let (identifier, log) = ask_or_default(&question, LISTEN, |answer| match answer {
        LISTEN => Ok((identify::listen(interface, LISTENING)?, None)),
        file => Ok((identify::read(Path::new(file), TimeArgs::default())?, Some(PathBuf::from(file)))),
    })?;
    let layout = messages::layout(&io::stdout());
    write!(io::stdout().lock(), "\n{}", identify_text::text(&identifier, log.as_deref(), false, layout))?;
    let found = identifier.possible();
    let proposed = found.iter().take(PROPOSED);
    let named = proposed.map(|candidate| (candidate.profile, candidate.vehicle.to_owned())).collect();
    Ok((named, found.first().is_some_and(ProfileCandidate::fits)))
}

fn assigned(buses: &[&str], interfaces: &[String]) -> Result<Vec<BusInterface>, Failure> {
    let known = buses.join(", ");
    let mut assigned: Vec<BusInterface> = Vec::new();
    for given in interfaces {
        let (bus, interface) = match (given.split_once('='), buses) {
            (Some((bus, interface)), _) => (bus, interface),
            (None, [only]) => (*only, given.as_str()),
            (None, _) => {
                let text = format!("--interface {given}: write BUS=INTERFACE, the buses are {known}");
                return Err(Failure::Usage(text));
            }
        };
        if !buses.contains(&bus) {
            let text = format!("--interface {given}: the profile has no bus {bus}; it has {known}");
            return Err(Failure::Usage(text));
        }
        assigned.push(BusInterface { bus: bus.to_owned(), interface: interface.to_owned() });
    }
    match buses.iter().find(|bus| !assigned.iter().any(|known| known.bus == **bus)) {
        Some(missing) => Err(Failure::Usage(format!("--interface {missing}=INTERFACE is missing"))),
        None => Ok(assigned),
    }
}

/// Returns the profile by name, by its path below the new configuration, or by its absolute path.
fn named(profile: &str, output: &Path) -> io::Result<String> {
    if !Path::new(profile).exists() {
        return Ok(profile.to_owned());
    }
    let (path, output) = (std::path::absolute(profile)?, std::path::absolute(output)?);
    let below = output.parent().and_then(|folder| path.strip_prefix(folder).ok());
    Ok(below.unwrap_or(&path).display().to_string())
}
