"""An independent Autoware (Cyclone DDS) for the tests: says what the gateway reads, reads what it says.

Usage: autoware.py DOMAIN
Prints a line of JSON for each event: `ready`, `matched` once each of its writers is read and each of its
readers has a writer, `heard` with what it read, `sent`. Each line of standard input is a command:
`say TOPIC` sends the sample of that topic; `nonsense TOPIC LENGTH` bytes that are not a message;
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

from autoware_messages import KEPT, SAMPLES, HazardCommand, TurnCommand, large_path, nonsense_type

HEARD = {"commanded_turn": TurnCommand, "commanded_hazard": HazardCommand}


def say(event, **fields):
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
    return DataReader(participant, Topic(participant, f"rt/{name}", HEARD[name], qos=qos), qos=qos)


def watch(writers, readers, ended):
    matched = False
    while not ended.is_set():
        if not matched:
            matched = all(writer.get_matched_subscriptions() for writer in writers) and all(
                reader.get_matched_publications() for reader in readers.values()
            )
            if matched:
                say("matched")
        for name, reader in readers.items():
            for sample in reader.take(N=100):
                if sample.sample_info.valid_data:
                    say("heard", topic=name, data=asdict(sample))
        time.sleep(0.005)


def send_paths(writer, points, bound, times):
    sample = large_path(points, bound)
    data = bytearray(sample.serialize())
    begin = time.monotonic()
    for number in range(1, times + 1):
        data[4:8] = number.to_bytes(4, "little")
        # Making the bytes anew would take longer than the time there is.
        sample.serialize = lambda **_: bytes(data)
        writer.write(sample)
        # A machine that is too slow for ten a second takes its time, rather than lose some.
        writer.wait_for_acks(duration(seconds=60))
        time.sleep(max(0.0, begin + number / 10 - time.monotonic()))
    say("sent", bytes=len(data), seconds=time.monotonic() - begin)


def main():
    participant = DomainParticipant(int(sys.argv[1]))
    writers = {name: open_writer(participant, name, type(SAMPLES[name])) for name in SAMPLES}
    # Two types of one name need two participants.
    other = DomainParticipant(int(sys.argv[1]))
    liars = {name: open_writer(other, name, nonsense_type(name)) for name in SAMPLES}
    readers = {name: open_reader(participant, name) for name in HEARD}
    say("ready")
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=[[*writers.values(), *liars.values()], readers, ended])
    watcher.start()
    for line in sys.stdin:
        command, *words = line.split()
        if command == "say":
            writers[words[0]].write(SAMPLES[words[0]])
        elif command == "nonsense":
            nonsense = nonsense_type(words[0])([255 - number % 7 for number in range(int(words[1]))])
            liars[words[0]].write(nonsense)
        else:
            send_paths(writers["path"], *map(int, words))
    ended.set()
    watcher.join()
    # Returning frees the participant, and that says goodbye to the network.


main()
