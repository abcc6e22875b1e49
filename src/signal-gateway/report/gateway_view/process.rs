//! The process of the gateway, and its connections.

use schemars::JsonSchema;
use serde::Serialize;

use super::value::{Fact, Section, age_text};
use crate::process_status::configuration::ConfigurationState;
use crate::process_status::recordings::RecorderState;
use crate::process_status::snapshot::{ProcessSnapshot, RosSnapshot};
use crate::report::text::{counted, times};
use gateway_core::provenance::ProvenanceSummary;

/// The process that the gateway runs in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ProcessView {
    /// Name of the vehicle profile.
    pub vehicle: String,
    /// Id of the process.
    pub pid: u32,
    /// Time since its start, ms.
    pub uptime_ms: u64,
    /// Number of the next change of the history; a greater one than before means that there are new changes.
    pub next_change: u64,
    /// Number of black-box recordings written since start.
    pub written_recordings: u64,
    /// Version, origin, id, time since its start, and number of black-box recordings, in words.
    pub about: Vec<String>,
    /// The connection to ROS 2, in words.
    pub ros: String,
    /// Vehicle profile, configuration, black box and topics, as far as there is something to say.
    pub sections: Vec<Section>,
}

impl ProcessView {
    pub(super) fn of(process: &ProcessSnapshot, stamp_ns: i64) -> Self {
        let (build, ros) = (&process.build, process.ros.as_ref());
        let commit = build.commit.as_ref().map(|commit| format!("commit {commit}"));
        let distribution = build.distribution.as_ref().map(|name| format!("ROS 2 {name}"));
        let about = [format!("signal-gateway {}", build.version)].into_iter().chain(commit);
        let age = age_text(process.uptime_ms / 1000 * 1000);
        let about =
            about.chain(distribution).chain([format!("process {}", process.pid), format!("up {age}")]);
        let black_box = process.black_box.as_ref();
        let recorded = black_box.map(|state| counted(state.recordings as u64, "black-box recording"));
        let ros_text = ros.map_or_else(|| "off".to_owned(), ros_text);
        let configuration = process.configuration.as_ref().and_then(|state| configuration(state, stamp_ns));
        let topics = ros.map(|ros| topics(ros, &ros_text));
        let sections = [provenance(&process.provenance), configuration, black_box.map(recordings), topics];
        Self {
            vehicle: process.vehicle.clone(),
            pid: process.pid,
            uptime_ms: process.uptime_ms,
            next_change: process.next_change,
            written_recordings: black_box.map_or(0, |black_box| black_box.written),
            about: about.chain(recorded).collect(),
            ros: ros_text,
            sections: sections.into_iter().flatten().collect(),
        }
    }
}

/// Returns how much of the vehicle profile has been verified; `None` for a profile without facts.
fn provenance(provenance: &ProvenanceSummary) -> Option<Section> {
    let ProvenanceSummary { car, recording, bench, unverified } = provenance;
    let verified = [(car, "a car"), (recording, "a recording"), (bench, "a bench")];
    let verified = verified.into_iter().filter(|(count, _)| **count > 0);
    let verified = verified.map(|(count, by)| format!("{} by {by}", counted(*count as u64, "fact")));
    let facts =
        [("verified", verified.collect::<Vec<_>>().join(", ")), ("unverified", unverified.join(", "))];
    let facts = facts.into_iter().filter(|(_, text)| !text.is_empty());
    let facts: Vec<_> = facts.map(|(name, text)| Fact::new(name, text)).collect();
    (!facts.is_empty()).then(|| Section { title: "vehicle profile".to_owned(), facts })
}

/// Returns the last reload; `None` before the first.
fn configuration(configuration: &ConfigurationState, stamp_ns: i64) -> Option<Section> {
    let last = configuration.last_reload.as_ref()?;
    let millis = stamp_ns.saturating_sub(last.stamp_ns) / 1_000_000;
    let at = age_text(u64::try_from(millis).unwrap_or_default());
    let result = last.reason.as_ref().map_or_else(
        || "reloaded".to_owned(),
        |reason| {
            format!(
                "refused, the previous one stays in effect: {}",
                reason.lines().collect::<Vec<_>>().join("; ")
            )
        },
    );
    let changes = last.changes.iter().filter(|_| last.is_applied);
    let changes = changes.map(|change| Fact::new("", change.to_string()));
    let reloads = counted(configuration.reloads, "reload");
    Some(Section {
        title: format!("configuration ({reloads}, {} refused)", configuration.refused),
        facts: [Fact::new(format!("{at} ago"), result)].into_iter().chain(changes).collect(),
    })
}

fn recordings(state: &RecorderState) -> Section {
    let newest = state.newest.as_ref().map_or_else(String::new, |newest| format!(", the newest {newest}"));
    let count = counted(state.recordings as u64, "recording");
    Section {
        title: "black box".to_owned(),
        facts: vec![Fact::new(&state.folder, format!("{count}{newest}"))],
    }
}

fn topics(ros: &RosSnapshot, text: &str) -> Section {
    let written = ros.written.iter().map(|topic| Fact::new(&topic.name, counted(topic.peers, "reader")));
    let read = ros.read.iter().map(|topic| Fact::new(&topic.name, counted(topic.peers, "writer")));
    Section { title: format!("ROS 2 ({text})"), facts: written.chain(read).collect() }
}

fn ros_text(ros: &RosSnapshot) -> String {
    let state = match (ros.is_up, &ros.last_failure) {
        (true, _) => {
            let readers = counted(ros.written.iter().map(|topic| topic.peers).sum(), "reader");
            let restarts = ros.restarts;
            let restarts =
                if restarts > 0 { format!(", replaced {}", times(restarts)) } else { String::new() };
            format!("joined, {readers}{restarts}")
        }
        (false, Some(failure)) => format!("down: {failure}"),
        (false, None) => "joining".to_owned(),
    };
    let links = ros.links.as_ref().map_or_else(String::new, |links| {
        let (routers, peers, lost) = (links.routers, links.peers, links.lost);
        let missing = links.unreachable.join(" ");
        let missing = if missing.is_empty() { missing } else { format!(", not connected {missing}") };
        format!(", Zenoh: routers {routers}, peers {peers}, connections lost {lost}{missing}")
    });
    format!("domain {}, {state}{links}", ros.domain_id)
}
