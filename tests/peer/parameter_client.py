"""A client of a node's services, as rmw_cyclonedds makes one (Cyclone DDS), for the tests.

Usage: parameter_client.py DOMAIN NODE, with NODE as `vehicle/signal_gateway`. Before each request and response stand the
number of the client and that of the request. Prints a line of JSON for each event: `ready` once all services are matched,
`answer` with its service, number and data, `changed` with an event of this node on `/parameter_events` as its data. Each
line of standard input is a request: `SERVICE NAME...` with one of list_parameters (prefixes, then the depth),
get_parameters, get_parameter_types, describe_parameters, set_parameters and set_parameters_atomically (names of
parameters that are to become true), layout (of the doors), or `nonsense COUNT`: so many bytes of it to get_parameters. Ends when standard input does.
"""

import json
import os
import sys
import threading
import time
from dataclasses import asdict

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl.types import int64, sequence, uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import matches
from parameter_messages import SERVICES, ParameterEvent, content, typed

# Where the layout of the doors is, which is not below a node.
DOORS = "vehicle/doors"
QOS = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(100),
)


def numbered(name, fields):
    """A request or response: the numbers of client and request, then its fields."""
    return typed(name, [("client", uint64), ("number", int64), *fields])


Nonsense = numbered("GetParameters_Request_", [("data", sequence[uint8])])


def emit(event, **fields):
    # In one piece: two threads may print.
    sys.stdout.write(json.dumps({"event": event, "at": time.monotonic(), **fields}, default=list) + "\n")
    sys.stdout.flush()


class Service:
    def __init__(self, participant, node, name):
        base, request, response = SERVICES[name]
        self.name = name
        node = DOORS if name == "layout" else node
        self.request = numbered(f"{base}_Request_", request)
        self.response = numbered(f"{base}_Response_", response)
        # The type only has to have the right name.
        self.requests = Topic(participant, f"rq/{node}/{name}Request", self.request, qos=QOS)
        self.writer = DataWriter(participant, self.requests, qos=QOS)
        replies = Topic(participant, f"rr/{node}/{name}Reply", self.response, qos=QOS)
        self.reader = DataReader(participant, replies, qos=QOS)

    def is_matched(self):
        return matches.subscriptions(self.writer) and matches.publications(self.reader)

    def ask(self, client, number, arguments):
        self.writer.write(self.request(client, number, *content(self.name, arguments)))


def main():
    domain, node = sys.argv[1:]
    participant = DomainParticipant(int(domain))
    services = {name: Service(participant, node, name) for name in SERVICES}
    nonsense = DataWriter(
        participant, Topic(participant, f"rq/{node}/get_parametersRequest", Nonsense, qos=QOS), qos=QOS
    )
    # As rmw_qos_profile_parameter_events has it.
    events_qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.Volatile,
        Policy.History.KeepLast(1000),
    )
    changes = Topic(participant, "rt/parameter_events", ParameterEvent, qos=events_qos)
    events = DataReader(participant, changes, qos=events_qos)
    while not (
        all(s.is_matched() for s in services.values())
        and matches.subscriptions(nonsense)
        and matches.publications(events)
    ):
        time.sleep(0.01)
    emit("ready")
    client, ended = int.from_bytes(os.urandom(7), "little"), threading.Event()

    def watch():
        readers = [events, *(service.reader for service in services.values())]
        changes = matches.Changes(participant, readers=readers)
        while not ended.is_set():
            for sample in events.take(N=100):
                if sample.sample_info.valid_data and sample.node == f"/{node}":
                    emit("changed", data=asdict(sample))
            for service in services.values():
                for sample in service.reader.take(N=100):
                    if sample.sample_info.valid_data:
                        data = asdict(sample)
                        if data.pop("client") == client:
                            emit("answer", service=service.name, number=data.pop("number"), data=data)
            changes.wait()

    watcher = threading.Thread(target=watch)
    watcher.start()
    for number, line in enumerate(sys.stdin, start=1):
        name, *arguments = line.split()
        if name == "nonsense":
            nonsense.write(Nonsense(client, number, [255 - i % 7 for i in range(int(arguments[0]))]))
        else:
            services[name].ask(client, number, arguments)
    ended.set()
    watcher.join()


main()
