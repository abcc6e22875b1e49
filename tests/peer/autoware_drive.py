"""An independent Autoware (Cyclone DDS) that drives by a script, in real time, and reads commands.

Usage: autoware_drive.py DOMAIN SCRIPT GATEWAYS PACE [NAME=TOPIC]...
So many gateways must read what is published. PACE is `timed`, where each cycle comes at its time; or `paced`, where
a cycle also waits until commands follow the last but one, and one that is late holds up those after it, so
that a busy machine makes a drive longer and no different. NAME begins with `turn` or `hazard`: commands to read there; or with
`report`: reports of the turn indicators.
SCRIPT has a JSON object a line: first the topics by name, then a cycle each with `t` in seconds, `odometry`
(x, y, yaw, z, speed), `path` (x, y, yaw, z, speed, lanelet), `factors` by module, `lane_driving`, and
`route`, `hazard_request`, `own_turn`, `own_hazard`, `control_mode` where there are any. The first cycle is repeated until
a command comes on every topic that is read. Prints one line of JSON: `cycles`, when each was published, and
`received`, by name: the stamp of each command, its number, when it was received; times of day in nanoseconds.
"""

import json
import math
import struct
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
from autoware_messages import (
    COVARIANCE,
    KEPT,
    SAMPLES,
    ControlMode,
    ControlPoint,
    HazardCommand,
    LaneletPrimitive,
    LaneletRoute,
    LaneletSegment,
    Odometry,
    OperationModeState,
    PathPoint,
    PathPointWithLaneId,
    PathWithLaneId,
    PlanningFactor,
    PlanningFactorArray,
    PoseWithCovariance,
    SafetyFactorArray,
    Scenario,
    TurnCommand,
    Twist,
    TwistWithCovariance,
    Uuid,
)
from messages import Header, Point, Pose, Quaternion, Time, Turn, Vector

NOTHING = Vector(0.0, 0.0, 0.0)
# Nobody waits longer for the other side.
PATIENCE_S = 120
# The first cycle is published so often once commands come, so that all of it is known.
REPEATS = 5


def now_stamp():
    now = time.time_ns()
    return now, Time(now // 1_000_000_000, now % 1_000_000_000)


def number(value):
    """JSON has none for what is not a number."""
    return math.nan if value is None else value


def pose(x, y, yaw, z):
    x, y, yaw = number(x), number(y), number(yaw)
    # A height that is not known is that of a flat map.
    return Pose(Point(x, y, z or 0.0), Quaternion(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def path(points):
    """The message, stamped 0."""
    return PathWithLaneId(
        Header(Time(0, 0), "map"),
        [
            PathPointWithLaneId(PathPoint(pose(x, y, yaw, z), speed, 0.0, 0.0, False), [lane] if lane else [])
            for x, y, yaw, z, speed, lane in points
        ],
        [],
        [],
    )


def path_bytes(points):
    """The bytes of [`path`]; Cyclone needs a tenth of a second for them, and they are due that often."""
    data = bytearray(b"\0\1\0\0" + struct.pack("<iiI4sI", 0, 0, 4, b"map\0", len(points)))
    for x, y, yaw, z, speed, lane in points:
        data += bytes((4 - len(data)) % 8)
        data += struct.pack("<7d3f?", x, y, z or 0.0, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2), speed, 0.0, 0.0, False)
        data += struct.pack("<3xI", 1 if lane else 0)
        if lane:
            data += bytes((4 - len(data)) % 8) + struct.pack("<q", lane)
    return data + struct.pack("<II", 0, 0)


def factors(header, module, listed):
    return PlanningFactorArray(
        header,
        [
            PlanningFactor(
                module,
                factor["forward"],
                [ControlPoint(pose(x, y, yaw, z), 0.0, shift, 0.0) for x, y, yaw, z, shift in factor["points"]],
                factor["behavior"],
                "",
                SafetyFactorArray(header, [], True, ""),
            )
            for factor in listed
        ],
    )


def route(header, planned):
    lanes = [[LaneletPrimitive(lane, "lane") for lane in lanes] for lanes in planned["segments"]]
    segments = [LaneletSegment(segment[0], segment) for segment in lanes]
    id_bytes = list(int(planned["id"]).to_bytes(16, "big"))
    return LaneletRoute(header, pose(*planned["start"]), pose(*planned["goal"]), segments, Uuid(id_bytes), False)


class Autoware:
    def __init__(self, participant, topics):
        self.writers = {name: self.open_writer(participant, name, topic) for name, topic in topics.items()}
        self.route = None

    @staticmethod
    def open_writer(participant, name, topic):
        message = type(SAMPLES[name.partition(":")[0]])
        qos = quality(name in KEPT)
        return DataWriter(participant, Topic(participant, f"rt{topic}", message, qos=qos), qos=qos)

    def write(self, name, message):
        self.writers[name].write(message)

    def publish(self, cycle):
        """Everything of a cycle, the odometry last."""
        _, stamp = now_stamp()
        header = Header(stamp, "map")
        planned = cycle.get("route", self.route)
        if planned != self.route:
            self.route = planned
            self.write("route", route(header, planned))
            self.write("operation_mode", OperationModeState(stamp, 2, True, False, True, True, True, True))
        self.write("scenario", Scenario("LaneDriving" if cycle["lane_driving"] else "Parking", []))
        self.write_path(cycle["path"], stamp)
        for name in self.writers:
            if name.startswith("factors:"):
                module = name.partition(":")[2]
                self.write(name, factors(header, module, cycle["factors"].get(module, [])))
        for name, message in (
            ("hazard_request", HazardCommand),
            ("own_turn", TurnCommand),
            ("own_hazard", HazardCommand),
            ("control_mode", ControlMode),
        ):
            if name in cycle:
                self.write(name, message(stamp, cycle[name]))
        if cycle["odometry"] is not None:
            x, y, yaw, z, speed = cycle["odometry"]
            twist = Twist(Vector(number(speed), 0.0, 0.0), NOTHING)
            where = PoseWithCovariance(pose(x, y, yaw, z), COVARIANCE)
            self.write("odometry", Odometry(header, "base_link", where, TwistWithCovariance(twist, COVARIANCE)))

    def write_path(self, points, stamp):
        sample = path(points[:1])
        data = path_bytes(points)
        struct.pack_into("<iI", data, 4, stamp.sec, stamp.nanosec)
        sample.serialize = lambda **_: bytes(data)
        self.write("path", sample)


def quality(kept):
    # Deep enough that nothing waiting to be acknowledged is overwritten.
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=10)),
        Policy.Durability.TransientLocal if kept else Policy.Durability.Volatile,
        Policy.History.KeepLast(1000),
    )


