//! Builds an avoidance from planning factors. A factor holds a batch of shift lines from the start of the
//! first to the end of the last, which is exact if the batch is one line. Lines in between are taken from the
//! planned path, where they are a little shorter than planned. An avoidance counts as approved when the
//! planned path follows one of its lines, since factors do not state whether it is approved. Lines have no
//! id; their ends identify them.

use super::factor::{FactorContext, FactorInterval, Made, Ramp};
use super::path_offsets::PathOffsets;
use crate::inputs::FactorFlaw;
use crate::manoeuvre::avoidance::{Avoidance, AvoidanceLine};
use crate::manoeuvre::{Manoeuvre, ManoeuvreKind};
use crate::planner_input::PlanningFactor;
use lanelet2_map::geometry::Pose;

/// Returns the avoidance of the module's factors. `refuse` receives the flaws of unusable factors.
pub(super) fn around(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    factors: &[&PlanningFactor],
    refuse: &mut impl FnMut(FactorFlaw),
) -> Made {
    let mut stretches = Vec::new();
    for factor in factors.iter().filter(|factor| !factor.is_about_speed()) {
        match factor.interval() {
            Ok(interval) => stretches.push(interval),
            Err(flaw) => refuse(flaw),
        }
    }
    if stretches.is_empty() {
        return Ok(Vec::new());
    }
    let Some(path_offsets) = path_offsets else { return Err(ManoeuvreKind::Avoidance) };
    let threshold_m = context.parameters.shift_length_threshold_m;
    let mut ramps: Vec<Ramp> =
        stretches.iter().flat_map(|interval| ramps(path_offsets, interval, threshold_m)).collect();
    ramps.sort_by_key(|ramp| path_offsets.nearest_index(ramp.start));
    let is_approved = ramps.iter().any(|ramp| path_offsets.follows(ramp));
    let avoidance = along(context, path_offsets, &ramps, is_approved).ok_or(ManoeuvreKind::Avoidance)?;
    Ok(vec![Manoeuvre::Avoidance(avoidance)])
}

/// Returns the avoidance along these ramps, in order; `None` without a path.
pub(super) fn along(
    context: &FactorContext<'_>,
    path_offsets: &PathOffsets,
    ramps: &[Ramp],
    approved: bool,
) -> Option<Avoidance> {
    let path = path_offsets.ramped(ramps)?;
    let line = |ramp: &Ramp| AvoidanceLine {
        id: id(ramp),
        line: path_offsets.line(ramp.start, ramp.end),
        start_shift_m: ramp.before_m,
        end_shift_m: ramp.after_m,
    };
    let ego = context.odometry.pose;
    let ego_index = path_offsets.nearest_index(ego);
    // Before the first line, the offset of the path belongs to another manoeuvre.
    let ahead = ramps.first().filter(|first| ego_index < path_offsets.nearest_index(first.start));
    Some(Avoidance {
        lines: ramps.iter().map(line).collect(),
        ego_index,
        deviation_m: path_offsets.beside_m(ego),
        current_shift_m: ahead.map_or_else(|| path_offsets.path_offset_m(ego), |first| first.before_m),
        lanes: path_offsets.lanes.clone(),
        approved,
        path,
    })
}

/// Returns the line of a batch with one line, otherwise the lines that the path shows.
fn ramps(path_offsets: &PathOffsets, interval: &FactorInterval, threshold_m: f64) -> Vec<Ramp> {
    if interval.shift_m().abs() < threshold_m {
        let mut ramps = path_offsets.own_ramps(interval.start.pose, interval.end.pose, threshold_m);
        // The factor has the exact start of the first line and end of the last; the path shows them late and
        // early. Near the vehicle the path may lack the first line, and far ahead the last; the outer ramp
        // then keeps its own ends.
        let shifts = |ramp: &Ramp| {
            let shift_m = ramp.after_m - ramp.before_m;
            (shift_m.abs() >= threshold_m).then_some(shift_m > 0.0)
        };
        if let Some(first) = ramps.first_mut() {
            let given =
                Ramp { start: interval.start.pose, before_m: interval.start.shift_length_m, ..*first };
            if shifts(&given) == shifts(first) {
                *first = given;
            }
        }
        if let Some(last) = ramps.last_mut() {
            let given = Ramp { end: interval.end.pose, after_m: interval.end.shift_length_m, ..*last };
            if shifts(&given) == shifts(last) {
                *last = given;
            }
        }
        return ramps;
    }
    vec![interval.ramp()]
}

/// Returns an id shared by lines that end within the same metre and shift to the same side.
fn id(ramp: &Ramp) -> u128 {
    let Pose { position, .. } = ramp.end;
    // Removes the sign of zero.
    let metre = |coordinate_m: f64| u128::from((coordinate_m.round() + 0.0).to_bits());
    let side = u128::from(ramp.after_m > ramp.before_m);
    metre(position.x_m) << 64 | metre(position.y_m) << 1 ^ side
}
