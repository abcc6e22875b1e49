"""Reads MCAP recordings with two readers that are not ours, and prints what they have, as JSON.

mcap_reader.py both BAG         rosbags and mcap-ros2-support on the folder of a bag, or on a file: they must agree, and each
                                message is a line {"topic", "type", "log_time", "publish_time", "fields"}, in order
mcap_reader.py prefix FILE...   both on files that may have been cut: for each a line
                                {"file", "messages", "last", "is_complete", "rosbags"}, up to the last whole chunk.
                                mcap-ros2-support reads the file as it is; rosbags, which begins with the index at the end,
                                what `mcap recover` makes of it: the same chunks with an index
"""

import json
import sys
from pathlib import Path

import numpy
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader


def plain(value):
    """A decoded message of either reader as plain values."""
    if isinstance(value, numpy.ndarray):
        return [plain(item) for item in value.tolist()]
    if isinstance(value, (bytes, bytearray)):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (bool, int, float, str)):
        return value
    names = getattr(value, "__slots__", None) or value.__dataclass_fields__
    return {
        name: plain(getattr(value, name))
        for name in names
        if not name.startswith("_") and name == name.lower()
    }


def with_rosbags(bag):
    with AnyReader([bag]) as reader:
        for connection, log_time, data in reader.messages():
            fields = plain(reader.deserialize(data, connection.msgtype))
            yield connection.topic, connection.msgtype, log_time, bytes(data), fields


def with_mcap(bag):
    files = [bag] if bag.is_file() else sorted(bag.glob("*.mcap"), key=lambda path: int(path.stem.rsplit("_", 1)[1]))
    for path in files:
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for schema, channel, message, decoded in reader.iter_decoded_messages():
                yield channel.topic, schema.name, message, plain(decoded)


def both(bag):
    theirs = sorted(with_rosbags(bag), key=lambda entry: (entry[2], entry[0], entry[3]))
    in_order = list(with_mcap(bag))
    ours = sorted(in_order, key=lambda entry: (entry[2].log_time, entry[0], entry[2].data))
    assert len(theirs) == len(ours), (len(theirs), len(ours))
    for (topic, kind, log_time, data, fields), (topic2, kind2, message, fields2) in zip(theirs, ours):
        assert (topic, kind, log_time, data) == (topic2, kind2, message.log_time, message.data)
        assert fields == fields2, (topic, fields, fields2)
    for topic, kind, message, fields in in_order:
        times = {"log_time": message.log_time, "publish_time": message.publish_time}
        print(json.dumps({"topic": topic, "type": kind, **times, "fields": fields}))


def prefix(path):
    """The messages of a file up to the last whole chunk."""
    messages, last, is_complete = 0, 0, False
    factory, schemas, channels, decoders = DecoderFactory(), {}, {}, {}
    recovered = path.with_suffix(".recovered.mcap")
    writer = Writer(str(recovered), compression=CompressionType.NONE)
    writer.start(profile="ros2")
    schema_ids, channel_ids = {}, {}
    with path.open("rb") as stream:
        try:
            for record in StreamReader(stream, validate_crcs=True).records:
                name = type(record).__name__
                if name == "Schema":
                    schemas[record.id] = record
                    if record.id not in schema_ids:
                        schema_ids[record.id] = writer.register_schema(record.name, record.encoding, record.data)
                elif name == "Channel":
                    channels[record.id] = record
                    if record.id not in channel_ids:
                        channel_ids[record.id] = writer.register_channel(
                            record.topic, record.message_encoding, schema_ids[record.schema_id], record.metadata
                        )
                elif name == "Footer":
                    is_complete = True
                elif isinstance(record, Message):
                    channel = channels[record.channel_id]
                    if channel.id not in decoders:
                        schema = schemas[channel.schema_id]
                        decoders[channel.id] = factory.decoder_for(channel.message_encoding, schema)
                    decoders[channel.id](record.data)
                    messages, last = messages + 1, record.log_time
                    writer.add_message(
                        channel_ids[record.channel_id], record.log_time, record.data, record.publish_time, record.sequence
                    )
        except (EndOfFile, McapError):
            pass
    writer.finish()
    found = {"messages": messages, "last": last, "is_complete": is_complete}
    print(json.dumps({"file": str(path), **found, "rosbags": sum(1 for _ in with_rosbags(recovered))}))


if __name__ == "__main__":
    mode, *paths = sys.argv[1:]
    if mode == "both":
        both(Path(paths[0]))
    else:
        for path in paths:
            prefix(Path(path))
