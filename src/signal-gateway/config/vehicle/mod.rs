//! Vehicle profiles, `config/vehicles/*.toml`: one source file per section, from names and raw values to
//! compiled bindings. `config/gateway.toml` explains every key.

mod arxml;
mod binder;
mod bus;
mod command;
mod hazard;
mod integrity;
mod life_signs;
mod light_sources;
mod message;
mod provenance;
mod raw_values;
mod requires;
mod status;
mod turn;
mod v2i;

use std::path::Path;

use super::built_in;
use super::file_kind::FileKind;
use super::files::Files;
use super::reading::{Checker, Fields, Problem, SourceLocation, Text, WrittenKey, flattened, from_toml};
use binder::Binder;
pub use binder::LoadedDbc;
use bus::{read_buses, start_timeout};
use can_signal::can::BusSettings;
use can_signal::validation::table::{BoundMessage, BoundSignal, MessageIndex, SignalTable};
use command::command;
use gateway_core::command::settings::CommandBinding;
use gateway_core::provenance::Provenance;
use gateway_core::v2i_reception::binding::V2iBinding;
use gateway_core::vehicle_lights::binding::{HazardBinding, LightsBinding, TurnBinding};
use gateway_core::vehicle_status::binding::StatusBinding;
use hazard::{hazard, is_from_both_sides};
use life_signs::LifeSigns;
use light_sources::faults;
use message::{BoundMessages, MessageSections};
use provenance::{BoundParts, provenance};
use requires::requires;
use status::status;
use turn::{turn, while_hazard};
pub(super) use v2i::LocatedId;
use v2i::v2i;

/// The document that explains the keys of profiles and of the gateway's file.
pub(super) const SEE: &str = "config/gateway.toml";

/// A vehicle profile, bound to its DBCs; without any lights by default.
#[derive(Debug, Default)]
pub(super) struct Vehicle {
    /// Name of the vehicle, for texts.
    pub name: String,
    /// Every key of the profile.
    pub keys: Vec<WrittenKey>,
    /// The profile's table; `None` for no vehicle.
    pub profile: Option<SourceLocation>,
    /// Buses without their interfaces, in the order of their names; `BusIndex` points here.
    pub buses: Vec<BusSettings>,
    pub dbcs: Vec<LoadedDbc>,
    pub lights: LightsBinding,
    pub status: StatusBinding,
    /// Binding of traffic-light states from the network; empty in most profiles.
    pub v2i: V2iBinding,
    /// The ids of these states, for checks against a map.
    pub v2i_ids: Vec<LocatedId>,
    /// Binding of commands; empty in many profiles.
    pub command: CommandBinding,
    /// The described vehicles, and the sources of its facts.
    pub provenance: Provenance,
}

impl Vehicle {
    /// Returns an empty profile for no vehicle, as on a bench.
    pub(super) fn none() -> Self {
        Self { name: "no vehicle".to_owned(), ..Self::default() }
    }

    /// Returns the place of a section of this profile that is missing, for refusals: e.g. `[command] of
    /// car.toml`.
    pub(super) fn place_of(&self, section: &str) -> String {
        let Some(SourceLocation { file, key, .. }) = &self.profile else {
            return format!("{section} of a vehicle profile");
        };
        if !key.is_empty() {
            let name = section.trim_start_matches('[');
            return format!("{}{key}.{name}", "[".repeat(section.len() - name.len()));
        }
        let copy = if built_in::project_path(file).is_some() { "a copy of the " } else { "" };
        format!("{section} of {copy}{}", built_in::display(file))
    }
}

/// Reads a profile from the bytes of its file, and passes its problems to `adopt`.
///
/// # Errors
/// Returns the names of the buses of a refused profile, ascending; `None` if the file is not TOML.
pub(super) fn read(
    files: &dyn Files,
    path: &Path,
    bytes: Vec<u8>,
    adopt: impl Fn(Vec<Problem>),
) -> Result<Vehicle, Option<Vec<String>>> {
    let text = FileKind::Profile.expect(path, &bytes).and_then(|()| Text::new(path, bytes));
    let root = text.and_then(|text| Ok((from_toml(&text, SEE)?, text)));
    let (root, text) = root.map_err(|problem| {
        adopt(vec![problem]);
        None
    })?;
    let checker = Checker::new(&text.file, SEE);
    let fields = Fields::of(&checker, &root);
    let buses = fields.as_ref().map(bus_names);
    let vehicle = fields.and_then(|fields| compile(files, fields));
    checker.finish(vehicle).map_err(|problems| {
        adopt(problems);
        buses
    })
}

/// Returns the names of the buses in a profile, ascending.
pub(super) fn bus_names(fields: &Fields<'_>) -> Vec<String> {
    let table = fields.value("bus").and_then(|value| Fields::of_table(fields.checker, value));
    let mut names: Vec<_> = table.iter().flat_map(Fields::keys).map(str::to_owned).collect();
    names.sort_unstable();
    names
}

