//! Junctions that offer the side of the next turn and are not taken: its signal waits, unless the law demands
//! it or it would be seen too late.

use std::sync::Arc;
use std::time::Duration;

use gateway_base::time::MonoTime;
use lanelet2_map::geometry::Pose;
use lanelet2_map::lane_network::{LaneNetwork, Lanelet, TurnDirection};
use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};
use turn_signal::country::Country;
use turn_signal::decider::{Decider, DeciderSettings};
use turn_signal::decision::Decision;
use turn_signal::inputs::Timed;
use turn_signal::light_command::TurnCommand;
use turn_signal::planner_input::Odometry;

use super::drive::{HALF_WIDTH_M, inputs, route_from, straight_lane};
use super::line::at;

/// The front of the sample vehicle before its rear axle, metres.
const FRONT_M: f64 = 3.79;
const CROSSING_M: [f64; 2] = [100.0, 120.0];

/// A quarter of a circle from a place on the straight road, to the left or to the right.
fn arc(id: i64, from_m: f64, degrees: f64, direction: TurnDirection) -> Lanelet {
    let (radius_m, side) = (12.0, degrees.signum());
    let pose = |step: i32| {
        let turned = (f64::from(step) * degrees / 30.0).to_radians();
        let (ahead_m, left_m) = (radius_m * turned.abs().sin(), side * radius_m * (1.0 - turned.cos()));
        Pose { yaw_rad: turned, position: at(from_m).point_at(ahead_m, left_m) }
    };
    let line = |by_m: f64| (0..=30).map(|step| pose(step).point_at(0.0, by_m)).collect();
    Lanelet {
        id,
        centerline: line(0.0),
        left_bound: line(HALF_WIDTH_M),
        right_bound: line(-HALF_WIDTH_M),
        turn_direction: direction,
        ..Lanelet::default()
    }
}

/// Straight over a crossing at which `other` leads off, and left at another one behind it.
struct Town {
    road: LaneNetwork,
    turn_m: f64,
}

impl Town {
    fn new(between_m: f64, other: Lanelet, straight: TurnDirection) -> Self {
        let [from_m, to_m] = CROSSING_M;
        let turn_m = to_m + between_m;
        let way = |lane: Lanelet, followers: &[i64]| Lanelet { followers: followers.to_vec(), ..lane };
        let lanes = [
            way(straight_lane(1, -100.0, from_m), &[2, 3]),
            Lanelet { turn_direction: straight, ..way(straight_lane(2, from_m, to_m), &[4]) },
            other,
            way(straight_lane(4, to_m, turn_m), &[5, 6]),
            arc(5, turn_m, 90.0, TurnDirection::Left),
            straight_lane(6, turn_m, turn_m + 60.0),
        ];
        Self { road: LaneNetwork::new(lanes, Vec::new()), turn_m }
    }

    /// Where the front is when LEFT is first shown, by the decision there, and signals that waited.
    fn shown_from(&self, settings: DeciderSettings, speed_mps: f64) -> (f64, Decision, u64) {
        let mut decider = Decider::new(settings);
        let route = route_from(1, at(-90.0), &[1, 2, 4, 5]);
        let mut now = MonoTime::from_millis(50_000);
        let mut first = None;
        let mut x_m = -90.0;
        while x_m + FRONT_M < self.turn_m {
            now = now.after(Duration::from_millis(100));
            let value = Odometry { pose: at(x_m), speed_mps };
            let decision = decider.decide(&inputs(Timed { at: now, value }, &self.road, &route), now);
            let is_shown = decision.turn == TurnCommand::Left;
            assert!(is_shown || first.is_none(), "off again at {x_m} m");
            if is_shown && first.is_none() {
                first = Some((x_m + FRONT_M, decision));
            }
            x_m += speed_mps / 10.0;
        }
        let (from_m, decision) = first.expect("never shown");
        (from_m, decision, decider.shortened())
    }
}

fn left() -> Lanelet {
    arc(3, CROSSING_M[0], 90.0, TurnDirection::Left)
}

fn settings(compat: DeciderCompat) -> DeciderSettings {
    DeciderSettings::deployed(compat)
}

#[test]
fn a_signal_waits_until_a_crossing_that_offers_its_side_is_passed() {
    let town = Town::new(40.0, left(), TurnDirection::Straight);
    let (upstream_m, ..) = town.shown_from(settings(Upstream), 8.0);
    assert!((upstream_m - (town.turn_m - 54.0)).abs() < 1.0, "{upstream_m}");
    let (from_m, decision, shortened) = town.shown_from(settings(Improved), 8.0);
    assert!((0.0..1.0).contains(&(from_m - CROSSING_M[1])), "{from_m}");
    assert_eq!((decision.junction, shortened), (None, 1));
    let off = DeciderSettings { waits_for_junctions: false, ..settings(Improved) };
    let (from_m, decision, shortened) = town.shown_from(off, 8.0);
    assert_eq!((from_m, decision.junction, shortened), (upstream_m, None, 0));
}

