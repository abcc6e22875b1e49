//! The table of parameters: names, what they take, where it goes.

use super::{CandidatePolicy, Parameters};
use crate::core::turn_signal::signal::Side;

/// One parameter: its names and what it takes.
pub struct Parameter {
    /// The documented name.
    pub name: &'static str,
    /// Other spellings: Autoware's own where it differs, and its name within the module it belongs to.
    pub aliases: &'static [&'static str],
    slot: Slot,
}

/// The kind of a value and the field it is kept in.
enum Slot {
    Metres(fn(&mut Parameters) -> &mut f64),
    Seconds(fn(&mut Parameters) -> &mut f64),
    Degrees(fn(&mut Parameters) -> &mut f64),
    Radians(fn(&mut Parameters) -> &mut f64),
    /// Metres, above zero.
    Spacing(fn(&mut Parameters) -> &mut f64),
    Flag(fn(&mut Parameters) -> &mut bool),
    /// Exactly `Left` or `Right`, anything else is not a signal.
    RoundaboutSide(fn(&mut Parameters) -> &mut Option<Side>),
    /// `LEFT`, or anything else for right.
    StartSide(fn(&mut Parameters) -> &mut Side),
    /// `left_side` or `right_side`.
    ParkingSide(fn(&mut Parameters) -> &mut Side),
    /// A count; negative is not a limit.
    Depth(fn(&mut Parameters) -> &mut Option<u32>),
    Policy(fn(&mut Parameters) -> &mut CandidatePolicy),
}

/// All parameters, those of turns, shifts and roundabouts first.
pub const PARAMETERS: &[Parameter] = &[
    row("turn_signal_intersection_search_distance", Slot::Metres(|p| &mut p.intersection_search_distance_m)),
    row2(
        "turn_signal_intersection_angle_threshold_degree",
        &["turn_signal_intersection_angle_threshold_deg"],
        Slot::Degrees(|p| &mut p.intersection_angle_threshold_deg),
    ),
    row("turn_signal_minimum_search_distance", Slot::Metres(|p| &mut p.minimum_search_distance_m)),
    row("turn_signal_search_time", Slot::Seconds(|p| &mut p.search_time_s)),
    row("turn_signal_shift_length_threshold", Slot::Metres(|p| &mut p.shift_length_threshold_m)),
    row(
        "turn_signal_remaining_shift_length_threshold",
        Slot::Metres(|p| &mut p.remaining_shift_length_threshold_m),
    ),
    row(
        "turn_signal_remaining_distance_to_bound_threshold",
        Slot::Metres(|p| &mut p.remaining_distance_to_bound_threshold_m),
    ),
    row("turn_signal_on_swerving", Slot::Flag(|p| &mut p.on_swerving)),
    row("turn_signal_roundabout_on_entry", Slot::RoundaboutSide(|p| &mut p.roundabout_on_entry)),
    row("turn_signal_roundabout_on_exit", Slot::RoundaboutSide(|p| &mut p.roundabout_on_exit)),
    row(
        "turn_signal_roundabout_entry_indicator_persistence",
        Slot::Flag(|p| &mut p.roundabout_entry_persists),
    ),
    row("turn_signal_roundabout_search_distance", Slot::Metres(|p| &mut p.roundabout_search_distance_m)),
    row2(
        "turn_signal_roundabout_angle_threshold_degree",
        &["turn_signal_roundabout_angle_threshold_deg"],
        Slot::Degrees(|p| &mut p.roundabout_angle_threshold_deg),
    ),
    row("turn_signal_roundabout_backward_depth", Slot::Depth(|p| &mut p.roundabout_backward_depth)),
    row("turn_signal_path_backward_length", Slot::Metres(|p| &mut p.path_backward_length_m)),
    row("forward_path_length", Slot::Spacing(|p| &mut p.path_forward_length_m)),
    row("input_path_interval", Slot::Spacing(|p| &mut p.path_interval_m)),
    row("ego_nearest_dist_threshold", Slot::Metres(|p| &mut p.nearest.distance_m)),
    row("ego_nearest_yaw_threshold", Slot::Radians(|p| &mut p.nearest.yaw_rad)),
    row2(
        "lane_change_min_length_for_turn_signal_activation",
        &["min_length_for_turn_signal_activation"],
        Slot::Metres(|p| &mut p.lane_change_activation_length_m),
    ),
    row("turn_signal_on_centerline_start", Slot::StartSide(|p| &mut p.centerline_start_side)),
    row2(
        "start_planner_minimum_shift_length",
        &["minimum_shift_length"],
        Slot::Metres(|p| &mut p.pull_out_minimum_shift_m),
    ),
    row("th_distance_to_middle_of_the_road", Slot::Metres(|p| &mut p.pull_out_middle_distance_m)),
    row("enable_back", Slot::Flag(|p| &mut p.pull_out_enable_back)),
    row("parking_policy", Slot::ParkingSide(|p| &mut p.parking_side)),
    row2(
        "avoidance_max_prepare_time",
        &["max_prepare_time"],
        Slot::Seconds(|p| &mut p.avoidance_prepare_time_s),
    ),
    row("candidate_path_turn_signal", Slot::Policy(|p| &mut p.avoidance_candidate)),
];

