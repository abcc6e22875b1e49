//! A participant that shows whether writers are silent, or are sending without being received: see
//! [`SilentWriters`].

use std::task::Waker;
use std::time::{Duration, Instant};

use rustdds::DomainParticipant;

use super::dds_node::DdsNode;
use super::participants::Participants;
use super::silent_writers::{ReadWriter, SilentWriters};
use super::topic_reader::{DdsTopicReader, TakenSample};
use crate::error::TransportError;
use crate::link::NetworkSettings;
use crate::qos::Durability;

/// Time within which writers are discovered and received.
const LIFE: Duration = Duration::from_secs(3);
/// Time since the last echo after which readers may no longer receive.
const ECHO_MISSED: Duration = Duration::from_millis(600);

/// The search for writers that send without being received.
pub(super) struct WriterWatch {
    pub(super) silent: SilentWriters,
    /// Present while writers are suspected.
    probe: Option<SilenceProbe>,
    pub(super) last_echo: Option<Instant>,
}

impl WriterWatch {
    pub(super) fn new(now: Instant) -> Self {
        Self { silent: SilentWriters::new(now), probe: None, last_echo: None }
    }

    /// Suspects writers, and returns true if the probe has received one of them; `waker` is called when the
    /// probe receives more.
    pub(super) fn is_one_unheard(
        &mut self,
        settings: &NetworkSettings,
        waker: &Waker,
        now: Instant,
        participants: &mut Participants,
    ) -> bool {
        self.suspect(settings, now, participants);
        let Self { silent, probe: Some(probe), .. } = self else { return false };
        let mut is_one_unheard = false;
        probe.take(waker, |writer, number| is_one_unheard |= silent.heard_elsewhere(&writer, number));
        let is_over = !silent.is_any_suspected() || probe.is_over(now);
        if is_over && !is_one_unheard {
            self.probe = None;
            self.silent.acquit();
        }
        is_one_unheard
    }

    fn suspect(&mut self, settings: &NetworkSettings, now: Instant, participants: &mut Participants) {
        let hears_itself = self.last_echo.is_none_or(|at| now.saturating_duration_since(at) < ECHO_MISSED);
        let may_suspect = hears_itself && participants.predecessors.is_empty() && self.probe.is_none();
        let is_there = |writer: &_| participants.current.reads(writer);
        let suspected = self.silent.look(now, may_suspect, is_there);
        if !suspected.is_empty()
            && let Some(domain) = participants.make(settings)
        {
            let probe = SilenceProbe::new(settings, domain, &suspected, now);
            self.probe = probe.inspect_err(|why| tracing::warn!("no probe of silence: {why}")).ok();
        }
    }

    /// Removes the probe; returns its participant.
    pub(super) fn take_probe(&mut self) -> Option<DomainParticipant> {
        let SilenceProbe { node, readers, .. } = self.probe.take()?;
        drop(readers);
        Some(node.domain)
    }
}

/// Readers of the topics of suspected writers, on a separate participant. Samples that writers have kept for
/// late readers are not received here, only samples sent from now on.
struct SilenceProbe {
    readers: Vec<(u16, DdsTopicReader)>,
    since: Instant,
    /// Last field: RustDDS requires endpoints to be dropped before their participant.
    node: DdsNode,
}

impl SilenceProbe {
    /// Starts to read the topics of these writers with a new participant.
    fn new(
        settings: &NetworkSettings,
        domain: DomainParticipant,
        suspected: &[ReadWriter],
        now: Instant,
    ) -> Result<Self, TransportError> {
        let node = DdsNode::new(settings, domain)?;
        let topics = (0..=u16::MAX).zip(&settings.read);
        let topics = topics.filter(|(position, _)| suspected.iter().any(|(topic, _)| topic == position));
        let reader = |read| node.reader(read, Durability::Volatile);
        let readers = topics.map(|(position, read)| Ok((position, reader(read)?)));
        Ok(Self { readers: readers.collect::<Result<_, TransportError>>()?, since: now, node })
    }

    /// Reads the samples that have arrived: `heard` receives each sample's writer and number.
    fn take(&self, waker: &Waker, mut heard: impl FnMut(ReadWriter, i64)) {
        for (position, reader) in &self.readers {
            let is_more = reader.take(waker, |taken| {
                if let TakenSample::Sample(writer, number, _) = taken {
                    heard((*position, writer), number);
                }
                true
            });
            if is_more {
                waker.wake_by_ref();
            }
        }
    }

    /// Returns true once any writer not received by now counts as silent.
    fn is_over(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.since) >= LIFE
    }
}
