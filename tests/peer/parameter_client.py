"""A client of a node's parameter services, as rmw_cyclonedds makes one (Cyclone DDS), for the tests.

Usage: parameter_client.py DOMAIN NODE, with NODE as `vehicle/signal_gateway`. Before each request and response stand the
number of the client and that of the request. Prints a line of JSON for each event: `ready` once all services are matched,
`answer` with its service, number and data, `changed` with an event of this node on `/parameter_events` as its data. Each
line of standard input is a request: `SERVICE NAME...` with one of list_parameters (prefixes, then the depth),
get_parameters, get_parameter_types, describe_parameters, set_parameters and set_parameters_atomically (names of
parameters that are to become true), or `nonsense COUNT`: so many bytes of it to get_parameters. Ends when standard input does.
"""

import json
import os
import sys
import threading
import time
from dataclasses import asdict, dataclass
from types import new_class

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, int64, sequence, uint8, uint32, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import matches

MESSAGE = "rcl_interfaces::msg::dds_::"
QOS = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=100)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(100),
)


@dataclass
class Value(IdlStruct, typename=f"{MESSAGE}ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = ()
    bool_array_value: sequence[bool] = ()
    integer_array_value: sequence[int64] = ()
    double_array_value: sequence[float64] = ()
    string_array_value: sequence[str] = ()


@dataclass
class Parameter(IdlStruct, typename=f"{MESSAGE}Parameter_"):
    name: str
    value: Value


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class ParameterEvent(IdlStruct, typename=f"{MESSAGE}ParameterEvent_"):
    stamp: Time
    node: str
    new_parameters: sequence[Parameter]
    changed_parameters: sequence[Parameter]
    deleted_parameters: sequence[Parameter]


@dataclass
class FloatRange(IdlStruct, typename=f"{MESSAGE}FloatingPointRange_"):
    from_value: float64
    to_value: float64
    step: float64


@dataclass
class IntegerRange(IdlStruct, typename=f"{MESSAGE}IntegerRange_"):
    from_value: int64
    to_value: int64
    step: uint64


@dataclass
class Descriptor(IdlStruct, typename=f"{MESSAGE}ParameterDescriptor_"):
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[FloatRange]
    integer_range: sequence[IntegerRange]


@dataclass
class SetResult(IdlStruct, typename=f"{MESSAGE}SetParametersResult_"):
    successful: bool
    reason: str


NAMES = [("names", sequence[str])]
PARAMETERS = [("parameters", sequence[Parameter])]
# Fields of request and response by service and type.
SERVICES = {
    "list_parameters": (
        "ListParameters",
        [("prefixes", sequence[str]), ("depth", uint64)],
        [("names", sequence[str]), ("prefixes", sequence[str])],
    ),
    "get_parameters": ("GetParameters", NAMES, [("values", sequence[Value])]),
    "get_parameter_types": ("GetParameterTypes", NAMES, [("types", sequence[uint8])]),
    "describe_parameters": ("DescribeParameters", NAMES, [("descriptors", sequence[Descriptor])]),
    "set_parameters": ("SetParameters", PARAMETERS, [("results", sequence[SetResult])]),
    "set_parameters_atomically": (
        "SetParametersAtomically",
        PARAMETERS,
        [("successful", bool), ("reason", str)],
    ),
}


def typed(name, fields):
    """A request or response: the numbers of client and request, then its fields."""
    annotations = dict([("client", uint64), ("number", int64), *fields])
    keywords = {"typename": f"rcl_interfaces::srv::dds_::{name}"}
    made = new_class(name, (IdlStruct,), keywords, lambda body: body.update(__annotations__=annotations))
    return dataclass(made)


Nonsense = typed("GetParameters_Request_", [("data", sequence[uint8])])


def emit(event, **fields):
    # In one piece: two threads may print.
    sys.stdout.write(json.dumps({"event": event, "at": time.monotonic(), **fields}, default=list) + "\n")
    sys.stdout.flush()


class Service:
    def __init__(self, participant, node, name):
        base, request, response = SERVICES[name]
        self.name = name
        self.request = typed(f"{base}_Request_", request)
        self.response = typed(f"{base}_Response_", response)
        # The type only has to have the right name.
        self.requests = Topic(participant, f"rq/{node}/{name}Request", self.request, qos=QOS)
        self.writer = DataWriter(participant, self.requests, qos=QOS)
        replies = Topic(participant, f"rr/{node}/{name}Reply", self.response, qos=QOS)
        self.reader = DataReader(participant, replies, qos=QOS)

    def is_matched(self):
        return matches.subscriptions(self.writer) and matches.publications(self.reader)

    def ask(self, client, number, arguments):
        if self.name == "list_parameters":
            content = (arguments[:-1], int(arguments[-1]))
        elif self.name.startswith("set"):
            content = ([Parameter(name, Value(type=1, bool_value=True)) for name in arguments],)
        else:
            content = (arguments,)
        self.writer.write(self.request(client, number, *content))


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
