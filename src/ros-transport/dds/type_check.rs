//! Compares the types of remote writers and readers with ours on the same topic.
//!
//! DDS does not connect endpoints of different types and does not report it, so a sender with a wrong type
//! looks like a missing sender.

use std::collections::{BTreeMap, BTreeSet};

use crate::link::NetworkSettings;
use ros_messages::dds_type;

/// Maximum number of remembered foreign types; further types are not reported.
const MAX_REPORTED: usize = 64;
/// Maximum displayed length of a foreign type name, characters.
const MAX_SHOWN: usize = 200;

/// The types of our topics, and the foreign types that were reported.
#[derive(Debug, Default)]
pub(super) struct TypeCheck {
    /// DDS type of each written topic, by DDS name.
    written: BTreeMap<String, String>,
    /// DDS type of each read topic, by DDS name.
    read: BTreeMap<String, String>,
    reported: BTreeSet<String>,
}

impl TypeCheck {
    pub(super) fn new(settings: &NetworkSettings) -> Self {
        let dds = |name: &str, type_name: &str| (format!("rt{name}"), dds_type(type_name));
        Self {
            written: settings.written.iter().map(|topic| dds(&topic.name, &topic.type_name)).collect(),
            read: settings.read.iter().map(|topic| dds(&topic.name, &topic.type_name)).collect(),
            reported: BTreeSet::new(),
        }
    }

    /// Warns once about a reader whose type differs from our writer's.
    pub(super) fn reader(&mut self, topic: &str, type_name: &str) {
        if let Some(warning) = difference("read", "published", &self.written, topic, type_name) {
            self.warn(warning);
        }
    }

    /// Warns once about a writer whose type differs from our reader's.
    pub(super) fn writer(&mut self, topic: &str, type_name: &str) {
        if let Some(warning) = difference("published", "read", &self.read, topic, type_name) {
            self.warn(warning);
        }
    }

    fn warn(&mut self, warning: String) {
        if self.reported.len() < MAX_REPORTED && !self.reported.contains(&warning) {
            tracing::warn!(log.subject = warning, "{warning}");
            self.reported.insert(warning);
        }
    }
}

/// Returns a text about a type that differs from ours; `None` if it does not, or the topic is not ours.
fn difference(
    theirs: &str,
    ours: &str,
    types: &BTreeMap<String, String>,
    topic: &str,
    type_name: &str,
) -> Option<String> {
    let expected = types.get(topic).filter(|expected| *expected != type_name)?;
    let name = topic.strip_prefix("rt").unwrap_or(topic);
    let (other, expected) = (ros_type(type_name), ros_type(expected));
    Some(format!("{name} is {theirs} as {other}, but {ours} here as {expected}: they are not connected"))
}

/// Returns a DDS type name in ROS 2 notation, `package/msg/Name`, always on one line.
pub(super) fn ros_type(dds: &str) -> String {
    let shown = dds.chars().filter(|character| !character.is_control()).take(MAX_SHOWN).collect::<String>();
    let ros = shown.strip_suffix('_').unwrap_or(&shown).replace("::dds_::", "::").replace("::", "/");
    if ros.is_empty() { "a type without a name".to_owned() } else { ros }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_writer_or_reader_of_another_type_is_reported_once_with_both_types() {
        let topic = |name: &str, type_name: &str| {
            let type_name = dds_type(&format!("autoware_vehicle_msgs/msg/{type_name}"));
            BTreeMap::from([(format!("rt{name}"), type_name)])
        };
        let mut check = TypeCheck {
            written: topic("/report", "TurnIndicatorsReport"),
            read: topic("/cmd", "TurnIndicatorsCommand"),
            reported: BTreeSet::new(),
        };
        check.writer("rt/cmd", "autoware_vehicle_msgs::msg::dds_::TurnIndicatorsCommand_");
        check.reader("rt/cmd", "std_msgs::msg::dds_::String_");
        check.writer("rt/other", "std_msgs::msg::dds_::String_");
        assert_eq!(check.reported.len(), 0);
        for _ in 0..2 {
            check.writer("rt/cmd", "std_msgs::msg::dds_::String_");
            check.reader("rt/report", "a\nb");
        }
        let reported: Vec<_> = check.reported.iter().map(String::as_str).collect();
        assert_eq!(
            reported,
            [
                "/cmd is published as std_msgs/msg/String, but read here as \
                 autoware_vehicle_msgs/msg/TurnIndicatorsCommand: they are not connected",
                "/report is read as ab, but published here as \
                 autoware_vehicle_msgs/msg/TurnIndicatorsReport: they are not connected",
            ]
        );
        (0..100).for_each(|number| check.writer("rt/cmd", &format!("other{number}")));
        assert_eq!(check.reported.len(), MAX_REPORTED);
    }
}
