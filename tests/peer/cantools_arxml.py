"""Prints what cantools reads of an ARXML file, as JSON, and converts it to a DBC: an independent opinion.

usage: cantools_arxml.py ARXML DBC BUS

Prints a list of the messages of BUS, each with its signals; start bits are in the numbers of DBC.
"""

import json
import sys

import cantools


def signal(found):
    choices = found.choices or {}
    return {
        "name": found.name,
        "start": found.start,
        "length": found.length,
        "big_endian": found.byte_order == "big_endian",
        "signed": found.is_signed,
        "float": found.is_float,
        "factor": float(found.scale),
        "offset": float(found.offset),
        "unit": found.unit or "",
        "values": {str(raw): str(name) for raw, name in choices.items()},
        "selected_by": [found.multiplexer_signal, *(found.multiplexer_ids or [])],
    }


def message(found):
    return {
        "name": found.name,
        "id": found.frame_id,
        "extended": found.is_extended_frame,
        "fd": found.is_fd,
        "length": found.length,
        "cycle_ms": found.cycle_time,
        "signals": [signal(one) for one in found.signals],
    }


def main():
    path, dbc, bus = sys.argv[1:]
    database = cantools.database.load_file(path, "arxml", sort_signals=None)
    cantools.database.dump_file(database, dbc)
    print(json.dumps([message(found) for found in database.messages if found.bus_name == bus]))


main()
