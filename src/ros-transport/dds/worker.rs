//! The DDS worker: executes orders, forwards samples, and replaces a participant that cannot continue.

use std::io;
use std::sync::Arc;
use std::task::Waker;
use std::time::Duration;

use tokio::time::sleep;

use super::interfaces::Interfaces;
use super::participant::Participant;
use super::participants::Participants;
use super::pings::{Answer, Pings};
use super::topic_reader::TakenSample;
use super::watches::Watches;
use crate::distribution::DISTRO;
use crate::error::TransportError;
use crate::link::{FromNetwork, Link, LostLines, NetworkSettings, NetworkStatus, Order, Sample};
use crate::orders;
use crate::parameters::Parameters;
use crate::processor_wait::ProcessorWait;
use crate::rebuild_cause::{CAUSES, CauseRow, RebuildCause};
use crate::wakeup::Wakeup;

/// Longest sleep between two polls of the DDS events.
const TICK: Duration = Duration::from_millis(100);
/// Maximum number of bytes waiting for the gateway; further samples stay in RustDDS, up to the topic's depth.
const MAX_WAITING: usize = 256 * 1024;

pub(super) struct DdsWorker {
    settings: NetworkSettings,
    /// Ends the wait when something was received.
    received: Arc<Wakeup>,
    /// Ends the wait when there are discovery events.
    discovered: Arc<Wakeup>,
    participants: Participants,
    watches: Watches,
    pings: Pings,
    /// The current order of each written topic, except orders that are delivered once.
    current: Vec<Order>,
    /// Counts since the start; the other fields are not used.
    counts: NetworkStatus,
    /// Returns the losses of this process's log.
    log_losses: fn() -> LostLines,
    status: NetworkStatus,
    /// Last field: the gateway sees the link end only when everything else is gone.
    link: Link,
}

/// Returns the chosen causes, in the order in which they are observed.
fn causes(is_chosen: impl Fn(&CauseRow) -> bool) -> impl Iterator<Item = RebuildCause> {
    CAUSES.iter().filter(move |row| is_chosen(row)).map(|row| row.cause)
}

impl DdsWorker {
    /// Creates a network side that has joined the graph with these participants.
    pub(super) fn new(
        settings: NetworkSettings,
        participants: Participants,
        link: Link,
        log_losses: fn() -> LostLines,
        processor: ProcessorWait,
    ) -> Self {
        Self {
            received: Arc::default(),
            discovered: Arc::default(),
            watches: Watches::new(&participants, processor),
            participants,
            pings: Pings::new(settings.echo_is_proven),
            current: settings.written.iter().map(|_| Order::Withdraw).collect(),
            counts: NetworkStatus::default(),
            log_losses,
            status: NetworkStatus::default(),
            settings,
            link,
        }
    }

    /// Runs until the gateway orders to stop. Fails with the error of the link if its other end is gone.
    pub(super) async fn run(mut self) -> io::Result<()> {
        self.link.answer(&FromNetwork::Ready);
        self.link.flush()?;
        loop {
            let is_discovery_alone = tokio::select! {
                ready = self.link.ready() => ready.map(|()| false)?,
                () = self.received.arrived() => false,
                () = self.discovered.arrived() => self.watches.last_round.elapsed() < TICK,
                () = sleep(TICK) => false,
            };
            self.observe();
            if is_discovery_alone {
                continue;
            }
            self.watches.begin_round(&self.participants);
            if self.obey()? {
                return Ok(());
            }
            if let Some(announcer) = &self.participants.announcer {
                announcer.send_on(&self.participants.own);
            }
            self.receive();
            let waker = self.waker();
            for participant in self.participants.all_mut() {
                self.counts.unanswered_requests += participant.serve(&waker);
            }
            self.watch_graph();
            self.answer_ping();
            self.link.flush()?;
            for cause in causes(|row| !row.waits) {
                if self.observes(cause) {
                    self.rebuild(cause, &[cause]);
                }
            }
            if self.watches.check(&self.settings) {
                if self.participants.may_rebuild(&self.settings) {
                    self.rebuild_at_check();
                }
                // Called regularly, since it also writes the lines about omitted lines.
                self.counts.lost_lines = (self.log_losses)();
            }
            self.participants.retire();
            self.update_status();
            self.link.flush()?;
        }
    }

    fn waker(&self) -> Waker {
        Waker::from(Arc::clone(&self.received))
    }

    /// Handles the discovery events, and serves newly matched readers at once: a late reader must be served
    /// within milliseconds.
    fn observe(&mut self) {
        let waker = Waker::from(Arc::clone(&self.discovered));
        let Participants { current, own, .. } = &mut self.participants;
        let observed = current.observe(&waker, &mut self.watches.peers.missing, own);
        self.count_write_error(observed);
        let settled = self.participants.current.settle();
        self.count_write_error(settled);
    }

