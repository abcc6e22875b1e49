"""Packs frames with opendbc and says what its car states read in them: an independent opinion on profiles.

usage: opendbc_lights.py REQUESTS

REQUESTS has one JSON object a line, of three kinds. The first:
    {"dbc": NAME, "platform": NAME or null, "length_ms": N, "frames": [[MS, MESSAGE, {SIGNAL: VALUE}], ...]}
Prints one for each:
    {"frames": [[MS, ID, DATA], ...], "blinkers": [[LEFT, RIGHT], ...], "status": {NAME: VALUE, ...}}
Status is speed in m/s, angle of the steering wheel in degrees, yaw rate in rad/s, gear and open door at the end.
ID is that of the DBC; DATA is hexadecimal. Blinkers are those of CarState every 10 ms, the period
of openpilot's loop, and empty without a platform. `CANPacker` fills in counters and checksums that it knows.

The second asks for frames of random bytes, with the checksum that opendbc computes:
    {"dbc": NAME, "message": MESSAGE, "checksums": COUNT}
    {"id": ID, "length": BYTES, "field": "START|LENGTH@ORDER", "frames": [DATA, ...]}

The third asks for the frames that openpilot sends to Hyundai and Kia on CAN FD, one pair of sides after the other:
    {"dbc": NAME, "requested": [[LEFT, RIGHT], ...]}
    {"frames": [[ID, DATA], ...]}

Each frame is on all three buses of opendbc, since its parsers differ in the bus they read and a profile does not know it.
The car's interface is made without fingerprints (`get_non_essential_params`), and all other messages are absent, which
reads as zeros.
"""

import json
import random
import sys

from opendbc.can import CANPacker
from opendbc.can.dbc import DBC
from opendbc.can.packer import set_value
from opendbc.car.car_helpers import interfaces
from opendbc.car.hyundai import hyundaicanfd

PERIOD_MS = 10
BUSES = (0, 1, 2)


def read_states(platform, frames, length_ms):
    interface = interfaces[platform](interfaces[platform].get_non_essential_params(platform))
    waiting = iter(frames)
    following = next(waiting, None)
    for now in range(0, length_ms, PERIOD_MS):
        received = []
        while following is not None and following[0] <= now:
            received.append((now * 1_000_000, [(*following[1:], bus) for bus in BUSES]))
            following = next(waiting, None)
        # The first instants must not be 0, which opendbc takes for "never".
        state = interface.update(received or [((now + 1) * 1_000_000, [])])
        yield state


def status_of(state):
    return {
        "speed": state.vEgoRaw,
        "steering": state.steeringAngleDeg,
        "yaw_rate": state.yawRate,
        "gear": str(state.gearShifter),
        "door": bool(state.doorOpen),
    }


def answer(request):
    packer = CANPacker(request["dbc"])
    frames = []
    for at, message, values in request["frames"]:
        known = packer.dbc.name_to_msg[message].sigs
        assert values.keys() <= known.keys(), f"{request['dbc']} {message} has no {values.keys() - known.keys()}"
        frames.append((at, *packer.make_can_msg(message, 0, values)[:2]))
    platform = request["platform"]
    states = list(read_states(platform, frames, request["length_ms"])) if platform else []
    return {
        "frames": [[at, address, data.hex()] for at, address, data in frames],
        "blinkers": [[bool(state.leftBlinker), bool(state.rightBlinker)] for state in states],
        "status": status_of(states[-1]) if states else None,
    }


def checksums(request):
    dice = random.Random(1)
    message = DBC(request["dbc"]).name_to_msg[request["message"]]
    signal = next(signal for signal in message.sigs.values() if signal.calc_checksum)
    frames = []
    for _ in range(request["checksums"]):
        data = bytearray(dice.randbytes(message.size))
        set_value(data, signal, signal.calc_checksum(message.address, signal, bytearray(data)))
        frames.append(data.hex())
    field = f"{signal.start_bit}|{signal.size}@{int(signal.is_little_endian)}"
    return {"id": message.address, "length": message.size, "field": field, "frames": frames}


def requested(request):
    packer, bus = CANPacker(request["dbc"]), hyundaicanfd.CanBus(None, fingerprint={}, lka_steering=True)
    made = (hyundaicanfd.create_spas_messages(packer, bus, *sides) for sides in request["requested"])
    return {"frames": [[address, data.hex()] for frames in made for address, data, _ in frames]}


def main():
    with open(sys.argv[1], encoding="utf-8") as requests:
        for request in requests:
            request = json.loads(request)
            kinds = [kind for kind in (checksums, requested) if kind.__name__ in request]
            print(json.dumps((kinds or [answer])[0](request)))


main()
