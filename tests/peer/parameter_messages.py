"""Requests and responses of a node's services, and the messages in them, for the peers of the tests."""

from cyclonedds.idl.types import sequence, uint8, uint64

from definitions import message, struct

Value = message("rcl_interfaces", "ParameterValue")
Parameter = message("rcl_interfaces", "Parameter")
ParameterEvent = message("rcl_interfaces", "ParameterEvent")
Descriptor = message("rcl_interfaces", "ParameterDescriptor")
SetResult = message("rcl_interfaces", "SetParametersResult")
ResponseStatus = message("autoware_adapi_v1_msgs", "ResponseStatus")
DoorLayout = message("autoware_adapi_v1_msgs", "DoorLayout")

TRUE = Value(1, True, 0, 0.0, "", (), (), (), (), ())
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
    # An empty request has a byte in ROS 2.
    "layout": (
        "GetDoorLayout",
        [("structure_needs_at_least_one_member", uint8)],
        [("status", ResponseStatus), ("doors", sequence[DoorLayout])],
    ),
}


def typed(name, fields):
    """A request or response of these fields."""
    package = "autoware_adapi_v1_msgs" if name.startswith("GetDoorLayout") else "rcl_interfaces"
    return struct(f"{package}::srv::dds_::{name}", fields)


def content(service, arguments):
    """The fields of a request with these arguments: prefixes, then the depth, for list_parameters, none for layout, else names of
    parameters, which are to become true where they are to be set."""
    if service == "layout":
        return (0,)
    if service == "list_parameters":
        return (arguments[:-1], int(arguments[-1]))
    if service.startswith("set"):
        return ([Parameter(name, TRUE) for name in arguments],)
    return (arguments,)
