//! Drives that come out otherwise over ROS, and why.

use signal_gateway::core::turn_signal::compat::DeciderCompat;

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
    Deviation { name, modes: &COMPATS, why: NOT_COMPARED, within_m: None }
}

pub(super) const DEVIATIONS: &[Deviation] = &[
    not_compared("avoidances_around_a_ring.toml"),
    not_compared("exit_three_metres_apart.toml"),
    not_compared("gap_gives_way_to_another.toml"),
    not_compared("lane_change_beside_an_exit.toml"),
    not_compared("lane_change_past_own_entry.toml"),
    Deviation {
        name: "avoidance_narrow_road.toml",
        modes: &[DeciderCompat::Improved],
        why: OUT_AND_BACK,
        within_m: Some(4.0),
    },
    Deviation {
        name: "avoidance_narrow_road.toml",
        modes: &[DeciderCompat::Upstream],
        why: GAP,
        within_m: None,
    },
    Deviation {
        name: "avoidance_out_and_back.toml",
        modes: &[DeciderCompat::Improved],
        why: OUT_AND_BACK,
        within_m: Some(4.0),
    },
    Deviation {
        name: "avoidance_out_and_back.toml",
        modes: &[DeciderCompat::Upstream],
        why: GAP,
        within_m: None,
    },
    Deviation {
        name: "front_on_required_start.toml",
        modes: &[DeciderCompat::Upstream],
        why: "one sample with the front exactly on a start: poses are rounded, and cycles are not those of odometry",
        within_m: None,
    },
    Deviation {
        name: "lane_change_then_back.toml",
        modes: &[DeciderCompat::Upstream],
        why: "the factor of the second lane change has begun when the vehicle is in range only, so that the first is not \
              replaced from the start",
        within_m: None,
    },
    Deviation {
        name: "gap_before_required_avoidance.toml",
        modes: &[DeciderCompat::Improved],
        why: "the first cycle is repeated, so that the minimum time of the signal is over when the drive begins",
        within_m: None,
    },
    Deviation {
        name: "helix_lane_changes.toml",
        modes: &[DeciderCompat::Upstream],
        why: "levels are taken for each other, and from the factors the first lane change is seen a metre later",
        within_m: None,
    },
    Deviation {
        name: "hazard_erased.toml",
        modes: &[DeciderCompat::Upstream],
        why: "offsets are published as one: that of the pull-out passes for that of the avoidance",
        within_m: None,
    },
    Deviation {
        name: "lane_change_displaced.toml",
        modes: &[DeciderCompat::Improved],
        why: "in the scenario both required sections end between two cycles; over ROS the cycles are others, and the lane \
              change goes on behind the turn",
        within_m: None,
    },
    Deviation {
        name: "lane_change_masked.toml",
        modes: &[DeciderCompat::Improved],
        why: "the scenario gives the position at which the bound is crossed, but its path stays in the lane: the turn lies \
              within the lane change",
        within_m: None,
    },
    Deviation {
        name: "reroute_stale_start.toml",
        modes: &[DeciderCompat::Improved],
        why: "shift lines are published without ids: on another route the line ends elsewhere and is another one",
        within_m: None,
    },
    Deviation {
        name: "side_shift.toml",
        modes: &[DeciderCompat::Improved],
        why: "side shifts are not published: that of the path passes for the avoidance's",
        within_m: Some(12.0),
    },
    Deviation {
        name: "side_shift.toml",
        modes: &[DeciderCompat::Upstream],
        why: "side shifts are not published, so that they erase nothing",
        within_m: None,
    },
];
