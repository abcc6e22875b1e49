"""An independent Autoware (Cyclone DDS) for the tests: publishes what the gateway reads, reads what it publishes.

Usage: autoware.py DOMAIN
Prints a line of JSON for each event: `ready`, `matched` once each of its writers is read and each of its
readers has a writer, `received` with what it read, `sent`. Each line of standard input is a command:
`publish TOPIC` sends the sample of that topic; `nonsense TOPIC LENGTH` bytes that are not a message;
`path POINTS BOUND TIMES` large paths, ten a second, stamped 1 s, 2 s and so on. Ends when standard
input does.
"""

import json
import sys
import threading
import time
from dataclasses import asdict

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import matches
from autoware_messages import KEPT, SAMPLES, HazardCommand, TurnCommand, large_path, nonsense_type

RECEIVED = {"commanded_turn": TurnCommand, "commanded_hazard": HazardCommand}


def emit(event, **fields):
    print(json.dumps({"event": event, **fields}, default=list), flush=True)


def quality(kept):
    # Deep enough that nothing waiting to be acknowledged is overwritten.
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=10)),
        Policy.Durability.TransientLocal if kept else Policy.Durability.Volatile,
        Policy.History.KeepLast(40),
    )


def open_writer(participant, name, message):
    qos = quality(name in KEPT)
    return DataWriter(participant, Topic(participant, f"rt/{name}", message, qos=qos), qos=qos)


def open_reader(participant, name):
    qos = quality(False)
    return DataReader(participant, Topic(participant, f"rt/{name}", RECEIVED[name], qos=qos), qos=qos)


def watch(participant, writers, readers, ended):
    matched = False
    changes = matches.Changes(participant, readers=readers.values())
    while not ended.is_set():
        if not matched:
            matched = all(matches.subscriptions(writer) for writer in writers) and all(
                matches.publications(reader) for reader in readers.values()
            )
            if matched:
                emit("matched")
        for name, reader in readers.items():
            for sample in reader.take(N=100):
                if sample.sample_info.valid_data:
                    emit("received", topic=name, data=asdict(sample))
        changes.wait()


def send_paths(writer, points, bound, times):
    sample = large_path(points, bound)
    data = bytearray(sample.serialize())
    begin = time.monotonic()
    for number in range(1, times + 1):
        data[4:8] = number.to_bytes(4, "little")
        # Making the bytes again would take longer than the time there is.
        sample.serialize = lambda **_: bytes(data)
        writer.write(sample)
        # A machine that is too slow for ten a second takes its time, rather than lose some.
        writer.wait_for_acks(duration(seconds=60))
        time.sleep(max(0.0, begin + number / 10 - time.monotonic()))
    emit("sent", bytes=len(data), seconds=time.monotonic() - begin)


def main():
    participant = DomainParticipant(int(sys.argv[1]))
    writers = {name: open_writer(participant, name, type(SAMPLES[name])) for name in SAMPLES}
    # Two types of one name need two participants.
    other = DomainParticipant(int(sys.argv[1]))
    foreign = {name: open_writer(other, name, nonsense_type(name)) for name in SAMPLES}
    readers = {name: open_reader(participant, name) for name in RECEIVED}
    emit("ready")
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=[participant, [*writers.values(), *foreign.values()], readers, ended])
    watcher.start()
    for line in sys.stdin:
        command, *arguments = line.split()
        if command == "publish":
            writers[arguments[0]].write(SAMPLES[arguments[0]])
        elif command == "nonsense":
            nonsense = nonsense_type(arguments[0])([255 - number % 7 for number in range(int(arguments[1]))])
            foreign[arguments[0]].write(nonsense)
        else:
            send_paths(writers["path"], *map(int, arguments))
    ended.set()
    watcher.join()
    # Returning frees the participant, and that announces its end to the network.


main()
