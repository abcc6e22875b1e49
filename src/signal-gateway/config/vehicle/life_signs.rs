//! The messages that prove the buses of a profile alive.

use super::binder::Binder;
use can_signal::can::IdMatch;
use can_signal::validation::table::{BoundMessage, BoundSignal};

/// The messages that prove the buses alive, as `GatewaySettings::life_signs` has them.
pub(super) struct LifeSigns<'h> {
    /// The further messages of each bus.
    pub(super) heartbeats: &'h [Vec<IdMatch>],
    /// The bus of each bound message, `None` for one that proves nothing.
    buses: Vec<Option<usize>>,
}

impl<'h> LifeSigns<'h> {
    /// Bound messages with one of the signals that are `carried`, and all those of buses that have none of
    /// them and no heartbeat.
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

    /// True if a further message proves the bus alive, or a bound one that is accepted by its position.
    pub(super) fn prove(&self, bus: usize, accept: impl Fn(usize) -> bool) -> bool {
        let mut bound = self.buses.iter().enumerate();
        !self.heartbeats[bus].is_empty() || bound.any(|(index, of)| *of == Some(bus) && accept(index))
    }

    /// Those of the bound messages that prove their bus alive.
    pub(super) fn of<'m>(&self, bound: &'m [BoundMessage]) -> Vec<&'m BoundMessage> {
        bound.iter().zip(&self.buses).filter(|(_, bus)| bus.is_some()).map(|(message, _)| message).collect()
    }
}
