"""Starts the gateway as a node: ros2 launch signal_gateway signal_gateway.launch.py config:=/etc/signal-gateway/gateway.toml."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

TURN_INDICATORS = "/vehicle/status/turn_indicators_status"
HAZARD_LIGHTS = "/vehicle/status/hazard_lights_status"

# Name, default (None: it must be given), description.
ARGUMENTS = [
    ("config", None, "Configuration file of the gateway"),
    ("name", "signal_gateway", "Name of the node, with which its diagnostics begin"),
    ("namespace", "", "Namespace of the node and of relative topics"),
    ("turn_indicators_status", TURN_INDICATORS, "Topic of the report"),
    ("hazard_lights_status", HAZARD_LIGHTS, "Topic of the report"),
    ("use_sim_time", "false", "True: traffic lights follow /clock"),
    ("log_level", "info", "debug, info, warn, error or fatal"),
    ("respawn", "true", "True: start it again when it ends"),
]


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, default, description in ARGUMENTS
    ]
    value = {name: LaunchConfiguration(name) for name, _, _ in ARGUMENTS}
    gateway = Node(
        package="signal_gateway",
        executable="signal-gateway",
        name=value["name"],
        namespace=value["namespace"],
        arguments=["run", "--config", value["config"]],
        # use_sim_time here: what a tree of launch files sets for all nodes comes behind it, and wins.
        ros_arguments=["--log-level", value["log_level"], "-p", ["use_sim_time:=", value["use_sim_time"]]],
        remappings=[
            (TURN_INDICATORS, value["turn_indicators_status"]),
            (HAZARD_LIGHTS, value["hazard_lights_status"]),
        ],
        output="screen",
        respawn=value["respawn"],
        respawn_delay=2.0,
    )
    return LaunchDescription([*arguments, gateway])
