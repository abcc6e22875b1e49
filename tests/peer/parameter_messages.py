"""Requests and responses of a node's parameter services, and the messages in them, for the peers of the tests."""

from dataclasses import dataclass
from types import new_class

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, int64, sequence, uint8, uint32, uint64

MESSAGE = "rcl_interfaces::msg::dds_::"


@dataclass
class Value(IdlStruct, typename=f"{MESSAGE}ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = ()
    bool_array_value: sequence[bool] = ()
    integer_array_value: sequence[int64] = ()
    double_array_value: sequence[float64] = ()
    string_array_value: sequence[str] = ()


@dataclass
class Parameter(IdlStruct, typename=f"{MESSAGE}Parameter_"):
    name: str
    value: Value


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class ParameterEvent(IdlStruct, typename=f"{MESSAGE}ParameterEvent_"):
    stamp: Time
    node: str
    new_parameters: sequence[Parameter]
    changed_parameters: sequence[Parameter]
    deleted_parameters: sequence[Parameter]


@dataclass
class FloatRange(IdlStruct, typename=f"{MESSAGE}FloatingPointRange_"):
    from_value: float64
    to_value: float64
    step: float64


@dataclass
class IntegerRange(IdlStruct, typename=f"{MESSAGE}IntegerRange_"):
    from_value: int64
    to_value: int64
    step: uint64


@dataclass
class Descriptor(IdlStruct, typename=f"{MESSAGE}ParameterDescriptor_"):
    name: str
    type: uint8
    description: str
    additional_constraints: str
    read_only: bool
    dynamic_typing: bool
    floating_point_range: sequence[FloatRange]
    integer_range: sequence[IntegerRange]


@dataclass
class SetResult(IdlStruct, typename=f"{MESSAGE}SetParametersResult_"):
    successful: bool
    reason: str


NAMES = [("names", sequence[str])]
PARAMETERS = [("parameters", sequence[Parameter])]
# Fields of request and response by service and type.
SERVICES = {
    "list_parameters": (
        "ListParameters",
        [("prefixes", sequence[str]), ("depth", uint64)],
        [("names", sequence[str]), ("prefixes", sequence[str])],
    ),
    "get_parameters": ("GetParameters", NAMES, [("values", sequence[Value])]),
    "get_parameter_types": ("GetParameterTypes", NAMES, [("types", sequence[uint8])]),
    "describe_parameters": ("DescribeParameters", NAMES, [("descriptors", sequence[Descriptor])]),
    "set_parameters": ("SetParameters", PARAMETERS, [("results", sequence[SetResult])]),
    "set_parameters_atomically": (
        "SetParametersAtomically",
        PARAMETERS,
        [("successful", bool), ("reason", str)],
    ),
}


def typed(name, fields):
    """A request or response of these fields."""
    annotations = dict(fields)
    keywords = {"typename": f"rcl_interfaces::srv::dds_::{name}"}
    made = new_class(name, (IdlStruct,), keywords, lambda body: body.update(__annotations__=annotations))
    return dataclass(made)


def content(service, arguments):
    """The fields of a request with these arguments: prefixes, then the depth, for list_parameters, else names of parameters, which
    are to become true where they are to be set."""
    if service == "list_parameters":
        return (arguments[:-1], int(arguments[-1]))
    if service.startswith("set"):
        return ([Parameter(name, Value(type=1, bool_value=True)) for name in arguments],)
    return (arguments,)
