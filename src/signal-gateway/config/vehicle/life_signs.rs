//! The messages that prove that the buses of a profile are alive.

use super::binder::Binder;
use can_signal::can::IdMatch;
use can_signal::validation::table::{BoundMessage, BoundSignal};

/// The messages that prove that the buses are alive, in the form of `GatewaySettings::life_signs`.
pub(super) struct LifeSigns<'h> {
    /// The further messages of each bus.
    pub(super) heartbeats: &'h [Vec<IdMatch>],
    /// Bus of each bound message; `None` for a message that proves nothing.
    buses: Vec<Option<usize>>,
}

impl<'h> LifeSigns<'h> {
    /// Selects the bound messages with one of the `carried` signals, and all messages of buses that have
    /// neither such a message nor a heartbeat.
    pub(super) fn new(
        binder: &Binder<'_>,
        carried: [&Vec<BoundSignal>; 3],
        heartbeats: &'h [Vec<IdMatch>],
    ) -> Self {
        let buses = binder.messages.iter().map(|(bus, _)| *bus);
        let is_carrier = |index| carried.into_iter().flatten().any(|signal| signal.message.0 == index);
        let carriers: Vec<_> =
            buses.clone().enumerate().map(|(index, bus)| is_carrier(index).then_some(bus)).collect();
        let is_alone = |bus: usize| heartbeats[bus].is_empty() && !carriers.contains(&Some(bus));
        let buses = buses.zip(&carriers).map(|(bus, carrier)| carrier.or(is_alone(bus).then_some(bus)));
        Self { heartbeats, buses: buses.collect() }
    }

    /// Returns true if a further message proves that the bus is alive, or a bound message whose position
    /// `accept` accepts.
    pub(super) fn prove(&self, bus: usize, accept: impl Fn(usize) -> bool) -> bool {
        let mut bound = self.buses.iter().enumerate();
        !self.heartbeats[bus].is_empty() || bound.any(|(index, of)| *of == Some(bus) && accept(index))
    }

    /// Returns the bound messages that prove that their bus is alive.
    pub(super) fn of<'m>(&self, bound: &'m [BoundMessage]) -> Vec<&'m BoundMessage> {
        bound.iter().zip(&self.buses).filter(|(_, bus)| bus.is_some()).map(|(message, _)| message).collect()
    }
}