const fn row(name: &'static str, slot: Slot) -> Parameter {
    row2(name, &[], slot)
}

const fn row2(name: &'static str, aliases: &'static [&'static str], slot: Slot) -> Parameter {
    Parameter { name, aliases, slot }
}

impl Parameter {
    /// The parameter with this name or alias.
    pub fn named(name: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|row| row.name == name || row.aliases.contains(&name))
    }

    /// Its value, as [`Parameters::set`] takes it.
    pub fn value(&self, parameters: &Parameters) -> String {
        // The slots give mutable references.
        let parameters = &mut parameters.clone();
        let side = |side: Side, names: [&str; 2]| match side {
            Side::Left => names[0].to_owned(),
            Side::Right => names[1].to_owned(),
        };
        match self.slot {
            Slot::Metres(slot)
            | Slot::Spacing(slot)
            | Slot::Seconds(slot)
            | Slot::Degrees(slot)
            | Slot::Radians(slot) => slot(parameters).to_string(),
            Slot::Flag(slot) => slot(parameters).to_string(),
            Slot::RoundaboutSide(slot) => {
                slot(parameters).map_or("None".to_owned(), |given| side(given, ["Left", "Right"]))
            }
            Slot::StartSide(slot) => side(*slot(parameters), ["LEFT", "RIGHT"]),
            Slot::ParkingSide(slot) => side(*slot(parameters), ["left_side", "right_side"]),
            Slot::Depth(slot) => slot(parameters).map_or("-1".to_owned(), |depth| depth.to_string()),
            Slot::Policy(slot) => slot(parameters).to_string(),
        }
    }

    /// Sets the parameter; on an error, which names what would fit, nothing changes.
    pub(super) fn set(&self, parameters: &mut Parameters, value: &str) -> Result<(), &'static str> {
        match self.slot {
            Slot::Metres(slot) => {
                *slot(parameters) = number(value, 0.0..=100_000.0).ok_or("metres, 0 to 100000")?;
            }
            Slot::Spacing(slot) => {
                *slot(parameters) = number(value, 0.01..=100_000.0).ok_or("metres, 0.01 to 100000")?;
            }
            Slot::Seconds(slot) => {
                *slot(parameters) = number(value, 0.0..=3_600.0).ok_or("seconds, 0 to 3600")?;
            }
            Slot::Degrees(slot) => {
                *slot(parameters) = number(value, 0.0..=180.0).ok_or("degrees, 0 to 180")?;
            }
            Slot::Radians(slot) => {
                *slot(parameters) = number(value, 0.0..=6.3).ok_or("radians, 0 to 6.3")?;
            }
            Slot::Flag(slot) => *slot(parameters) = value.parse().map_err(|_| "true or false")?,
            Slot::RoundaboutSide(slot) => {
                *slot(parameters) = match unquoted(value) {
                    "Left" => Some(Side::Left),
                    "Right" => Some(Side::Right),
                    _ => None,
                };
            }
            Slot::StartSide(slot) => {
                *slot(parameters) = if unquoted(value) == "LEFT" { Side::Left } else { Side::Right };
            }
            Slot::ParkingSide(slot) => {
                *slot(parameters) = match unquoted(value) {
                    "left_side" => Side::Left,
                    "right_side" => Side::Right,
                    _ => return Err("left_side or right_side"),
                };
            }
            Slot::Depth(slot) => {
                let depth: i64 = value.parse().map_err(|_| "a whole number; negative = no limit")?;
                *slot(parameters) = match depth {
                    ..0 => None,
                    depth => Some(u32::try_from(depth).map_err(|_| "a whole number below 2^32")?),
                };
            }
            Slot::Policy(slot) => {
                *slot(parameters) = policy(unquoted(value))
                    .ok_or("none, stopped_candidate, all_candidate or stop_on_approval")?;
            }
        }
        Ok(())
    }
}

fn policy(value: &str) -> Option<CandidatePolicy> {
    use CandidatePolicy::{AllCandidate, None, StopOnApproval, StoppedCandidate};
    [None, StoppedCandidate, AllCandidate, StopOnApproval]
        .into_iter()
        .find(|policy| policy.to_string() == value)
}

fn number(value: &str, range: std::ops::RangeInclusive<f64>) -> Option<f64> {
    value.parse().ok().filter(|number| range.contains(number))
}

/// Strings may come with or without the quotes of a parameter file.
fn unquoted(value: &str) -> &str {
    let within = |quote| value.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote));
    within('"').or_else(|| within('\'')).unwrap_or(value)
}
