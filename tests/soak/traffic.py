"""Other traffic on a bus, in frames that concern nobody.

Usage: traffic.py INTERFACE PERCENT SECONDS
A frame of eight bytes is taken for 125 bits of 500 kbit/s, stuffing included: 100 percent are 4000 a second.
"""

import socket
import struct
import sys
import time

interface, percent, seconds = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
bus.bind((interface,))
rate = 40 * percent
begin, sent, refused = time.monotonic(), 0, 0
while (now := time.monotonic() - begin) < seconds:
    due = int(now * rate) - sent
    for number in range(sent, sent + due):
        # Standard identifiers from 0x600 on; the profile's are below.
        try:
            bus.send(struct.pack("=IB3x8s", 0x600 + number % 0x1FF, 8, number.to_bytes(8, "little")))
        except OSError:
            refused += 1
    sent += due
    time.sleep(0.005)
print(f"traffic: {sent} frames, {sent / seconds:.0f}/s, {refused} refused")
