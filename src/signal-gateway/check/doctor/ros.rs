//! Checks that the gateway is in the same domain as the other nodes, and that its topics match theirs.

use std::collections::BTreeMap;

use super::facts::{Facts, Known, Reach, RosFacts};
use super::row::{CheckRow, FindingRow, Outcome};
use crate::io::ros::own_topics::OwnTopic;
use crate::io::ros::topics::{Durability, Reliability};
use crate::report::text::counted;
use gateway_base::diagnostics::Level;
use ros_transport::survey::{DdsEndpoint, DomainSurvey};

const DOMAIN: &str = "docs/doctor.md#the-ros-2-domain";
const TOPIC: &str = "docs/doctor.md#topics";
/// Maximum number of topics listed in a text.
const MAX_TOPICS: usize = 5;

const VARIABLE: FindingRow = FindingRow {
    name: "variable_refused",
    level: Level::Error,
    text: "the environment cannot be followed: {problem}",
    why: "a gateway that is started from this shell ends at once",
    remedy: "set the variable as the message says, or unset it",
    see: DOMAIN,
};
const PEERS: FindingRow = FindingRow {
    name: "static_peers",
    level: Level::Warn,
    text: "ROS_STATIC_PEERS is set, and the gateway does not follow it",
    why: "other computers find it only by multicast",
    remedy: "allow multicast between the computers, or list this computer as a peer on the others",
    see: DOMAIN,
};
const SHELL: FindingRow = FindingRow {
    name: "other_domain_in_shell",
    level: Level::Warn,
    text: "the gateway uses domain {own}, this shell domain {shell}",
    why: "`ros2 topic list` and nodes of this shell do not see the gateway",
    remedy: "export ROS_DOMAIN_ID={own}; or set [ros] domain_id = {shell}, if Autoware is there",
    see: DOMAIN,
};
const SERVICE: FindingRow = FindingRow {
    name: "other_domain_in_service",
    level: Level::Warn,
    text: "the service uses domain {service}, a gateway of this shell domain {own}",
    why: "what is tried by hand is not what the service does",
    remedy: "set the domain in one place: [ros] domain_id in the configuration, and no ROS_DOMAIN_ID in /etc/default/signal-gateway; then systemctl restart signal-gateway",
    see: DOMAIN,
};
const MIDDLEWARE: FindingRow = FindingRow {
    name: "other_middleware",
    level: Level::Warn,
    text: "nodes of this shell use {rmw}, the gateway [ros] transport = \"{transport}\"",
    why: "DDS and Zenoh do not meet: neither side sees the other",
    remedy: "set [ros] transport = \"{other}\", or RMW_IMPLEMENTATION={wanted} for the nodes",
    see: "docs/fleet.md",
};
const LOCALHOST: FindingRow = FindingRow {
    name: "localhost_only",
    level: Level::Warn,
    text: "the environment keeps this shell's nodes on this computer, the configuration names {networks}",
    why: "the gateway is seen from other computers, the nodes of this shell are not; what works here may not work there",
    remedy: "unset ROS_LOCALHOST_ONLY and ROS_AUTOMATIC_DISCOVERY_RANGE, or set [ros] only_networks = [\"127.0.0.1\"]",
    see: DOMAIN,
};
const ELSEWHERE: FindingRow = FindingRow {
    name: "peers_in_other_domain",
    level: Level::Warn,
    text: "nobody else is in domain {own}, but {count} in domain {shell}",
    why: "Autoware is probably there, and receives nothing of the gateway",
    remedy: "set [ros] domain_id = {shell} in the configuration",
    see: DOMAIN,
};

pub(super) const ROS_DOMAIN: CheckRow = CheckRow {
    name: "ros_domain",
    asks: "Do the configuration, this shell and the service use the same ROS 2 domain, and is anybody there?",
    findings: &[&VARIABLE, &PEERS, &SHELL, &SERVICE, &MIDDLEWARE, &LOCALHOST, &ELSEWHERE],
    judge: |facts: &Facts| with_ros(facts, domain),
};

