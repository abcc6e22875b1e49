//! Checks the ids for which a profile binds V2I states against the lights of the map
//! (docs/spec/traffic-lights.md, "V2X unit on CAN").

use std::collections::BTreeMap;

use crate::config::reading::{Problem, Refusal};
use crate::config::vehicle::LocatedId;
use can_signal::validation::meaning::Meaning;
use gateway_core::v2i_reception::binding::{BoundGroup, V2iBinding};
use lanelet2_map::light_map::{LightGroup, LightMap};
use traffic_lights::bulb::Color;

/// Refuses ids that are not in the map, and heads whose states contradict another state of their group; at
/// most one problem for each id, in the order of the profile.
pub(in super::super) fn check_ids(ids: &[LocatedId], binding: &V2iBinding, map: &LightMap) -> Vec<Problem> {
    let positions: BTreeMap<i64, usize> = ids.iter().enumerate().map(|(at, bound)| (bound.id, at)).collect();
    let states: BTreeMap<i64, &BoundGroup> = binding.groups().map(|bound| (bound.id, bound)).collect();
    let mut refusals: BTreeMap<usize, Refusal> = BTreeMap::new();
    for (at, LocatedId { id, .. }) in ids.iter().enumerate() {
        let reason = match (map.group(*id), map.head(*id)) {
            (Some(LightGroup { heads, .. }), _) if heads.is_empty() => {
                format!("the group {id} of the map has no signal heads")
            }
            (None, None) => format!("{id} is neither a group nor a signal head of the map"),
            (Some(_), _) | (None, Some(_)) => continue,
        };
        let remedy =
            "give the id of a traffic_light regulatory element of the map of [traffic_lights], or of a head";
        refusals.insert(at, Refusal::new(reason, remedy));
    }
    for (relation_id, group) in map.groups() {
        let way_ids = group.heads.iter().filter_map(|head| map.at(*head)).map(|head| head.way_id);
        // A number that is both a head and a group is the group.
        let heads: Vec<_> = way_ids
            .filter(|id| map.group(*id).is_none())
            .filter_map(|id| Some((*positions.get(&id)?, *states.get(&id)?)))
            .collect();
        if states.contains_key(&relation_id) {
            for (at, head) in heads {
                let reason =
                    format!("{} is a head of the group {relation_id}, which has a signal too", head.id);
                let remedy = format!("remove it: the state of {relation_id} is for all of its heads");
                refusals.entry(at).or_insert(Refusal { reason, remedy });
            }
        } else if let Some([(_, first), (at, second)]) = contradicting(heads) {
            let reason = format!(
                "{} and {} are heads of the group {relation_id}: it would be red and green while they differ",
                first.id, second.id
            );
            let remedy = format!("bind one signal with id = {relation_id}, or show arrows with one of them");
            refusals.entry(at).or_insert(Refusal { reason, remedy });
        }
    }
    let problem = |(at, Refusal { reason, remedy }): (usize, Refusal)| {
        Some(ids.get(at)?.location.problem(reason, remedy))
    };
    refusals.into_iter().filter_map(problem).collect()
}

type BoundHead<'b> = (usize, &'b BoundGroup);

/// Returns two heads, in the order of the profile, one of which can show a red circle and the other a green
/// circle.
fn contradicting(mut heads: Vec<BoundHead<'_>>) -> Option<[BoundHead<'_>; 2]> {
    heads.sort_by_key(|(at, _)| *at);
    let of = |color| heads.iter().copied().filter(move |(_, head)| shows_circle(head, color));
    // If more than two can show both, the first two suffice.
    let pairs =
        of(Color::Red).take(2).flat_map(|red| of(Color::Green).take(2).map(move |green| [red, green]));
    let mut pair = pairs.into_iter().find(|[(red, _), (green, _)]| red != green)?;
    pair.sort_by_key(|(at, _)| *at);
    Some(pair)
}

fn shows_circle(head: &BoundGroup, color: Color) -> bool {
    let states = head.state.values.entries().iter();
    let mut bulbs = states.filter_map(|(_, meaning)| match meaning {
        Meaning::Defined(bulbs) => Some(*bulbs),
        Meaning::NotAvailable | Meaning::Fault | Meaning::Undefined => None,
    });
    bulbs.any(|bulbs| bulbs.shows_circle(color))
}
