"""The ROS graph, as a node of Jazzy joins it, or of Humble with SIGNAL_GATEWAY_PEER_GRAPH=24: a bridge carries what belongs to a node, and nothing else."""

import os

from cyclonedds.core import Policy, Qos
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from messages import graph_types


def join(participant, readers=(), writers=()):
    """Shows readers and writers as those of the node SIGNAL_GATEWAY_PEER_NODE, if that is set.

    Returns the writer of the graph, which shows them while it is kept.
    """
    node = os.environ.get("SIGNAL_GATEWAY_PEER_NODE")
    if not node:
        return None
    length = int(os.environ.get("SIGNAL_GATEWAY_PEER_GRAPH", 16))
    info, gid, entities = graph_types(length)
    qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.TransientLocal,
        Policy.History.KeepLast(1),
    )
    writer = DataWriter(participant, Topic(participant, "ros_discovery_info", info, qos=qos), qos=qos)

    def gids(endpoints):
        return [gid(list(endpoint.get_guid().bytes.ljust(length, b"\0"))) for endpoint in endpoints]

    writer.write(info(*gids([participant]), [entities("/", node, gids(readers), gids(writers))]))
    return writer
