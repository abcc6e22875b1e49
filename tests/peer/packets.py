"""Counts the IP packets that leave over one interface, for the tests.

Usage: packets.py DOMAIN INTERFACE, as root; the domain means nothing. Each line of standard input is answered with a line of
JSON: packets sent so far by protocol, `udp`, `igmp` and `other` (IPv6 without UDP left out: the kernel talks for itself).
Ends when standard input does.
"""

import json
import socket
import sys
import threading

UDP, IGMP = 17, 2


def protocol(ethertype, packet):
    if ethertype == 0x0800 and len(packet) >= 20:
        return {UDP: "udp", IGMP: "igmp"}.get(packet[9], "other")
    if ethertype == 0x86DD and len(packet) >= 40 and packet[6] == UDP:
        return "udp"
    return None


def main():
    every_protocol = socket.htons(0x0003)
    sniffer = socket.socket(socket.AF_PACKET, socket.SOCK_DGRAM, every_protocol)
    sniffer.bind((sys.argv[2], 0x0003))
    sniffer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
    counts = {"udp": 0, "igmp": 0, "other": 0}

    def watch():
        while True:
            packet, (_, ethertype, kind, *_) = sniffer.recvfrom(65535)
            name = protocol(ethertype, packet) if kind == socket.PACKET_OUTGOING else None
            if name:
                counts[name] += 1

    threading.Thread(target=watch, daemon=True).start()
    print(json.dumps({"event": "ready"}), flush=True)
    for _ in sys.stdin:
        print(json.dumps({"event": "sent", **counts}), flush=True)


main()