fn domain(facts: &Facts, ros: &RosFacts) -> Vec<Outcome> {
    if let Some(problem) = &ros.problem {
        return vec![VARIABLE.found().with("problem", problem)];
    }
    let variable =
        |name: &str| facts.environment.get(name).map(String::as_str).filter(|value| !value.is_empty());
    let own = ros.domain_id.to_string();
    let shell = variable("ROS_DOMAIN_ID").unwrap_or("0");
    let mut outcomes = Vec::new();
    if variable("ROS_STATIC_PEERS").is_some() {
        outcomes.push(PEERS.found());
    }
    let others = ros.shell_survey.as_ref().filter(|survey| survey.participants > 0);
    let is_alone = matches!(&ros.survey, Known::Yes(survey) if survey.participants == 0);
    match others.filter(|_| is_alone) {
        Some(survey) => {
            let count = participants(survey);
            outcomes.push(ELSEWHERE.found().with("own", &own).with("shell", shell).with("count", &count));
        }
        None if shell != own => outcomes.push(SHELL.found().with("own", &own).with("shell", shell)),
        None => {}
    }
    let service = service_domain(facts, ros);
    if let Some(service) = service.filter(|service| *service != own) {
        outcomes.push(SERVICE.found().with("own", &own).with("service", &service));
    }
    outcomes.extend(variable("RMW_IMPLEMENTATION").and_then(|rmw| middleware(rmw, ros.is_zenoh)));
    let is_local = variable("ROS_LOCALHOST_ONLY") == Some("1")
        || variable("ROS_AUTOMATIC_DISCOVERY_RANGE") == Some("LOCALHOST");
    let is_reached = ros.only_networks.iter().any(|network| !network.starts_with("127."));
    if is_local && is_reached {
        outcomes.push(LOCALHOST.found().with("networks", ros.only_networks.join(", ")));
    }
    if outcomes.is_empty() {
        let where_from = if ros.is_domain_configured { "of the configuration" } else { "of this shell" };
        let is_local = !ros.only_networks.is_empty() && !is_reached;
        let reach = if is_local { ", on this computer only" } else { "" };
        let others = match &ros.survey {
            Known::Yes(survey) => format!("; {} there", participants(survey)),
            Known::No(_) => String::new(),
        };
        outcomes.push(Outcome::sound(format!("domain {own} {where_from}{reach}{others}")));
    }
    outcomes
}

/// Returns the domain of the service: from the running gateway, otherwise from its environment file.
fn service_domain(facts: &Facts, ros: &RosFacts) -> Option<String> {
    if let Some(domain_id) = facts.running.domain_id {
        return Some(domain_id.to_string());
    }
    match &facts.service {
        Known::Yes(service) if service.is_installed && !ros.is_domain_configured => {
            Some(service.domain_id.clone().unwrap_or("0".to_owned()))
        }
        Known::Yes(_) | Known::No(_) => None,
    }
}

fn middleware(rmw: &str, is_zenoh: bool) -> Option<Outcome> {
    let speaks_zenoh = rmw.contains("zenoh");
    let [transport, other] = if is_zenoh { ["zenoh", "dds"] } else { ["dds", "zenoh"] };
    let wanted = if is_zenoh { "rmw_zenoh_cpp" } else { "rmw_cyclonedds_cpp" };
    (speaks_zenoh != is_zenoh).then(|| {
        MIDDLEWARE
            .found()
            .with("rmw", rmw)
            .with("transport", transport)
            .with("other", other)
            .with("wanted", wanted)
    })
}

fn participants(survey: &DomainSurvey) -> String {
    counted(u64::try_from(survey.participants).unwrap_or(u64::MAX), "participant")
}

