"""Writes the frames of a candump log as bags, with two writers that are not ours.

bag_writer.py LOG FOLDER        prints the name of each file or bag in FOLDER: MCAP of the mcap package with chunks that are plain,
                                lz4 and zstd; bags of rosbags as MCAP with chunks that are plain and zstd, and as
                                sqlite3. Beside the frames there is a topic of another type.
"""

import sys
from pathlib import Path

from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

FRAME = """std_msgs/Header header
uint32 id
bool is_rtr
bool is_extended
bool is_error
uint8 dlc
uint8[8] data"""
HEADER = """================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec"""


def entries(log):
    for line in log.read_text().splitlines():
        stamp, interface, frame = line.split()
        sec, micros = (int(part) for part in stamp.strip("()").split("."))
        number, data = frame.split("#")
        yield sec, micros * 1000, interface, int(number, 16), len(number) == 8, bytes.fromhex(data)


def with_mcap(log, path, **options):
    with path.open("wb") as stream:
        writer = McapWriter(stream, **options)
        frames = writer.register_msgdef("can_msgs/msg/Frame", FRAME + "\n" + HEADER)
        texts = writer.register_msgdef("std_msgs/msg/String", "string data")
        for index, (sec, nanosec, interface, number, is_extended, data) in enumerate(entries(log)):
            at = sec * 1_000_000_000 + nanosec
            frame = {
                "header": {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": interface},
                "id": number,
                "is_rtr": False,
                "is_extended": is_extended,
                "is_error": False,
                "dlc": len(data),
                "data": list(data.ljust(8, b"\0")),
            }
            if index % 10 == 0:
                writer.write_message("/chatter", texts, {"data": f"text {index}"}, at, at)
            writer.write_message(f"/{interface}/from_can_bus", frames, frame, at, at)
        writer.finish()
    print(path.name)


def with_rosbags(log, path, storage, is_packed):
    import numpy

    types = get_typestore(Stores.ROS2_HUMBLE)
    types.register(get_types_from_msg(FRAME, "can_msgs/msg/Frame"))
    names = ["can_msgs/msg/Frame", "std_msgs/msg/Header", "builtin_interfaces/msg/Time", "std_msgs/msg/String"]
    frame_type, header_type, time_type, text_type = (types.types[name] for name in names)
    writer = Writer(path, version=9, storage_plugin=storage)
    if is_packed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        texts = writer.add_connection("/chatter", names[3], typestore=types)
        for index, (sec, nanosec, interface, number, is_extended, data) in enumerate(entries(log)):
            if interface not in connections:
                topic = f"/{interface}/from_can_bus"
                connections[interface] = writer.add_connection(topic, names[0], typestore=types)
            header = header_type(time_type(sec, nanosec), interface)
            padded = numpy.frombuffer(data.ljust(8, b"\0"), dtype=numpy.uint8)
            frame = frame_type(header, number, False, is_extended, False, len(data), padded)
            at = sec * 1_000_000_000 + nanosec
            if index % 10 == 0:
                writer.write(texts, at, types.serialize_cdr(text_type(f"text {index}"), names[3]))
            writer.write(connections[interface], at, types.serialize_cdr(frame, names[0]))
    print(path.name)


log, folder = (Path(argument) for argument in sys.argv[1:3])
for compression in (CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD):
    with_mcap(log, folder / f"{compression.name.lower()}.mcap", compression=compression, chunk_size=100_000)
with_rosbags(log, folder / "rosbags", StoragePlugin.MCAP, False)
with_rosbags(log, folder / "rosbags_zstd", StoragePlugin.MCAP, True)
with_rosbags(log, folder / "rosbags_sqlite3", StoragePlugin.SQLITE3, False)
