use super::*;
use crate::osm;
use crate::points::Points;
use crate::projector::Projector;

const CROSSROADS: &str = include_str!("../../../tests/maps/crossroads.osm");

/// Returns an arc of `bend_deg` to the left with a radius of 30 m, or a line of 20 m.
fn arc(bend_deg: f64) -> Vec<Point> {
    if bend_deg == 0.0 {
        return vec![Point::new(0.0, 0.0), Point::new(10.0, 0.0), Point::new(20.0, 0.0)];
    }
    let side = bend_deg.signum();
    let at = |step: u8| {
        let angle = bend_deg.abs().to_radians() * f64::from(step) / 10.0;
        Point::new(30.0 * angle.sin(), side * 30.0 * (1.0 - angle.cos()) + 0.0)
    };
    (0..=10).map(at).collect()
}

fn lane(id: LaneId, turn_direction: TurnDirection, bend_deg: f64, followers: &[LaneId]) -> Lanelet {
    Lanelet {
        id,
        turn_direction,
        centerline: arc(bend_deg),
        followers: followers.to_vec(),
        ..Lanelet::default()
    }
}

fn texts(road: &LaneNetwork) -> Vec<String> {
    check_tags(road).iter().map(MapFinding::to_string).collect()
}

fn found(lanes: impl IntoIterator<Item = Lanelet>) -> Vec<String> {
    texts(&LaneNetwork::new(lanes, Vec::new()))
}

#[test]
fn a_tag_is_held_against_the_bend() {
    use TurnDirection::{Left, None, Right, Straight};
    for (tag, bend_deg, expected) in [
        (Left, 90.0, ""),
        (Left, -4.0, ""),
        (Left, -90.0, "tagged left, but it bends 90° to the right"),
        (Left, -8.0, "tagged left, but it bends 8° to the right"),
        (Left, 270.0, ""),
        (Right, -200.0, ""),
        (Right, 40.0, "tagged right, but it bends 40° to the left"),
        (Straight, 45.0, ""),
        (Straight, 80.0, "tagged straight, but it bends 80° to the left"),
        (None, 90.0, ""),
    ] {
        let findings = found([lane(7, tag, bend_deg, &[])]);
        let expected = Some(expected).filter(|text| !text.is_empty());
        let expected: Vec<_> =
            expected.map(|text| format!("lanelet 7 at (0.0, 0.0) m: {text}")).into_iter().collect();
        assert_eq!(findings, expected, "{tag:?} {bend_deg}");
    }
}

#[test]
fn a_direction_that_nobody_knows_is_found() {
    let unknown = |value: &str| Lanelet {
        unknown_direction: Some(value.to_owned()),
        ..lane(7, TurnDirection::None, 90.0, &[])
    };
    let expected = "lanelet 7 at (0.0, 0.0) m: its turn_direction \"Left\" names no direction: expected left, right or straight, \
                    in lower case";
    assert_eq!(found([unknown("Left")]), [expected]);
}

#[test]
fn a_turn_that_is_announced_behind_one_to_the_other_side_is_found() {
    use TurnDirection::{Left, None, Right, Straight};
    // 1, 2 and 3 follow each other; 3 turns left, and is announced from this distance.
    let road = |first: TurnDirection, distance_m: Option<f64>| {
        let turn = Lanelet { turn_signal_distance_m: distance_m, ..lane(3, Left, 90.0, &[]) };
        let bend_deg = if first == Right { -90.0 } else { 90.0 };
        found([lane(1, first, bend_deg, &[2]), lane(2, None, 0.0, &[3]), turn])
    };
    let between_m = lane(2, None, 0.0, &[]).length_m();
    let found = road(Right, Some(between_m + 1.0));
    let expected = format!(
        "its turn_signal_distance of {} m reaches behind the end of lanelet 1, which turns to the other side",
        between_m + 1.0
    );
    assert!(matches!(&found[..], [only] if only.ends_with(&expected)), "{found:?}");
    for (first, distance_m) in [
        (Right, Some(between_m - 1.0)),
        (Right, Option::None),
        (Left, Some(between_m + 1.0)),
        (Straight, Some(between_m + 1.0)),
    ] {
        let found = road(first, distance_m);
        assert!(
            !found.iter().any(|text| text.contains("reaches behind")),
            "{first:?} {distance_m:?}: {found:?}"
        );
    }
}

#[test]
fn a_turn_over_several_lanelets_is_found_once() {
    use TurnDirection::{Left, Right};
    let findings = found([
        lane(1, TurnDirection::None, 0.0, &[2]),
        lane(2, Left, 45.0, &[3]),
        lane(3, Left, 45.0, &[4]),
        lane(4, Right, -50.0, &[]),
    ]);
    let expected =
        ["lanelet 2 at (0.0, 0.0) m: a turn tagged left (90° to the left) is split over the lanelets 2, 3"];
    assert_eq!(findings, expected);
    let circle = found([lane(1, Left, 50.0, &[2]), lane(2, Left, 45.0, &[1])]);
    assert!(circle.is_empty(), "it has no first lanelet: {circle:?}");
}

