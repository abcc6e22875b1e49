"""An independent writer (Cyclone DDS) to the gateway's subscriptions, for the tests.

Usage: writer.py DOMAIN KIND TOPIC RELIABILITY DURABILITY
KIND is one of messages.py, RELIABILITY reliable or best_effort, DURABILITY transient_local or
volatile. Prints a line of JSON for each event: `ready`, `matched`, `unmatched`, `wrote`. Each line
of standard input is a message: for text the text itself, or `LENGTH*` for one of that length; for
groups `SEC ID COLOR SHAPE STATUS CONFIDENCE`; else so many bytes of nonsense. Ends when standard
input does.
"""

import json
import sys
import threading
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from messages import TYPES, Element, Group, GroupArray, Text, Time


def say(event, **fields):
    print(json.dumps({"event": event, "at": time.time(), **fields}), flush=True)


def message(kind, line):
    if kind == "text":
        return Text("x" * int(line[:-1]) if line.endswith("*") else line)
    if kind == "groups":
        sec, group, color, shape, status, confidence = line.split()
        element = Element(int(color), int(shape), int(status), float(confidence))
        return GroupArray(Time(int(sec), 1), [Group(int(group), [element], [])])
    return TYPES[kind]([255 - i % 7 for i in range(int(line))])


def watch(writer, ended):
    matched = set()
    while not ended.is_set():
        now = set(writer.get_matched_subscriptions())
        for _ in now - matched:
            say("matched")
        for _ in matched - now:
            say("unmatched")
        matched = now
        time.sleep(0.005)


def main():
    domain, kind, topic_name, reliability, durability = sys.argv[1:]
    participant = DomainParticipant(int(domain))
    qos = Qos(
        Policy.Reliability.Reliable(duration(seconds=10))
        if reliability == "reliable"
        else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal
        if durability == "transient_local"
        else Policy.Durability.Volatile,
        Policy.History.KeepLast(10),
    )
    writer = DataWriter(participant, Topic(participant, topic_name, TYPES[kind], qos=qos), qos=qos)
    say("ready")
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=[writer, ended])
    watcher.start()
    for line in sys.stdin:
        sample = message(kind, line.rstrip("\n"))
        before = time.time()
        writer.write(sample)
        say("wrote", before=before)
    ended.set()
    watcher.join()
    # Returning frees the participant, and that says goodbye to the network.


main()
