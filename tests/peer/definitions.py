"""Types of Cyclone DDS, made of the definitions of messages in ros/msg."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import new_class

from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types

FOLDER = Path(__file__).resolve().parents[2] / "ros" / "msg"
PRIMITIVES = {"bool": bool, "char": types.uint8, "string": str}


def struct(typename, fields):
    """A type with this name in DDS and these fields: name and type."""
    annotations = dict(fields)
    keywords = {"typename": typename}
    made = new_class(typename.split("::")[-1], (IdlStruct,), keywords, lambda body: body.update(__annotations__=annotations))
    return dataclass(made)


@cache
def message(package, name):
    """The type of a message with all types in it."""
    lines = (FOLDER / package / "msg" / f"{name}.msg").read_text().splitlines()
    fields = [line.split()[:2] for line in lines if line and line[0] != "#" and "=" not in line.replace("<=", "")]
    return struct(f"{package}::msg::dds_::{name}_", [(field, field_type(text)) for text, field in fields])


def field_type(text):
    """The type of a field, for example `float64[36]` or `geometry_msgs/Point[]`."""
    base, is_many, size = text.rstrip("]").partition("[")
    if "/" in base:
        one = message(*base.split("/"))
    else:
        one = PRIMITIVES.get(base) or getattr(types, base)
    if not is_many:
        return one
    if size.isdigit():
        return types.array[one, int(size)]
    return types.sequence[one, int(size.removeprefix("<="))] if size else types.sequence[one]
