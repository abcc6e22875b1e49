//! The parameters of the decider, under Autoware's names (docs/spec/turn-signal-decider.md, "Parameters").

use super::side::Side;
use lanelet2_map::geometry::path::NearestLimits;

pub mod table;

/// All parameters. Distances in metres, times in seconds.
#[derive(Debug, Clone, PartialEq)]
pub struct DeciderParameters {
    /// `turn_signal_intersection_search_distance`: constant part of the search distance.
    pub intersection_search_distance_m: f64,
    /// `turn_signal_intersection_angle_threshold_degree`: heading deviation that ends the required
    /// section of a turn.
    pub intersection_angle_threshold_deg: f64,
    /// `turn_signal_minimum_search_distance`: minimum prepare distance of shifts, and the distance that
    /// counts as near a turn lane while standing.
    pub minimum_search_distance_m: f64,
    /// `turn_signal_search_time`: time part of all search distances.
    pub search_time_s: f64,
    /// `turn_signal_shift_length_threshold`: smaller shifts are not signalled.
    pub shift_length_threshold_m: f64,
    /// `turn_signal_remaining_shift_length_threshold`: a shift with less than this remaining is done.
    pub remaining_shift_length_threshold_m: f64,
    /// `turn_signal_remaining_distance_to_bound_threshold`: pulling out is done at this distance from the
    /// bound.
    pub remaining_distance_to_bound_threshold_m: f64,
    /// `turn_signal_on_swerving`: shifts are signalled.
    pub on_swerving: bool,
    /// `turn_signal_roundabout_on_entry`: the signal on the way in; `None` for no signal.
    pub roundabout_on_entry: Option<Side>,
    /// `turn_signal_roundabout_on_exit`: the signal on the way out; `None` for no signal.
    pub roundabout_on_exit: Option<Side>,
    /// `turn_signal_roundabout_entry_indicator_persistence`: the entry signal lasts until the exit.
    pub roundabout_entry_persists: bool,
    /// `turn_signal_roundabout_search_distance`: constant part of the search distance of entries.
    pub roundabout_search_distance_m: f64,
    /// `turn_signal_roundabout_angle_threshold_degree`: heading threshold for entries and exits.
    pub roundabout_angle_threshold_deg: f64,
    /// `turn_signal_roundabout_backward_depth`: maximum number of lanelets searched backwards; `None` means
    /// all.
    pub roundabout_backward_depth: Option<u32>,
    /// `turn_signal_path_backward_length`: length of the distance path behind the vehicle.
    pub path_backward_length_m: f64,
    /// `forward_path_length`: length of the distance path ahead.
    pub path_forward_length_m: f64,
    /// `input_path_interval`: spacing of the distance path.
    pub path_interval_m: f64,
    /// `ego_nearest_dist_threshold`, `ego_nearest_yaw_threshold`: limits of the nearest point.
    pub nearest: NearestLimits,
    /// `min_length_for_turn_signal_activation` of the lane change.
    pub lane_change_activation_length_m: f64,
    /// `turn_signal_on_centerline_start` of the start planner.
    pub centerline_start_side: Side,
    /// `minimum_shift_length` of the start planner.
    pub pull_out_minimum_shift_m: f64,
    /// `th_distance_to_middle_of_the_road` of the start planner.
    pub pull_out_middle_distance_m: f64,
    /// `enable_back` of the start planner.
    pub pull_out_enable_back: bool,
    /// Goal planner `parking_policy`: the side it pulls over to.
    pub parking_side: Side,
    /// `max_prepare_time` of the avoidance.
    pub avoidance_prepare_time_s: f64,
    /// `candidate_path_turn_signal` of the avoidance.
    pub avoidance_candidate: CandidatePolicy,
}

/// The condition on which a waiting avoidance is signalled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum CandidatePolicy {
    /// `none`: never signalled.
    #[default]
    None,
    /// `stopped_candidate`: signalled while the vehicle stands.
    StoppedCandidate,
    /// `all_candidate`: always signalled.
    AllCandidate,
    /// `stop_on_approval`: not signalled while waiting; the planner then stops the vehicle with the signal
    /// on.
    StopOnApproval,
}

/// Dimensions of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleInfo {
    /// Distance between the axles, metres.
    pub wheel_base_m: f64,
    /// Distance from the front axle to the front bumper, metres.
    pub front_overhang_m: f64,
    /// Distance from the rear axle to the rear bumper, metres.
    pub rear_overhang_m: f64,
    /// Distance from the centre line to the left side, metres.
    pub left_m: f64,
    /// Distance from the centre line to the right side, metres.
    pub right_m: f64,
}

impl DeciderParameters {
    /// The values set by Autoware's launch files: as documented, except that the entry signal of a roundabout
    /// persists.
    pub const DEPLOYED: Self = Self {
        intersection_search_distance_m: 30.0,
        intersection_angle_threshold_deg: 15.0,
        minimum_search_distance_m: 10.0,
        search_time_s: 3.0,
        shift_length_threshold_m: 0.3,
        remaining_shift_length_threshold_m: 0.1,
        remaining_distance_to_bound_threshold_m: 1.3,
        on_swerving: true,
        roundabout_on_entry: None,
        roundabout_on_exit: Some(Side::Left),
        roundabout_entry_persists: true,
        roundabout_search_distance_m: 30.0,
        roundabout_angle_threshold_deg: 15.0,
        roundabout_backward_depth: Some(50),
        path_backward_length_m: 100.0,
        path_forward_length_m: 300.0,
        path_interval_m: 2.0,
        nearest: NearestLimits { distance_m: 3.0, yaw_rad: 1.046 },
        lane_change_activation_length_m: 10.0,
        centerline_start_side: Side::Right,
        pull_out_minimum_shift_m: 0.5,
        pull_out_middle_distance_m: 0.5,
        pull_out_enable_back: true,
        parking_side: Side::Left,
        avoidance_prepare_time_s: 3.0,
        avoidance_candidate: CandidatePolicy::None,
    };

    /// Returns the distance in metres at which turns come within range at this speed.
    pub fn intersection_search_m(&self, speed_mps: f64) -> f64 {
        self.search_time_s * speed_mps + self.intersection_search_distance_m
    }

    /// Returns the distance in metres at which roundabouts come within range at this speed.
    pub fn roundabout_search_m(&self, speed_mps: f64) -> f64 {
        self.search_time_s * speed_mps + self.roundabout_search_distance_m
    }

    /// Returns the distance in metres before a shift from which it is announced at this speed.
    pub fn prepare_m(&self, speed_mps: f64) -> f64 {
        (speed_mps * self.search_time_s).max(self.minimum_search_distance_m)
    }
}

impl VehicleInfo {
    /// The dimensions of Autoware's sample vehicle.
    pub const SAMPLE: Self = Self {
        wheel_base_m: 2.79,
        front_overhang_m: 1.0,
        rear_overhang_m: 1.1,
        left_m: 0.948,
        right_m: 0.948,
    };

    /// Returns the distance from the rear axle to the front bumper, metres.
    pub fn front_m(&self) -> f64 {
        self.wheel_base_m + self.front_overhang_m
    }
}
