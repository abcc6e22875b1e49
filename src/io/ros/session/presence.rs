//! One participant with everything on it: node, topics, writers, and who reads them.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use ros2_client::names::{MessageTypeName, Name};
use rustdds::dds::result::CreateResult;
use rustdds::no_key::DataWriterCdr;
use rustdds::policy::{self, History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent,
    DomainParticipantStatusListener, GUID, LostReason, QosPolicies, QosPolicyBuilder, RTPSEntity,
    StatusEvented, Timestamp, Topic, TopicKind,
};

use super::graph::{GraphEntry, node_name};
use super::lookout::{Missing, Prefix, prefix};
use super::mailbox::Wish;
use super::report::{ReportTopic, is_acknowledged};
use super::{Durability, RosError, RosSettings};
use crate::io::ros::messages::{DiagnosticArray, HazardLightsReport, TurnIndicatorsReport};
use crate::io::ros::topics::{
    DIAGNOSTICS_DEPTH, DIAGNOSTICS_TYPE, HAZARD_LIGHTS_TYPE, REPORT_DEPTH, TURN_INDICATORS_TYPE, TypeName,
};

/// Makes a participant; it announces itself at once.
pub(super) fn participant(settings: &RosSettings) -> CreateResult<DomainParticipant> {
    let builder = DomainParticipantBuilder::new(settings.domain_id);
    if settings.only_networks.is_empty() {
        builder.build()
    } else {
        builder.with_only_networks(settings.only_networks.iter().copied()).build()
    }
}

/// Our presence in the graph. Dropping it says goodbye.
pub(super) struct Presence {
    turn: ReportTopic<TurnIndicatorsReport>,
    hazard: ReportTopic<HazardLightsReport>,
    diagnostics: DataWriterCdr<DiagnosticArray>,
    graph: GraphEntry,
    readers: BTreeMap<GUID, BTreeSet<GUID>>,
    events: DomainParticipantStatusListener,
    /// Last: RustDDS wants endpoints to go before their participant.
    participant: DomainParticipant,
}

impl Presence {
    /// Puts node, topics and writers on a participant.
    pub(super) fn new(settings: &RosSettings, participant: DomainParticipant) -> Result<Self, RosError> {
        let node = node_name(settings)?;
        let dds = |error: rustdds::dds::result::CreateError| RosError::Dds(error.to_string());
        let events = participant.status_listener();
        let publisher = participant.create_publisher(&QosPolicies::default()).map_err(dds)?;
        let topic =
            |name: &str, (package, message): TypeName, qos: &QosPolicies| -> Result<Topic, RosError> {
                let parsed = Name::parse(name)
                    .map_err(|why| RosError::Topic { topic: name.to_owned(), why: why.to_string() })?;
                let type_name = MessageTypeName::new(package, message).dds_msg_type();
                let name = parsed.to_dds_name("rt", &node, "");
                participant.create_topic(name, type_name, qos, TopicKind::NoKey).map_err(dds)
            };
        let topics = &settings.topics;
        let report_qos = qos(settings.durability, REPORT_DEPTH);
        let turn = topic(&topics.turn_indicators, TURN_INDICATORS_TYPE, &report_qos)?;
        let hazard = topic(&topics.hazard_lights, HAZARD_LIGHTS_TYPE, &report_qos)?;
        let diagnostics =
            topic(&topics.diagnostics, DIAGNOSTICS_TYPE, &qos(Durability::Volatile, DIAGNOSTICS_DEPTH))?;
        let presence = Self {
            turn: ReportTopic::new(&publisher, turn, settings.durability).map_err(dds)?,
            hazard: ReportTopic::new(&publisher, hazard, settings.durability).map_err(dds)?,
            diagnostics: publisher.create_datawriter_no_key_cdr(&diagnostics, None).map_err(dds)?,
            graph: GraphEntry::new(&participant, &publisher, node.clone()).map_err(dds)?,
            readers: BTreeMap::new(),
            events,
            participant,
        };
        presence.announce();
        Ok(presence)
    }

    /// Its identity.
    pub(super) fn prefix(&self) -> Prefix {
        prefix(&self.participant.guid().to_bytes())
    }

    /// Publishes or withdraws the turn-indicators report.
    pub(super) fn turn(&mut self, wish: Wish<TurnIndicatorsReport>) -> Result<(), String> {
        match wish {
            Wish::Publish(report) => self.turn.publish(report, self.readers()[0] > 0),
            Wish::Withdraw => self.turn.withdraw().inspect(|()| self.announce()),
        }
    }

