"""Decodes frames with cantools: an independent opinion on raw values.

usage: cantools_decode.py REQUESTS

REQUESTS has lines `file PATH` and `frame ID DATA` (ID decimal as in the DBC, bit 31 for 29-bit
ids; DATA in hex). Prints `file ok` or `file unloadable REASON` for each file, and for each frame of
a loaded file `frame NAME=RAW ...` with the signals that are in it; RAW is `?` where cantools fails.

Each signal is decoded in a message of its own (with its multiplexors): cantools cannot unpack
messages whose signals share bits, as those of real files do.
"""

import copy
import sys

import cantools
from cantools.database.can import Message
from cantools.database.errors import DecodeError


def alone(message, signal):
    """The message with only that signal and the multiplexors above it."""
    needed = [copy.copy(signal)]
    needed[0].is_multiplexer = False
    while needed[-1].multiplexer_signal is not None:
        needed.append(message.get_signal_by_name(needed[-1].multiplexer_signal))
    return Message(message.frame_id, message.name, message.length, needed,
                   is_extended_frame=message.is_extended_frame, strict=False)


def decode(signals, data):
    for name, message in signals:
        try:
            values = message.decode(data, decode_choices=False, scaling=False)
        except DecodeError as error:
            values = {} if "expected multiplexer id" in str(error) else {name: "?"}
        if name in values:
            yield name, values[name]


def load(path):
    """Message id to pairs of signal name and message of its own."""
    database = cantools.database.load_file(path, strict=False, encoding="cp1252")
    messages = {}
    for message in database.messages:
        frame_id = message.frame_id | (0x80000000 if message.is_extended_frame else 0)
        messages[frame_id] = [(signal.name, alone(message, signal)) for signal in message.signals]
    return messages


def main():
    messages = None
    with open(sys.argv[1], encoding="utf-8") as requests:
        for request in requests:
            kind, _, rest = request.rstrip("\n").partition(" ")
            if kind == "file":
                try:
                    messages = load(rest)
                    print("file ok")
                except Exception as error:
                    messages = None
                    print("file unloadable", str(error).replace("\n", " "))
            elif messages is not None:
                frame_id, _, data = rest.partition(" ")
                values = decode(messages[int(frame_id)], bytes.fromhex(data))
                print("frame", *(f"{name}={value}" for name, value in values))


main()
