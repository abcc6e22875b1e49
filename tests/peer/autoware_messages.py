"""Messages between Autoware and the gateway, as types of Cyclone DDS."""

from dataclasses import dataclass
from functools import cache

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int64, sequence, uint8, uint16

from messages import Header, Pose, Quaternion, Time, Vector


@dataclass
class PoseWithCovariance(
    IdlStruct, typename="geometry_msgs::msg::dds_::PoseWithCovariance_"
):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class Twist(IdlStruct, typename="geometry_msgs::msg::dds_::Twist_"):
    linear: Vector
    angular: Vector


@dataclass
class TwistWithCovariance(
    IdlStruct, typename="geometry_msgs::msg::dds_::TwistWithCovariance_"
):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs::msg::dds_::Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class Uuid(IdlStruct, typename="unique_identifier_msgs::msg::dds_::UUID_"):
    uuid: array[uint8, 16]


@dataclass
class LaneletPrimitive(IdlStruct, typename="autoware_planning_msgs::msg::dds_::LaneletPrimitive_"):
    id: int64
    primitive_type: str


@dataclass
class LaneletSegment(IdlStruct, typename="autoware_planning_msgs::msg::dds_::LaneletSegment_"):
    preferred_primitive: LaneletPrimitive
    primitives: sequence[LaneletPrimitive]


@dataclass
class LaneletRoute(IdlStruct, typename="autoware_planning_msgs::msg::dds_::LaneletRoute_"):
    header: Header
    start_pose: Pose
    goal_pose: Pose
    segments: sequence[LaneletSegment]
    uuid: Uuid
    allow_modification: bool


@dataclass
class PathPoint(IdlStruct, typename="autoware_planning_msgs::msg::dds_::PathPoint_"):
    pose: Pose
    longitudinal_velocity_mps: float32
    lateral_velocity_mps: float32
    heading_rate_rps: float32
    is_final: bool


@dataclass
class PathPointWithLaneId(
    IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::PathPointWithLaneId_"
):
    point: PathPoint
    lane_ids: sequence[int64]


@dataclass
class PathWithLaneId(
    IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::PathWithLaneId_"
):
    header: Header
    points: sequence[PathPointWithLaneId]
    left_bound: sequence[Vector]
    right_bound: sequence[Vector]