#[test]
fn a_fork_that_turns_off_needs_a_tag() {
    let fork = |tag, bend_deg, next: Lanelet| {
        let follower = next.id;
        found([
            lane(1, TurnDirection::None, 0.0, &[2, 3]),
            lane(2, TurnDirection::None, 0.0, &[]),
            lane(3, tag, bend_deg, &[follower]),
            next,
        ])
    };
    let straight = || lane(4, TurnDirection::None, 0.0, &[]);
    let expected = "lanelet 3 at (0.0, 0.0) m: turns off by 72° to the right where the road forks after 1, without a turn_direction";
    assert_eq!(fork(TurnDirection::None, -72.0, straight()), [expected]);
    assert!(fork(TurnDirection::Right, -72.0, straight()).is_empty(), "it is tagged");
    let low = "lanelet 3 at (0.0, 0.0) m: leads off to the right of 2 where the road forks after 1, without a turn_direction";
    assert_eq!(fork(TurnDirection::None, -54.0, straight()), [low], "a turn or a bend");
    assert!(fork(TurnDirection::Straight, -54.0, straight()).is_empty(), "it is tagged");
    assert!(
        fork(TurnDirection::None, -8.0, straight()).is_empty(),
        "1.4 m beside each other are lanes of one road"
    );
    // The same turn, drawn as two lanelets.
    assert_eq!(fork(TurnDirection::None, -36.0, lane(4, TurnDirection::None, -36.0, &[])), [expected]);
    let alone = found([lane(1, TurnDirection::None, 0.0, &[3]), lane(3, TurnDirection::None, -90.0, &[])]);
    assert!(alone.is_empty(), "the road bends, nothing turns off: {alone:?}");
}

#[test]
fn a_turn_of_few_points_counts_in_full() {
    // A right angle with a radius of 4 m, whose centreline has a point every 3 m.
    let centerline = [(51.5, 101.6), (54.4, 100.4), (55.5, 97.5)].map(|(x, y)| Point::new(x, y)).to_vec();
    let turn = Lanelet { centerline, ..lane(3, TurnDirection::None, 0.0, &[]) };
    let [fork, straight] =
        [lane(1, TurnDirection::None, 0.0, &[2, 3]), lane(2, TurnDirection::None, 0.0, &[])];
    assert_eq!(found([fork, straight, turn]).len(), 1);
}

#[test]
fn lanelets_without_length_are_passed_once() {
    let point = |id, followers: &[LaneId]| Lanelet {
        id,
        centerline: vec![Point::default(); 2],
        followers: followers.to_vec(),
        ..Lanelet::default()
    };
    assert!(found([point(1, &[2, 4]), point(2, &[3]), point(3, &[2]), point(4, &[])]).is_empty());
}

/// Returns a ring of the lanelets 11 and 12 with the entry 1 and the exits 21 and 22.
fn ring() -> (Vec<Lanelet>, Roundabout) {
    let member = |id, followers: &[LaneId], tagged| Lanelet {
        roundabouts: vec![0],
        enables_exit_signal: tagged,
        ..lane(id, TurnDirection::None, 0.0, followers)
    };
    let lanes = vec![
        Lanelet { exits_signalled_left: vec![22], ..member(1, &[11], false) },
        member(11, &[12, 21], true),
        member(12, &[11, 22], true),
        member(21, &[], false),
        member(22, &[], false),
    ];
    (lanes, Roundabout { entries: vec![1], exits: vec![21, 22], internals: vec![11, 12] })
}

#[test]
fn a_complete_ring_has_no_flaw() {
    let (lanes, element) = ring();
    assert!(texts(&LaneNetwork::new(lanes, vec![element])).is_empty());
}

#[test]
fn incomplete_tags_of_a_ring_are_found() {
    type Change = fn(&mut Vec<Lanelet>, &mut Roundabout);
    #[rustfmt::skip]
    let cases: [(Change, &[&str]); 8] = [
        (|lanes, _| lanes[2].enables_exit_signal = false,
            &["22 at (0.0, 0.0) m: an exit with no enable_exit_turn_signal"]),
        (|lanes, _| lanes[1].roundabouts.clear(), &["11 at (0.0, 0.0) m: a roundabout gives it a role, but"]),
        (|_, element| element.internals.push(13), &["13: a roundabout names it, but it is not on the map"]),
        (|_, element| _ = element.exits.remove(1),
            &["1 at (0.0, 0.0) m: signals on entry for the exit 22",
              "22 at (0.0, 0.0) m: refers to a roundabout"]),
        (|lanes, _| lanes[0].exits_signalled_right = vec![22],
            &["1 at (0.0, 0.0) m: signals on entry both left and right"]),
        (|lanes, _| lanes[0].exits_signalled_left = vec![23],
            &["1 at (0.0, 0.0) m: signals on entry for the exit 23"]),
        (|lanes, _| lanes[0].followers.clear(), &["1 at (0.0, 0.0) m: an entry that leads to no lanelet"]),
        (|lanes, _| _ = lanes[1].followers.pop(), &["21 at (0.0, 0.0) m: an exit to which no lanelet"]),
    ];
    for (change, expected) in cases {
        let (mut lanes, mut element) = ring();
        change(&mut lanes, &mut element);
        let findings = texts(&LaneNetwork::new(lanes, vec![element]));
        assert_eq!(findings.len(), expected.len(), "{findings:?}");
        for (finding, expected) in findings.iter().zip(expected) {
            assert!(finding.starts_with(&format!("lanelet {expected}")), "{finding}, expected {expected}");
        }
    }
}

#[test]
fn turns_of_a_drawn_map_agree_with_their_tags_until_two_are_exchanged() {
    let read = |text: &str| {
        let osm = osm::read(text.as_bytes()).unwrap();
        LaneNetwork::read(&osm, &Points::new(&osm, &Projector::Local).unwrap()).unwrap()
    };
    assert!(texts(&read(CROSSROADS)).is_empty(), "{:?}", texts(&read(CROSSROADS)));
    let exchanged = CROSSROADS.replace("v=\"left\"", "v=\"middle\"").replace("v=\"right\"", "v=\"left\"");
    let findings = texts(&read(&exchanged));
    assert!(
        findings.iter().any(|text| text.contains("tagged left, but it bends 94° to the right")),
        "{findings:?}"
    );
    assert!(findings.iter().any(|text| text.contains("without a turn_direction")), "{findings:?}");
}
