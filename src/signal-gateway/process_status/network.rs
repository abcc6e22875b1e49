//! State of the ROS 2 network side as reported in diagnostics.

use std::time::Duration;

use derive_more::Display;
use ros_transport::link::{LostLines, ZenohLinks};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::catalogue::{self, ROS};
use super::confinement::Confinement;
use gateway_base::diagnostics::{MessagePart, Status};

/// Time for which a replacement network side counts as new.
const RECENT: Duration = Duration::from_secs(60);
/// Time that a network side that has just joined has to find a router or a peer of Zenoh.
const SEARCH: Duration = Duration::from_secs(5);

/// State of the network side, as known to its session.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools)] // each by itself
pub struct NetworkState {
    /// Where the network side runs.
    pub place: Place,
    /// True while it has joined the network and answers.
    pub is_up: bool,
    /// True while its own samples come back to it; if they do not, only its thread is known to work.
    pub has_echo: bool,
    /// Number of replacements.
    pub restarts: u64,
    /// Cause of its last end.
    pub last_failure: Option<NetworkFailure>,
    /// Time since it joined the network; `None` while it is not up.
    pub age: Option<Duration>,
    /// Memory in use by its process, bytes; `None` if unknown.
    pub memory_bytes: Option<u64>,
    /// Confinement of its process; `None` for a thread, and before the process has reported it.
    pub confinement: Option<Confinement>,
    /// Number of log lines lost by its processes since the session's start.
    pub lost_lines: LostLines,
    /// True if the ROS 2 graph belongs to another distribution, so the node is not in it.
    pub has_other_graph: bool,
    /// Current load on the network side.
    pub burden: Option<Burden>,
    /// Processor load of its process, percent; `None` if unknown.
    pub processor_percent: Option<u32>,
    /// Number of other participants plus their endpoints that are matched with ours; zero with Zenoh.
    pub peers: u32,
    /// Number of ends within the last minute.
    pub recent_ends: usize,
    /// Number of writers since start that were accepted again after continuing below numbers received under
    /// their identity.
    pub taken_anew: u64,
    /// Time since the last of them.
    pub since_taken_anew: Option<Duration>,
    /// Connections of Zenoh; `None` with DDS, which has none.
    pub links: Option<ZenohLinks>,
    /// Reports on the vehicle that other nodes publish too.
    pub shared_topics: Vec<SharedTopic>,
}

/// A topic that other nodes publish too.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display("{name} {other_writers}")]
pub struct SharedTopic {
    /// Absolute name of the topic.
    pub name: String,
    /// Number of their writers.
    pub other_writers: u64,
}

/// Where a network side runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Display)]
pub enum Place {
    /// In a thread of the gateway.
    #[default]
    #[display("thread")]
    Thread,
    /// In a process of its own.
    #[display("process")]
    Process,
    /// In a process of another user, which systemd has started.
    #[display("service")]
    Service,
}

/// Load on a network side that has joined; if several apply, the first counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Burden {
    /// No sample of it arrives at a reader of our own, although some did before.
    Unheard,
    /// More peers than any ROS network has.
    Crowd,
    /// It has used a whole processor for some seconds.
    Busy,
}

/// Why a network side ended.
#[derive(Debug, Clone, PartialEq, Eq, Display, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NetworkFailure {
    /// It ended by itself with this exit code.
    #[display("exit code {_0}")]
    Exited(i32),
    /// It was ended by this signal, which was not ours.
    #[display("killed by signal {_0}")]
    Signalled(i32),
    /// One of its threads had a panic.
    #[display("panic")]
    Panicked,
    /// It was refused more memory than its limit allows.
    #[display("out of memory")]
    OutOfMemory,
    /// It did not answer in time, and was killed.
    #[display("no answer")]
    NoAnswer,
    /// It answered, but no sample of it arrived at a reader of our own.
    #[display("not heard")]
    Unheard,
    /// More peers were announced to it than any ROS network has.
    #[display("too many peers")]
    Crowded,
    /// The process that supervised it has ended, and has taken it along.
    #[display("its service has ended")]
    SupervisorEnded,
    /// It broke the rules of the link in this way, and was killed.
    #[display("it sent {_0}")]
    Violation(String),
    /// It could not be started, or could not join the network, for this reason.
    #[display("not started: {_0}")]
    NotStarted(String),
}

