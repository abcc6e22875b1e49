//! The DDS worker: executes orders, forwards samples, and replaces a participant that cannot continue.

use std::io;
use std::sync::Arc;
use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::RTPSEntity;
use tokio::time::sleep;

use super::ack_timeout::AckTimeout;
use super::discovery_probe::{DiscoveryProbe, MissingPeers, Prefix, ProbeResult, prefix};
use super::interfaces::Interfaces;
use super::joining::JoinedParticipant;
use super::loopback_announcer::LoopbackAnnouncer;
use super::participant::{Participant, participant};
use super::pings::{Answer, Pings};
use super::set_back::SetBack;
use super::silence_probe::SilenceProbe;
use super::silent_writers::SilentWriters;
use super::topic_reader::TakenSample;
use crate::distribution::DISTRO;
use crate::link::LostLines;
use crate::link::{FromNetwork, Link, NetworkSettings, NetworkStatus, Order, Sample};
use crate::orders;
use crate::parameters::Parameters;
use crate::wakeup::Wakeup;

/// Longest sleep between two polls of the DDS events.
const TICK: Duration = Duration::from_millis(100);
/// Minimum time for which a replaced participant remains next to its successor.
const OVERLAP: Duration = Duration::from_secs(1);
/// Maximum such time, if some of its readers have not found the successor: without multicast Cyclone polls a
/// silent port every 30 s.
const MAX_OVERLAP: Duration = Duration::from_secs(35);
/// Maximum number of replaced participants at the same time; usually few, since most leave within a second.
const MAX_PREDECESSORS: usize = 3;
/// Number of replaced writers after which a participant is itself replaced, see
/// [`Participant::replaced_writers`].
const MAX_REPLACED_WRITERS: u32 = 1000;
/// A longer round means that the process was stopped, and that peers may have given up its participant for
/// good.
const STANDSTILL: Duration = Duration::from_secs(2);
/// Time since the last echo after which readers may no longer receive.
const ECHO_MISSED: Duration = Duration::from_millis(600);
/// Maximum number of own participants that are remembered; those of the last lease (50 s) would suffice.
const MAX_OWN: usize = 32;
/// Maximum number of bytes waiting for the gateway; further samples stay in RustDDS, up to the topic's depth.
const MAX_WAITING: usize = 256 * 1024;

/// State of the network side.
#[allow(clippy::struct_excessive_bools)] // each by itself
pub(super) struct DdsWorker {
    settings: NetworkSettings,
    /// Ends the wait when something was received.
    wakeup: Arc<Wakeup>,
    waker: Waker,
    /// Ends the wait when there are discovery events.
    discovered: Arc<Wakeup>,
    participant: Participant,
    /// `None` where the loopback is not used.
    announcer: Option<LoopbackAnnouncer>,
    /// Replaced participants, oldest first, each with the time of its replacement.
    predecessors: Vec<(Participant, Instant)>,
    /// The probe, with the interfaces at its creation.
    probe: Option<(DiscoveryProbe, Interfaces)>,
    missing: MissingPeers,
    /// Our own participants, present or gone, which never count as missing.
    own: Vec<Prefix>,
    /// The interfaces at the creation of our participant.
    interfaces: Interfaces,
    /// The interfaces at the last check.
    last_interfaces: Interfaces,
    last_slow: Instant,
    last_made: Instant,
    ack_timeout: AckTimeout,
    last_round: Instant,
    stood_still: bool,
    wall_clock: SetBack,
    silent_writers: SilentWriters,
    /// Present while writers are suspected.
    silence_probe: Option<SilenceProbe>,
    /// Time of the last echo.
    last_echo: Option<Instant>,
    /// Samples received outside our participant since the last answer to a ping.
    witnessed: u64,
    write_failed: bool,
    /// The current order of each written topic, except orders that are delivered once.
    current: Vec<Order>,
    pings: Pings,
    rebuilds: u32,
    write_errors: u64,
    unanswered_requests: u64,
    /// Returns the losses of this process's log.
    log_losses: fn() -> LostLines,
    lost_lines: LostLines,
    /// The last status sent.
    status: NetworkStatus,
    /// True once it has left the graph of another distribution.
    has_left_graph: bool,
    /// Last field: the gateway sees the link end only when everything else is gone.
    link: Link,
}

