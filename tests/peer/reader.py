"""An independent reader (Cyclone DDS) of the gateway's topics, for the tests.

Usage: reader.py DOMAIN KIND TOPIC DURABILITY [KIND TOPIC DURABILITY]...
KIND is one of messages.py, factors, sections (markers), gid16 or gid24 (the ROS graph with identifiers of that length), or
`endpoints` (every writer in the domain, whatever its topic; TOPIC and DURABILITY mean nothing);
`KIND=NAME` where several are of one kind. DURABILITY is transient_local or volatile. Prints a line
of JSON for each event: `ready` (with the time of day since which it reads, nanoseconds), and with the kind or its name
`matched` and `unmatched` (with the writer's QoS), `sample` (with the writer's time of day). What arrived on a topic before
a sample of one that is named behind it is printed before that sample. Samples that wait for us: 10, or
SIGNAL_GATEWAY_PEER_DEPTH. The node they belong to: SIGNAL_GATEWAY_PEER_NODE, or none. Each line of standard input becomes the
participant's user data, which changes its announcement (`announced`). Ends when standard input does.
"""

import json
import os
import sys
import threading
import time
from dataclasses import asdict

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import matches
import ros_graph
from autoware_messages import PlanningFactorArray
from messages import TYPES, graph_types

TYPES = {**TYPES, "factors": PlanningFactorArray, "sections": TYPES["markers"]}


def emit(event, **fields):
    # In one piece: two threads may print.
    sys.stdout.write(json.dumps({"event": event, "at": time.monotonic(), **fields}, default=list) + "\n")
    sys.stdout.flush()


def offered(endpoint):
    """The writer's durability, reliability and identity as this side sees them."""
    kinds = [str(policy) for policy in endpoint.qos]
    return {"writer": endpoint.key.bytes.hex(), "qos": " ".join(kinds)}


def watch(participant, readers, ended):
    matched = {kind: {} for kind in readers}
    changes = matches.Changes(participant, readers=readers.values())
    while not ended.is_set():
        # What is taken last is printed first.
        taken = {kind: take_all(reader) for kind, reader in reversed(readers.items())}
        for kind, reader in readers.items():
            poll_matches(kind, reader, matched[kind])
            for sample in taken[kind]:
                if sample.sample_info.valid_data:
                    emit("sample", kind=kind, sent=sample.sample_info.source_timestamp, data=shown(sample))
        changes.wait()


def take_all(reader):
    samples = []
    while len(more := list(reader.take(N=100))) == 100:
        samples += more
    return samples + more


def poll_matches(kind, reader, matched):
    handles = set(matches.publications(reader))
    for handle in handles - matched.keys():
        endpoint = reader.get_matched_publication_data(handle)
        if endpoint is not None:
            matched[handle] = offered(endpoint)
            emit("matched", kind=kind, **matched[handle])
    for handle in matched.keys() - handles:
        emit("unmatched", kind=kind, **matched.pop(handle))


def shown(sample):
    """A sample's content; of many groups their number."""
    if hasattr(sample, "type_name"):
        return {"topic": sample.topic_name, "type": sample.type_name, **offered(sample)}
    groups = getattr(sample, "traffic_light_groups", [])
    if len(groups) > 100:
        return {"stamp": asdict(sample.stamp), "groups": len(groups)}
    return asdict(sample)


def open_reader(participant, name, topic_name, durability):
    kind = name.partition("=")[0]
    if kind == "endpoints":
        return BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    message = graph_types(int(kind[3:]))[0] if kind.startswith("gid") else TYPES[kind]
    qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.TransientLocal
        if durability == "transient_local"
        else Policy.Durability.Volatile,
        Policy.History.KeepLast(int(os.environ.get("SIGNAL_GATEWAY_PEER_DEPTH", "10"))),
    )
    return DataReader(participant, Topic(participant, topic_name, message, qos=qos), qos=qos)


def main():
    domain, *arguments = sys.argv[1:]
    since = time.time_ns()
    participant = DomainParticipant(int(domain))
    triples = zip(*[iter(arguments)] * 3)
    readers = {
        triple[0].rpartition("=")[2]: open_reader(participant, *triple) for triple in triples
    }
    _graph = ros_graph.join(participant, readers=readers.values())
    emit("ready", since=since)
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=[participant, readers, ended])
    watcher.start()
    for line in sys.stdin:
        participant.set_qos(Qos(Policy.Userdata(line.encode())))
        emit("announced")
    ended.set()
    watcher.join()
    # Returning frees the participant, which announces to the network that it leaves.


main()
