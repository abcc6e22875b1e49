"""Times cantools decoding frames one after the other, as the gateway's benchmark does.

usage: cantools_bench.py SECONDS DBC FRAME...

FRAME is ID#DATA in hex, 11-bit ids. Prints the time of one decoded frame in nanoseconds that a tenth of many
rounds stay below: raw values, no scaling and no names, the least work that cantools can do.
"""

import sys
import time

import cantools


def main():
    seconds, path, *frames = sys.argv[1:]
    messages = cantools.database.load_file(path)
    frames = [(int(frame_id, 16), bytes.fromhex(data)) for frame_id, data in (f.split("#") for f in frames)]
    rounds = []
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        start = time.perf_counter_ns()
        for _ in range(1000):
            for frame_id, data in frames:
                messages.decode_message(frame_id, data, decode_choices=False, scaling=False)
        rounds.append((time.perf_counter_ns() - start) / (1000 * len(frames)))
    print(sorted(rounds)[len(rounds) // 10])


main()
