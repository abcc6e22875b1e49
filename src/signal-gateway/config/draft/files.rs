//! The files of a discovered vehicle: DBCs, profile and configuration.

use std::collections::BTreeMap;

use super::dbc::{DraftMessage, dbc_text};
use super::gateway::{BusInterface, gateway_toml};
use super::profile;
use super::vehicle::VehicleDraft;
use can_signal::can::BusIndex;
use vehicle_bringup::discovery::candidate::HazardForm;
use vehicle_bringup::discovery::capture::MessageKey;

/// Names and texts of files; the configuration is `gateway.toml`.
pub type VehicleFiles = Vec<(String, String)>;

impl VehicleDraft<'_> {
    /// Returns the files; `None` unless both sides are certain.
    pub fn files(&self) -> Option<VehicleFiles> {
        let turn = self.findings.turn.first().filter(|_| self.findings.is_usable())?;
        let hazard = self.findings.sure_hazard();
        let mut messages: BTreeMap<MessageKey, DraftMessage> = BTreeMap::new();
        self.add_turn(&mut messages, &turn.form);
        if let Some(HazardForm::Signal(switch) | HazardForm::Button(switch)) = hazard.map(|found| &found.form)
        {
            self.add(&mut messages, *switch, "HAZARD", ["off", "on"]);
        }
        self.add_protection(&mut messages);
        let heartbeats = self.add_heartbeats(&mut messages);
        let mut buses: Vec<_> = messages.keys().map(|key| key.bus).collect();
        buses.dedup();
        let stem = file_stem(self.name);
        let is_only = buses.len() == 1;
        let dbc_file = |bus: BusIndex| {
            if is_only { format!("{stem}.dbc") } else { format!("{stem}_{}.dbc", self.interface(bus)) }
        };
        let mut files = Vec::new();
        for bus in &buses {
            let of_bus = messages.iter().filter(|(key, _)| key.bus == *bus);
            let of_bus: Vec<_> = of_bus.map(|(_, message)| message.clone()).collect();
            files.push((dbc_file(*bus), dbc_text(&of_bus)));
        }
        let dbcs: Vec<_> = buses.iter().map(|bus| (self.interface(*bus), dbc_file(*bus))).collect();
        let profile_file = format!("{stem}.toml");
        let profile = profile::profile_toml(self, turn, hazard, &messages, &dbcs, &heartbeats);
        files.push((profile_file.clone(), profile));
        let bus = |bus: &BusIndex| {
            let interface = self.interface(*bus);
            BusInterface { bus: interface.clone(), interface }
        };
        let buses: Vec<_> = buses.iter().map(bus).collect();
        files.push(("gateway.toml".to_owned(), gateway_toml(&profile_file, &buses, None)));
        Some(files)
    }
}

/// Converts to a name that every file system accepts: `My car` becomes `my_car`.
fn file_stem(name: &str) -> String {
    let plain = |character: char| {
        if character.is_ascii_alphanumeric() { character.to_ascii_lowercase() } else { '_' }
    };
    let stem: String = name.chars().map(plain).collect();
    if stem.is_empty() { "vehicle".to_owned() } else { stem }
}