#[test]
fn a_way_without_a_tag_is_known_by_where_it_leads_and_passed_where_it_parts() {
    let town = Town::new(60.0, arc(3, CROSSING_M[0], 20.0, TurnDirection::None), TurnDirection::None);
    // Its 4.2 m do not lead it apart: a lane of one road.
    let (from_m, _, shortened) = town.shown_from(settings(Improved), 15.0);
    assert_eq!((from_m < CROSSING_M[0] + 6.0, shortened), (true, 0));
    let town = Town::new(60.0, arc(3, CROSSING_M[0], 60.0, TurnDirection::None), TurnDirection::None);
    let (from_m, _, shortened) = town.shown_from(settings(Improved), 15.0);
    // 3 m to the side of the straight way after a turn by 41°, 8.7 m along the arc.
    assert!((8.7..12.2).contains(&(from_m - CROSSING_M[0])), "{from_m}");
    assert_eq!(shortened, 1);
}

#[test]
fn other_ways_do_not_shorten_a_signal() {
    let right = arc(3, CROSSING_M[0], -90.0, TurnDirection::Right);
    let straight = Lanelet { turn_direction: TurnDirection::Straight, ..straight_lane(3, 100.0, 120.0) };
    for other in [right, straight, arc(3, CROSSING_M[0], -60.0, TurnDirection::None)] {
        let town = Town::new(40.0, other, TurnDirection::Straight);
        let (from_m, _, shortened) = town.shown_from(settings(Improved), 8.0);
        assert!((from_m - (town.turn_m - 54.0)).abs() < 1.0, "{from_m}");
        assert_eq!(shortened, 0);
    }
}

#[test]
fn the_law_and_what_is_seen_too_late_come_before_the_junction() {
    let town = Town::new(20.0, left(), TurnDirection::Straight);
    let book = Country::new("XX".to_owned(), "the book".to_owned());
    let country = Some(Arc::new(Country { turn_distance_m: Some(30.0), ..book }));
    let legal = DeciderSettings { country, ..settings(Improved) };
    let (from_m, decision, shortened) = town.shown_from(legal.clone(), 8.0);
    assert!((0.0..1.0).contains(&(from_m - (town.turn_m - 30.0))), "{from_m}");
    assert_eq!(shortened, 1, "54 m were cut to 30 m");
    let remark = decision.junction.unwrap();
    assert_eq!((remark.key(), remark.least_m()), ("law", Some(30.0)));
    assert_eq!(
        remark.to_string(),
        "shown before the way to the left on 3, which is not taken, since the law demands it 30 m before the turn \
         (XX: the book)"
    );
    // At a higher speed than the law thought of, or without a law.
    let town = Town::new(2.0, left(), TurnDirection::Straight);
    for (settings, speed_mps, least_m) in
        [(legal, 25.0, 37.5), (settings(Improved), 10.0, 15.0), (settings(Improved), 3.0, 10.0)]
    {
        let (from_m, decision, _) = town.shown_from(settings, speed_mps);
        assert!((0.0..2.5).contains(&(from_m - (town.turn_m - least_m))), "{from_m}");
        let remark = decision.junction.unwrap();
        assert_eq!((remark.key(), remark.least_m()), ("seen_too_late", Some(least_m)));
    }
}

/// Slowing down within the distance in which it is shown all the same does not take the signal back.
#[test]
fn what_is_shown_stays() {
    let town = Town::new(10.0, left(), TurnDirection::Straight);
    let mut decider = Decider::new(settings(Improved));
    let route = route_from(1, at(-90.0), &[1, 2, 4, 5]);
    let mut now = MonoTime::from_millis(50_000);
    let mut at_speed = |x_m: f64, speed_mps: f64| {
        now = now.after(Duration::from_secs(2));
        let value = Odometry { pose: at(x_m), speed_mps };
        decider.decide(&inputs(Timed { at: now, value }, &town.road, &route), now).turn
    };
    use TurnCommand::{Disable, Left};
    assert_eq!(at_speed(90.0, 12.0), Disable);
    assert_eq!(at_speed(110.0, 12.0), Left, "16.2 m before the turn, 18 m are needed");
    assert_eq!(at_speed(110.5, 2.0), Left);
    assert_eq!(at_speed(111.0, 0.0), Left);
}