@dataclass
class ControlPoint(IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::ControlPoint_"):
    pose: Pose
    velocity: float32
    shift_length: float32
    distance: float32


@dataclass
class PredictedPath(IdlStruct, typename="autoware_perception_msgs::msg::dds_::PredictedPath_"):
    path: sequence[Pose]
    time_step: Time
    confidence: float32


@dataclass
class SafetyFactor(IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::SafetyFactor_"):
    type: uint16
    object_id: Uuid
    predicted_path: PredictedPath
    ttc_begin: float32
    ttc_end: float32
    points: sequence[Vector]
    is_safe: bool


@dataclass
class SafetyFactorArray(
    IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::SafetyFactorArray_"
):
    header: Header
    factors: sequence[SafetyFactor]
    is_safe: bool
    detail: str


@dataclass
class PlanningFactor(
    IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::PlanningFactor_"
):
    module: str
    is_driving_forward: bool
    control_points: sequence[ControlPoint]
    behavior: uint16
    detail: str
    safety_factors: SafetyFactorArray


@dataclass
class PlanningFactorArray(
    IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::PlanningFactorArray_"
):
    header: Header
    factors: sequence[PlanningFactor]


@dataclass
class PoseWithUuidStamped(IdlStruct, typename="autoware_planning_msgs::msg::dds_::PoseWithUuidStamped_"):
    header: Header
    pose: Pose
    uuid: Uuid


@dataclass
class OperationModeState(
    IdlStruct, typename="autoware_adapi_v1_msgs::msg::dds_::OperationModeState_"
):
    stamp: Time
    mode: uint8
    is_autoware_control_enabled: bool
    is_in_transition: bool
    is_stop_mode_available: bool
    is_autonomous_mode_available: bool
    is_local_mode_available: bool
    is_remote_mode_available: bool


@dataclass
class Scenario(IdlStruct, typename="autoware_internal_planning_msgs::msg::dds_::Scenario_"):
    current_scenario: str
    activating_scenarios: sequence[str]


@dataclass
class TurnCommand(IdlStruct, typename="autoware_vehicle_msgs::msg::dds_::TurnIndicatorsCommand_"):
    stamp: Time
    command: uint8


@dataclass
class HazardCommand(IdlStruct, typename="autoware_vehicle_msgs::msg::dds_::HazardLightsCommand_"):
    stamp: Time
    command: uint8


@dataclass
class ControlMode(IdlStruct, typename="autoware_vehicle_msgs::msg::dds_::ControlModeReport_"):
    stamp: Time
    mode: uint8


# Contents of the test messages; the tests have the same.
HEADER = Header(Time(7, 1), "map")
POSE = Pose(Vector(1.0, 2.0, 3.0), Quaternion(0.0, 0.0, 1.0, 0.0))
COVARIANCE = [float(number) for number in range(36)]
ROUTE = LaneletRoute(
    HEADER,
    POSE,
    POSE,
    [LaneletSegment(LaneletPrimitive(10, "lane"), [LaneletPrimitive(11, "lane"), LaneletPrimitive(10, "lane")])],
    Uuid(list(range(1, 17))),
    True,
)
SAFETY = SafetyFactor(
    2, Uuid([9] * 16), PredictedPath([POSE], Time(0, 500_000_000), 0.5), 1.5, 2.5, [Vector(4.0, 5.0, 6.0)], True
)
FACTOR = PlanningFactor(
    "goal_planner",
    True,
    [ControlPoint(POSE, 4.0, -0.5, 12.0)],
    5,
    "right shift",
    SafetyFactorArray(HEADER, [SAFETY], False, "near"),
)
SAMPLES = {
    "odometry": Odometry(
        HEADER,
        "base_link",
        PoseWithCovariance(POSE, COVARIANCE),
        TwistWithCovariance(Twist(Vector(-4.5, 0.1, 0.2), Vector(0.3, 0.4, 0.5)), COVARIANCE),
    ),
    "route": ROUTE,
    "path": PathWithLaneId(
        HEADER,
        [PathPointWithLaneId(PathPoint(POSE, 4.5, 0.25, -0.5, True), [100, -7])],
        [Vector(1.0, 2.0, 3.0)],
        [],
    ),
    "factors": PlanningFactorArray(HEADER, [FACTOR]),
    "modified_goal": PoseWithUuidStamped(HEADER, POSE, Uuid(list(range(1, 17)))),
    "operation_mode": OperationModeState(Time(7, 1), 2, True, False, True, True, False, False),
    "scenario": Scenario("LaneDriving", ["LaneDriving", "Parking"]),
    "hazard_request": HazardCommand(Time(7, 1), 2),
    "own_turn": TurnCommand(Time(7, 1), 3),
    "own_hazard": HazardCommand(Time(7, 1), 1),
    "turn_command": TurnCommand(Time(7, 1), 9),
    "hazard_command": HazardCommand(Time(7, 1), 2),
    "control_mode": ControlMode(Time(7, 1), 4),
}
KEPT = {"route", "modified_goal", "operation_mode"}


@cache
def nonsense_type(name):
    """Bytes under the name of the topic's type."""

    @dataclass
    class Nonsense(IdlStruct, typename=type(SAMPLES[name]).__idl_typename__):
        data: sequence[uint8]

    return Nonsense


def large_path(points, bound):
    """A path of so many points, with bounds of so many points."""
    point = PathPointWithLaneId(PathPoint(POSE, 4.5, 0.0, 0.0, False), [100, 101])
    corner = Vector(1.0, 2.0, 3.0)
    return PathWithLaneId(HEADER, [point] * points, [corner] * bound, [corner] * bound)
