"""Counts the entries of recordings with readers that are not ours.

    recordings.py READER FILE ...

A line for each file: its data frames, remote requests and error frames. READER is `can` (python-can), `cantools`, or
`lines:REGEX`, which counts the lines with data frames for formats that neither reads.
"""

import gzip
import re
import sys


def by_python_can(path):
    import can

    counts = [0, 0, 0]
    if path.endswith(".log.gz"):
        # Its choice by the name fails for two dots before that.
        reader = can.CanutilsLogReader(gzip.open(path, "rt"))
    else:
        reader = can.LogReader(path)
    for message in reader:
        counts[2 if message.is_error_frame else 1 if message.is_remote_frame else 0] += 1
    return counts


def by_cantools(path):
    from cantools.logreader import Parser

    counts = [0, 0, 0]
    with open(path, encoding="utf-8") as lines:
        for frame in Parser(lines):
            counts[1 if getattr(frame, "is_remote_frame", False) else 0] += 1
    return counts


def by_lines(pattern):
    def count(path):
        with open(path, encoding="utf-8", errors="replace") as lines:
            return [sum(1 for line in lines if re.search(pattern, line)), 0, 0]

    return count


arguments = sys.argv[1:]
for reader, path in zip(arguments[::2], arguments[1::2]):
    if reader == "can":
        read = by_python_can
    elif reader == "cantools":
        read = by_cantools
    else:
        read = by_lines(reader.removeprefix("lines:"))
    print(*read(path))
