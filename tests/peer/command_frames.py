"""Makes command frames again with cantools: an independent opinion on every byte.

usage: command_frames.py VEHICLE DBC LOG

LOG has lines `(SECONDS) INTERFACE ID#DATA STATE`: every frame of the vehicle's command message in the order
of the bus, and what it should request. Each is decoded, and encoded from the signals that request its STATE,
the counter that its place in the log gives it and a checksum worked out here. Prints the number of frames and
of each state; at the first frame that differs, what differs, and exits with 1.
"""

import sys

import cantools


def crc8_j1850(data):
    """SAE J1850: polynomial 0x1D, begun with 0xFF and inverted at the end."""
    remainder = 0xFF
    for byte in data:
        remainder ^= byte
        for _ in range(8):
            remainder = (remainder << 1) ^ (0x11D if remainder & 0x80 else 0)
    return remainder ^ 0xFF


def hyundai_checksum(frame_id, data):
    """CRC-16 with 0x1021 over all behind it and the identifier, low byte first; the last term is for 32 bytes."""
    remainder = 0
    for byte in data[2:] + frame_id.to_bytes(2, "little"):
        remainder ^= byte << 8
        for _ in range(8):
            remainder = (remainder << 1) ^ (0x11021 if remainder & 0x8000 else 0)
    return remainder ^ 0x9F5B


def new_eagle_checksum(_, data):
    return crc8_j1850(data[:7])


def tesla_checksum(frame_id, data):
    """The sum of the identifier's bytes and all but the last byte."""
    return (frame_id // 256 + frame_id % 256 + sum(data[:7])) % 256


PACMOD = {"IGNORE_OVERRIDES": 0, "CLEAR_OVERRIDE": 0}
TESLA = {
    "DAS_headlightRequest": 3,
    "DAS_wiperSpeed": 15,
    "DAS_highLowBeamDecision": 3,
    "DAS_heaterRequest": 0,
    "DAS_turnIndicatorRequestReason": 0,
    "DAS_autopilotActive": 0,
    "DAS_accActive": 0,
}
NEW_EAGLE = {
    "AKit_DoorLockReq": 0,
    "AKit_RightRearDoorReq": 0,
    "AKit_LeftRearDoorReq": 0,
    "AKit_HornReq": 0,
    "AKit_BlockBasicCruiseCtrlBtns": 0,
    "AKit_BlockAdapCruiseCtrlBtns": 0,
    "AKit_BlockTurnSigStalkInpts": 0,
    "AKit_FrontWiperReq": 0,
    "AKit_RearWiperReq": 0,
    "AKit_IgnitionReq": 0,
    "AKit_HighBeamReq": 0,
    "AKit_LowBeamReq": 0,
    "AKit_LiftgateDoorReq": 0,
}


def pacmod(enable, choice):
    return PACMOD | {"ENABLE": enable, "TURN_SIGNAL_CMD": choice}


def new_eagle(choice):
    return NEW_EAGLE | {"AKit_TurnSignalReq": choice}


def tesla(turn, hazard):
    return TESLA | {"DAS_turnIndicatorRequest": turn, "DAS_hazardLightRequest": hazard}


def hyundai(choice):
    return {"BLINKER_CONTROL": choice}


# Message, counter, checksum and its rule, and what each state sets, by the names that the DBC has for values.
VEHICLES = {
    "hyundai_canfd": ("SPAS2", "COUNTER", "CHECKSUM", hyundai_checksum, {
        "off": hyundai("none"),
        "left": hyundai("left"),
        "right": hyundai("right"),
        "hazard": hyundai("hazard"),
    }),
    "pacmod": ("TURN_CMD", None, None, None, {
        "none": pacmod(0, "NONE"),
        "off": pacmod(1, "NONE"),
        "left": pacmod(1, "LEFT"),
        "right": pacmod(1, "RIGHT"),
        "hazard": pacmod(1, "HAZARD"),
    }),
    "new_eagle_dbw": (
        "AKit_OtherActuators", "AKit_OtherRollingCntr", "AKit_OtherChecksum", new_eagle_checksum, {
            "off": new_eagle("None"),
            "left": new_eagle("Left"),
            "right": new_eagle("Right"),
            "hazard": new_eagle("Hazards"),
        }),
    "tesla_model3": (
        "DAS_bodyControls", "DAS_bodyControlsCounter", "DAS_bodyControlsChecksum", tesla_checksum, {
            "none": tesla("NONE", "SNA"),
            "off": tesla("NONE", "OFF"),
            "left": tesla("LEFT", "OFF"),
            "left, any": tesla("LEFT", "SNA"),
            "right": tesla("RIGHT", "OFF"),
            "hazard": tesla("NONE", "ON"),
        }),
}


def main():
    vehicle, dbc, log = sys.argv[1:]
    name, counter, checksum, rule, states = VEHICLES[vehicle]
    message = cantools.database.load_file(dbc).get_message_by_name(name)
    seen = {}
    with open(log, encoding="utf-8") as lines:
        for number, line in enumerate(lines):
            _, _, frame, state = line.rstrip("\n").split(" ", 3)
            frame_id, _, data = frame.partition("#")
            data = bytes.fromhex(data)
            signals = dict(states[state])
            if counter:
                signals[counter] = number % 2 ** message.get_signal_by_name(counter).length
            if checksum:
                signals[checksum] = 0
            made = bytearray(message.encode(signals))
            if checksum:
                made = message.encode(signals | {checksum: rule(message.frame_id, made)})
            is_extended = len(frame_id) == 8
            decoded = message.decode(data)
            if (int(frame_id, 16), is_extended) != (message.frame_id, message.is_extended_frame):
                sys.exit(f"frame {number}: {frame_id} is not {name}")
            if data != bytes(made) or decoded != message.decode(bytes(made)):
                sys.exit(f"frame {number}, {state}: {data.hex()} should be {made.hex()}; it decodes to {decoded}")
            seen[state] = seen.get(state, 0) + 1
    counts = " ".join(f"{state.replace(' ', '_')}: {count}" for state, count in sorted(seen.items()))
    print(f"{sum(seen.values())} frames, {counts}")


main()
