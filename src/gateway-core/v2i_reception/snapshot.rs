//! What was received of a V2X unit, for people and programs that watch the gateway.

use super::V2iReception;
use can_signal::can::Bus;
use can_signal::validation::snapshot::{MessageSnapshot, Received, SignalSnapshot, UsedBy};
use gateway_base::time::MonoTime;

impl V2iReception {
    /// Returns the signals and messages of the V2X unit.
    pub fn received_snapshot(
        &self,
        buses: &[Bus],
        now: MonoTime,
    ) -> (Vec<SignalSnapshot>, Vec<MessageSnapshot>) {
        let Self { binding, observations, .. } = self;
        let received = Received { used_by: UsedBy::V2i, table: &binding.table, observations, buses };
        (received.signals(now, |_, _| Vec::new()).collect(), received.messages().collect())
    }
}
