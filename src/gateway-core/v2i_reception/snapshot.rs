//! Signals and messages received from a V2X unit, for people and programs that monitor the gateway.

use super::V2iReception;
use can_signal::can::Bus;
use can_signal::validation::snapshot::{Received, ReceivedSnapshot, UsedBy};
use gateway_base::time::MonoTime;

impl V2iReception {
    /// Returns the signals and messages of the V2X unit.
    pub fn received_snapshot(&self, buses: &[Bus], now: MonoTime) -> ReceivedSnapshot {
        let Self { binding, observations, .. } = self;
        let received = Received { used_by: UsedBy::V2i, table: &binding.table, observations, buses };
        received.snapshot(now, |_, _| Vec::new())
    }
}
