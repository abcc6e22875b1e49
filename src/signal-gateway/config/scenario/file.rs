//! The content of a scenario file, and the ids in it that a map does not know.

use std::fmt;
use std::path::PathBuf;

use derive_more::Display;

use super::light_names::LightNames;
use crate::config::reading::{Problem, SourceLocation, joined};
use lanelet2_map::light_map::{GroupEntry, LightMap};
use traffic_lights::compat::Compat;
use traffic_lights::scenario::Scenario;

/// Number of ids of the map that are named in a refusal.
const SHOWN: usize = 8;

/// The content of a scenario file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScenarioFile {
    /// The scenario that the file describes.
    pub scenario: Scenario,
    /// Path of the map, relative to the working directory like the file's own path; `None` if the file names
    /// no map, or a map that only its launch system can find.
    pub map: Option<PathBuf>,
    /// Reason why the map named in the file cannot be found, with the remedy.
    pub unresolved_map: Option<String>,
    /// Groups instead of a map; bench format only.
    pub groups: Vec<GroupEntry>,
    /// Ends of the scenario that could occur earlier than simulated, since their triggers are only partly
    /// interpreted.
    pub uncertain_ends: Vec<UncertainEnd>,
    /// Parts that are not about traffic lights, in the order of the file.
    pub not_interpreted: Vec<NotInterpreted>,
    /// Every id in the file, for [`ScenarioFile::check_against`].
    pub ids: Vec<UsedId>,
    /// The texts that stand for ids, with
    /// [`ReadOptions::takes_text_ids`](super::ReadOptions::takes_text_ids).
    pub light_names: LightNames,
}

/// An event that ends the scenario, or its stop trigger, that was omitted, or of which a group of conditions
/// was omitted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UncertainEnd {
    /// Name of the event, or its path; `None` for the stop trigger.
    pub event: Option<String>,
    /// `true` for `exitSuccess`, `false` for `exitFailure`; `None` for the stop trigger, which ends it
    /// without a verdict.
    pub success: Option<bool>,
}

/// Prints the reason why the verdict is unknown.
impl fmt::Display for UncertainEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (end, trigger) = match &self.event {
            Some(event) => (format!("the event {event:?}"), "its trigger"),
            None => ("the stop trigger".to_owned(), "it"),
        };
        write!(f, "{end} would end the scenario, and {trigger} is not interpreted as a whole")
    }
}

/// A part of the file that has no effect: `file:line:column: element: not interpreted: what`.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
#[display("{location}: not interpreted: {what}")]
pub struct NotInterpreted {
    /// Location of the first part of its kind.
    pub location: SourceLocation,
    /// Description of the part, the number of parts of its kind, or the reason why it has no effect.
    pub what: String,
}

/// An id of a light or group with its location.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsedId {
    /// Way or relation id, or the number of a text.
    pub id: i64,
    /// Location of the id.
    pub location: SourceLocation,
}

impl ScenarioFile {
    /// Returns a problem for every use of an id that is neither a head nor a group of the map. There are none
    /// in upstream mode, since upstream looks up an id only when it is needed.
    pub fn check_against(&self, map: &LightMap, compat: Compat) -> Vec<Problem> {
        if compat == Compat::Upstream {
            return Vec::new();
        }
        let remedy = known_ids(map);
        let is_unknown = |used: &&UsedId| map.head(used.id).is_none() && map.group(used.id).is_none();
        let unknown = self.ids.iter().filter(is_unknown).map(|used| {
            let reason = format!("the map has neither a light nor a group {}", used.id);
            used.location.problem(reason, remedy.clone())
        });
        unknown.collect()
    }
}

fn known_ids(map: &LightMap) -> String {
    let lights = map.heads().iter().map(|head| head.way_id.to_string());
    let groups = map.groups().map(|(id, _)| id.to_string());
    format!(
        "give an id of the map, or another map: its lights are {}; its groups are {}",
        joined(lights, SHOWN),
        joined(groups, SHOWN)
    )
}
