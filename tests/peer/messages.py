"""The messages of the tests, as types of Cyclone DDS."""

from dataclasses import dataclass

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, byte, float32, float64, int32, int64, sequence, uint8, uint32


@dataclass
class Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: Time
    frame_id: str


@dataclass
class Turn(IdlStruct, typename="autoware_vehicle_msgs::msg::dds_::TurnIndicatorsReport_"):
    stamp: Time
    report: uint8


@dataclass
class Hazard(IdlStruct, typename="autoware_vehicle_msgs::msg::dds_::HazardLightsReport_"):
    stamp: Time
    report: uint8


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs::msg::dds_::KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticStatus_"):
    level: byte
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs::msg::dds_::DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Element(IdlStruct, typename="autoware_perception_msgs::msg::dds_::TrafficLightElement_"):
    color: uint8
    shape: uint8
    status: uint8
    confidence: float32


@dataclass
class Prediction(
    IdlStruct, typename="autoware_perception_msgs::msg::dds_::PredictedTrafficLightState_"
):
    predicted_stamp: Time
    simultaneous_elements: sequence[Element]
    reliability: float32
    information_source: str


@dataclass
class Group(IdlStruct, typename="autoware_perception_msgs::msg::dds_::TrafficLightGroup_"):
    traffic_light_group_id: int64
    elements: sequence[Element]
    predictions: sequence[Prediction]


@dataclass
class GroupArray(
    IdlStruct, typename="autoware_perception_msgs::msg::dds_::TrafficLightGroupArray_"
):
    stamp: Time
    traffic_light_groups: sequence[Group]


@dataclass
class Signal(IdlStruct, typename="autoware_perception_msgs::msg::dds_::TrafficSignal_"):
    traffic_signal_id: int64
    elements: sequence[Element]


@dataclass
class SignalArray(IdlStruct, typename="autoware_perception_msgs::msg::dds_::TrafficSignalArray_"):
    stamp: Time
    signals: sequence[Signal]


@dataclass
class BulbV1(IdlStruct, typename="traffic_simulator_msgs::msg::dds_::TrafficLightBulbV1_"):
    enum_revision: uint8
    color: uint8
    shape: uint8
    status: uint8
    confidence: float32


@dataclass
class LightV1(IdlStruct, typename="traffic_simulator_msgs::msg::dds_::TrafficLightV1_"):
    lanelet_way_id: int64
    traffic_light_bulbs: sequence[BulbV1]


@dataclass
class ArrayV1(IdlStruct, typename="traffic_simulator_msgs::msg::dds_::TrafficLightArrayV1_"):
    traffic_lights: sequence[LightV1]


@dataclass
class Vector(IdlStruct, typename="geometry_msgs::msg::dds_::Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Pose(IdlStruct, typename="geometry_msgs::msg::dds_::Pose_"):
    position: Vector
    orientation: Quaternion


@dataclass
class Color(IdlStruct, typename="std_msgs::msg::dds_::ColorRGBA_"):
    r: float32
    g: float32
    b: float32
    a: float32


@dataclass
class Image(IdlStruct, typename="sensor_msgs::msg::dds_::CompressedImage_"):
    header: Header
    format: str
    data: sequence[uint8]


@dataclass
class UvCoordinate(IdlStruct, typename="visualization_msgs::msg::dds_::UVCoordinate_"):
    u: float32
    v: float32


@dataclass
class MeshFile(IdlStruct, typename="visualization_msgs::msg::dds_::MeshFile_"):
    filename: str
    data: sequence[uint8]


@dataclass
class Marker(IdlStruct, typename="visualization_msgs::msg::dds_::Marker_"):
    header: Header
    ns: str
    id: int32
    type: int32
    action: int32
    pose: Pose
    scale: Vector
    color: Color
    lifetime: Time
    frame_locked: bool
    points: sequence[Vector]
    colors: sequence[Color]
    texture_resource: str
    texture: Image
    uv_coordinates: sequence[UvCoordinate]
    text: str
    mesh_resource: str
    mesh_file: MeshFile
    mesh_use_embedded_materials: bool


@dataclass
class MarkerArray(IdlStruct, typename="visualization_msgs::msg::dds_::MarkerArray_"):
    markers: sequence[Marker]


@dataclass
class Clock(IdlStruct, typename="rosgraph_msgs::msg::dds_::Clock_"):
    clock: Time


@dataclass
class Text(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str


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


@dataclass
class Log(IdlStruct, typename="rcl_interfaces::msg::dds_::Log_"):
    stamp: Time
    level: uint8
    name: str
    msg: str
    file: str
    function: str
    line: uint32


TYPES = {
    "log": Log,
    "turn": Turn,
    "hazard": Hazard,
    "diagnostics": DiagnosticArray,
    "groups": GroupArray,
    "signals": SignalArray,
    "array_v1": ArrayV1,
    "markers": MarkerArray,
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
