//! Avoidance of planning factors. A factor tells of a batch of shift lines from its first start to its
//! last end: exact when the batch is one line. Of one that goes out and comes back what lies between is
//! taken from the planned path: lines that are a little shorter there than they are. Whether it is
//! approved is not told: it counts as such when the planned path follows one of its lines. Lines have no
//! id: their ends stand for it.

use super::path_offsets::{PathOffsets, Ramp};
use super::{FactorContext, Interval, Made};
use crate::core::map::geometry::Pose;
use crate::core::turn_signal::inputs::FactorFlaw;
use crate::core::turn_signal::manoeuvre::avoidance::{Avoidance, AvoidanceLine};
use crate::core::turn_signal::manoeuvre::{Manoeuvre, ManoeuvreKind};
use crate::core::turn_signal::planner_input::PlanningFactor;
use crate::core::turn_signal::shift::ShiftLine;

/// The avoidance of the module's factors. `refuse` hears what is wrong with them.
pub(super) fn around(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    factors: &[&PlanningFactor],
    refuse: &mut impl FnMut(FactorFlaw),
) -> Made {
    let mut stretches = Vec::new();
    for factor in factors.iter().filter(|factor| !factor.is_about_speed()) {
        match factor.interval() {
            Some(interval) => stretches.push(interval),
            None => refuse(FactorFlaw::NoStretch),
        }
    }
    if stretches.is_empty() {
        return Made::All(Vec::new());
    }
    let Some(path_offsets) = path_offsets else { return Made::NeedsPath(ManoeuvreKind::Avoidance) };
    let threshold_m = context.parameters.shift_length_threshold_m;
    let mut ramps: Vec<Ramp> =
        stretches.iter().flat_map(|interval| ramps(path_offsets, interval, threshold_m)).collect();
    ramps.sort_by_key(|ramp| path_offsets.nearest_index(ramp.start.position));
    let Some(path) = path_offsets.ramped(&ramps) else { return Made::NeedsPath(ManoeuvreKind::Avoidance) };
    let line = |ramp: &Ramp| AvoidanceLine {
        id: id(ramp),
        line: ShiftLine {
            start_index: path_offsets.nearest_index(ramp.start.position),
            end_index: path_offsets.nearest_index(ramp.end.position),
            start: ramp.start,
            end: ramp.end,
        },
        start_shift_m: ramp.before_m,
        end_shift_m: ramp.after_m,
    };
    let ego = context.odometry.pose.position;
    let ego_index = path_offsets.nearest_index(ego);
    // Before its first line, what the path is shifted by belongs to another manoeuvre.
    let ahead = ramps.first().filter(|first| ego_index < path_offsets.nearest_index(first.start.position));
    let avoidance = Avoidance {
        lines: ramps.iter().map(line).collect(),
        ego_index,
        deviation_m: path_offsets.beside_m(ego),
        current_shift_m: ahead.map_or_else(|| path_offsets.path_offset_m(ego), |first| first.before_m),
        lanes: path_offsets.lanes.clone(),
        approved: ramps.iter().any(|ramp| path_offsets.follows(ramp)),
        path,
    };
    Made::All(vec![Manoeuvre::Avoidance(avoidance)])
}

/// The line of a batch of one; else those that the path shows.
fn ramps(path_offsets: &PathOffsets, interval: &Interval, threshold_m: f64) -> Vec<Ramp> {
    if interval.shift_m().abs() < threshold_m {
        let mut ramps = path_offsets.own_ramps(interval.start(), interval.end(), threshold_m);
        // Where the first one begins and the last one ends is told; the path shows it late and early.
        // It may not show the first one any more, or the last one not yet: what then is first or last
        // would not shift any more from where the batch begins, or to where it ends.
        let shifts = |ramp: &Ramp| {
            let shift_m = ramp.after_m - ramp.before_m;
            (shift_m.abs() >= threshold_m).then_some(shift_m > 0.0)
        };
        if let Some(first) = ramps.first_mut() {
            let told = Ramp { start: interval.start(), before_m: interval.start.shift_length_m, ..*first };
            if shifts(&told) == shifts(first) {
                *first = told;
            }
        }
        if let Some(last) = ramps.last_mut() {
            let told = Ramp { end: interval.end(), after_m: interval.end.shift_length_m, ..*last };
            if shifts(&told) == shifts(last) {
                *last = told;
            }
        }
        return ramps;
    }
    vec![Ramp {
        start: interval.start(),
        end: interval.end(),
        before_m: interval.start.shift_length_m,
        after_m: interval.end.shift_length_m,
    }]
}

/// The same for a line that ends within the same metre and shifts to the same side.
fn id(ramp: &Ramp) -> u128 {
    let Pose { position, .. } = ramp.end;
    // Zero without a sign.
    let metre = |coordinate_m: f64| u128::from((coordinate_m.round() + 0.0).to_bits());
    let side = u128::from(ramp.after_m > ramp.before_m);
    metre(position.x_m) << 64 | metre(position.y_m) << 1 ^ side
}
