//! The network side as visible to the caller: status and current load.

use std::time::{Duration, Instant};

use super::{Active, Exchange, NetworkPhase};
use crate::io::ros::reception::TakenAnew;
use crate::io::ros::session::crowd::MAX_PEERS;
use crate::process_status::network::{Burden, NetworkState, SharedTopic};
use ros_transport::link::{LostLines, NetworkStatus};

/// Interval at which age and memory are recorded.
const NOTE_INTERVAL: Duration = Duration::from_secs(1);
/// Time for which a restart counts as recent.
const RECENT: Duration = Duration::from_secs(60);

impl Exchange {
    /// Updates the status that the caller sees, including the state if it has changed or is due.
    pub(super) fn show(&mut self, now: Instant) {
        self.unended.retain_mut(|host| host.end().is_none());
        let is_due = self.noted.as_ref().is_none_or(|(noted, at)| {
            let NetworkState { is_up, has_echo, restarts, last_failure, .. } = noted;
            now.duration_since(*at) >= NOTE_INTERVAL
                || (is_up, has_echo) != (&self.state.is_up, &self.state.has_echo)
                || (restarts, last_failure) != (&self.state.restarts, &self.state.last_failure)
        });
        let active = if let NetworkPhase::Active(active) = &self.phase { Some(active) } else { None };
        let none = NetworkStatus::default();
        let (seen, joined) = active.map_or((&none, None), |active| (&active.status, active.joined));
        if is_due {
            self.state.age = joined.map(|joined| now.saturating_duration_since(joined));
            self.state.peers = seen.peers();
            let reading = active.map(|active| active.host.look()).unwrap_or_default();
            self.state.processor_percent = self.processor.look(reading.threads, now);
            self.state.memory_bytes = reading.memory_bytes;
            let burdens = [
                (active.is_some_and(|active| !active.liveness.is_heard()), Burden::Unheard),
                (self.state.peers >= MAX_PEERS, Burden::Crowd),
                (self.processor.is_busy(), Burden::Busy),
            ];
            self.state.burden = burdens.into_iter().find_map(|(is_there, burden)| is_there.then_some(burden));
            let TakenAnew { count, last } = self.reception.taken_anew;
            self.state.taken_anew = count;
            self.state.since_taken_anew = last.map(|last| now.saturating_duration_since(last));
            self.ends.retain(|end| now.saturating_duration_since(*end) < RECENT);
            self.state.recent_ends = self.ends.len();
            let lost_lines = active.map(|active| active.lost_lines()).unwrap_or_default();
            self.state.confinement = active.and_then(|active| active.host.confinement());
            self.state.links = self.state.links.as_ref().map(|_| seen.links.clone().unwrap_or_default());
            self.state.has_other_graph = seen.has_left_graph || self.has_other_distribution;
            self.state.lost_lines = self.lost_lines.plus(lost_lines);
            self.noted = Some((self.state.clone(), now));
        }
        let count = |counts: &[u32], index| counts.get(index).copied().map_or(0, u64::from);
        self.mailbox.update_status(|status| {
            for (index, outgoing) in status.outgoing.iter_mut().enumerate() {
                outgoing.peers = count(&seen.readers, index);
                outgoing.other_writers = count(&seen.other_writers, index);
            }
            for (shown, incoming) in status.incoming.iter_mut().zip(self.reception.statuses()) {
                shown.clone_from(incoming);
            }
            // Seldom: a copy has lists, and the caller waits for this lock.
            if status.seen != *seen {
                status.seen.clone_from(seen);
            }
            status.send_errors = self.send_errors;
            if is_due {
                status.network.clone_from(&self.state);
            }
            let written = status.outgoing.iter().zip(&self.table);
            let shared = written.filter(|(topic, outgoing)| outgoing.is_report() && topic.other_writers > 0);
            let shared = shared.map(|(topic, _)| SharedTopic {
                name: topic.name.clone(),
                other_writers: topic.other_writers,
            });
            status.network.shared_topics = shared.collect();
        });
    }
}

impl Active {
    /// Returns the number of log lines that the network side lost; 0 for a thread, which shares the log of
    /// this process.
    pub(super) fn lost_lines(&self) -> LostLines {
        if self.host.is_isolated() { self.status.lost_lines } else { LostLines::default() }
    }

    /// Writes the pending messages, and reads until the other end is closed.
    pub(super) async fn end(&mut self) {
        while self.link.flush().is_ok() && self.link.read().is_ok() {
            // Its remaining messages are not needed.
            while let Ok(Some(_)) = self.link.next_frame() {}
            if self.link.ready().await.is_err() {
                return;
            }
        }
    }
}