impl NetworkState {
    /// Returns the transport of the messages.
    pub fn transport(&self) -> &'static str {
        if self.links.is_some() { "zenoh" } else { "dds" }
    }

    /// Returns the status of the network side.
    pub fn status(&self) -> Status {
        let own_samples = if self.has_echo { "come back" } else { "do not come back" };
        let topics = self.shared_topics.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let (confinement, links) = (self.confinement.as_ref(), self.links.as_ref());
        let unreachable = links.map(|links| links.unreachable.join(", "));
        let values = [
            ("runs_as", Some(self.place.to_string())),
            ("restarts", Some(self.restarts.to_string())),
            ("restarts_last_minute", Some(self.recent_ends.to_string())),
            ("last_failure", self.last_failure.as_ref().map(ToString::to_string)),
            ("age_s", self.age.map(|age| age.as_secs().to_string())),
            ("own_samples", self.age.map(|_| own_samples.to_owned())),
            ("memory_kb", self.memory_bytes.map(|bytes| (bytes / 1024).to_string())),
            ("confinement", confinement.map(Confinement::layers)),
            ("refused_calls", confinement.map(Confinement::refused_calls)),
            ("processor_percent", self.processor_percent.map(|percent| percent.to_string())),
            ("peers", links.is_none().then(|| self.peers.to_string())),
            ("writers_taken_anew", Some(self.taken_anew.to_string())),
            ("other_writers", Some(topics).filter(|topics| !topics.is_empty())),
            ("transport", Some(self.transport().to_owned())),
            ("zenoh_routers", links.map(|links| links.routers.to_string())),
            ("zenoh_peers", links.map(|links| links.peers.to_string())),
            ("zenoh_connections_lost", links.map(|links| links.lost.to_string())),
            ("zenoh_unreachable", unreachable.filter(|nodes| !nodes.is_empty())),
        ];
        let values = values.into_iter().filter_map(|(key, value)| Some((key, value?))).collect();
        Status::new(&ROS, "ros", &[message(self)], values)
    }
}

