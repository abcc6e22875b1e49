//! The subjects of the shipped scenarios: each manoeuvre, each conflict pattern, each weakness of upstream.

/// Manoeuvres and faults of inputs, with the scenarios that drive them.
pub(crate) const MANOEUVRES: &[(&str, &[&str])] = &[
    ("intersection, left", &["crossing_left.toml", "short_signal_distance.toml"]),
    ("intersection, right", &["crossing_right.toml"]),
    ("intersection, straight", &["crossing_straight.toml"]),
    ("turn after turn", &["left_then_right.toml", "split_turn.toml", "chicane.toml"]),
    ("avoidance in the gap between two turns", &["gap_before_required_avoidance.toml"]),
    ("stop before a turn", &["stop_before_turn.toml", "slowing_before_turn.toml"]),
    ("no turn direction", &["fork.toml"]),
    ("roundabout, side by the map", &["roundabout_first_exit.toml", "roundabout_third_exit.toml"]),
    ("roundabout, exit by tag", &["roundabout_second_exit.toml"]),
    ("roundabout, exit without tag", &["roundabout_untagged.toml"]),
    ("roundabout, entry that ends", &["roundabout_entry_short.toml"]),
    ("roundabout, entry that lasts", &["roundabout_persistent.toml", "roundabout_silent_exit.toml"]),
    (
        "roundabout, around",
        &["roundabout_u_turn.toml", "roundabout_once_around.toml", "roundabout_past_own_entry.toml"],
    ),
    ("roundabout, slowing down", &["roundabout_slowing_down.toml"]),
    ("avoidance, out and back", &["avoidance_out_and_back.toml"]),
    ("avoidance, one lane", &["avoidance_narrow_road.toml"]),
    ("avoidance, not signalled", &["swerving_silent.toml"]),
    ("avoidance before a turn", &["avoidance_before_turn.toml"]),
    ("lane change, left, running", &["lane_change_left.toml", "lane_change_masked.toml"]),
    ("lane change, right, waiting", &["lane_change_right_waiting.toml"]),
    ("pull out, right", &["pull_out_right.toml", "pull_out_before_crossing.toml"]),
    ("pull out, left", &["pull_out_left.toml"]),
    ("backing out with hazard lights", &["backing_out.toml", "hazard_erased.toml"]),
    ("pull over", &["pull_over.toml"]),
    ("pull over, announced before", &["pull_over_pre_signal.toml"]),
    ("side shift", &["side_shift.toml"]),
    ("turn, roundabout and avoidance", &["three_candidates.toml"]),
    ("another route", &["reroute_short_signal.toml", "reroute_stale_start.toml"]),
    ("inputs that fail", &["odometry_gap.toml", "bad_inputs.toml"]),
];

/// Conflict patterns, and the branches of the rule by which they are decided.
pub(crate) const CONFLICTS: &[(&str, &str, &[&str])] = &[
    ("C1, drawing 1", "conflict_01_partial.toml", &["A2", "A4"]),
    ("C2, drawing 2", "conflict_02_returns.toml", &["A2", "A4"]),
    ("C3, drawing 3", "conflict_03_nested.toml", &["A1"]),
    ("C4, drawing 4", "conflict_04_later_first.toml", &["B2"]),
    ("C5, drawing 5", "conflict_05_enclosing.toml", &["B1"]),
    ("C6", "conflict_06_gap.toml", &["A2", "A3", "A4"]),
    ("C7", "conflict_07_gap_later_first.toml", &["B2"]),
    ("C8", "conflict_08_same_start.toml", &["B1"]),
    ("C9", "conflict_09_same_interval.toml", &["B2"]),
    ("C10", "conflict_10_announced_together.toml", &["A2", "A4"]),
    ("C11", "conflict_11_together_later_first.toml", &["B2"]),
    ("C12", "conflict_12_three_metres_apart.toml", &["B1"]),
];

/// Scenarios in which upstream's commands show a weakness that improved ones have not.
#[rustfmt::skip]
pub(crate) const WEAKNESSES: &[(&str, &[&str])] = &[
    ("W1", &["slowing_before_turn.toml"]),
    ("W2", &["reroute_short_signal.toml"]),
    ("W3", &["front_on_required_start.toml"]),
    ("W4", &["conflict_02_returns.toml", "conflict_05_enclosing.toml", "conflict_06_gap.toml",
        "conflict_08_same_start.toml", "conflict_10_announced_together.toml",
        "conflict_12_three_metres_apart.toml", "lane_change_displaced.toml"]),
    ("W5", &["hazard_erased.toml", "side_shift.toml"]),
    ("W6", &["empty_record_at_origin.toml"]),
    ("W7", &["split_turn.toml"]),
    ("W8", &["reroute_stale_start.toml"]),
    ("W9", &["lane_change_left.toml", "lane_change_masked.toml", "lane_change_right_waiting.toml"]),
    ("W10", &["roundabout_entry_short.toml", "roundabout_silent_exit.toml", "roundabout_untagged.toml"]),
    ("W15", &["pull_out_left.toml", "pull_out_right.toml", "pull_out_before_turn.toml"]),
    ("W18", &["avoidance_out_and_back.toml", "avoidance_short_gap.toml", "avoidance_early_return.toml",
        "avoidance_narrow_road.toml", "pull_over.toml", "pull_over_pre_signal.toml",
        "pull_over_decided_early.toml", "gap_gives_way_to_another.toml"]),
    ("W19", &["lane_changes_same_side.toml", "lane_changes_one_after_the_other.toml",
        "lane_change_then_back.toml"]),
    ("W20", &["helix.toml", "helix_lane_changes.toml", "pull_out_beside_oncoming.toml",
        "lane_change_past_own_entry.toml", "avoidances_around_a_ring.toml"]),
    ("W21", &["conflict_05_enclosing.toml", "conflict_09_same_interval.toml", "exit_three_metres_apart.toml",
        "front_on_required_start.toml", "lane_change_beside_an_exit.toml"]),
    ("W22", &["once_around_a_block.toml"]),
    ("W23", &["turn_behind_a_crossing.toml", "turn_behind_a_crossing_by_law.toml"]),
    ("W24", &["goal_passed_on_the_way.toml"]),
];

/// Scenarios in which upstream and improved show the same sides in the same order, and only gaps between two
/// signals (W2) and the ends of shifts (W18) lie elsewhere.
#[rustfmt::skip]
pub(crate) const ONLY_A_GAP: &[&str] = &[
    "avoidance_before_turn.toml", "backing_out.toml", "chicane.toml", "conflict_01_partial.toml",
    "conflict_04_later_first.toml", "conflict_07_gap_later_first.toml", "gap_before_required_avoidance.toml",
    "left_then_right.toml", "roundabout_once_around.toml", "roundabout_third_exit.toml",
    "roundabout_u_turn.toml", "three_candidates.toml",
];
