//! Vehicle profiles, `config/vehicles/*.toml`: one file per section with its shape and its check, from
//! names and raw values to compiled bindings.
//!
//! Every key is explained in `config/gateway.toml`. Spans are kept so that a value which cannot be used
//! is refused with its line and column.

mod binder;
mod bus;
mod command;
mod hazard;
mod integrity;
mod keys;
mod light_sources;
mod message;
mod raw_values;
mod turn;
mod v2i;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use serde::Deserialize;
use toml::Spanned;

use super::files::Files;
use super::reading::document::Document;
use super::reading::problem::Problem;
use crate::core::can::frame::CanId;
use crate::core::command::settings::CommandBinding;
use crate::core::dbc::model::Database;
use crate::core::traffic_light::v2i_reception::binding::V2iBinding;
use crate::core::validation::table::{BoundMessage, BoundSignal, MessageIndex, SignalTable};
use crate::core::vehicle_lights::binding::{
    FaultBinding, HazardBinding, LightsBinding, TurnBinding, TurnWhileHazard,
};
use binder::Binder;
use bus::{BusFile, alive_timeout, heartbeat_messages, read_buses, refuse_own_messages};
use command::{CommandProfileFile, command};
use hazard::{HazardFile, hazard};
use light_sources::faults;
use message::{MessageFile, messages};
use turn::{TurnFile, turn, while_hazard};
use v2i::{V2iFile, v2i};

/// A whole profile.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleFile {
    /// For people.
    pub name: String,
    /// Buses by name.
    #[serde(default)]
    pub bus: BTreeMap<Spanned<String>, BusFile>,
    /// Timing of bound messages by DBC name.
    #[serde(default)]
    pub message: BTreeMap<Spanned<String>, MessageFile>,
    /// Turn indicators; may be left out beside `v2i`.
    pub turn: Option<Spanned<TurnFile>>,
    /// Hazard lights; may be left out beside `v2i`.
    pub hazard: Option<Spanned<HazardFile>>,
    /// Traffic-light states from the network.
    #[serde(default)]
    pub v2i: Vec<Spanned<V2iFile>>,
    /// Commands to the vehicle.
    pub command: Option<Spanned<CommandProfileFile>>,
}

/// What a profile comes to.
#[derive(Debug)]
pub(super) struct Vehicle {
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
pub(super) struct VehicleBus {
    /// Name in the profile.
    pub name: String,
    /// Further messages that prove it alive.
    pub heartbeat_messages: Vec<CanId>,
    /// Longest silence while awake.
    pub alive_timeout: Duration,
    /// Whether the whole bus may fall asleep.
    pub may_sleep: bool,
    /// Path of its DBC.
    pub dbc_path: PathBuf,
    /// Its DBC.
    pub database: Database,
}

/// Compiles a profile.
///
/// # Errors
/// Every problem found, each with its place in `document`.
pub(super) fn compile(
    document: &Document,
    file: &VehicleFile,
    files: &dyn Files,
) -> Result<Vehicle, Vec<Problem>> {
    let buses = read_buses(document, files, &file.bus)?;
    let mut binder = Binder::new(document, &buses);
    let lights = lights(&mut binder, file);
    let light_signals = std::mem::take(&mut binder.signals);
    let sources = v2i(&mut binder, &file.v2i);
    let v2i_signals = std::mem::take(&mut binder.signals);
    let command = command(&mut binder, file.command.as_ref(), lights.as_ref().map(|lights| &lights.hazard));
    let command_signals = std::mem::take(&mut binder.signals);
    let heartbeat_messages: Vec<_> =
        buses.iter().map(|bus| heartbeat_messages(&mut binder, &file.bus, bus)).collect();
    if let Some(command) = &command {
        refuse_own_messages(&mut binder, &file.bus, &command.allowed);
    }
    let all_bound = lights.is_some() && sources.is_some() && command.is_some();
    let messages = messages(&mut binder, &file.message, &heartbeat_messages, all_bound);
    match (lights, sources, command, binder.checker.problems) {
        (Some(lights), Some(sources), Some(command), problems) if problems.is_empty() => {
            let lights = LightsBinding { table: table(&messages, light_signals), ..lights };
            let v2i = V2iBinding { table: table(&messages, v2i_signals), sources };
            let command = CommandBinding { table: table(&messages, command_signals), ..command };
            let limits: Vec<_> = buses.iter().map(|bus| alive_timeout(&file.bus, bus, &messages)).collect();
            let buses = buses.into_iter().zip(heartbeat_messages).zip(limits).map(
                |((bus, heartbeat_messages), limit)| VehicleBus {
                    alive_timeout: limit,
                    may_sleep: file.bus.get(bus.name.as_str()).is_some_and(|bus| bus.may_sleep),
                    heartbeat_messages,
                    dbc_path: bus.dbc_path.into(),
                    name: bus.name,
                    database: bus.database,
                },
            );
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
    let both_sides = hazard_file.is_some_and(HazardFile::is_from_both_sides);
    let turn_while_hazard = turn_file.map(|turn| while_hazard(binder, turn, both_sides));
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