fn message(state: &NetworkState) -> MessagePart {
    let failure = state.last_failure.as_ref();
    match state.burden.filter(|_| state.is_up) {
        Some(Burden::Unheard) => return catalogue::unheard(),
        Some(Burden::Crowd) => return catalogue::crowd(),
        Some(Burden::Busy) => return catalogue::busy(),
        None => {}
    }
    match (state.age.filter(|_| state.is_up), failure) {
        (None, None) => catalogue::joining(),
        (None, Some(failure)) => catalogue::down(failure),
        (Some(age), Some(failure)) if age < RECENT && state.recent_ends > 1 => {
            catalogue::replaced_again(failure)
        }
        (Some(age), Some(failure)) if age < RECENT => catalogue::replaced(failure),
        (Some(_), _) if state.since_taken_anew.is_some_and(|since| since < RECENT) => catalogue::taken_anew(),
        (Some(_), _) if !state.shared_topics.is_empty() => {
            let topics: Vec<_> = state.shared_topics.iter().map(|topic| topic.name.as_str()).collect();
            catalogue::shared_topics(topics.join(", "))
        }
        (Some(_), _) if state.has_other_graph => catalogue::other_graph(),
        (Some(age), _) => match &state.links {
            Some(ZenohLinks { unreachable, .. }) if !unreachable.is_empty() => {
                catalogue::disconnected(unreachable.join(", "))
            }
            Some(ZenohLinks { routers: 0, peers: 0, .. }) if age < SEARCH => catalogue::searching(),
            Some(ZenohLinks { routers: 0, peers: 0, .. }) => catalogue::alone(),
            Some(_) | None => catalogue::joined(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns level and message, as `WARN message`, of a network side that has joined and then changed by
    /// `change`.
    fn headline(change: impl FnOnce(&mut NetworkState)) -> String {
        let age = Some(Duration::from_secs(1));
        let mut state = NetworkState { is_up: true, has_echo: true, age, ..NetworkState::default() };
        change(&mut state);
        let status = state.status();
        format!("{} {}", status.level, status.message)
    }

    #[test]
    fn a_failure_is_reported_while_it_lasts_and_for_a_minute() {
        let failed = |state: &mut NetworkState| state.last_failure = Some(NetworkFailure::OutOfMemory);
        assert_eq!(headline(|_| ()), "OK joined");
        let down = headline(|state| {
            failed(state);
            state.is_up = false;
        });
        assert_eq!(down, "WARN the network side is down: out of memory");
        assert_eq!(headline(failed), "WARN the network side was replaced: out of memory");
        let later = headline(|state| {
            failed(state);
            state.age = Some(RECENT);
        });
        assert_eq!(later, "OK joined");
    }

    #[test]
    fn what_weighs_on_it_is_said_while_it_lasts() {
        let burden = |burden| headline(|state| state.burden = Some(burden));
        let failed = |state: &mut NetworkState| {
            (state.last_failure, state.recent_ends) = (Some(NetworkFailure::Signalled(9)), 12);
        };
        let again = "WARN the network side was replaced again and again: killed by signal 9";
        assert_eq!(headline(failed), again);
        assert_eq!(burden(Burden::Busy), "WARN joined, but takes a whole processor");
        assert_eq!(burden(Burden::Crowd), "WARN joined, but with more peers than a network has");
        let unheard = "WARN joined, but what it sends does not arrive at a reader of its own";
        assert_eq!(burden(Burden::Unheard), unheard);
        let taken_anew =
            |seconds| headline(|state| state.since_taken_anew = Some(Duration::from_secs(seconds)));
        let anew = "WARN joined; numbers far ahead came under a writer's identity, and it was taken anew";
        assert_eq!([taken_anew(59), taken_anew(60)], [anew, "OK joined"]);
    }

    #[test]
    fn another_writer_of_a_report_is_a_warning_with_topic_and_number() {
        let topic = |name: &str, other_writers| SharedTopic { name: name.to_owned(), other_writers };
        let shared_topics = vec![topic("/gear", 1), topic("/velocity", 2)];
        let text = headline(|state| state.shared_topics.clone_from(&shared_topics));
        assert_eq!(text, "WARN joined, but another node also publishes /gear, /velocity");
        let values = NetworkState { shared_topics, ..NetworkState::default() }.status().values;
        assert!(values.contains(&("other_writers", "/gear 1, /velocity 2".to_owned())), "{values:?}");
    }

    #[test]
    fn zenoh_wants_a_connection_with_anybody() {
        let links = |routers, peers| ZenohLinks { routers, peers, lost: 3, unreachable: vec![] };
        let with = |links| headline(|state| state.links = Some(links));
        assert_eq!(with(links(0, 0)), "OK joined, looking for a Zenoh router");
        let alone = headline(|state| {
            state.links = Some(links(0, 0));
            state.age = Some(SEARCH);
        });
        assert_eq!(alone, "WARN joined, but connected with no Zenoh router and no peer");
        assert_eq!([with(links(1, 0)), with(links(0, 1))], ["OK joined"; 2]);
        let state = NetworkState { links: Some(links(1, 2)), ..NetworkState::default() };
        let values = state.status().values;
        for (key, value) in [
            ("transport", "zenoh"),
            ("zenoh_routers", "1"),
            ("zenoh_peers", "2"),
            ("zenoh_connections_lost", "3"),
        ] {
            assert!(values.contains(&(key, value.to_owned())), "{key}: {values:?}");
        }
        let values = NetworkState::default().status().values;
        assert!(values.contains(&("transport", "dds".to_owned())), "{values:?}");
        assert!(!values.iter().any(|(key, _)| key.starts_with("zenoh")), "{values:?}");
    }

    #[test]
    fn nodes_that_are_there_and_not_connected_are_named() {
        let unreachable = vec!["/planner".to_owned(), "/ns/commander".to_owned()];
        let links = ZenohLinks { routers: 1, peers: 0, lost: 1, unreachable };
        let expected = "WARN lost the connection with /planner, /ns/commander; connecting again";
        assert_eq!(headline(|state| state.links = Some(links.clone())), expected);
        let values = NetworkState { links: Some(links), ..NetworkState::default() }.status().values;
        assert!(values.contains(&("zenoh_unreachable", "/planner, /ns/commander".to_owned())), "{values:?}");
    }
}