const PUBLISHER: FindingRow = FindingRow {
    name: "other_publisher",
    level: Level::Warn,
    text: "{topic} is published by {others} as well",
    why: "readers get both in turn, so that a light or a speed seems to jump",
    remedy: "stop the other node, which `ros2 topic info -v {topic}` names; or rename the topic here: {key}",
    see: TOPIC,
};
const OTHER_TYPE: FindingRow = FindingRow {
    name: "other_type",
    level: Level::Warn,
    text: "{topic} is {own} here, and {type} with {side} ({other})",
    why: "DDS does not connect different types, and says nothing of it",
    remedy: "build both against the same version of the messages, or rename the topic on one side",
    see: TOPIC,
};
const READER: FindingRow = FindingRow {
    name: "incompatible_reader",
    level: Level::Warn,
    text: "a reader of {topic} ({other}) requests {requested}, and {offered} is offered",
    why: "DDS does not connect them: this reader receives nothing",
    remedy: "request {offered} in that node{key}",
    see: TOPIC,
};
const WRITER: FindingRow = FindingRow {
    name: "incompatible_writer",
    level: Level::Warn,
    text: "a writer of {topic} ({other}) offers {offered}, and {requested} is requested",
    why: "DDS does not connect them: the gateway receives nothing of it",
    remedy: "offer {requested} in that node",
    see: TOPIC,
};

pub(super) const TOPICS: CheckRow = CheckRow {
    name: "topics",
    asks: "Does anybody else publish on topics of the gateway, and do the QoS of readers and writers fit?",
    findings: &[&PUBLISHER, &OTHER_TYPE, &READER, &WRITER],
    judge: |facts: &Facts| {
        with_ros(facts, |facts, ros| match &ros.survey {
            Known::Yes(survey) => topics(facts, ros, survey),
            Known::No(reason) => vec![Outcome::not_checked(reason.clone())],
        })
    },
};

fn topics(facts: &Facts, ros: &RosFacts, survey: &DomainSurvey) -> Vec<Outcome> {
    let mut outcomes: Vec<_> =
        ros.written.iter().filter_map(|topic| publishers(facts, topic, survey)).collect();
    for (own, others, is_reader) in
        [(&ros.written, &survey.readers, true), (&ros.read, &survey.writers, false)]
    {
        let pairs = own.iter().flat_map(|topic| others.iter().map(move |other| (topic, other)));
        let found = pairs.filter(|(topic, other)| topic.name == other.topic);
        let found: Vec<_> = found.filter_map(|(topic, other)| mismatch(topic, other, is_reader)).collect();
        for outcome in found {
            // Several identical readers give one finding.
            if !outcomes.contains(&outcome) {
                outcomes.push(outcome);
            }
        }
    }
    if outcomes.is_empty() {
        outcomes.push(Outcome::sound(readers(ros, survey)));
    }
    outcomes
}

/// Judges the writers of other nodes on a topic, without the running gateway's writer.
fn publishers(facts: &Facts, topic: &OwnTopic, survey: &DomainSurvey) -> Option<Outcome> {
    let mut others = BTreeMap::<&str, u64>::new();
    for writer in survey.writers.iter().filter(|writer| writer.topic == topic.name) {
        *others.entry(&writer.implementation).or_default() += 1;
    }
    let is_ours = is_written_by_ours(facts, topic, survey.domain_id);
    if let Some(own) = others.get_mut(OWN_IMPLEMENTATION).filter(|_| is_ours) {
        *own -= 1;
    }
    let texts: Vec<_> = others
        .into_iter()
        .filter(|(_, count)| *count > 0)
        .map(|(implementation, count)| format!("{} ({implementation})", counted(count, "other writer")))
        .collect();
    let is_alone = texts.is_empty() || topic.is_shared;
    let key = "[ros.topics], [turn_signal.outputs] or [traffic_lights.outputs]";
    (!is_alone).then(|| {
        PUBLISHER.found().with("topic", &topic.name).with("others", texts.join(", ")).with("key", key)
    })
}