impl DdsWorker {
    /// Creates a network side that has joined the graph with this participant.
    pub(super) fn new(
        settings: NetworkSettings,
        joined: JoinedParticipant,
        link: Link,
        log_losses: fn() -> LostLines,
    ) -> Self {
        let JoinedParticipant { participant, interfaces, announcer } = joined;
        let wakeup = Arc::new(Wakeup::default());
        let now = Instant::now();
        Self {
            link,
            waker: Waker::from(Arc::clone(&wakeup)),
            wakeup,
            discovered: Arc::new(Wakeup::default()),
            predecessors: Vec::new(),
            probe: None,
            missing: MissingPeers::default(),
            own: vec![participant.prefix()],
            participant,
            announcer,
            last_interfaces: interfaces.clone(),
            interfaces,
            last_slow: now,
            last_made: now,
            ack_timeout: AckTimeout::default(),
            last_round: now,
            stood_still: false,
            wall_clock: SetBack::watch(),
            silent_writers: SilentWriters::new(now),
            silence_probe: None,
            last_echo: None,
            witnessed: 0,
            write_failed: false,
            current: settings.written.iter().map(|_| Order::Withdraw).collect(),
            pings: Pings::new(settings.echo_is_proven),
            rebuilds: 0,
            write_errors: 0,
            unanswered_requests: 0,
            log_losses,
            lost_lines: LostLines::default(),
            status: NetworkStatus::default(),
            has_left_graph: false,
            settings,
        }
    }

    /// Runs until the gateway orders to stop. Fails with the error of the link if its other end is gone.
    pub(super) async fn run(mut self) -> io::Result<()> {
        self.link.answer(&FromNetwork::Ready);
        self.link.flush()?;
        loop {
            let is_discovery_alone = tokio::select! {
                ready = self.link.ready() => ready.map(|()| false)?,
                () = self.wakeup.arrived() => false,
                () = self.discovered.arrived() => self.last_round.elapsed() < TICK,
                () = sleep(TICK) => false,
            };
            self.observe();
            if is_discovery_alone {
                continue;
            }
            let now = Instant::now();
            // Creating a participant may take as long.
            let made_one = self.last_made >= self.last_round;
            self.stood_still |= !made_one && now.duration_since(self.last_round) > STANDSTILL;
            self.last_round = now;
            if self.obey()? {
                return Ok(());
            }
            if let Some(announcer) = &self.announcer {
                announcer.send_on(&self.own);
            }
            self.receive();
            self.serve();
            self.watch_graph();
            self.answer_ping();
            self.link.flush()?;
            self.probe_discovery();
            self.follow_wall_clock();
            self.follow_silent_writers();
            if self.last_slow.elapsed() >= self.settings.recovery.check_interval {
                self.last_slow = Instant::now();
                self.check_network();
                // Called regularly, since it also writes the lines about omitted lines.
                self.lost_lines = (self.log_losses)();
            }
            self.retire();
            self.update_status();
            self.link.flush()?;
        }
    }

    /// Handles the discovery events, and serves newly matched readers at once: a late reader must be served
    /// within milliseconds.
    fn observe(&mut self) {
        let waker = Waker::from(Arc::clone(&self.discovered));
        let observed = self.participant.observe(&waker, &mut self.missing, &self.own);
        self.count_write_error(observed);
        let settled = self.participant.settle();
        self.count_write_error(settled);
    }

