//! What the caller sees of the network side: its status.

use std::time::{Duration, Instant};

use super::{Active, Exchange, Phase};
use crate::core::gateway::network::NetworkState;
use crate::core::gateway::process_status::LostLines;
use crate::io::ros::link::NetworkStatus;

/// Time after which age and memory are noted again.
const NOTE_INTERVAL: Duration = Duration::from_secs(1);

impl Exchange {
    /// Shows the status to the caller, with the state when it has changed or is due.
    pub(super) fn show(&mut self, now: Instant) {
        self.unended.retain_mut(|host| host.end().is_none());
        let none = NetworkStatus::default();
        let (seen, joined) = match &self.phase {
            Phase::Active(active) => (&active.status, active.joined),
            Phase::Ending { .. } | Phase::Down { .. } | Phase::Refused => (&none, None),
        };
        let is_due = self.noted.as_ref().is_none_or(|(noted, at)| {
            let NetworkState { is_up, has_echo, restarts, last_failure, .. } = noted;
            now.duration_since(*at) >= NOTE_INTERVAL
                || (is_up, has_echo) != (&self.state.is_up, &self.state.has_echo)
                || (restarts, last_failure) != (&self.state.restarts, &self.state.last_failure)
        });
        if is_due {
            self.state.age = joined.map(|joined| now.saturating_duration_since(joined));
            let active = match &self.phase {
                Phase::Active(active) => Some(active),
                Phase::Ending { .. } | Phase::Down { .. } | Phase::Refused => None,
            };
            let lost_lines = active.map(|active| active.lost_lines()).unwrap_or_default();
            self.state.memory_bytes = active.and_then(|active| active.host.memory_bytes());
            self.state.confinement = active.and_then(|active| active.host.confinement());
            self.state.links = self.state.links.as_ref().map(|_| seen.links.clone().unwrap_or_default());
            self.state.has_other_graph = seen.has_left_graph || self.has_other_distribution;
            self.state.lost_lines = self.lost_lines.plus(lost_lines);
            self.noted = Some((self.state.clone(), now));
        }
        let count = |count: u32| usize::try_from(count).unwrap_or(usize::MAX);
        self.mailbox.update_status(|status| {
            for (index, outgoing) in status.outgoing.iter_mut().enumerate() {
                outgoing.readers = seen.readers.get(index).copied().map_or(0, count);
            }
            for (shown, incoming) in status.incoming.iter_mut().zip(self.reception.statuses()) {
                shown.clone_from(incoming);
            }
            status.missing_peers = count(seen.missing_peers);
            status.has_probe = seen.has_probe;
            status.rebuilds = seen.rebuilds;
            status.unanswered_requests = seen.unanswered_requests;
            status.write_errors = seen.write_errors.saturating_add(self.send_errors);
            if is_due {
                status.network.clone_from(&self.state);
            }
        });
    }
}

impl Active {
    /// Log lines that it did not write; none of a thread, whose log is that of this process.
    pub(super) fn lost_lines(&self) -> LostLines {
        if self.host.is_isolated() { self.status.lost_lines } else { LostLines::default() }
    }
}