def open_reader(participant, name, topic):
    kinds = {"turn": TurnCommand, "hazard": HazardCommand, "report": Turn}
    message = next(message for kind, message in kinds.items() if name.startswith(kind))
    qos = quality(False)
    return DataReader(participant, Topic(participant, f"rt{topic}", message, qos=qos), qos=qos)


def receive(participant, readers, received, ended):
    changes = matches.Changes(participant, readers=readers.values())
    while not ended.is_set():
        for name, reader in readers.items():
            for sample in reader.take(N=100):
                if sample.sample_info.valid_data:
                    stamp = sample.stamp.sec * 1_000_000_000 + sample.stamp.nanosec
                    value = sample.report if isinstance(sample, Turn) else sample.command
                    received[name].append([stamp, value, time.time_ns()])
        changes.wait()


def keep_up(received, published):
    """Whether commands on every topic follow the last but one of the cycles that were published."""
    return len(published) < 2 or all(commands[-1][0] > published[-2] for commands in received.values())


def has_followed(received, stamp):
    """Whether commands on every topic are newer than a time, and the report, if it is read, says what the last one does."""
    if not all(commands[-1][0] > stamp for commands in received.values()):
        return False
    return "report" not in received or received["report"][-1][1] == received["turn"][-1][1]


def wait_until(is_it, what, meanwhile=lambda: None, pause=0.1):
    end = time.monotonic() + PATIENCE_S
    while not is_it():
        if time.monotonic() > end:
            sys.exit(f"timed out waiting for {what}")
        meanwhile()
        time.sleep(pause)


def main():
    domain, script, gateways, pace, *pairs = sys.argv[1:]
    with open(script, encoding="utf-8") as lines:
        topics, *cycles = map(json.loads, lines)
    some = next(cycle["path"] for cycle in cycles if cycle["path"])
    assert path(some).serialize() == bytes(path_bytes(some)), "not the bytes that Cyclone makes"
    participant = DomainParticipant(int(domain))
    autoware = Autoware(participant, topics)
    names = dict(pair.split("=") for pair in pairs)
    readers = {name: open_reader(participant, name, topic) for name, topic in names.items()}
    received = {name: [] for name in readers}
    wait_until(
        lambda: all(
            len(matches.subscriptions(writer)) >= int(gateways) for writer in autoware.writers.values()
        )
        and all(matches.publications(reader) for reader in readers.values()),
        "the gateways",
    )
    ended = threading.Event()
    listener = threading.Thread(target=receive, args=[participant, readers, received, ended], daemon=True)
    listener.start()
    wait_until(
        lambda: all(any(command for _, command, _ in commands) for commands in received.values()),
        "commands",
        lambda: autoware.publish(cycles[0]),
    )
    for _ in range(REPEATS):
        autoware.publish(cycles[0])
        time.sleep(0.1)
    published = []
    begin = time.monotonic() - cycles[0]["t"]
    for cycle in cycles:
        time.sleep(max(0.0, begin + cycle["t"] - time.monotonic()))
        if pace == "paced":
            wait_until(lambda: keep_up(received, published), "commands of the last but one cycle", pause=0.005)
            begin = max(begin, time.monotonic() - cycle["t"])
        published.append(time.time_ns())
        autoware.publish(cycle)
    # What follows from the last cycle.
    if pace == "paced":
        wait_until(lambda: has_followed(received, published[-1]), "commands of the last cycle", pause=0.005)
    time.sleep(0.4)
    ended.set()
    listener.join()
    print(json.dumps({"cycles": published, "received": received}), flush=True)


main()
