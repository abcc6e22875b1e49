"""An independent writer (Cyclone DDS) to the gateway's subscriptions, for the tests.

Usage: writer.py DOMAIN KIND TOPIC RELIABILITY DURABILITY [KIND TOPIC RELIABILITY DURABILITY]...
KIND is one of messages.py, RELIABILITY reliable or best_effort, DURABILITY transient_local or
volatile. Prints a line of JSON for each event: `ready`; `matched` and `unmatched` (with the number
of the topic, from 0, and the writer's GUID); `wrote`. Each line of standard input is a message: for text the text itself,
or `LENGTH*` for one of that length; for groups `SEC GROUP[, GROUP]...` with a GROUP of `ID` and any
number of `COLOR SHAPE STATUS CONFIDENCE`; for clock `SEC NANOSEC`; else so many bytes of nonsense. With several topics the
topic's number and a blank come first. Samples that wait for volatile readers: 10, or SIGNAL_GATEWAY_PEER_DEPTH.
The node they belong to: SIGNAL_GATEWAY_PEER_NODE, or none. Ends when standard input does.
"""

import json
import os
import sys
import threading
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import matches
import ros_graph
from messages import TYPES, Clock, Element, Group, GroupArray, Text, Time


def emit(event, **fields):
    # In one piece: two threads may print.
    sys.stdout.write(json.dumps({"event": event, "at": time.time(), **fields}) + "\n")
    sys.stdout.flush()


def message(kind, line):
    if kind == "text":
        return Text("x" * int(line[:-1]) if line.endswith("*") else line)
    if kind == "clock":
        seconds, _, nanos = line.partition(" ")
        return Clock(Time(int(seconds), int(nanos)))
    if kind == "groups":
        sec, _, groups = line.partition(" ")
        return GroupArray(Time(int(sec), 1), [group(text.split()) for text in groups.split(",")])
    return TYPES[kind]([255 - i % 7 for i in range(int(line))])


def group(words):
    bulbs = zip(*[iter(words[1:])] * 4)
    elements = [Element(int(c), int(shape), int(s), float(conf)) for c, shape, s, conf in bulbs]
    return Group(int(words[0]), elements, [])


def watch(participant, writers, ended):
    matched = [set() for _ in writers]
    changes = matches.Changes(participant, writers=writers)
    while not ended.is_set():
        for number, writer in enumerate(writers):
            now = set(matches.subscriptions(writer))
            for _ in now - matched[number]:
                emit("matched", topic=number, guid=writer.guid.hex)
            for _ in matched[number] - now:
                emit("unmatched", topic=number, guid=writer.guid.hex)
            matched[number] = now
        changes.wait()


def open_writer(participant, kind, topic_name, reliability, durability):
    # What a busy reader has not acknowledged yet is not overwritten; a late joiner is handed ten.
    depth = 10 if durability == "transient_local" else int(os.environ.get("SIGNAL_GATEWAY_PEER_DEPTH", "10"))
    qos = Qos(
        Policy.Reliability.Reliable(duration(seconds=10))
        if reliability == "reliable"
        else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal
        if durability == "transient_local"
        else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
        # Without it a late joiner is handed one sample, and those that nobody has acknowledged yet.
        Policy.DurabilityService(0, Policy.History.KeepLast(10), -1, -1, -1),
    )
    return DataWriter(participant, Topic(participant, topic_name, TYPES[kind], qos=qos), qos=qos)


def main():
    domain, *arguments = sys.argv[1:]
    participant = DomainParticipant(int(domain))
    topics = list(zip(*[iter(arguments)] * 4))
    writers = [open_writer(participant, *topic) for topic in topics]
    _graph = ros_graph.join(participant, writers=writers)
    emit("ready")
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=[participant, writers, ended])
    watcher.start()
    for line in sys.stdin:
        number, text = line.rstrip("\n").split(" ", 1) if len(topics) > 1 else ("0", line.rstrip("\n"))
        sample = message(topics[int(number)][0], text)
        before = time.time()
        writers[int(number)].write(sample)
        emit("wrote", before=before)
    ended.set()
    watcher.join()
    # Returning frees the participant, which announces to the network that it leaves.


main()
