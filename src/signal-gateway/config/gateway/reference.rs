//! All sections with the rows of their keys, from which the documented file is generated.

use super::topic_names::rows;
use super::traffic_lights::{arbiter, faults, topics};
use super::{
    black_box, can, command, diagnostics, http, mcap, recording, reports, ros, status, top, traffic_lights,
    turn_signal, vehicle_geometry,
};
use crate::config::reading::KeyRow;
use crate::config::{country, decider};

/// A section of `gateway.toml`.
#[derive(Debug, Clone)]
pub struct KeySection {
    /// Path of the section, with a star for a name of the user's choice; empty for the top of the file.
    pub path: &'static str,
    /// The name that the documented file shows for the star.
    pub shown: &'static str,
    /// Meaning of the section, shown after its name.
    pub doc: &'static str,
    /// True if it is shown as a comment, since its presence alone has an effect.
    pub is_optional: bool,
    /// Rows of its keys, in the order of the documented file.
    pub keys: Vec<&'static dyn KeyRow>,
}

const GEOMETRY: &str = "dimensions of the car, for velocity and steering, and for the decider (default there: Autoware's sample vehicle)";

/// Returns all sections in the order of the documented file.
pub fn sections() -> Vec<KeySection> {
    [sections_of_program(), sections_of_ros(), sections_of_flows()].into_iter().flatten().collect()
}

fn section(path: &'static str, doc: &'static str, keys: Vec<&'static dyn KeyRow>) -> KeySection {
    KeySection { path, shown: "", doc, is_optional: false, keys }
}

fn optional(path: &'static str, doc: &'static str, keys: Vec<&'static dyn KeyRow>) -> KeySection {
    KeySection { is_optional: true, ..section(path, doc, keys) }
}

fn sections_of_program() -> Vec<KeySection> {
    vec![
        section("", "", top::keys()),
        KeySection {
            shown: "powertrain",
            ..section(
                "can.*",
                "one section for each bus of the vehicle profile, by its name there",
                can::keys(),
            )
        },
        optional(
            "recording",
            "a recording (formats: docs/vehicle-lights.md), for source = \"recording\" and for `replay` without a LOG",
            recording::keys(),
        ),
        section("reports", "", reports::keys()),
        section("vehicle_geometry", GEOMETRY, vehicle_geometry::keys()),
        section("diagnostics", "", diagnostics::keys()),
        section(
            "black_box",
            "`run` on SocketCAN writes a recording around each change to ERROR",
            black_box::keys(),
        ),
        section(
            "status",
            "the present state of a running gateway: `signal-gateway status`, docs/status.md",
            status::keys(),
        ),
        section(
            "http",
            "the live page, docs/live-page.md, and metrics for Prometheus, docs/metrics.md",
            http::keys(),
        ),
        section(
            "mcap",
            "`run` records what is received and published, as MCAP files of rosbag2",
            mcap::keys(),
        ),
    ]
}

fn sections_of_ros() -> Vec<KeySection> {
    vec![
        section("ros", "", ros::keys()),
        section("ros.zenoh", "with transport = \"zenoh\"", ros::zenoh::keys()),
        section(
            "ros.topics",
            "all topics: absolute, relative to the namespace (a/b), or private to the node (~/a)",
            rows(&ros::TOPICS),
        ),
    ]
}

fn sections_of_flows() -> Vec<KeySection> {
    let decider_keys =
        [turn_signal::keys(), country::keys(), decider::keys(), turn_signal::vehicle::keys()].concat();
    vec![
        optional(
            "command",
            "commands to the vehicle, see docs/commands.md; without this section: none are followed",
            command::keys(),
        ),
        optional("command.topics", "", rows(&command::TOPICS)),
        optional(
            "traffic_lights",
            "without this section: none. Needs no profile when there is no vehicle",
            traffic_lights::keys(),
        ),
        optional("traffic_lights.topics", "\"\": not published", topics::written::keys()),
        optional(
            "traffic_lights.inputs",
            "read only when named, live. A group without elements removes its state",
            topics::read::keys(),
        ),
        optional("traffic_lights.arbiter", "without this section: no merged topic", arbiter::keys()),
        KeySection {
            shown: "camera",
            ..optional(
                "traffic_lights.faults.*",
                "faults on purpose on the camera topic; also [traffic_lights.faults.v2i]",
                faults::keys(),
            )
        },
        optional(
            "turn_signal",
            "the turn signal decider, docs/turn-signal-decider.md; without this section: none",
            decider_keys,
        ),
        optional(
            "turn_signal.parameters",
            "by the names of Autoware, either spelling; see docs/turn-signal-decider.md",
            country::parameter_keys(),
        ),
        optional("turn_signal.age_limits", "older is not used", decider::age_limits::keys()),
        optional(
            "turn_signal.inputs",
            "\"\": not read, where that is possible",
            rows(&turn_signal::topics::INPUTS),
        ),
        optional("turn_signal.outputs", "", rows(&turn_signal::topics::OUTPUTS)),
    ]
}