    /// Carries out the gateway's orders since the last call. Returns true if one of them is to stop.
    fn obey(&mut self) -> io::Result<bool> {
        let received = orders::receive(&mut self.link, &self.settings)?;
        if let Some(parameters) = received.parameters {
            self.set_parameters(parameters);
        }
        for number in received.pings {
            self.pings.asked(number, self.last_round);
            let sent = self.participant.send_echo(number);
            self.count_write_error(sent);
        }
        for (topic, order) in received.orders {
            let position = usize::from(topic);
            self.each(|participant| participant.carry_out(position, &order));
            if let Some(current) = self.current.get_mut(position).filter(|_| self.settings.is_kept(topic)) {
                *current = order;
            }
        }
        Ok(received.stop)
    }

    /// Drops each predecessor once all its peers have discovered our participant too.
    fn retire(&mut self) {
        let Self { participant, predecessors, own, .. } = self;
        predecessors.retain_mut(|(predecessor, since)| {
            // Peers that it loses are not missing: our participant has discovered them or never will. It is
            // polled, since it leaves soon; its errors do not matter.
            let _ = predecessor.observe(Waker::noop(), &mut MissingPeers::default(), own);
            let overlap = since.elapsed();
            overlap < OVERLAP || (overlap < MAX_OVERLAP && !participant.serves_all_of(predecessor))
        });
    }

    /// Passes received samples to the gateway while the link accepts them. Predecessors come first; they read
    /// until our participant has discovered all writers.
    fn receive(&mut self) {
        let Self { link, waker, silent_writers, .. } = self;
        let mut hand_over = |subscription: u16, taken: TakenSample| {
            if let TakenSample::Sample(writer, number, _) = &taken {
                silent_writers.heard((subscription, *writer), *number);
            }
            match &taken {
                TakenSample::Sample(writer, number, encoded) => link.answer(&FromNetwork::Sample(Sample {
                    subscription,
                    writer: writer.to_bytes(),
                    number: *number,
                    encoding: encoded.encoding,
                    bytes: &encoded.bytes,
                })),
                TakenSample::Unreadable(reason) => {
                    link.answer(&FromNetwork::Unreadable(subscription, reason))
                }
            };
            link.waiting() < MAX_WAITING
        };
        let mut is_more = false;
        for (predecessor, _) in &self.predecessors {
            is_more |= predecessor.take(waker, &mut hand_over);
        }
        is_more |= self.participant.take(waker, &mut hand_over);
        // A full link wakes the task when it has room again.
        if is_more && self.link.waiting() < MAX_WAITING {
            self.waker.wake_by_ref();
        }
    }

    fn set_parameters(&mut self, parameters: Parameters) {
        let participants = self.predecessors.iter_mut().map(|(predecessor, _)| predecessor);
        for participant in participants.chain([&mut self.participant]) {
            participant.set_parameters(&parameters);
        }
        self.settings.set_parameters(parameters);
    }

    /// Answers requests to the node's services.
    fn serve(&mut self) {
        let participants = self.predecessors.iter_mut().map(|(predecessor, _)| predecessor);
        for participant in participants.chain([&mut self.participant]) {
            self.unanswered_requests += participant.serve(&self.waker);
        }
    }

    /// Leaves the graph if the other nodes belong to another distribution.
    fn watch_graph(&mut self) {
        if self.participant.leave_other_graph(&self.waker) {
            tracing::warn!(
                "the other nodes are of another distribution of ROS 2 than this build ({DISTRO}): this node leaves their graph; topics work"
            );
            // No other participant of ours enters it either.
            self.predecessors.iter_mut().for_each(|(predecessor, _)| predecessor.leave_graph());
            self.settings.graph = false;
            self.has_left_graph = true;
        }
    }

