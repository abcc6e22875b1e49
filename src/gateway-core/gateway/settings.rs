//! Settings of the gateway, and the identifiers that they need from each bus.

use std::collections::BTreeSet;
use std::time::Duration;

use crate::command::settings::{CommandBinding, CommandSettings, Transmit};
use crate::v2i_reception::binding::V2iBinding;
use crate::vehicle_lights::binding::LightsBinding;
use crate::vehicle_report::Publish;
use crate::vehicle_status::binding::StatusBinding;
use crate::vehicle_status::settings::StatusSettings;
use can_signal::can::{BusIndex, BusSettings, IdMatch};
use traffic_lights::flow::LightsFlowSettings;
use turn_signal::flow::TurnSignalSettings;

/// Settings of the gateway, checked by `config`.
#[derive(Debug, Clone)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct GatewaySettings {
    /// ROS node name, the prefix of each diagnostic name.
    pub node: String,
    /// Buses, indexed by [`BusIndex`].
    pub buses: Vec<BusSettings>,
    pub lights: LightsBinding,
    pub status: StatusBinding,
    /// Configuration of the vehicle and of the reports on its status.
    pub status_settings: StatusSettings,
    /// Binding of the vehicle profile for traffic-light states from the network.
    pub v2i: V2iBinding,
    /// Traffic lights; without them, `v2i` is not used.
    pub traffic_lights: Option<LightsFlowSettings>,
    /// Turn signal decider; without it, its topics are not used.
    pub turn_signal: Option<TurnSignalSettings>,
    /// Commands to the vehicle, with the binding of the vehicle profile; `None` = no commands are accepted.
    pub command: Option<(CommandSettings, CommandBinding)>,
    pub publish: Publish,
    /// Interval at which all statuses are refreshed, at most 500 ms.
    pub diagnostics_period: Duration,
}

impl GatewaySettings {
    /// Returns these settings with commands as a dry run: no frame is sent to the vehicle.
    #[must_use]
    pub fn dry(mut self) -> Self {
        if let Some((settings, _)) = &mut self.command {
            settings.transmit = Transmit::Off;
        }
        self
    }

    /// Returns the names of the interfaces on which commands are sent, each once; none in a dry run.
    pub fn command_interfaces(&self) -> BTreeSet<&str> {
        let live = self.command.iter().filter(|(settings, _)| settings.transmit == Transmit::On);
        let entries = live.flat_map(|(_, binding)| binding.allowed.entries());
        entries.map(|(bus, _)| self.buses[usize::from(bus.0)].interface.as_str()).collect()
    }

    /// Returns the relevant identifiers of a bus, each match once: bound messages, heartbeat messages, and
    /// messages that only the gateway may send. All other frames can be filtered out in the kernel.
    pub fn relevant_ids(&self, bus: BusIndex) -> Vec<IdMatch> {
        let mut ids = self.proving_ids(bus);
        ids.extend(self.status_ids(bus));
        ids.sort_unstable();
        ids.dedup();
        ids
    }

    /// Returns the identifiers whose frames prove a bus alive. A message bound only for the vehicle's status
    /// counts only on a bus without other relevant messages, because it may come from a different control
    /// unit than the lights, whose event messages are valid while the bus is alive.
    pub fn life_signs(&self, bus: BusIndex) -> Vec<IdMatch> {
        let proving = self.proving_ids(bus);
        if proving.is_empty() { self.status_ids(bus).collect() } else { proving }
    }

    fn status_ids(&self, bus: BusIndex) -> impl Iterator<Item = IdMatch> + '_ {
        let bound = self.status.table.messages.iter().filter(move |message| message.bus == bus);
        bound.map(|message| message.ids)
    }

    /// Returns the relevant identifiers of a bus, except messages of the status.
    fn proving_ids(&self, bus: BusIndex) -> Vec<IdMatch> {
        let command = self.command.iter().map(|(_, binding)| binding);
        let bound = self.lights.table.messages.iter().chain(&self.v2i.table.messages);
        let bound = bound.chain(command.clone().flat_map(|binding| &binding.table.messages));
        let bound = bound.filter(|message| message.bus == bus).map(|message| message.ids);
        let ours = command.flat_map(|binding| binding.allowed.entries());
        let ours = ours.filter(|(there, _)| *there == bus).map(|(_, id)| (*id).into());
        let alive = self.buses[usize::from(bus.0)].heartbeat_messages.iter().copied();
        let required = self.lights.requirements.iter().filter(|required| required.bus == bus);
        let required = required.map(|required| required.ids);
        bound.chain(ours).chain(alive).chain(required).collect()
    }
}
