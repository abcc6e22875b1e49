"""Decodes a candump log with cantools, frame by frame, as long as it takes.

usage: cantools_log.py DBC LOG

Frames that the DBC does not know are only read. Raw values, no scaling and no names: the least work that cantools
can do. Prints the number of decoded frames.
"""

import sys

import cantools


def main():
    database, path = sys.argv[1:]
    database = cantools.database.load_file(database, strict=False)
    known = {message.frame_id: message for message in database.messages}
    decoded = 0
    with open(path, encoding="ascii") as log:
        for line in log:
            _, _, frame = line.split(" ", 2)
            frame_id, _, data = frame.partition("#")
            message = known.get(int(frame_id, 16))
            if message is not None:
                message.decode(bytes.fromhex(data), decode_choices=False, scaling=False, allow_truncated=True)
                decoded += 1
    print(decoded)


main()
