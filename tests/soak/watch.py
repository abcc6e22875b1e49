"""Reads the gateway's reports and diagnostics for a while and prints what was lost.

Usage: watch.py DOMAIN SECONDS
Reports come every 100 ms and at each change: each pause of more than 500 ms is a loss, after the first report, unless this program,
which does nothing else, did not run for as long either. So is a frame that the kernel dropped. Ends with 1 when something was lost.
"""

import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

sys.path.insert(0, __file__.rsplit("/", 2)[0] + "/peer")
from messages import DiagnosticArray, Hazard, Turn

domain, seconds = int(sys.argv[1]), float(sys.argv[2])
participant = DomainParticipant(domain)
reliable = Policy.Reliability.Reliable(duration(milliseconds=100))


def reader(name, kind):
    qos = Qos(reliable, Policy.Durability.Volatile, Policy.History.KeepLast(100))
    return DataReader(participant, Topic(participant, name, kind, qos=qos), qos=qos)


def received(topic):
    """The messages that have come; a writer that ends leaves samples without one."""
    return [sample for sample in topic.take(N=100) if sample.sample_info.valid_data]


readers = {
    "turn": reader("rt/vehicle/status/turn_indicators_status", Turn),
    "hazard": reader("rt/vehicle/status/hazard_lights_status", Hazard),
}
diagnostics = reader("rt/diagnostics", DiagnosticArray)
reports = {kind: 0 for kind in readers}
last, longest, pauses, worst, drops = {}, {}, {}, {}, 0
stood_still = {kind: 0.0 for kind in readers}
begun = before = time.monotonic()
while (now := time.monotonic()) < begun + seconds:
    for kind, topic in readers.items():
        # For how long this program did not run since the last report, the usual sleep not counted.
        stood_still[kind] += max(0.0, now - before - 0.01)
        if samples := received(topic):
            came, stamped = last.get(kind, (now, None))
            stamp = samples[0].stamp.sec + samples[0].stamp.nanosec / 1e9
            pause = now - came - stood_still[kind]
            if now - came > 0.4:
                made = "" if stamped is None else f", {stamp - stamped:.2f} s between the reports' times"
                print(f"{now - begun:7.1f} s  {kind}: none for {now - came:.2f} s{made}, {stood_still[kind]:.2f} s of it stood still")
            longest[kind] = max(longest.get(kind, 0), pause)
            pauses[kind] = pauses.get(kind, 0) + (pause > 0.5)
            reports[kind] += len(samples)
            last[kind] = (now, samples[-1].stamp.sec + samples[-1].stamp.nanosec / 1e9)
            stood_still[kind] = 0.0
    before = now
    for array in received(diagnostics):
        for status in array.status:
            level = status.level if isinstance(status.level, int) else ord(status.level)
            worst[status.name] = max(worst.get(status.name, (0, "")), (level, status.message))
            drops = max([drops] + [int(value.value) for value in status.values if value.key == "drops"])
    time.sleep(0.005)
for kind in readers:
    print(f"{kind}: {reports[kind]} reports, longest pause {1000 * longest.get(kind, 0):.0f} ms, {pauses.get(kind, 0)} too long")
for name, (level, message) in worst.items():
    print(f"worst of {name}: {level} {message}")
print(f"frames dropped: {drops}")
sys.exit(drops > 0 or any(pauses.values()) or not all(reports.values()))