    /// Publishes or withdraws the hazard-lights report.
    pub(super) fn hazard(&mut self, wish: Wish<HazardLightsReport>) -> Result<(), String> {
        match wish {
            Wish::Publish(report) => self.hazard.publish(report, self.readers()[1] > 0),
            Wish::Withdraw => self.hazard.withdraw().inspect(|()| self.announce()),
        }
    }

    /// Publishes diagnostics.
    pub(super) fn diagnostics(&self, array: DiagnosticArray) -> Result<(), String> {
        self.diagnostics.write(array, Some(Timestamp::now())).map_err(|error| error.to_string())
    }

    /// Says to new readers what is current, and forgets it when nobody is left.
    pub(super) fn settle(&mut self) -> Result<(), String> {
        let [turn, hazard, _] = self.readers();
        let turn = self.turn.settle(turn > 0)?;
        let hazard = self.hazard.settle(hazard > 0)?;
        if turn || hazard {
            self.announce();
        }
        Ok(())
    }

    /// Whether every reader has acknowledged everything; waits some milliseconds for it.
    pub(super) fn is_acknowledged(&self) -> bool {
        self.turn.is_acknowledged() && self.hazard.is_acknowledged() && is_acknowledged(&self.diagnostics)
    }

    /// Matched readers of the three topics: turn indicators, hazard lights, diagnostics.
    pub(super) fn readers(&self) -> [usize; 3] {
        [self.turn.guid(), self.hazard.guid(), self.diagnostics.guid()]
            .map(|writer| self.readers.get(&writer).map_or(0, BTreeSet::len))
    }

    /// Whether all who read `other` read this one too.
    pub(super) fn serves_all_of(&self, other: &Self) -> bool {
        let served: BTreeSet<&GUID> = self.readers.values().flatten().collect();
        other.readers.values().flatten().all(|reader| served.contains(reader))
    }

    /// Takes note of what happened in the network since the last time; peers whose lease ran out
    /// are added to `missing`, except those in `own`.
    pub(super) fn observe(&mut self, missing: &mut Missing, own: &[Prefix]) {
        while let Some(event) = self.events.try_recv_status() {
            #[allow(clippy::wildcard_enum_match_arm)] // a foreign enum that may grow
            match event {
                DomainParticipantStatusEvent::RemoteReaderMatched { local_writer, remote_reader } => {
                    self.readers.entry(local_writer).or_default().insert(remote_reader);
                }
                DomainParticipantStatusEvent::ReaderLost { guid, .. } => {
                    self.forget_readers(|reader| *reader == guid);
                }
                DomainParticipantStatusEvent::ParticipantDiscovered { dpd } => {
                    missing.remove(&prefix(&dpd.guid.to_bytes()));
                }
                DomainParticipantStatusEvent::ParticipantLost { id, reason } => {
                    let peer = prefix(id.as_ref());
                    self.forget_readers(|reader| reader.prefix == id);
                    match reason {
                        LostReason::Disposed => missing.remove(&peer),
                        LostReason::Timeout { lease, .. } if !own.contains(&peer) => {
                            tracing::warn!("a DDS peer was silent for longer than its lease of {lease:?}");
                            missing.insert(peer, Instant::now());
                        }
                        LostReason::Timeout { .. } => {}
                    }
                }
                DomainParticipantStatusEvent::RemoteReaderQosIncompatible { local_writer, .. } => {
                    tracing::warn!(
                        "a reader of {} wants more than this writer offers, e.g. transient_local from volatile; \
                         it gets nothing",
                        self.topic_of(local_writer)
                    );
                }
                _ => {}
            }
        }
        let writers = [self.turn.guid(), self.hazard.guid(), self.diagnostics.guid()];
        self.readers.retain(|writer, _| writers.contains(writer));
    }

    fn forget_readers(&mut self, gone: impl Fn(&GUID) -> bool) {
        for readers in self.readers.values_mut() {
            readers.retain(|reader| !gone(reader));
        }
    }

    fn topic_of(&self, writer: GUID) -> &'static str {
        if writer == self.turn.guid() {
            "the turn-indicators topic"
        } else if writer == self.hazard.guid() {
            "the hazard-lights topic"
        } else {
            "diagnostics"
        }
    }

    fn announce(&self) {
        self.graph.announce([self.turn.guid(), self.hazard.guid(), self.diagnostics.guid()]);
    }
}

fn qos(durability: Durability, depth: i32) -> QosPolicies {
    let durability = match durability {
        Durability::TransientLocal => policy::Durability::TransientLocal,
        Durability::Volatile => policy::Durability::Volatile,
    };
    let reliability = Reliability::Reliable { max_blocking_time: rustdds::Duration::from_millis(10) };
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth })
        .build()
}