    /// Answers pings if there are signs of life.
    fn answer_ping(&mut self) {
        let signs = self.participant.take_signs_of_life(&self.waker, self.last_round);
        self.witnessed = self.witnessed.saturating_add(signs.witnessed);
        let has_network = || {
            let now = Interfaces::now(&self.settings.only_networks);
            now.is_none_or(|now| now.still_serves(&self.interfaces))
        };
        if let Some(Answer { number, has_echo }) = self.pings.answer(signs, self.last_round, has_network) {
            self.last_echo = if has_echo { Some(self.last_round) } else { self.last_echo };
            let is_heard = std::mem::take(&mut self.witnessed) > 0;
            self.link.answer(&FromNetwork::Pong { number, has_echo, is_heard });
        }
    }

    /// Calls `act` for our participant and its predecessors, since some readers know only one of them.
    fn each(&mut self, mut act: impl FnMut(&mut Participant) -> Result<(), String>) {
        for (predecessor, _) in &mut self.predecessors {
            let _ = act(predecessor);
        }
        let done = act(&mut self.participant);
        self.count_write_error(done);
    }

    fn count_write_error(&mut self, written: Result<(), String>) {
        if let Err(error) = written {
            if !self.write_failed {
                tracing::warn!("RustDDS did not take a sample: {error}");
            }
            self.write_failed = true;
            self.write_errors += 1;
        }
    }

    /// Searches for missing peers, and moves to the probe if it has found one.
    fn probe_discovery(&mut self) {
        let Some((probe, _)) = &self.probe else { return };
        match probe.poll(&self.missing) {
            ProbeResult::NoneFound => {}
            ProbeResult::PeerLost => self.probe = None,
            ProbeResult::PeerFound => {
                if let Some((probe, interfaces)) = self.probe.take() {
                    tracing::info!("a DDS peer is back after an outage: continuing with a new participant");
                    self.replace(probe.into_participant(), interfaces);
                }
            }
        }
    }

    /// Replaces the participant at once when the wall clock was set back: see [`SetBack`].
    fn follow_wall_clock(&mut self) {
        if self.wall_clock.is_to_follow()
            && let Some(participant) = self.make()
        {
            tracing::info!("the wall clock was set back: continuing with a new DDS participant");
            self.wall_clock.note_followed();
            self.replace(participant, self.last_interfaces.clone());
        }
    }

    /// Replaces the participant if writers that sent regularly are no longer received: see [`SilentWriters`].
    fn follow_silent_writers(&mut self) {
        self.suspect_writers();
        let Self { silence_probe, silent_writers, waker, last_round, .. } = self;
        let Some(probe) = silence_probe else { return };
        let mut is_one_unheard = false;
        probe.take(waker, |writer, number| is_one_unheard |= silent_writers.heard_elsewhere(&writer, number));
        if !is_one_unheard && silent_writers.is_any_suspected() && !probe.is_over(*last_round) {
            return;
        }
        let probe = silence_probe.take();
        if !is_one_unheard {
            silent_writers.acquit();
        } else if let Some(probe) = probe {
            tracing::info!(
                "a writer is not heard any more, but sends: continuing with a new DDS participant"
            );
            self.replace(probe.into_participant(), self.last_interfaces.clone());
        }
    }

    fn suspect_writers(&mut self) {
        let Self { participant, predecessors, silence_probe, last_round, last_echo, .. } = self;
        let hears_itself = last_echo.is_none_or(|at| last_round.saturating_duration_since(at) < ECHO_MISSED);
        let may_suspect = hears_itself && predecessors.is_empty() && silence_probe.is_none();
        let is_there = |writer: &_| participant.reads(writer);
        let suspected = self.silent_writers.look(*last_round, may_suspect, is_there);
        if !suspected.is_empty()
            && let Some(domain) = self.make()
        {
            let probe = SilenceProbe::new(&self.settings, domain, &suspected, self.last_round);
            self.silence_probe = probe.inspect_err(|why| tracing::warn!("no probe of silence: {why}")).ok();
        }
    }

