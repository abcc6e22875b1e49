"""Messages between Autoware and the gateway, as types of Cyclone DDS."""

from dataclasses import dataclass
from functools import cache

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import sequence, uint8

from definitions import message
from messages import Header, Point, Pose, Quaternion, Time, Vector

Duration = message("builtin_interfaces", "Duration")
PoseWithCovariance = message("geometry_msgs", "PoseWithCovariance")
Twist = message("geometry_msgs", "Twist")
TwistWithCovariance = message("geometry_msgs", "TwistWithCovariance")
Odometry = message("nav_msgs", "Odometry")
Uuid = message("unique_identifier_msgs", "UUID")
LaneletPrimitive = message("autoware_planning_msgs", "LaneletPrimitive")
LaneletSegment = message("autoware_planning_msgs", "LaneletSegment")
LaneletRoute = message("autoware_planning_msgs", "LaneletRoute")
PathPoint = message("autoware_planning_msgs", "PathPoint")
PoseWithUuidStamped = message("autoware_planning_msgs", "PoseWithUuidStamped")
PredictedPath = message("autoware_perception_msgs", "PredictedPath")
PathPointWithLaneId = message("autoware_internal_planning_msgs", "PathPointWithLaneId")
PathWithLaneId = message("autoware_internal_planning_msgs", "PathWithLaneId")
ControlPoint = message("autoware_internal_planning_msgs", "ControlPoint")
SafetyFactor = message("autoware_internal_planning_msgs", "SafetyFactor")
SafetyFactorArray = message("autoware_internal_planning_msgs", "SafetyFactorArray")
PlanningFactor = message("autoware_internal_planning_msgs", "PlanningFactor")
PlanningFactorArray = message("autoware_internal_planning_msgs", "PlanningFactorArray")
Scenario = message("autoware_internal_planning_msgs", "Scenario")
OperationModeState = message("autoware_adapi_v1_msgs", "OperationModeState")
TurnCommand = message("autoware_vehicle_msgs", "TurnIndicatorsCommand")
HazardCommand = message("autoware_vehicle_msgs", "HazardLightsCommand")
ControlMode = message("autoware_vehicle_msgs", "ControlModeReport")


# Contents of the test messages; the tests have the same.
HEADER = Header(Time(7, 1), "map")
POSE = Pose(Point(1.0, 2.0, 3.0), Quaternion(0.0, 0.0, 1.0, 0.0))
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
    2, Uuid([9] * 16), PredictedPath([POSE], Duration(0, 500_000_000), 0.5), 1.5, 2.5, [Point(4.0, 5.0, 6.0)], True
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
        [Point(1.0, 2.0, 3.0)],
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
    corner = Point(1.0, 2.0, 3.0)
    return PathWithLaneId(HEADER, [point] * points, [corner] * bound, [corner] * bound)
