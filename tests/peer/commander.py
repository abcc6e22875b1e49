"""An independent sender of commands (Cyclone DDS) for the tests: the commands of Autoware to the vehicle.

Usage: commander.py DOMAIN DURABILITY
DURABILITY is volatile, or transient_local, which a reader of volatile data must take as well. Sends
`turn`, `hazard` and `mode` reliably with depth 1, on Autoware's names of them. A line of standard input is

    TOPIC VALUE[,VALUE]... HZ   send these raw values in turn from now on, so many times a second, until…
    TOPIC silent                … nothing more is sent
    TOPIC once VALUE            one message, between the others
    TOPIC stamps SECONDS        from now on stamps differ from the time of day by so much

with several commands on a line apart by `;`, which then begin together. Prints a line of JSON for each
event: `ready`; `matched` and `unmatched` with the topic; `done` with the line, once it is carried out;
`status` for each diagnostics status about commands; `report` for each change of what the vehicle's lights
are reported to do. Ends when standard input does.
"""

import json
import sys
import threading
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import matches
from autoware_messages import ControlMode, HazardCommand, TurnCommand
from messages import DiagnosticArray, Hazard, Time, Turn

SENT_TYPES = {
    "turn": ("rt/control/command/turn_indicators_cmd", TurnCommand),
    "hazard": ("rt/control/command/hazard_lights_cmd", HazardCommand),
    "mode": ("rt/vehicle/status/control_mode", ControlMode),
}
REPORTED = {
    "turn": ("rt/vehicle/status/turn_indicators_status", Turn),
    "hazard": ("rt/vehicle/status/hazard_lights_status", Hazard),
}
TASKS = ("turn_indicators_command", "hazard_lights_command", "command_transmission")


def emit(event, **fields):
    # In one piece: two threads print.
    sys.stdout.write(json.dumps({"event": event, **fields}, default=list) + "\n")
    sys.stdout.flush()


class TopicSender:
    """One topic: its message, and when it is sent next."""

    def __init__(self, participant, kind, durability):
        name, self.message = SENT_TYPES[kind]
        qos = quality(durability)
        self.writer = DataWriter(participant, Topic(participant, name, self.message, qos=qos), qos=qos)
        self.kind = kind
        self.matched = False
        self.values = []
        self.period = 0.0
        self.due = None
        self.stamps = 0.0

    def command(self, words, now):
        if words[0] == "silent":
            self.due = None
        elif words[0] == "once":
            self.send(int(words[1]))
        elif words[0] == "stamps":
            self.stamps = float(words[1])
        else:
            self.values = [int(value) for value in words[0].split(",")]
            self.period = 1.0 / float(words[1])
            self.due = now

    def send_due(self, now):
        if self.due is not None and now >= self.due:
            self.send(self.values[0])
            self.values.append(self.values.pop(0))
            # A late one does not make up for what it missed.
            self.due = max(self.due + self.period, now)

    def send(self, value):
        stamp = time.time_ns() + int(self.stamps * 1e9)
        self.writer.write(self.message(Time(*divmod(stamp, 1_000_000_000)), value))

    def poll_matches(self):
        matched = bool(matches.subscriptions(self.writer))
        if matched != self.matched:
            self.matched = matched
            emit("matched" if matched else "unmatched", topic=self.kind)


def quality(durability):
    return Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.TransientLocal if durability == "transient_local" else Policy.Durability.Volatile,
        Policy.History.KeepLast(1),
    )


def open_reader(participant, name, message, depth):
    qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
    )
    return DataReader(participant, Topic(participant, name, message, qos=qos), qos=qos)


def emit_samples(kind, samples, shown):
    for sample in samples:
        if not sample.sample_info.valid_data:
            continue
        if kind != "diagnostics":
            if shown.get(kind) != sample.report:
                emit("report", topic=kind, report=sample.report)
            shown[kind] = sample.report
            continue
        for status in sample.status:
            task = status.name.rpartition(": ")[2]
            if task in TASKS:
                values = {value.key: value.value for value in status.values}
                level = status.level if isinstance(status.level, int) else status.level[0]
                emit("status", task=task, level=level, message=status.message, values=values)


def run_topics(senders, readers, lock, ended):
    shown = {}
    rounds = 0
    while not ended.is_set():
        with lock:
            now = time.monotonic()
            for sender in senders.values():
                sender.send_due(now)
            due = [sender.due for sender in senders.values() if sender.due is not None]
        # Polling is dear on a slow machine; sending must be on time.
        rounds += 1
        if rounds % 5 == 0 or not due:
            for sender in senders.values():
                sender.poll_matches()
            for kind, reader in readers.items():
                emit_samples(kind, reader.take(N=100), shown)
        ended.wait(min([0.02, *(max(0.0, at - time.monotonic()) for at in due)]))


def main():
    participant = DomainParticipant(int(sys.argv[1]))
    senders = {kind: TopicSender(participant, kind, sys.argv[2]) for kind in SENT_TYPES}
    readers = {kind: open_reader(participant, *topic, 1) for kind, topic in REPORTED.items()}
    readers["diagnostics"] = open_reader(participant, "rt/diagnostics", DiagnosticArray, 1000)
    emit("ready")
    lock, ended = threading.Lock(), threading.Event()
    worker = threading.Thread(target=run_topics, args=[senders, readers, lock, ended])
    worker.start()
    for line in sys.stdin:
        with lock:
            now = time.monotonic()
            for command in line.split(";"):
                topic, *words = command.split()
                senders[topic].command(words, now)
        emit("done", line=line.strip())
    ended.set()
    worker.join()
    # Returning frees the participant, which announces to the network that it leaves.


main()
