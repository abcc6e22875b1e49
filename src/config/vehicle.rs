//! From a vehicle profile and its DBCs to compiled bindings.

use std::path::{Path, PathBuf};
use std::time::Duration;

use toml::Spanned;

use super::command_profile::{command, refuse_alive_by};
use super::files::Files;
use super::hazard::hazard;
use super::lights::{faults, while_hazard};
use super::messages::messages;
use super::problem::{Document, Problem};
use super::roles::{Binder, ProfileBus};
use super::turn::turn;
use super::v2i::v2i;
use super::vehicle_file::VehicleFile;
use crate::core::command::settings::CommandBinding;
use crate::core::dbc;
use crate::core::dbc::model::Database;
use crate::core::event::BusIndex;
use crate::core::frame::CanId;
use crate::core::traffic_light::v2i_reception::binding::V2iBinding;
use crate::core::trust::table::{BoundMessage, BoundSignal, MessageIndex, SignalTable};
use crate::core::vehicle_lights::binding::{
    FaultBinding, HazardBinding, LightsBinding, TurnBinding, TurnWhileHazard,
};

/// What a profile comes to.
#[derive(Debug)]
pub struct Vehicle {
    /// For people.
    pub name: String,
    /// Its buses, in the order of their names; [`BusIndex`] points here.
    pub buses: Vec<VehicleBus>,
    /// Its lights.
    pub lights: LightsBinding,
    /// Traffic-light states from the network; nothing in most profiles.
    pub v2i: V2iBinding,
    /// What may be sent to it; nothing in many profiles.
    pub command: CommandBinding,
}

impl Vehicle {
    /// No vehicle at all: a bench.
    pub(super) fn none() -> Self {
        let lights = LightsBinding {
            table: SignalTable::default(),
            turn: TurnBinding::LeftOut,
            turn_faults: FaultBinding::default(),
            hazard: HazardBinding::LeftOut,
            hazard_faults: FaultBinding::default(),
            turn_while_hazard: TurnWhileHazard::default(),
        };
        Self {
            name: "no vehicle".to_owned(),
            buses: Vec::new(),
            lights,
            v2i: V2iBinding::default(),
            command: CommandBinding::default(),
        }
    }
}

/// A bus as the profile describes it.
#[derive(Debug)]
pub struct VehicleBus {
    /// Name in the profile.
    pub name: String,
    /// Further messages that prove it alive.
    pub alive_by: Vec<CanId>,
    /// Longest silence while awake.
    pub alive_timeout: Duration,
    /// Whether the whole bus may fall asleep.
    pub may_sleep: bool,
    /// Path of its DBC.
    pub dbc_path: PathBuf,
    /// Its DBC.
    pub database: Database,
}

/// Silence that ends a bus's life when the profile gives none, at least.
const ALIVE_TIMEOUT_MS: u64 = 1000;
/// No believed silence is longer than an hour.
pub(super) const LONGEST_TIMEOUT_MS: u64 = 3_600_000;

/// Compiles a profile.
///
/// # Errors
/// Every problem found, each with its place in `document`.
pub fn compile(document: &Document, file: &VehicleFile, files: &dyn Files) -> Result<Vehicle, Vec<Problem>> {
    let buses = read_buses(document, file, files)?;
    let mut binder = Binder::new(document, &buses);
    let lights = lights(&mut binder, file);
    let light_signals = std::mem::take(&mut binder.signals);
    let sources = v2i(&mut binder, &file.v2i);
    let v2i_signals = std::mem::take(&mut binder.signals);
    let command = command(&mut binder, file.command.as_ref(), lights.as_ref().map(|lights| &lights.hazard));
    let command_signals = std::mem::take(&mut binder.signals);
    let alive_by: Vec<_> = buses.iter().map(|bus| alive_by(&mut binder, file, bus)).collect();
    if let Some(command) = &command {
        refuse_alive_by(&mut binder, file, &command.allowed);
    }
    let all_bound = lights.is_some() && sources.is_some() && command.is_some();
    let messages = messages(&mut binder, file, &alive_by, all_bound);
    match (lights, sources, command, binder.problems) {
        (Some(lights), Some(sources), Some(command), problems) if problems.is_empty() => {
            let lights = LightsBinding { table: table(&messages, light_signals), ..lights };
            let v2i = V2iBinding { table: table(&messages, v2i_signals), sources };
            let command = CommandBinding { table: table(&messages, command_signals), ..command };
            let limits: Vec<_> = buses.iter().map(|bus| alive_timeout(file, bus, &messages)).collect();
            let buses =
                buses.into_iter().zip(alive_by).zip(limits).map(|((bus, alive_by), limit)| VehicleBus {
                    alive_timeout: limit,
                    may_sleep: file.bus.get(bus.name.as_str()).is_some_and(|bus| bus.may_sleep),
                    alive_by,
                    dbc_path: bus.dbc_path.into(),
                    name: bus.name,
                    database: bus.database,
                });
            Ok(Vehicle { name: file.name.clone(), buses: buses.collect(), lights, v2i, command })
        }
        (_, _, _, problems) => Err(problems),
    }
}

