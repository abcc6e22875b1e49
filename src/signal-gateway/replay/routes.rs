//! The assignment of a recording's interfaces to buses.

use std::path::Path;

use crate::io::mcap::encoder::topic_token;
use can_log::Log;
use can_signal::can::BusIndex;
use gateway_core::gateway::GatewaySettings;

/// The bus of each interface name of a recording.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Routes(pub Vec<(String, BusIndex)>);

impl Routes {
    /// Maps each configured interface by its name, and by that of its bus, as in the gateway's recordings.
    pub fn by_interface(settings: &GatewaySettings) -> Self {
        let buses = || settings.buses.iter().zip((0..=u8::MAX).map(BusIndex));
        let interfaces = buses().map(|(bus, index)| (bus.interface.clone(), index));
        let names = buses().map(|(bus, index)| (topic_token(&bus.name), index));
        Self(interfaces.chain(names).collect())
    }

    /// Maps the only interface of the log to the only bus, whatever their names.
    pub fn adopt_only_interface(&mut self, log: &Path) {
        if let Some((interface, BusIndex(0))) = self.0.first()
            && self.0.iter().all(|(_, bus)| *bus == BusIndex(0))
            && let [only] = Log::interfaces_in(log).as_slice()
            && self.bus_of(only).is_none()
        {
            tracing::info!("the recording's {only} is taken for {interface}");
            self.0.push((only.clone(), BusIndex(0)));
        }
    }

    /// Returns the bus of an interface name.
    pub fn bus_of(&self, interface: &str) -> Option<BusIndex> {
        self.0.iter().find(|(name, _)| name == interface).map(|(_, bus)| *bus)
    }
}
