"""Autoware's own readers of the vehicle's status (Cyclone DDS), rule by rule, for the tests.

Usage: autoware_vehicle.py DOMAIN
Reads as Autoware does: reliable, volatile, depth 1, the velocity with depth 10. Prints a line of JSON for each event:
`ready`, and
`twist`          what vehicle_velocity_converter makes of a velocity (header copied) and gyro_odometer takes, with `frame`, `vx`, `wz`
`stale`          a twist whose stamp is more than 0.2 s from now: gyro_odometer clears its queues
`gear_command`   a change of what shift_decider sends while nobody drives, ten a second: the last gear reported
`status`         a change of what default_adapi sends as /api/vehicle/status, ten a second, once all four reports have come
`engaged`        a change of what operation_mode_transition_manager and mrm_handler take the control mode for
`doors`          a change of the states of the doors
Ends when standard input does.
"""

import json
import sys
import threading
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import matches
from messages import TYPES

TOPICS = {
    "velocity": "vehicle/status/velocity_status",
    "steering": "vehicle/status/steering_status",
    "gear": "vehicle/status/gear_status",
    "control_mode": "vehicle/status/control_mode",
    "turn": "vehicle/status/turn_indicators_status",
    "hazard": "vehicle/status/hazard_lights_status",
    "doors": "vehicle/doors/status",
}
MESSAGE_TIMEOUT_S = 0.2
# default_adapi's tables; a number that is not in them is unknown, as NONE (0) is.
GEARS = {1: "NEUTRAL", **dict.fromkeys(range(2, 20), "DRIVE"), 20: "REVERSE", 21: "REVERSE", 22: "PARK", 23: "LOW", 24: "LOW"}
TURNS = {1: "DISABLE", 2: "LEFT", 3: "RIGHT"}
HAZARDS = {1: "DISABLE", 2: "ENABLE"}
AUTONOMOUS = 1


def emit(event, **fields):
    print(json.dumps({"event": event, **fields}), flush=True)


class Changes:
    """Prints an event when its content is another."""

    def __init__(self):
        self.last = {}

    def emit(self, event, **fields):
        if self.last.get(event) != fields:
            self.last[event] = fields
            emit(event, **fields)


def open_reader(participant, kind):
    qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=100)),
        Policy.Durability.Volatile,
        Policy.History.KeepLast(10 if kind == "velocity" else 1),
    )
    topic = Topic(participant, f"rt/{TOPICS[kind]}", TYPES[kind], qos=qos)
    return DataReader(participant, topic, qos=qos)


def odometer(report):
    stamp = report.header.stamp
    if abs(time.time() - (stamp.sec + stamp.nanosec / 1e9)) > MESSAGE_TIMEOUT_S:
        emit("stale")
    else:
        vx, wz = report.longitudinal_velocity, report.heading_rate
        emit("twist", frame=report.header.frame_id, vx=vx, wz=wz)


def on_timer(latest, changes):
    if "gear" in latest:
        changes.emit("gear_command", command=latest["gear"].report)
    if all(kind in latest for kind in ("steering", "gear", "turn", "hazard")):
        changes.emit(
            "status",
            gear=GEARS.get(latest["gear"].report, "UNKNOWN"),
            turn=TURNS.get(latest["turn"].report, "UNKNOWN"),
            hazard=HAZARDS.get(latest["hazard"].report, "UNKNOWN"),
            angle=round(latest["steering"].steering_tire_angle, 4),
        )


def watch(participant, ended):
    readers = {kind: open_reader(participant, kind) for kind in TOPICS}
    waiting = matches.Changes(participant, readers=readers.values())
    changes, latest, due = Changes(), {}, time.monotonic()
    emit("ready")
    while not ended.is_set():
        for kind, reader in readers.items():
            for sample in reader.take(N=100):
                if sample.sample_info.valid_data:
                    latest[kind] = sample
                    if kind == "velocity":
                        odometer(sample)
        if "control_mode" in latest:
            changes.emit("engaged", is_autonomous=latest["control_mode"].mode == AUTONOMOUS)
        if "doors" in latest:
            changes.emit("doors", states=[door.status for door in latest["doors"].doors])
        if time.monotonic() >= due:
            due = time.monotonic() + 0.1
            on_timer(latest, changes)
        waiting.wait()


def main():
    participant = DomainParticipant(int(sys.argv[1]))
    ended = threading.Event()
    watcher = threading.Thread(target=watch, args=[participant, ended])
    watcher.start()
    sys.stdin.read()
    ended.set()
    watcher.join()


main()
