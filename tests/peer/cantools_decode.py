"""Decodes frames with cantools: an independent opinion on raw values.

usage: cantools_decode.py REQUESTS

REQUESTS has lines `file PATH` and `frame ID DATA` (ID decimal as in the DBC, bit 31 for 29-bit
ids; DATA in hex). Prints `file whole`, `file bones REASON` or `file unloadable REASON` for each
file, and for each frame of a loaded file `frame NAME=RAW ...` for all it knows; RAW is `absent` for
signals that are not in the frame, `?` where cantools fails, and `frame none` stands for a message it does not know.

Bones are what is left of a file that cantools refuses: its well-formed messages and signals.

Each signal is decoded in a message of its own (with its multiplexors): cantools cannot unpack
messages whose signals share bits, as those of real files do.
"""

import copy
import re
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
        yield name, values.get(name, "absent")


MESSAGE = re.compile(r"BO_ +(\d+) +[A-Za-z_]\w* *: *\d+ +\w+\s*$")
NUMBER = r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)?"
SIGNAL = re.compile(
    rf'\s*SG_ +[A-Za-z_]\w*( +(M|m\d+M?))? *: *\d+\|\d+@[01][-+] *\({NUMBER},{NUMBER}\) *'
    rf'\[{NUMBER}\|{NUMBER}\] *"[^"]*" +[\w, ]+$')


def bones(text):
    """The lines of messages and signals that no reader can take amiss."""
    inside = False
    for line in text.splitlines():
        message = MESSAGE.match(line)
        if message:
            inside = int(message[1]) <= 0x7FF or bool(int(message[1]) & 0x80000000)
        elif line.strip() and not line.strip().startswith("SG_"):
            inside = False
        if inside and (message or SIGNAL.match(line)):
            yield line


def load(path):
    """The verdict, and message id to pairs of signal name and message of its own."""
    with open(path, encoding="cp1252", errors="replace") as file:
        text = file.read()
    try:
        return "whole", taken_apart(cantools.database.load_string(text, "dbc", strict=False))
    except Exception as error:
        left = 'VERSION ""\n' + "\n".join(bones(text)) + "\n"
        verdict = "bones " + str(error).replace("\n", " ")
        return verdict, taken_apart(cantools.database.load_string(left, "dbc", strict=False))


def taken_apart(database):
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
                    verdict, messages = load(rest)
                    print("file", verdict)
                except Exception as error:
                    messages = None
                    print("file unloadable", str(error).replace("\n", " "))
            elif messages is not None:
                frame_id, _, data = rest.partition(" ")
                signals = messages.get(int(frame_id))
                if signals is None:
                    print("frame none")
                else:
                    print("frame", *(f"{name}={value}" for name, value in decode(signals, bytes.fromhex(data))))


main()
