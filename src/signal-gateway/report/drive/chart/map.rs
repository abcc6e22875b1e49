//! The parts of a drive chart apart from signals: speed, stops, and the way on the map.

use std::ops::Range;

use crate::config::drive::DriveFile;
use crate::report::chart::{Bar, IndicatorState, Look, Mark, Plan, PlanLane};
use crate::report::drive::snapshot::Snapshot;
use lanelet2_map::geometry::Point;
use lanelet2_map::lane_network::{LaneId, Lanelet, TurnDirection};

/// Speed below which the vehicle counts as standing, m/s.
const STANDING_MPS: f64 = 0.1;
/// Minimum length of a shown stop, seconds.
const MIN_STOP_S: f64 = 0.5;
/// Number of parts of the distance, with a speed bar for each.
const SPEED_BARS: u32 = 200;
/// Minimum distance between points of the way, metres.
const POINT_GAP_M: f64 = 0.5;
/// Maximum distance of a shown lane from the way, metres.
const NEAR_M: f64 = 30.0;

#[derive(Debug, Clone, Copy)]
pub(super) struct Cycle {
    at_s: f64,
    at_m: f64,
    speed_mps: f64,
    position: Point,
    lane: Option<LaneId>,
    indicator: IndicatorState,
}

impl Cycle {
    pub(super) fn new(snapshot: &Snapshot<'_>, indicator: IndicatorState) -> Self {
        let Snapshot { at_s, at_m, speed_mps, lane, pose, .. } = *snapshot;
        Self { at_s, at_m, speed_mps, position: pose.position, lane, indicator }
    }
}

/// Returns the speed over the distance as bars, whose height is relative to the highest speed.
pub(super) fn speed(cycles: &[Cycle], route_m: &Range<f64>) -> Vec<Bar> {
    let top = top_mps(cycles);
    if top <= 0.0 || route_m.end <= route_m.start {
        return Vec::new();
    }
    let width = (route_m.end - route_m.start) / f64::from(SPEED_BARS);
    let bar = |number: u32| {
        let [begin, end] = [number, number + 1].map(|part| route_m.start + f64::from(part) * width);
        // The last cycle before the end of the part.
        let cycle = cycles.iter().rev().find(|cycle| cycle.at_m < end)?;
        let speed_mps = cycle.speed_mps.abs();
        let text = format!("{:.1} km/h", speed_mps * 3.6);
        Some(Bar { from: begin, to: end, look: Look::Share(speed_mps / top, text) })
    };
    let mut bars: Vec<Bar> = Vec::new();
    for bar in (0..SPEED_BARS).filter_map(bar) {
        match bars.last_mut() {
            Some(last) if last.look == bar.look => last.to = bar.to,
            Some(_) | None => bars.push(bar),
        }
    }
    bars
}

pub(super) fn speed_label(cycles: &[Cycle]) -> String {
    format!("speed, 0 to {:.0} km/h", top_mps(cycles) * 3.6)
}

fn top_mps(cycles: &[Cycle]) -> f64 {
    cycles.iter().map(|cycle| cycle.speed_mps.abs()).fold(0.0, f64::max)
}

pub(super) fn stops(cycles: &[Cycle]) -> Vec<Mark> {
    let stands = |cycle: &Cycle| cycle.speed_mps.abs() < STANDING_MPS;
    let groups = cycles.chunk_by(|one, other| stands(one) == stands(other));
    let stop = |group: &[Cycle]| {
        let (first, last) = (group.first()?, group.last()?);
        let lasts_s = last.at_s - first.at_s;
        let text = format!("stands for {lasts_s:.1} s");
        (stands(first) && lasts_s >= MIN_STOP_S).then_some(Mark { at: first.at_m, text })
    };
    groups.filter_map(stop).collect()
}

fn distance_m(one: Point, other: Point) -> f64 {
    (one.x_m - other.x_m).hypot(one.y_m - other.y_m)
}

pub(super) fn plan(file: &DriveFile, cycles: &[Cycle]) -> Plan {
    let mut driven: Vec<(IndicatorState, Vec<Point>)> = Vec::new();
    for cycle in cycles {
        let point = cycle.position;
        match driven.last_mut() {
            Some((indicator, points)) if *indicator == cycle.indicator => {
                if points.last().is_none_or(|last| distance_m(*last, point) >= POINT_GAP_M) {
                    points.push(point);
                }
            }
            // The signal changes at this point: the parts meet here.
            Some((_, points)) => {
                points.push(point);
                driven.push((cycle.indicator, vec![point]));
            }
            None => driven.push((cycle.indicator, vec![point])),
        }
    }
    let is_near = |lane: &Lanelet| {
        let way = || driven.iter().flat_map(|(_, points)| points.iter().step_by(10));
        lane.centerline.iter().any(|point| way().any(|way| distance_m(*way, *point) < NEAR_M))
    };
    let lanes = file.road.lanes().filter(|lane| is_near(lane)).map(|lane| PlanLane {
        name: lane.id.to_string(),
        side: side(lane.turn_direction),
        is_driven: cycles.iter().any(|cycle| cycle.lane == Some(lane.id)),
        outline: lane.left_bound.iter().chain(lane.right_bound.iter().rev()).copied().collect(),
    });
    Plan { lanes: lanes.collect(), driven }
}

pub(super) const fn side(direction: TurnDirection) -> Option<IndicatorState> {
    match direction {
        TurnDirection::None | TurnDirection::Straight => None,
        TurnDirection::Left => Some(IndicatorState::Left),
        TurnDirection::Right => Some(IndicatorState::Right),
    }
}
