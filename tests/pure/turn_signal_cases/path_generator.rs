//! P1 to P7: the smaller decider of upstream's path generator, on two turns of a test map.

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::polyline::{at_arc, headed, length_m};
use lanelet2_map::geometry::{Point, Pose};
use lanelet2_map::lane_network::{LaneNetwork, Lanelet, TurnDirection};
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::decision::Basis;
use turn_signal::inputs::{InputFinding, Inputs, Timed};
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::manoeuvre::Manoeuvre;
use turn_signal::parameters::DeciderParameters;
use turn_signal::path_generator::TaggedLanelet;
use turn_signal::planner_input::Odometry;
use turn_signal::side::Side;

use super::drive::{inputs, lane_change, route_from};

pub(crate) const ROUTE: [i64; 5] = [500, 501, 489, 497, 494];

fn lane(id: i64, turn_direction: TurnDirection, points: &[(f64, f64)], followers: Vec<i64>) -> Lanelet {
    let centerline: Vec<Point> = points.iter().map(|(x, y)| Point::new(*x, *y)).collect();
    let aside = |left_m: f64| headed(&centerline).iter().map(|pose| pose.point_at(0.0, left_m)).collect();
    Lanelet {
        id,
        turn_direction,
        left_bound: aside(1.5),
        right_bound: aside(-1.5),
        followers,
        centerline,
        ..Lanelet::default()
    }
}

/// `count` equal pieces.
fn straight([(ax, ay), (bx, by)]: [(f64, f64); 2], count: u32) -> Vec<(f64, f64)> {
    let share = |n| f64::from(n) / f64::from(count);
    (0..=count).map(|n| (ax + (bx - ax) * share(n), ay + (by - ay) * share(n))).collect()
}

pub(crate) fn consecutive_turn() -> LaneNetwork {
    use TurnDirection::{Left, None, Right};
    LaneNetwork::new(
        [
            lane(500, None, &straight([(12.110, 101.383), (51.509, 101.580)], 8), vec![501]),
            lane(501, Right, &[(51.509, 101.580), (54.375, 100.372), (55.472, 97.493)], vec![489]),
            lane(489, None, &[(55.472, 97.493), (55.457, 94.080)], vec![497]),
            lane(
                497,
                Left,
                &[(55.457, 94.080), (56.276, 90.845), (58.528, 88.386), (61.673, 87.292), (65.042, 87.183)],
                vec![494],
            ),
            lane(494, None, &straight([(65.042, 87.183), (148.749, 86.902)], 17), vec![]),
        ],
        Vec::new(),
    )
}

/// Odometry at a distance before the end of a lanelet.
fn odometry(road: &LaneNetwork, (lane, before_end_m): (i64, f64), speed_mps: f64) -> Odometry {
    let centerline = &road.lane(lane).unwrap().centerline;
    let position = at_arc(centerline, length_m(centerline) - before_end_m).unwrap();
    Odometry { pose: Pose { position, yaw_rad: 0.0 }, speed_mps }
}

#[test]
fn the_lengths_are_those_of_the_map() {
    let road = consecutive_turn();
    for (id, expected) in [(500, 39.399), (501, 6.191), (489, 3.413), (497, 13.373), (494, 83.707)] {
        assert!((road.lane(id).unwrap().length_m() - expected).abs() < 2e-3, "{id}");
    }
}

#[test]
fn every_listed_position_gives_its_command_by_its_lanelet() {
    use TaggedLanelet::{Ahead, None, Own, PastEnd, TooFar};
    let deployed = DeciderParameters::DEPLOYED;
    let narrow = DeciderParameters { intersection_search_distance_m: 0.0, ..DeciderParameters::DEPLOYED };
    for (id, position, speed_mps, parameters, command, tagged) in [
        ("P1", (500, 40.0), 0.0, &deployed, TurnCommand::NoCommand, TooFar(501)),
        ("P3", (500, 40.0), 3.5, &deployed, TurnCommand::Right, Ahead(501)),
        ("P5", (501, 1.0), 0.0, &deployed, TurnCommand::Left, Ahead(497)),
        ("P7", (497, 1.0), 0.0, &deployed, TurnCommand::Left, PastEnd(497)),
        ("standing within the search distance", (500, 33.0), 0.0, &deployed, TurnCommand::Right, Ahead(501)),
        ("standing just outside", (500, 34.0), 0.0, &deployed, TurnCommand::NoCommand, TooFar(501)),
        ("before the required end", (501, 5.0), 0.0, &deployed, TurnCommand::Right, Own(501)),
        ("on the last lanelet of the route", (494, 10.0), 0.0, &deployed, TurnCommand::NoCommand, None),
        ("0.6 m before the next turn", (501, 1.0), 0.0, &narrow, TurnCommand::NoCommand, TooFar(497)),
        ("the turn is behind the front already", (489, 3.4), 0.0, &narrow, TurnCommand::Left, Ahead(497)),
    ] {
        let (road, route) = (consecutive_turn(), route_from(1, Pose::default(), &ROUTE));
        let settings = DeciderSettings::deployed(DeciderCompat::PathGenerator);
        let mut decider = Decider::new(DeciderSettings { parameters: parameters.clone(), ..settings });
        let now = MonoTime::from_millis(100);
        let odometry = Timed { at: now, value: odometry(&road, position, speed_mps) };
        // Neither the lane change nor a minimum duration has an effect.
        let change = lane_change(Side::Left, Option::None, Some(Pose::new(60.0, 100.0, 0.0)));
        let manoeuvres = [Timed { at: now, value: Manoeuvre::LaneChange(change) }];
        let inputs = Inputs { manoeuvres: &manoeuvres, ..inputs(odometry, &road, &route) };
        let empty = Inputs { planned_path: Some(Timed { at: now, value: 0 }), ..inputs };
        let empty = decider.decide(&empty, now);
        assert_eq!(
            (empty.turn, &empty.findings[..]),
            (TurnCommand::NoCommand, &[InputFinding::EmptyPlannedPath][..])
        );
        for now in [now, MonoTime::from_millis(200)] {
            let decision = decider.decide(&inputs, now);
            assert_eq!((decision.turn, decision.hazard), (command, HazardCommand::NoCommand), "{id}");
            assert_eq!(decision.basis, Basis::PathGenerator(tagged), "{id}");
            assert_eq!((decision.held, &decision.remarks[..]), (Option::None, &[][..]), "{id}");
        }
    }
}

/// From turn to turn, one decider: no command is held.
#[test]
fn commands_follow_each_other_at_once() {
    let (road, route) = (consecutive_turn(), route_from(1, Pose::default(), &ROUTE));
    let mut decider = Decider::new(DeciderSettings::deployed(DeciderCompat::PathGenerator));
    let positions = [(500, 34.0), (500, 33.0), (501, 5.0), (501, 1.0), (497, 1.0), (494, 10.0)];
    let commands = positions.map(|position| {
        let now = MonoTime::from_millis(100);
        let odometry = Timed { at: now, value: odometry(&road, position, 0.0) };
        decider.decide(&inputs(odometry, &road, &route), now).turn
    });
    use TurnCommand::{Left, NoCommand, Right};
    assert_eq!(commands, [NoCommand, Right, Right, Left, Left, NoCommand]);
}
