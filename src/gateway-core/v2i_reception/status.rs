//! Diagnostics of received traffic-light states, and what is received, for people and programs that monitor
//! the gateway.

use super::catalogue::{self, V2I_TRAFFIC_LIGHTS};
use super::{InvalidReason, State, V2iReception, ValidState};
use can_signal::can::Bus;
use can_signal::validation::display::raw_text;
use can_signal::validation::integrity::IntegrityCounts;
use can_signal::validation::snapshot::{Received, ReceivedSnapshot, UsedBy};
use can_signal::validation::table::MessageIndex;
use gateway_base::diagnostics::{MessagePart, Status};
use gateway_base::time::MonoTime;

impl V2iReception {
    /// Returns the diagnostic status of the reception.
    pub fn status(&self, buses: &[Bus], now: MonoTime) -> Status {
        let states: Vec<_> = self.states().collect();
        let known = states.iter().filter(|(_, state)| state.is_ok()).count();
        let bad = |(id, state): &(i64, State)| Some((*id, state.err().filter(|reason| reason.is_bad())?));
        let mut bad = states.iter().filter_map(bad);
        let message = match bad.next() {
            None => catalogue::known(known, states.len()),
            Some((id, reason)) => {
                let others = match bad.count() {
                    0 => String::new(),
                    others => format!(" (and {others} more)"),
                };
                let message =
                    self.invalid_message(reason, buses).within(|reason| catalogue::group(id, reason));
                message.with_text(|text| text + &others)
            }
        };
        let Self { binding, observations, .. } = self;
        let messages = (0..binding.table.messages.len()).map(MessageIndex);
        let frames: u64 = messages.clone().map(|message| observations.counts(message).frames).sum();
        let too_short: u64 = messages.clone().map(|message| observations.counts(message).too_short).sum();
        let checkers = messages.filter_map(|message| observations.integrity_counts(message));
        let newest = self.valid_states().map(|(_, state)| now.since(state.received.at)).min();
        // For example `34806: red solidOn circle` or `34806: V2X.GROUP1 is stale, …`.
        let text = |(id, state): &(i64, State)| match state {
            Ok(ValidState { bulbs, .. }) => format!("{id}: {bulbs}"),
            Err(reason) => format!("{id}: {}", self.invalid_message(*reason, buses).text),
        };
        let all: Vec<_> = states.iter().map(text).collect();
        let rejected: u64 = checkers.map(|counts| IntegrityCounts::rejected(&counts)).sum();
        let values = vec![
            ("groups", all.join("; ")),
            ("known_groups", known.to_string()),
            ("age_ms", newest.map_or("never".to_owned(), |age| age.as_millis().to_string())),
            ("frames", frames.to_string()),
            ("too_short_frames", too_short.to_string()),
            ("rejected_frames", rejected.to_string()),
            ("unmapped_count", self.counts.unmapped.to_string()),
            ("undefined_count", self.counts.undefined.to_string()),
        ];
        Status::new(&V2I_TRAFFIC_LIGHTS, "v2i_traffic_lights", &[message], values)
    }

    /// Returns the signals and messages of the V2X unit.
    pub fn received_snapshot(&self, buses: &[Bus], now: MonoTime) -> ReceivedSnapshot {
        let Self { binding, observations, .. } = self;
        let received = Received { used_by: UsedBy::V2i, table: &binding.table, observations, buses };
        received.snapshot(now, |_, _| Vec::new())
    }

    fn invalid_message(&self, reason: InvalidReason, buses: &[Bus]) -> MessagePart {
        let table = &self.binding().table;
        match reason {
            InvalidReason::Signal(reason) => reason.message(table, buses),
            InvalidReason::NotReceived => catalogue::not_received(),
            InvalidReason::NotReceivedAgain => catalogue::not_received_again(),
            InvalidReason::StatesUnusable(signal, raw) => {
                catalogue::states_unusable(&table.signals[signal.0].name, raw_text(raw))
            }
        }
    }
}