    /// Carries out the gateway's orders since the last call. Returns true if one of them is to stop.
    fn obey(&mut self) -> io::Result<bool> {
        let received = orders::receive(&mut self.link, &self.settings)?;
        if let Some(parameters) = received.parameters {
            self.set_parameters(parameters);
        }
        for number in received.pings {
            self.pings.asked(number, self.watches.last_round);
            let sent = self.participants.current.send_echo(number);
            self.count_write_error(sent);
        }
        for (topic, order) in received.orders {
            let position = usize::from(topic);
            let mut done = Ok(());
            for participant in self.participants.all_mut() {
                // Only our participant's errors count, which is the last.
                done = participant.carry_out(position, &order);
            }
            self.count_write_error(done);
            if let Some(current) = self.current.get_mut(position).filter(|_| self.settings.is_kept(topic)) {
                *current = order;
            }
        }
        Ok(received.stop)
    }

    /// Passes received samples to the gateway while the link accepts them. Predecessors come first; they read
    /// until our participant has discovered all writers.
    fn receive(&mut self) {
        let waker = self.waker();
        let Self { link, watches, .. } = self;
        let mut hand_over = |subscription: u16, taken: TakenSample| {
            match &taken {
                TakenSample::Sample(writer, number, encoded) => {
                    watches.writers.silent.heard((subscription, *writer), *number);
                    link.answer(&FromNetwork::Sample(Sample {
                        subscription,
                        writer: writer.to_bytes(),
                        number: *number,
                        endian: encoded.endian,
                        bytes: &encoded.bytes,
                    }))
                }
                TakenSample::Unreadable(reason) => {
                    link.answer(&FromNetwork::Unreadable(subscription, reason))
                }
            };
            link.waiting() < MAX_WAITING
        };
        let mut is_more = false;
        for participant in self.participants.all_mut() {
            is_more |= participant.take(&waker, &mut hand_over);
        }
        // A full link wakes the task when it has room again.
        if is_more && self.link.waiting() < MAX_WAITING {
            waker.wake();
        }
    }

    fn set_parameters(&mut self, parameters: Parameters) {
        for participant in self.participants.all_mut() {
            participant.set_parameters(&parameters);
        }
        self.settings.set_parameters(parameters);
    }

    /// Leaves the graph if the other nodes belong to another distribution.
    fn watch_graph(&mut self) {
        if self.participants.current.leave_other_graph(&self.waker()) {
            tracing::warn!(
                "the other nodes are of another distribution of ROS 2 than this build ({DISTRO}): this node leaves their graph; topics work"
            );
            // No other participant of ours enters it either.
            self.participants.all_mut().for_each(Participant::leave_graph);
            self.settings.graph = false;
            self.counts.has_left_graph = true;
        }
    }

    /// Answers pings if there are signs of life.
    fn answer_ping(&mut self) {
        let now = self.watches.last_round;
        let signs = self.participants.current.take_signs_of_life(&self.waker(), now);
        let has_network = || {
            let present = Interfaces::now(&self.settings.only_networks);
            present.is_none_or(|present| present.still_serves(&self.participants.interfaces))
        };
        if let Some(Answer { number, has_echo, is_heard }) = self.pings.answer(signs, now, has_network) {
            if has_echo {
                self.watches.writers.last_echo = Some(now);
            }
            self.link.answer(&FromNetwork::Pong { number, has_echo, is_heard });
        }
    }

    fn count_write_error(&mut self, written: Result<(), TransportError>) {
        if let Err(error) = written {
            if !self.watches.write_failed {
                tracing::warn!("RustDDS did not take a sample: {error}");
            }
            self.watches.write_failed = true;
            self.counts.write_errors += 1;
        }
    }

    fn observes(&mut self, cause: RebuildCause) -> bool {
        let waker = self.waker();
        self.watches.observe(cause, &self.settings, &waker, &mut self.participants)
    }

    /// Replaces the participant if a cause that waits for a check is observed, otherwise searches for missing
    /// peers.
    fn rebuild_at_check(&mut self) {
        let mut observed: Vec<_> = causes(|row| row.waits).collect();
        observed.retain(|cause| self.observes(*cause));
        match *observed {
            [first, ..] => self.rebuild(first, &observed),
            [] => self.watches.search_peers(&self.settings, &mut self.participants),
        }
    }

    /// Replaces the participant as this cause requires; the others were observed with it.
    fn rebuild(&mut self, cause: RebuildCause, observed: &[RebuildCause]) {
        let Self { settings, participants, watches, .. } = self;
        let Some((domain, interfaces)) = watches.successor(cause, settings, participants) else { return };
        match CAUSES.iter().find(|row| row.cause == cause).and_then(|row| row.log) {
            Some(text) => tracing::info!("{text}"),
            None => tracing::info!(causes = ?observed, "continuing with a new DDS participant"),
        }
        if let Some(done) = participants.replace(settings, domain, interfaces, &self.current) {
            watches.note_replaced();
            self.count_write_error(done);
            self.counts.rebuilds += 1;
        }
    }

    /// Sends changes of the status to the gateway.
    fn update_status(&mut self) {
        let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let Self { participants, watches, .. } = self;
        let current = &participants.current;
        let status = NetworkStatus {
            readers: current.readers().map(count).collect(),
            writers: current.writers().map(count).collect(),
            other_writers: current.other_writers().map(count).collect(),
            missing_peers: count(watches.peers.missing.len()),
            has_probe: watches.peers.probe.is_some(),
            participants: current.peers,
            unheard_writers: watches.writers.silent.unheard,
            ..self.counts.clone()
        };
        if status != self.status {
            self.link.answer(&FromNetwork::Status(status.clone()));
            self.status = status;
        }
    }
}
