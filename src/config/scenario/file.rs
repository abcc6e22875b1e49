//! The content of a scenario file, and the ids in it that a map does not know.

use std::fmt;
use std::path::PathBuf;

use crate::config::reading::location::SourceLocation;
use crate::config::reading::problem::Problem;
use crate::core::compat::Compat;
use crate::core::map::light_map::{GroupEntry, LightMap};
use crate::core::traffic_light::scenario::Scenario;

/// The number of ids of the map that are named in a refusal.
const SHOWN: usize = 8;

/// The content of a scenario file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScenarioFile {
    /// The scenario itself.
    pub scenario: Scenario,
    /// Path of the map, relative to the working directory as the file's own path is; `None` when the file names
    /// no map, or one that only its launch system can find.
    pub map: Option<PathBuf>,
    /// Groups instead of a map; bench format only.
    pub groups: Vec<GroupEntry>,
    /// Parts that are not about traffic lights, in the order of the file.
    pub not_interpreted: Vec<NotInterpreted>,
    /// Every id that it names, for [`ScenarioFile::check_against`].
    pub ids: Vec<UsedId>,
}

/// A part of the file that has no effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotInterpreted {
    /// First place of such a part.
    pub location: SourceLocation,
    /// The part, the number of such parts, or the reason why it has no effect.
    pub what: String,
}

/// `file:line:column: element: what`
impl fmt::Display for NotInterpreted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: not interpreted: {}", self.location, self.what)
    }
}

/// An id of a light or group with its place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UsedId {
    /// Way or relation id.
    pub id: i64,
    /// Place of the id.
    pub location: SourceLocation,
}

impl ScenarioFile {
    /// Every use of an id that is neither a head nor a group of the map. Upstream finds out when it
    /// needs the id, so with its behaviour there is none.
    pub fn check_against(&self, map: &LightMap, compat: Compat) -> Vec<Problem> {
        match compat {
            Compat::Upstream => Vec::new(),
            Compat::Improved => {
                let known = |id: i64| map.head(id).is_some() || map.group(id).is_some();
                let unknown = self.ids.iter().filter(|used| !known(used.id));
                let remedy = known_ids(map);
                unknown
                    .map(|used| {
                        let reason = format!("the map has neither a light nor a group {}", used.id);
                        used.location.problem(reason, remedy.clone())
                    })
                    .collect()
            }
        }
    }
}

fn known_ids(map: &LightMap) -> String {
    let some = |ids: &mut dyn Iterator<Item = i64>| {
        let mut shown: Vec<_> = ids.take(SHOWN + 1).map(|id| id.to_string()).collect();
        if shown.len() > SHOWN {
            shown.truncate(SHOWN);
            shown.push("…".to_owned());
        }
        if shown.is_empty() { "none".to_owned() } else { shown.join(", ") }
    };
    format!(
        "give an id of the map, or another map: its lights are {}; its groups are {}",
        some(&mut map.heads().iter().map(|head| head.way_id)),
        some(&mut map.groups().map(|(id, _)| id))
    )
}
