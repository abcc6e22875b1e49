//! The facts of a sound set-up.

/// A vehicle computer with a PEAK PCAN-USB FD on `can0`, as `doctor --json` reports them, written as TOML.
pub(super) const FACTS: &str = r#"
listened_ms = 3000
known_interfaces = ["can0"]

[configuration]
path = "/etc/signal-gateway/gateway.toml"
vehicle = "Demo vehicle"

[[interfaces]]
bus = "body"
sends = false
state.name = "can0"
state.kind = "can"
state.is_up = true
state.transmit_queue = 10

[interfaces.state.controller]
state = "error-active"
restart_ms = 100
bit_timing = { bitrate_bps = 500000, sample_point_permille = 875 }
modes = { listen_only = true }
supported = { listen_only = true, loopback = true, error_reporting = true, fd = true }

[interfaces.survey.yes]
frames = 1234
ids = 35
of_profile = 300
error_frames = 0
drops = 0
stamp_distance_ms = 1

[environment]
ROS_DOMAIN_ID = "42"
RMW_IMPLEMENTATION = "rmw_cyclonedds_cpp"

[ros]
enabled = true
domain_id = 42
is_domain_configured = true
only_networks = ["192.168.1.5"]

[[ros.written]]
name = "/vehicle/status/turn_indicators_status"
type_name = "autoware_vehicle_msgs/msg/TurnIndicatorsReport"
reliability = "Reliable"
durability = "Volatile"

[[ros.written]]
name = "/diagnostics"
type_name = "diagnostic_msgs/msg/DiagnosticArray"
reliability = "Reliable"
durability = "Volatile"
is_shared = true

[[ros.read]]
name = "/control/command/turn_indicators_cmd"
type_name = "autoware_vehicle_msgs/msg/TurnIndicatorsCommand"
reliability = "Reliable"
durability = "TransientLocal"

[ros.survey.yes]
domain_id = 42
participants = 3

# The own writer, and one of another node on a topic that all nodes share.
[[ros.survey.yes.writers]]
topic = "/vehicle/status/turn_indicators_status"
type_name = "autoware_vehicle_msgs/msg/TurnIndicatorsReport"
reliability = "Reliable"
durability = "Volatile"
implementation = "RustDDS"

[[ros.survey.yes.writers]]
topic = "/diagnostics"
type_name = "diagnostic_msgs/msg/DiagnosticArray"
reliability = "Reliable"
durability = "Volatile"
implementation = "Cyclone DDS"
# here

[service.yes]
is_installed = true
unit_file_state = "enabled"
active_state = "active"
exit_code = 0
pid = 812
configuration = "/etc/signal-gateway/gateway.toml"

[running]
socket = "/run/signal-gateway/status.sock"
reach = "served"
domain_id = 42
written = ["/vehicle/status/turn_indicators_status", "/diagnostics"]
differences = []

[permissions]
folders = [{ key = "[black_box] folder", path = "/var/lib/signal-gateway/black-box" }]
unreadable_for_service = []

[clock]
is_synchronised = true
jump_ms = 0
"#;
