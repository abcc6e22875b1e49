//! The files of a discovered vehicle: DBCs, profile and configuration.

use std::collections::BTreeMap;

use super::dbc::dbc_text;
use super::gateway::{BusInterface, gateway_toml};
use super::profile::{DraftBus, profile_toml};
use super::vehicle::{DraftMessages, VehicleDraft};
use vehicle_bringup::discovery::candidate::HazardForm;

/// Names and texts of files; the configuration is `gateway.toml`.
pub type VehicleFiles = Vec<(String, String)>;

impl VehicleDraft<'_> {
    /// Returns the files; `None` unless both sides are certain.
    pub fn files(&self) -> Option<VehicleFiles> {
        let turn = self.findings.turn.first().filter(|_| self.findings.is_usable())?;
        let hazard = self.findings.sure_hazard();
        let mut messages = DraftMessages { vehicle: self, messages: BTreeMap::new() };
        messages.add_turn(&turn.form);
        if let Some(HazardForm::Signal(switch) | HazardForm::Button(switch)) = hazard.map(|found| &found.form)
        {
            messages.add_switch(*switch, "HAZARD");
        }
        messages.add_protection();
        let mut heartbeats = messages.add_heartbeats();
        let mut indices: Vec<_> = messages.messages.keys().map(|key| key.bus).collect();
        indices.dedup();
        let stem = file_stem(self.name);
        let (mut files, mut buses, mut interfaces) = (Vec::new(), Vec::new(), Vec::new());
        for index in &indices {
            let interface = self.interface(*index);
            let dbc = match indices.len() {
                1 => format!("{stem}.dbc"),
                _ => format!("{stem}_{interface}.dbc"),
            };
            let of_bus = messages.messages.iter().filter(|(key, _)| key.bus == *index);
            let of_bus: Vec<_> = of_bus.map(|(_, message)| message.clone()).collect();
            files.push((dbc.clone(), dbc_text(&of_bus)));
            interfaces.push(BusInterface { bus: interface.clone(), interface: interface.clone() });
            buses.push(DraftBus { name: interface, dbc, heartbeat: heartbeats.remove(index) });
        }
        let profile_file = format!("{stem}.toml");
        files.push((profile_file.clone(), profile_toml(&messages, turn, hazard, &buses)));
        files.push(("gateway.toml".to_owned(), gateway_toml(&profile_file, &interfaces, None)));
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
