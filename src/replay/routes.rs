//! The assignment of a recording's interfaces to buses.

use std::path::Path;

use crate::core::can::BusIndex;
use crate::core::gateway::GatewaySettings;
use crate::io::can::log::Log;

/// The bus of each interface name of a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Routes(pub Vec<(String, BusIndex)>);

impl Routes {
    /// Returns each configured interface under its own name.
    pub fn by_interface(settings: &GatewaySettings) -> Self {
        let names = settings.buses.iter().map(|bus| bus.interface.clone());
        Self(names.zip((0..=u8::MAX).map(BusIndex)).collect())
    }

    /// Maps the only interface of the log to the only bus, whatever their names.
    pub fn adopt_only_interface(&mut self, log: &Path) {
        if let [(interface, _)] = self.0.as_mut_slice()
            && let [only] = Log::interfaces_in(log).as_slice()
            && only != interface
        {
            tracing::info!("the recording's {only} is taken for {interface}");
            interface.clone_from(only);
        }
    }

    /// Returns the bus of an interface name.
    pub fn bus_of(&self, interface: &str) -> Option<BusIndex> {
        self.0.iter().find(|(name, _)| name == interface).map(|(_, bus)| *bus)
    }
}
