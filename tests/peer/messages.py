"""The messages of the tests, as types of Cyclone DDS."""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, sequence, uint8

from definitions import message

Time = message("builtin_interfaces", "Time")
Header = message("std_msgs", "Header")
Text = message("std_msgs", "String")
Turn = message("autoware_vehicle_msgs", "TurnIndicatorsReport")
Hazard = message("autoware_vehicle_msgs", "HazardLightsReport")
DiagnosticArray = message("diagnostic_msgs", "DiagnosticArray")
Element = message("autoware_perception_msgs", "TrafficLightElement")
Group = message("autoware_perception_msgs", "TrafficLightGroup")
GroupArray = message("autoware_perception_msgs", "TrafficLightGroupArray")
Point = message("geometry_msgs", "Point")
Vector = message("geometry_msgs", "Vector3")
Quaternion = message("geometry_msgs", "Quaternion")
Pose = message("geometry_msgs", "Pose")
Clock = message("rosgraph_msgs", "Clock")


@dataclass
class NoText(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    """Bytes that are not text, under the name of a text."""

    data: sequence[uint8]


@dataclass
class NoGroups(
    IdlStruct, typename="autoware_perception_msgs::msg::dds_::TrafficLightGroupArray_"
):
    """Bytes that are not groups, under the name of groups."""

    data: sequence[uint8]


TYPES = {
    "log": message("rcl_interfaces", "Log"),
    "turn": Turn,
    "hazard": Hazard,
    "velocity": message("autoware_vehicle_msgs", "VelocityReport"),
    "steering": message("autoware_vehicle_msgs", "SteeringReport"),
    "gear": message("autoware_vehicle_msgs", "GearReport"),
    "control_mode": message("autoware_vehicle_msgs", "ControlModeReport"),
    "doors": message("autoware_adapi_v1_msgs", "DoorStatusArray"),
    "diagnostics": DiagnosticArray,
    "groups": GroupArray,
    "signals": message("autoware_perception_msgs", "TrafficSignalArray"),
    "array_v1": message("traffic_simulator_msgs", "TrafficLightArrayV1"),
    "markers": message("visualization_msgs", "MarkerArray"),
    "text": Text,
    "clock": Clock,
    "no_text": NoText,
    "no_groups": NoGroups,
}


def graph_types(length):
    """The ROS graph with identifiers of this length: its message, an identifier, and the entities of a node."""

    @dataclass
    class Gid(IdlStruct, typename="rmw_dds_common::msg::dds_::Gid_"):
        data: array[uint8, length]

    @dataclass
    class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common::msg::dds_::NodeEntitiesInfo_"):
        node_namespace: str
        node_name: str
        reader_gid_seq: sequence[Gid]
        writer_gid_seq: sequence[Gid]

    @dataclass
    class ParticipantEntitiesInfo(
        IdlStruct, typename="rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"
    ):
        gid: Gid
        node_entities_info_seq: sequence[NodeEntitiesInfo]

    return ParticipantEntitiesInfo, Gid, NodeEntitiesInfo
