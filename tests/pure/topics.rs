//! The rows of topics: every type is defined, and the documentation has the table that they make.

use ros_messages::type_hash;
use signal_gateway::io::ros::topics::{Delivery, Durability, LOG_LIFESPAN, OUTGOING, OutgoingRow, TopicFlow};

use crate::support::docs_table;

const EDGES: [&str; 2] = [
    "<!-- Made by `UPDATE_DOCS=1 cargo test --test pure topics` from io::ros::topics. -->\n",
    "<!-- The end of the table. -->\n",
];

fn line(row: &OutgoingRow) -> String {
    let durability = match row.durability {
        None | Some(Durability::TransientLocal) => "transient local",
        Some(Durability::Volatile) => "volatile",
    };
    let kept = match row.delivery {
        Delivery::Log => format!("lifespan {} s", LOG_LIFESPAN.as_secs()),
        Delivery::Report | Delivery::Stream | Delivery::Live | Delivery::Once => {
            format!("depth {}", row.depth)
        }
    };
    let (topic, type_name, when) = (row.default_name, row.type_name, row.when);
    format!("| `{topic}` | `{type_name}` | reliable, {durability}, {kept} | {when} |\n")
}

#[test]
fn documentation_has_the_topics_of_reports_diagnostics_and_log() {
    let is_shown = |row: &&OutgoingRow| {
        matches!(row.flow, TopicFlow::VehicleLights | TopicFlow::VehicleStatus | TopicFlow::Gateway)
    };
    let lines: String = OUTGOING.iter().filter(is_shown).map(line).collect();
    let table = format!("| topic | type | QoS | when |\n|---|---|---|---|\n{lines}");
    docs_table::check("docs/vehicle-lights.md", EDGES, &table, "topics");
}

#[test]
fn every_type_that_is_written_is_defined() {
    let lacks = |row: &&OutgoingRow| type_hash(row.type_name).is_none();
    let undefined: Vec<_> = OUTGOING.iter().filter(lacks).map(|row| row.default_name).collect();
    assert_eq!(undefined, [""; 0]);
}
