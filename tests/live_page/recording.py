"""A recording of the demo vehicle with one state after the other, and the ways in which they are seen on the page."""

PHASE_S = 5
TURN, HAZARD, SPEEDS = 0x2A5, 0x2C1, 0x0C6
BUS_OFF, RESTARTED, UNDEFINED = "20000040#0000000000000000", "20000100#0000000000000000", 3

# Name, turn value (None for silence of its message), hazard value, caption of the car, what is reported of turn and hazard.
STATES = [
    ("off", 0, 0, "lights off", "off", "off"),
    ("left", 1, 0, "turning left", "left", "off"),
    ("right", 2, 0, "turning right", "right", "off"),
    ("hazard", 0, 1, "hazard lights on", "off", "on"),
    ("invalid", UNDEFINED, 0, "not published", "withheld", "off"),
    ("unknown", None, 0, "not published", "withheld", "off"),
]


def turn(value):
    return f"{TURN:03X}#0000{value << 1:02X}0000000000"


def hazard(value):
    return f"{HAZARD:03X}#00{value:02X}000000000000"


def lines():
    """The states in turn, then bus-off and the restart of the controller."""
    at_ms = 0

    def frame(text):
        return f"({1_700_000_000 + at_ms / 1000:.6f}) can0 {text}"

    for _, turn_value, hazard_value, *_ in STATES:
        for _ in range(PHASE_S * 20):
            if turn_value is not None:
                yield frame(turn(turn_value))
            if at_ms % 100 == 0:
                yield frame(hazard(hazard_value))
            at_ms += 50
    yield frame(BUS_OFF)
    at_ms += PHASE_S * 1000
    yield frame(RESTARTED)
    yield frame(turn(0))
