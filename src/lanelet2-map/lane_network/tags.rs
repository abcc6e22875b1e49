//! The tags of a lanelet that concern turn signals (docs/spec/turn-signal-decider.md, "Map facts").

use super::TurnDirection;
use crate::osm::Tags;
use gateway_base::names::{named_by_variant, variant};

named_by_variant!(TurnDirection);

impl TurnDirection {
    /// Returns the direction that a value of the tag `turn_direction` names.
    pub(super) fn from_tag(value: Option<&str>) -> Self {
        value.and_then(variant).unwrap_or_default()
    }

    /// Returns the value of the tag if it names no direction; tags are case-sensitive, so `Left` names none.
    pub(super) fn unknown(value: Option<&str>) -> Option<String> {
        value.filter(|_| Self::from_tag(value) == Self::None).map(str::to_owned)
    }
}

/// Returns whether vehicles may use a lanelet with these tags: a tag `participant:vehicle` or `participant`
/// decides, then any other participant tag (not for vehicles), then the subtype. These are lanelet2's rules.
pub(super) fn is_for_vehicles(tags: &Tags) -> bool {
    let mut participants = tags.iter().filter(|(key, _)| key.starts_with("participant")).peekable();
    if participants.peek().is_none() {
        return matches!(tags.get("subtype"), None | Some("" | "road" | "highway" | "play_street" | "exit"));
    }
    participants
        .find(|(key, _)| matches!(*key, "participant" | "participant:vehicle"))
        .is_some_and(|(_, value)| matches!(value, "yes" | "true" | "1"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::osm;

    type Pairs<'a> = &'a [(&'a str, &'a str)];

    /// Returns the tags of a way with these keys and values.
    fn tags(pairs: Pairs<'_>) -> Tags {
        let inside: String =
            pairs.iter().map(|(key, value)| format!("<tag k='{key}' v='{value}'/>")).collect();
        let osm = osm::read(format!("<osm><way id='1'>{inside}</way></osm>").as_bytes()).unwrap();
        osm.ways.all()[0].tags.clone()
    }

    #[test]
    fn vehicles_may_use_what_participants_or_the_subtype_allow() {
        let cases: [(Pairs<'_>, bool); 9] = [
            (&[], true),
            (&[("subtype", "road")], true),
            (&[("subtype", "crosswalk")], false),
            (&[("subtype", "road_shoulder")], false),
            (&[("subtype", "road_shoulder"), ("participant:vehicle", "yes")], true),
            (&[("subtype", "road"), ("participant:vehicle", "no")], false),
            (&[("subtype", "road"), ("participant:pedestrian", "yes")], false),
            (&[("subtype", "road"), ("participant:vehicle:bus", "yes")], false),
            (&[("subtype", "road"), ("participant:pedestrian", "yes"), ("participant:vehicle", "yes")], true),
        ];
        for (pairs, expected) in cases {
            assert_eq!(is_for_vehicles(&tags(pairs)), expected, "{pairs:?}");
        }
    }

    #[test]
    fn turn_directions_are_exact_values() {
        use TurnDirection::{Left, None, Right, Straight};
        let cases =
            [("left", Left), ("right", Right), ("straight", Straight), ("none", None), ("Left", None)];
        for (value, expected) in cases {
            assert_eq!(TurnDirection::from_tag(Some(value)), expected, "{value}");
            assert_eq!(TurnDirection::unknown(Some(value)).is_some(), expected == None, "{value}");
        }
        assert_eq!(
            (TurnDirection::from_tag(Option::None), TurnDirection::unknown(Option::None)),
            (None, Option::None)
        );
    }
}