/// What `[turn]` and `[hazard]` come to, still without messages and signals.
fn lights(binder: &mut Binder<'_>, file: &VehicleFile) -> Option<LightsBinding> {
    // Who describes something else may leave the lights to another gateway.
    if file.v2i.is_empty() {
        for (key, missing) in [("turn", file.turn.is_none()), ("hazard", file.hazard.is_none())] {
            if missing {
                let remedy = "add the section, e.g. with fitted = false or from = \"unbound\"";
                binder.refuse(0..0, format!("missing section `{key}`"), remedy);
            }
        }
    }
    let turn_binding = match &file.turn {
        Some(file) => turn(binder, file),
        None => Some(TurnBinding::LeftOut),
    };
    let hazard_binding = match &file.hazard {
        Some(file) => hazard(binder, file, turn_binding.as_ref()),
        None => Some(HazardBinding::LeftOut),
    };
    let turn_file = file.turn.as_ref().map(Spanned::get_ref);
    let hazard_file = file.hazard.as_ref().map(Spanned::get_ref);
    let turn_faults = turn_file.map(|file| faults(binder, &file.fault_signal, file.on_fault.as_ref()));
    let hazard_faults = hazard_file.map(|file| faults(binder, &file.fault_signal, file.on_fault.as_ref()));
    let turn_while_hazard = turn_file.map(|turn| while_hazard(binder, turn, hazard_file));
    Some(LightsBinding {
        table: SignalTable::default(),
        turn: turn_binding?,
        turn_faults: turn_faults.unwrap_or_default(),
        hazard: hazard_binding?,
        hazard_faults: hazard_faults.unwrap_or_default(),
        turn_while_hazard: turn_while_hazard.unwrap_or_default(),
    })
}

/// Signals with those of all messages that carry them.
fn table(messages: &[BoundMessage], mut signals: Vec<BoundSignal>) -> SignalTable {
    let mut carriers: Vec<_> = signals.iter().map(|signal| signal.message).collect();
    carriers.sort_unstable();
    carriers.dedup();
    for signal in &mut signals {
        // Each is among the carriers.
        signal.message = MessageIndex(carriers.partition_point(|carrier| *carrier < signal.message));
    }
    let carriers = carriers.iter().filter_map(|carrier| messages.get(carrier.0));
    SignalTable { messages: carriers.cloned().collect(), signals }
}

fn read_buses(
    document: &Document,
    file: &VehicleFile,
    files: &dyn Files,
) -> Result<Vec<ProfileBus>, Vec<Problem>> {
    let mut problems = Vec::new();
    let mut buses = Vec::new();
    for (index, (name, bus)) in (0..=u8::MAX).zip(&file.bus) {
        let path = document.path().parent().unwrap_or(Path::new("")).join(bus.dbc.get_ref());
        match files.read(&path) {
            Ok(bytes) => buses.push(ProfileBus {
                name: name.get_ref().clone(),
                index: BusIndex(index),
                dbc_path: path.display().to_string(),
                database: dbc::parse(&bytes),
            }),
            Err(error) => problems.push(document.problem(
                bus.dbc.span(),
                format!("cannot read {}: {error}", path.display()),
                "give the DBC's path relative to this file",
            )),
        }
        if let Some(limit) = bus.alive_timeout_ms.as_ref().filter(|limit| !is_timeout(*limit.get_ref())) {
            problems.push(out_of_range(document, limit));
        }
    }
    if file.bus.len() > usize::from(u8::MAX) {
        problems.push(document.problem(0..0, "more than 255 buses", "describe fewer"));
    }
    if problems.is_empty() { Ok(buses) } else { Err(problems) }
}

pub(super) fn is_timeout(ms: u64) -> bool {
    (1..=LONGEST_TIMEOUT_MS).contains(&ms)
}

pub(super) fn out_of_range(document: &Document, limit: &Spanned<u64>) -> Problem {
    let reason = format!("{} ms is no usable limit", limit.get_ref());
    document.problem(limit.span(), reason, format!("give 1 to {LONGEST_TIMEOUT_MS} ms"))
}

/// As the profile says; by default no bus is called silent while its liveliest message may be.
fn alive_timeout(file: &VehicleFile, bus: &ProfileBus, messages: &[BoundMessage]) -> Duration {
    let given = file.bus.get(bus.name.as_str()).and_then(|bus| bus.alive_timeout_ms.as_ref());
    let of_bus = messages.iter().filter(|message| message.bus == bus.index);
    let silences = of_bus.filter_map(|message| message.timing.timeout());
    let default = silences.min().unwrap_or_default().max(Duration::from_millis(ALIVE_TIMEOUT_MS));
    given.map_or(default, |ms| Duration::from_millis(*ms.get_ref()))
}

fn alive_by(binder: &mut Binder<'_>, file: &VehicleFile, bus: &ProfileBus) -> Vec<CanId> {
    let names = file.bus.get(bus.name.as_str()).map_or(&[][..], |bus| &bus.alive_by);
    let find = |name: &Spanned<String>| {
        binder.find_message(Some(&bus.name), name.get_ref(), name.span()).map(|(_, message)| message.id)
    };
    names.iter().filter_map(find).collect()
}
