//! Names of topics from a section of the configuration.

use crate::config::reading::{ConfigKey, Fields, KeyRow, optional_topic, topic};
use crate::io::ros::topics::{OUTGOING, OutgoingRow, SubscriptionKind, TopicFlow};
use turn_signal::planner_input::FactorTopic;

/// The names of the topics of a section, with their keys. A topic with an empty name is not used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TopicNames(pub(crate) Vec<(&'static str, String)>);

impl TopicNames {
    /// Reads the names that the section gives, or their defaults.
    pub(super) fn read(fields: &Fields<'_>, keys: &'static [ConfigKey<String>]) -> Self {
        Self(keys.iter().map(|key| (key.name, fields.read(key))).collect())
    }

    /// Returns the name of the topic with this key; it is empty if there is none.
    pub fn name(&self, key: &str) -> &str {
        self.iter().find(|(other, _)| *other == key).map_or("", |(_, name)| name)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.0.iter().map(|(key, name)| (*key, name.as_str()))
    }

    /// Returns the default names of the decider's inputs.
    pub fn of_decider() -> Self {
        let kinds = SubscriptionKind::DECIDER.into_iter().chain(SubscriptionKind::OWN_COMMANDS);
        let factors = FactorTopic::ALL.first().copied().map(SubscriptionKind::Factors);
        let rows = kinds.chain(factors).map(SubscriptionKind::row);
        Self(rows.filter_map(|row| Some((row.key?.key, row.default_name.to_owned()))).collect())
    }
}

/// Returns the keys of this section's published topics.
pub(super) fn written(section: &str) -> Vec<ConfigKey<String>> {
    let key = |row: &OutgoingRow| {
        let name = row.key.filter(|key| key.section == section)?.key;
        let is_optional = row.default_name.is_empty() || row.flow == TopicFlow::VehicleStatus;
        let key = if is_optional { optional_topic } else { topic };
        Some(key(name, row.default_name).doc(row.doc))
    };
    OUTGOING.iter().filter_map(key).collect()
}

pub(super) fn rows(keys: &'static [ConfigKey<String>]) -> Vec<&'static dyn KeyRow> {
    keys.iter().map(|key| key as &dyn KeyRow).collect()
}
