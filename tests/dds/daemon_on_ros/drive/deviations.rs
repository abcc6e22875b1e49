//! Drives that come out otherwise over ROS, and why.

use turn_signal::compat::DeciderCompat::{self, Improved, Upstream};

use crate::support::drive_script::COMPATS;

/// A drive of which planning factors carry less than the scenario holds.
pub(super) struct Deviation {
    pub(super) name: &'static str,
    pub(super) modes: &'static [DeciderCompat],
    pub(super) why: &'static str,
    /// Tolerance that is enough, metres; `None` = the commands are others.
    pub(super) within_m: Option<f64>,
}

const OUT_AND_BACK: &str = "one factor for lines out and back: where they meet is taken from the path";
const GAP: &str =
    "one factor for lines out and back: the first one ends a little early, so that it is dark between";

const NOT_COMPARED: &str =
    "from the random drives, positions to a cycle: what factors make of it has not been looked at";

const fn not_compared(name: &'static str) -> Deviation {
    over_ros(name, &COMPATS, None, NOT_COMPARED)
}

const fn over_ros(
    name: &'static str,
    modes: &'static [DeciderCompat],
    within_m: Option<f64>,
    why: &'static str,
) -> Deviation {
    Deviation { name, modes, why, within_m }
}

#[rustfmt::skip]
pub(super) const DEVIATIONS: &[Deviation] = &[
    not_compared("avoidances_around_a_ring.toml"),
    not_compared("exit_three_metres_apart.toml"),
    not_compared("gap_gives_way_to_another.toml"),
    not_compared("lane_change_beside_an_exit.toml"),
    not_compared("lane_change_past_own_entry.toml"),
    over_ros("avoidance_narrow_road.toml", &[Improved], Some(4.0), OUT_AND_BACK),
    over_ros("avoidance_narrow_road.toml", &[Upstream], None, GAP),
    over_ros("avoidance_out_and_back.toml", &[Improved], Some(4.0), OUT_AND_BACK),
    over_ros("avoidance_out_and_back.toml", &[Upstream], None, GAP),
    over_ros("front_on_required_start.toml", &[Upstream], None,
        "one sample with the front exactly on a start: poses are rounded, and cycles are not those of \
         odometry"),
    over_ros("lane_change_then_back.toml", &[Upstream], None,
        "the factor of the second lane change has begun when the vehicle is in range only, so that the \
         first is not replaced from the start"),
    over_ros("gap_before_required_avoidance.toml", &[Improved], None,
        "the first cycle is repeated, so that the minimum time of the signal is over when the drive begins"),
    over_ros("helix_lane_changes.toml", &[Upstream], None,
        "levels are taken for each other, and from the factors the first lane change is seen a metre later"),
    over_ros("hazard_erased.toml", &[Upstream], None,
        "offsets are published as one: that of the pull-out passes for that of the avoidance"),
    over_ros("lane_change_displaced.toml", &[Improved], None,
        "in the scenario both required sections end between two cycles; over ROS the cycles are others, \
         and the lane change goes on behind the turn"),
    over_ros("lane_change_masked.toml", &[Improved], None,
        "the scenario gives the position at which the bound is crossed, but its path stays in the lane: \
         the turn lies within the lane change"),
    over_ros("reroute_stale_start.toml", &[Improved], None,
        "shift lines are published without ids: on another route the line ends elsewhere and is another one"),
    over_ros("side_shift.toml", &[Improved], Some(12.0),
        "side shifts are not published: that of the path passes for the avoidance's"),
    over_ros("side_shift.toml", &[Upstream], None,
        "side shifts are not published, so that they erase nothing"),
];
