"""Writes what Autoware publishes on a drive as bags, with a serializer and two writers that are not ours.

drive_bag_writer.py SCRIPT FOLDER   SCRIPT is as autoware_drive.py has it; a topic "trajectory" takes the place of path and factors. Makes drive.mcap of the mcap package, with chunks in
                                    zstd, and the bag rosbags_sqlite3 of rosbags in FOLDER. Messages are serialized by rosbags.
"""

import json
import math
import sys
from pathlib import Path

import numpy
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

DEFINITIONS = Path(__file__).resolve().parents[2] / "ros" / "msg"
START_NS = 1_700_000_000_000_000_000
NAMES = {
    "odometry": "nav_msgs/msg/Odometry",
    "route": "autoware_planning_msgs/msg/LaneletRoute",
    "path": "autoware_internal_planning_msgs/msg/PathWithLaneId",
    "trajectory": "autoware_planning_msgs/msg/Trajectory",
    "factors": "autoware_internal_planning_msgs/msg/PlanningFactorArray",
    "scenario": "autoware_internal_planning_msgs/msg/Scenario",
    "own_turn": "autoware_vehicle_msgs/msg/TurnIndicatorsCommand",
    "report": "autoware_vehicle_msgs/msg/TurnIndicatorsReport",
}

STORE = get_typestore(Stores.ROS2_HUMBLE)
for definition in sorted(DEFINITIONS.glob("*/msg/*.msg")):
    package, name = definition.parts[-3], definition.stem
    if f"{package}/msg/{name}" not in STORE.types:
        STORE.register(get_types_from_msg(definition.read_text(), f"{package}/msg/{name}"))


def make(name, *values):
    return STORE.types[name](*values)


def time(nanos):
    return make("builtin_interfaces/msg/Time", nanos // 1_000_000_000, nanos % 1_000_000_000)


def header(nanos):
    return make("std_msgs/msg/Header", time(nanos), "map")


def number(value):
    """JSON has none for what is not a number."""
    return math.nan if value is None else float(value)


def pose(x, y, yaw, z):
    x, y, yaw = number(x), number(y), number(yaw)
    point = make("geometry_msgs/msg/Point", x, y, float(z or 0.0))
    return make("geometry_msgs/msg/Pose", point, make("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)))


def odometry(nanos, x, y, yaw, z, speed):
    covariance = numpy.zeros(36)
    where = make("geometry_msgs/msg/PoseWithCovariance", pose(x, y, yaw, z), covariance)
    vectors = [make("geometry_msgs/msg/Vector3", one, 0.0, 0.0) for one in (number(speed), 0.0)]
    twist = make("geometry_msgs/msg/TwistWithCovariance", make("geometry_msgs/msg/Twist", *vectors), covariance)
    return make(NAMES["odometry"], header(nanos), "base_link", where, twist)


def route(nanos, planned):
    package = "autoware_planning_msgs/msg/"
    segments = []
    for lanes in planned["segments"]:
        lanes = [make(package + "LaneletPrimitive", lane, "lane") for lane in lanes]
        segments.append(make(package + "LaneletSegment", lanes[0], lanes))
    uuid = numpy.frombuffer(int(planned["id"]).to_bytes(16, "big"), dtype=numpy.uint8)
    ends = [pose(*planned[end]) for end in ("start", "goal")]
    return make(NAMES["route"], header(nanos), *ends, segments, make("unique_identifier_msgs/msg/UUID", uuid), False)


def path(nanos, points):
    made = []
    for x, y, yaw, z, speed, lane in points:
        point = make("autoware_planning_msgs/msg/PathPoint", pose(x, y, yaw, z), number(speed), 0.0, 0.0, False)
        lanes = numpy.array([lane] if lane else [], dtype=numpy.int64)
        made.append(make("autoware_internal_planning_msgs/msg/PathPointWithLaneId", point, lanes))
    return make(NAMES["path"], header(nanos), made, [], [])


def trajectory(nanos, points):
    made = []
    for x, y, yaw, z, speed, _ in points:
        rest = [0.0] * 5  # lateral speed, acceleration, yaw rate, wheel angles
        point = make("autoware_planning_msgs/msg/TrajectoryPoint", make("builtin_interfaces/msg/Duration", 0, 0), pose(x, y, yaw, z), number(speed), *rest)
        made.append(point)
    return make(NAMES["trajectory"], header(nanos), made)


def factors(nanos, module, listed):
    package = "autoware_internal_planning_msgs/msg/"
    made = []
    for factor in listed:
        points = [
            make(package + "ControlPoint", pose(x, y, yaw, z), 0.0, float(shift), 0.0)
            for x, y, yaw, z, shift in factor["points"]
        ]
        safety = make(package + "SafetyFactorArray", header(nanos), [], True, "")
        made.append(make(package + "PlanningFactor", module, factor["forward"], points, factor["behavior"], "", safety))
    return make(NAMES["factors"], header(nanos), made)


def messages(topics, script):
    """Time, key and message of each sample, in the order of time."""
    is_learned = "trajectory" in topics
    for cycle in script:
        at = START_NS + round(cycle["t"] * 1e9)
        if "route" in cycle:
            yield at, "route", route(at, cycle["route"])
        yield at, "scenario", make(NAMES["scenario"], "LaneDriving" if cycle["lane_driving"] else "Parking", [])
        if is_learned:
            yield at, "trajectory", trajectory(at, cycle["path"])
        else:
            yield at, "path", path(at, cycle["path"])
            for module, listed in cycle["factors"].items():
                yield at, f"factors:{module}", factors(at, module, listed)
        for key in ("own_turn", "report"):
            if key in cycle:
                yield at, key, make(NAMES[key], time(at), cycle[key])
        if cycle["odometry"] is not None:
            yield at, "odometry", odometry(at, *cycle["odometry"])


def with_mcap(topics, samples, file):
    with file.open("wb") as stream:
        writer = McapWriter(stream, compression=CompressionType.ZSTD)
        writer.start("ros2")
        channels = {}
        for at, key, data in samples:
            name = NAMES[key.partition(":")[0]]
            if key not in channels:
                definition, _ = STORE.generate_msgdef(name, ros_version=2)
                schema = writer.register_schema(name, "ros2msg", definition.encode())
                channels[key] = writer.register_channel(topics[key], "cdr", schema)
            writer.add_message(channels[key], at, data, at)
        writer.finish()


def with_rosbags(topics, samples, folder):
    with Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {}
        for at, key, data in samples:
            if key not in connections:
                name = NAMES[key.partition(":")[0]]
                connections[key] = writer.add_connection(topics[key], name, typestore=STORE)
            writer.write(connections[key], at, data)


lines = [json.loads(line) for line in Path(sys.argv[1]).read_text().splitlines()]
made = [(at, key, bytes(STORE.serialize_cdr(message, NAMES[key.partition(":")[0]]))) for at, key, message in messages(lines[0], lines[1:])]
with_mcap(lines[0], made, Path(sys.argv[2]) / "drive.mcap")
with_rosbags(lines[0], made, Path(sys.argv[2]) / "rosbags_sqlite3")
print(len(made))
