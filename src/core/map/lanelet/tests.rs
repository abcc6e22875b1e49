use super::super::osm;
use super::*;

type Pairs<'a> = &'a [(&'a str, &'a str)];

/// Tags of a way that has these.
fn tags(pairs: Pairs<'_>) -> Tags {
    let inside: String = pairs.iter().map(|(key, value)| format!("<tag k='{key}' v='{value}'/>")).collect();
    let osm = osm::read(format!("<osm><way id='1'>{inside}</way></osm>").as_bytes()).unwrap();
    osm.ways.all()[0].tags.clone()
}

#[test]
fn lane_changes_follow_tags_and_markings() {
    let cases: [(Pairs<'_>, bool, bool); 15] = [
        (&[], false, false),
        (&[("type", "line_thin"), ("subtype", "dashed")], true, true),
        (&[("type", "line_thick"), ("subtype", "dashed")], true, true),
        (&[("type", "line_thin"), ("subtype", "solid")], false, false),
        (&[("type", "line_thin"), ("subtype", "dashed_solid")], false, true),
        (&[("type", "line_thick"), ("subtype", "solid_dashed")], true, false),
        (&[("type", "road_border"), ("subtype", "dashed")], false, false),
        (&[("type", "virtual")], false, false),
        (&[("type", "line_thin")], false, false),
        (&[("type", "line_thin"), ("subtype", "solid"), ("lane_change", "yes")], true, true),
        (&[("type", "line_thin"), ("subtype", "dashed"), ("lane_change", "no")], false, false),
        (&[("lane_change:left", "yes")], true, false),
        (&[("lane_change:right", "yes")], false, true),
        (&[("lane_change:left", "yes"), ("lane_change:right", "true")], true, true),
        (&[("lane_change:left", "no"), ("lane_change:right", "yes")], false, false),
    ];
    for (pairs, to_left, to_right) in cases {
        let found = LaneChange::over(&tags(pairs));
        assert_eq!(found, LaneChange { to_left, to_right }, "{pairs:?}");
        assert_eq!(found.inverted(), LaneChange { to_left: to_right, to_right: to_left }, "{pairs:?}");
    }
}

#[test]
fn vehicles_may_use_what_tags_or_the_subtype_say() {
    let cases: [(Pairs<'_>, bool, bool); 13] = [
        (&[], true, true),
        (&[("subtype", "road")], true, true),
        (&[("subtype", "crosswalk")], false, true),
        (&[("subtype", "road_shoulder")], false, true),
        (&[("subtype", "road_shoulder"), ("participant:vehicle", "yes")], true, true),
        (&[("subtype", "road"), ("participant:vehicle", "no")], false, true),
        (&[("subtype", "road"), ("participant:pedestrian", "yes")], false, true),
        (&[("subtype", "road"), ("participant:vehicle:bus", "yes")], false, true),
        (
            &[("subtype", "road"), ("participant:pedestrian", "yes"), ("participant:vehicle", "yes")],
            true,
            true,
        ),
        (&[("one_way", "no")], true, false),
        (&[("one_way", "yes")], true, true),
        (&[("one_way:vehicle", "no")], true, false),
        (&[("one_way:bicycle", "no")], true, true),
    ];
    for (pairs, for_vehicles, one_way) in cases {
        let tags = tags(pairs);
        assert_eq!((is_for_vehicles(&tags), is_one_way(&tags)), (for_vehicles, one_way), "{pairs:?}");
    }
}

#[test]
fn turn_directions_are_exact_words() {
    use TurnDirection::{Left, None, Right, Straight};
    let cases = [("left", Left), ("right", Right), ("straight", Straight), ("none", None), ("Left", None)];
    for (value, expected) in cases {
        assert_eq!(TurnDirection::from_tag(Some(value)), expected, "{value}");
    }
    assert_eq!(TurnDirection::from_tag(Option::None), None);
}
