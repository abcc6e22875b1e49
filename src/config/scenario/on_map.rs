//! Ids that the map does not know.

use super::ScenarioFile;
use crate::config::problem::Problem;
use crate::core::map::light_map::LightMap;
use crate::core::traffic_light::compat::Compat;

/// How many ids of the map are named in a refusal.
const SHOWN: usize = 8;

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
                        used.place.problem(reason, remedy.clone())
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
