//! The messages of the statuses of the process, and the catalogue of all statuses of the program.

use gateway_base::diagnostics::{Section, messages};
use gateway_core::gateway::catalogue as gateway;

messages! {
    /// The last reload of the configuration.
    RELOAD {
        Ok as_at_start() "as at the start";
        Ok reloaded() "reloaded";
        Warn refused(why) "reload refused, the one before goes on: {why}", "Correct the file at the place that is named and reload again; restart where a restart is needed. `check --against-running` says which before.";
    }
}

messages! {
    /// The recordings of faults.
    RECORDER {
        Ok ready() "ready";
        Warn not_written(error) "recordings cannot be written: {error}", "Make room, or correct `[black_box] folder` and its rights; it is tried again every 10 s.";
    }
}

messages! {
    /// The recording of everything.
    RECORDING {
        Ok recording() "recording";
        Warn recording_failed(error) "the recording cannot be written: {error}", "Make room, or correct the folder and its rights. What waits, up to 16 MB, is written once the disk takes it; what comes beyond that is lost. A folder that cannot be made is tried again every 10 s.";
    }
}

messages! {
    /// The log on standard error.
    LINES {
        Ok written() "written";
        Warn lines_lost(error) "log lines are lost: {error}", "Mend what reads standard error: the journal, a pipe's reader, a full disk.";
    }
}

messages! {
    /// The network side of ROS 2.
    NETWORK {
        Ok joined() "joined";
        Warn joining() "joining the network", "Wait until it has joined.";
        Warn down(failure) "the network side is down: {failure}", "Wait; if it stays, read the log, and look for who sends what DDS cannot bear.";
        Warn replaced(failure) "the network side was replaced: {failure}", "Nothing is to be done; it is shown for a minute. If it comes again, look for who sends what DDS cannot bear.";
        Ok searching() "joined, looking for a Zenoh router";
        Warn disconnected(nodes) "lost the connection with {nodes}; connecting again", "Wait: a router knows of these nodes, and samples do not pass. If it stays, look whether they and the gateway reach each other's `listen` addresses, and restart them.";
        Warn replaced_again(failure) "the network side was replaced again and again: {failure}", "Look for who sends what DDS cannot bear, or ends the process.";
        Warn unheard() "joined, but what it sends does not arrive at a reader of its own", "Nothing is to be done; it is replaced within two seconds. If it comes again, look for who floods the network.";
        Warn crowd() "joined, but with more peers than a network has", "Look for who announces them. Once no more come, the network side is replaced and has forgotten them.";
        Warn busy() "joined, but takes a whole processor", "Look for who floods the network with packets of DDS or Zenoh, and for more data than the computer can send.";
        Warn taken_anew() "joined; numbers far ahead came under a writer's identity, and it was taken anew", "Look for who sends in the name of another; it is shown for a minute.";
        Warn alone() "joined, but connected with no Zenoh router and no peer", "Start the router, or look at `connect` and `listen` in the file of `[ros.zenoh] config`; certificates and their dates, where it has any.";
        Warn shared_topics(topics) "joined, but another node also publishes {topics}", "Find the node with `ros2 topic info -v` and stop it, or leave the topic to it: name another one, or none, in `[ros.topics]`. Readers get both in turn.";
        Warn other_graph() "joined, but not in the graph, which is of another distribution of ROS 2", "Install the package for the distribution of the other nodes. Topics work; `ros2 node` does not list this node.";
    }
}

/// The configuration.
pub static CONFIGURATION: Section = Section { names: &["configuration"], messages: &[RELOAD] };
/// The black box.
pub static BLACK_BOX: Section = Section { names: &["black_box"], messages: &[RECORDER] };
/// The MCAP recording.
pub static MCAP: Section = Section { names: &["mcap"], messages: &[RECORDING] };
/// The log.
pub static LOG: Section = Section { names: &["log"], messages: &[LINES] };
/// The network side of ROS 2.
pub static ROS: Section = Section { names: &["ros"], messages: &[NETWORK] };

/// The statuses of the process, in the order of `docs/diagnostics.md`.
pub static PROCESS: [&Section; 5] = [&CONFIGURATION, &BLACK_BOX, &MCAP, &LOG, &ROS];

/// Returns all statuses of the program, in the order of `docs/diagnostics.md`, starting with the gateway's.
pub fn sections() -> impl Iterator<Item = &'static Section> {
    gateway::SECTIONS.into_iter().chain(PROCESS)
}