    /// Checks the interfaces, the probe, and whether our participant still works.
    fn check_network(&mut self) {
        self.missing.give_up(Instant::now());
        let now =
            Interfaces::now(&self.settings.only_networks).unwrap_or_else(|| self.last_interfaces.clone());
        let link_came_up = now.has_new_link_since(&self.last_interfaces);
        // An address counts once it was present at two checks, since interfaces get their addresses one by
        // one.
        let settled = now == self.last_interfaces;
        self.last_interfaces = now;
        if self.missing.len() == 0 || link_came_up {
            self.probe = None;
        }
        if self.last_made.elapsed() < self.settings.recovery.min_rebuild_interval {
            return;
        }
        let new_address = settled && self.last_interfaces.has_new_address_since(&self.interfaces);
        let readers = self.participant.readers().sum();
        let unacknowledged =
            self.ack_timeout.observe(self.participant.is_acknowledged(), readers, Instant::now());
        let (write_failed, stood_still) = (self.write_failed, self.stood_still);
        let worn_out = self.participant.replaced_writers >= MAX_REPLACED_WRITERS;
        if new_address || unacknowledged || write_failed || stood_still || worn_out {
            if let Some(participant) = self.make() {
                tracing::info!(
                    new_address,
                    unacknowledged,
                    write_failed,
                    stood_still,
                    worn_out,
                    "continuing with a new DDS participant"
                );
                self.replace(participant, self.last_interfaces.clone());
            }
        } else if self.missing.len() > 0 && self.probe.is_none() {
            self.probe = self
                .make()
                .map(|participant| (DiscoveryProbe::new(participant), self.last_interfaces.clone()));
        }
    }

    fn make(&mut self) -> Option<rustdds::DomainParticipant> {
        self.last_made = Instant::now();
        let made = participant(&self.settings);
        if let Ok(participant) = &made {
            if self.own.len() >= MAX_OWN {
                self.own.remove(0);
            }
            self.own.push(prefix(&participant.guid().to_bytes()));
        }
        made.inspect_err(|error| tracing::warn!("no new participant: {error}")).ok()
    }

    /// Moves to another participant and publishes the current samples there.
    fn replace(&mut self, participant: rustdds::DomainParticipant, interfaces: Interfaces) {
        let mut successor = match Participant::new(&self.settings, participant) {
            Ok(successor) => successor,
            Err(error) => {
                tracing::warn!("no new participant: {error}");
                return;
            }
        };
        let carry_out = |(position, order)| successor.carry_out(position, order);
        let done = self.current.iter().enumerate().map(carry_out).fold(Ok(()), Result::and);
        let predecessor = std::mem::replace(&mut self.participant, successor);
        if self.predecessors.len() >= MAX_PREDECESSORS {
            self.predecessors.remove(0);
        }
        self.predecessors.push((predecessor, Instant::now()));
        self.interfaces = interfaces;
        (self.probe, self.silence_probe) = (None, None);
        self.missing.clear();
        (self.write_failed, self.stood_still) = (false, false);
        self.count_write_error(done);
        self.rebuilds += 1;
    }

    /// Sends changes of the status to the gateway.
    fn update_status(&mut self) {
        let count = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let status = NetworkStatus {
            readers: self.participant.readers().map(count).collect(),
            writers: self.participant.writers().map(count).collect(),
            other_writers: self.participant.other_writers().map(count).collect(),
            missing_peers: count(self.missing.len()),
            has_probe: self.probe.is_some(),
            rebuilds: self.rebuilds,
            participants: self.participant.peers,
            unheard_writers: self.silent_writers.unheard,
            write_errors: self.write_errors,
            unanswered_requests: self.unanswered_requests,
            lost_lines: self.lost_lines,
            has_left_graph: self.has_left_graph,
            links: None,
        };
        if status != self.status {
            self.link.answer(&FromNetwork::Status(status.clone()));
            self.status = status;
        }
    }
}