/// Returns true if a gateway runs that publishes this topic, or might publish it without reporting so.
fn is_written_by_ours(facts: &Facts, topic: &OwnTopic, domain_id: u16) -> bool {
    let running = &facts.running;
    match running.reach {
        Reach::Served => running.domain_id == Some(domain_id) && running.written.contains(&topic.name),
        Reach::Denied | Reach::Unreadable => true,
        Reach::Absent => matches!(&facts.service, Known::Yes(service) if service.active_state == "active"),
    }
}

/// The DDS implementation by which a running gateway is recognised.
const OWN_IMPLEMENTATION: &str = "RustDDS";

fn mismatch(topic: &OwnTopic, other: &DdsEndpoint, is_reader: bool) -> Option<Outcome> {
    let found =
        |row: &FindingRow| row.found().with("topic", &topic.name).with("other", &other.implementation);
    if topic.type_name != other.type_name {
        let side = if is_reader { "a reader" } else { "a writer" };
        let found = found(&OTHER_TYPE).with("own", &topic.type_name);
        return Some(found.with("type", &other.type_name).with("side", side));
    }
    let (ours, theirs) = ((topic.reliability, topic.durability), (other.reliability, other.durability));
    let (offered, requested) = if is_reader { (ours, theirs) } else { (theirs, ours) };
    let mut missing = Vec::new();
    if (offered.0, requested.0) == (Reliability::BestEffort, Reliability::Reliable) {
        missing.push(("best effort", "reliable"));
    }
    if (offered.1, requested.1) == (Durability::Volatile, Durability::TransientLocal) {
        missing.push(("volatile", "transient local"));
    }
    if missing.is_empty() {
        return None;
    }
    let (offered, requested): (Vec<_>, Vec<_>) = missing.into_iter().unzip();
    let found = found(if is_reader { &READER } else { &WRITER });
    let found = found.with("offered", offered.join(", ")).with("requested", requested.join(", "));
    Some(found.with("key", if is_reader { reports_key(topic) } else { "" }))
}

/// Returns the key for a topic's durability, which is configurable for the reports of the lights.
fn reports_key(topic: &OwnTopic) -> &'static str {
    const CONFIGURABLE: [&str; 2] = ["TurnIndicatorsReport", "HazardLightsReport"];
    let is_configurable = CONFIGURABLE.iter().any(|name| topic.type_name.ends_with(name));
    if is_configurable { "; or set [reports] durability = \"transient_local\"" } else { "" }
}

fn readers(ros: &RosFacts, survey: &DomainSurvey) -> String {
    let count = |topic: &OwnTopic| {
        survey.readers.iter().map(|reader| u64::from(reader.topic == topic.name)).sum::<u64>()
    };
    let read = ros.written.iter().map(|topic| (&topic.name, count(topic))).filter(|(_, count)| *count > 0);
    let text = |(name, count)| format!("{name} {}", counted(count, "reader"));
    let read: Vec<_> = read.map(text).collect();
    let more = match read.len() {
        0 => return "no topic has another publisher, and none is read yet".to_owned(),
        length if length > MAX_TOPICS => format!(" and {} more", length - MAX_TOPICS),
        _ => String::new(),
    };
    let shown = read[..read.len().min(MAX_TOPICS)].join(", ");
    format!("no topic has another publisher; {shown}{more}")
}

/// Judges the ROS 2 side; reports it as not checked if there is none.
fn with_ros(facts: &Facts, judge: impl Fn(&Facts, &RosFacts) -> Vec<Outcome>) -> Vec<Outcome> {
    match &facts.ros {
        None => vec![Outcome::not_checked("no configuration that can be used says what is published")],
        Some(ros) if !ros.enabled => {
            vec![Outcome::not_checked("[ros] enabled = false: nothing is published")]
        }
        Some(ros) => judge(facts, ros),
    }
}
