//! The network side's part of a session's settings.

use crate::io::ros::outgoing::Outgoing;
use crate::io::ros::settings::{Isolation, RosSettings};
use ros_transport::link::{NetworkSettings, ReadTopic};

/// Limit for the writers' history if the network side has no process with its own memory limit, bytes.
const THREAD_HISTORY: u64 = 256 << 20;

/// Returns the part of a session's settings that the network side needs.
pub(super) fn network_settings(settings: &RosSettings, table: &[Outgoing]) -> NetworkSettings {
    let read = settings.subscriptions.iter().map(|subscription| ReadTopic {
        name: subscription.name.clone(),
        type_name: subscription.kind.row().type_name.to_owned(),
        reliability: subscription.reliability,
        durability: subscription.durability,
        depth: subscription.depth,
    });
    NetworkSettings {
        node: settings.node.clone(),
        namespace: settings.namespace.clone(),
        graph: settings.graph,
        domain_id: settings.domain_id,
        only_networks: settings.only_networks.clone(),
        written: table.iter().map(Outgoing::written).collect(),
        read: read.collect(),
        recovery: settings.recovery,
        echo_is_proven: false,
        history_bytes: history_bytes(&settings.isolation),
        services: settings.services.clone(),
        transport: settings.transport.clone(),
    }
}

/// Returns the limit for the writers' history, bytes: two thirds of the process's memory limit.
fn history_bytes(isolation: &Isolation) -> usize {
    let bytes = match isolation {
        Isolation::Process { memory_limit_mb, .. } => (u64::from(*memory_limit_mb) << 20) * 2 / 3,
        Isolation::Thread => THREAD_HISTORY,
    };
    usize::try_from(bytes).unwrap_or(usize::MAX)
}