/// Compiles a profile; `None` if a problem was recorded.
pub(super) fn compile(files: &dyn Files, fields: Fields<'_>) -> Option<Vehicle> {
    let checker = fields.checker;
    let before = checker.count();
    let profile = checker.source_location(fields.location());
    let (name, keys) = (fields.required_string("name"), flattened(&fields));
    let (dbcs, sections) = read_buses(files, &fields)?;
    let mut binder = Binder::new(checker, &dbcs);
    let lights = lights(&mut binder, &fields);
    let light_signals = std::mem::take(&mut binder.signals);
    let status = status(&mut binder, &fields);
    let status_signals = std::mem::take(&mut binder.signals);
    let (sources, v2i_ids) = v2i(&mut binder, &fields).unzip();
    let v2i_signals = std::mem::take(&mut binder.signals);
    let hazard = lights.as_ref().map(|lights| &lights.hazard);
    let command = command(&mut binder, fields.table("command"), hazard);
    let command_signals = std::mem::take(&mut binder.signals);
    let allowed = command.as_ref().map(|command| &command.allowed);
    let described = dbcs.iter().zip(&sections);
    let messages = MessageSections::read(&binder, &fields);
    let requirements = requires(&binder, &fields, &messages);
    let lights = lights.map(|lights| LightsBinding { requirements, ..lights });
    let heartbeats =
        described.map(|(dbc, section)| section.heartbeat_messages(&binder, dbc, allowed, &messages));
    let heartbeats: Vec<_> = heartbeats.collect();
    let all_bound = lights.is_some() && status.is_some() && sources.is_some() && command.is_some();
    let carriers = [&light_signals, &v2i_signals, &command_signals];
    let life_signs = LifeSigns::new(&binder, carriers, &heartbeats);
    let BoundMessages { all: messages, of_status } =
        messages.bind(&binder, &fields, &life_signs, allowed, all_bound);
    let parts = lights.as_ref().zip(status.as_ref()).zip(sources.as_ref()).zip(command.as_ref());
    let parts = parts.map(|(((lights, status), v2i), command)| BoundParts {
        lights,
        status,
        messages: &messages,
        dbcs: &dbcs,
        heartbeats: &heartbeats,
        v2i,
        command,
    });
    let provenance = provenance(&fields, parts.as_ref());
    fields.done();
    if checker.count() > before {
        return None;
    }
    let proving = life_signs.of(&messages);
    let required = &lights.as_ref()?.requirements;
    let described = dbcs.iter().zip(&sections).zip(heartbeats);
    let buses = described.map(|((dbc, section), heartbeats)| BusSettings {
        start_timeout: start_timeout(dbc.index, messages.iter().chain(&of_status), required),
        ..section.settings(dbc, heartbeats, &proving)
    });
    Some(Vehicle {
        name: name?.text,
        profile: Some(profile),
        keys,
        buses: buses.collect(),
        dbcs,
        lights: LightsBinding { table: table(&messages, light_signals), ..lights? },
        status: StatusBinding { table: table(&of_status, status_signals), ..status? },
        v2i: V2iBinding { table: table(&messages, v2i_signals), sources: sources? },
        v2i_ids: v2i_ids?,
        command: CommandBinding { table: table(&messages, command_signals), ..command? },
        provenance,
    })
}

/// Reads `[turn]` and `[hazard]` to a binding without messages and signals; `None` if a problem was recorded.
fn lights(binder: &mut Binder<'_>, top: &Fields<'_>) -> Option<LightsBinding> {
    // A profile that describes something else can leave the lights to another gateway.
    for key in ["turn", "hazard"].iter().filter(|key| !top.has("v2i") && !top.has(key)) {
        let remedy = "add the section, e.g. with fitted = false or from = \"not_visible\"";
        top.refuse(key, format!("missing section `{key}`"), remedy);
    }
    let before = binder.checker.count();
    let (turn_fields, hazard_fields) = (top.table("turn"), top.table("hazard"));
    let turn = match &turn_fields {
        Some(fields) => turn(binder, fields),
        None => Some(TurnBinding::LeftOut),
    };
    let hazard = match &hazard_fields {
        Some(fields) => hazard(binder, fields, turn.as_ref()),
        None => Some(HazardBinding::LeftOut),
    };
    let both_sides = hazard_fields.as_ref().is_some_and(is_from_both_sides);
    let turn_while_hazard = turn_fields.as_ref().map(|fields| while_hazard(fields, both_sides));
    let [turn_faults, hazard_faults] =
        [&turn_fields, &hazard_fields].map(|fields| fields.as_ref().map(|fields| faults(binder, fields)));
    for fields in [turn_fields, hazard_fields].into_iter().flatten() {
        fields.done();
    }
    if binder.checker.count() > before {
        return None;
    }
    Some(LightsBinding {
        table: SignalTable::default(),
        requirements: Vec::new(),
        turn: turn?,
        turn_faults: turn_faults.unwrap_or_default(),
        hazard: hazard?,
        hazard_faults: hazard_faults.unwrap_or_default(),
        turn_while_hazard: turn_while_hazard.unwrap_or_default(),
    })
}

/// Joins the signals with the `messages` that carry them.
fn table(messages: &[BoundMessage], mut signals: Vec<BoundSignal>) -> SignalTable {
    let mut carriers: Vec<_> = signals.iter().map(|signal| signal.message).collect();
    carriers.sort_unstable();
    carriers.dedup();
    for signal in &mut signals {
        // Every message is among the carriers.
        signal.message = MessageIndex(carriers.partition_point(|carrier| *carrier < signal.message));
    }
    let carriers = carriers.iter().filter_map(|carrier| messages.get(carrier.0));
    SignalTable { messages: carriers.cloned().collect(), signals }
}
