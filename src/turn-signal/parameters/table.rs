//! The table of parameters: names, accepted values, fields.

use thiserror::Error;

use super::{CandidatePolicy, DeciderParameters};
use crate::side::Side;

/// A parameter with its names and accepted values.
#[derive(Debug)]
pub struct DeciderParameter {
    /// The name that Autoware documents.
    pub name: &'static str,
    /// Other spellings: Autoware's spelling where it differs, and the name within its module.
    pub aliases: &'static [&'static str],
    slot: Slot,
}

#[derive(Debug)]
enum Slot {
    Number(Quantity, fn(&mut DeciderParameters) -> &mut f64),
    Flag(fn(&mut DeciderParameters) -> &mut bool),
    /// `Left`, `Right`, or `None`.
    RoundaboutSide(fn(&mut DeciderParameters) -> &mut Option<Side>),
    /// One of these names of a side, with the text for errors.
    Side(Names<Side>, &'static str, fn(&mut DeciderParameters) -> &mut Side),
    /// A count; a negative number means no limit.
    Depth(fn(&mut DeciderParameters) -> &mut Option<u32>),
    Policy(fn(&mut DeciderParameters) -> &mut CandidatePolicy),
}

/// Values by their names in a parameter file.
type Names<T> = &'static [(&'static str, T)];

/// The values that a parameter accepts.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterValues {
    /// Numbers from the first to the second, with a unit.
    Numbers(f64, f64, &'static str),
    /// Whole numbers.
    WholeNumbers,
    /// `true` or `false`.
    Flags,
    /// One of these texts.
    Texts(Vec<&'static str>),
}

/// Range of a number, with its unit.
#[derive(Debug, Clone, Copy)]
struct Quantity {
    min: f64,
    max: f64,
    unit: &'static str,
    /// Unit and range as text.
    expected: &'static str,
}

const METRES: Quantity = Quantity { min: 0.0, max: 100_000.0, unit: "m", expected: "metres, 0 to 100000" };
const SPACING: Quantity =
    Quantity { min: 0.01, max: 100_000.0, unit: "m", expected: "metres, 0.01 to 100000" };
const SECONDS: Quantity = Quantity { min: 0.0, max: 3_600.0, unit: "s", expected: "seconds, 0 to 3600" };
const DEGREES: Quantity = Quantity { min: 0.0, max: 180.0, unit: "deg", expected: "degrees, 0 to 180" };
const RADIANS: Quantity = Quantity { min: 0.0, max: 6.3, unit: "rad", expected: "radians, 0 to 6.3" };

const ROUNDABOUT_SIDES: Names<Option<Side>> =
    &[("Left", Some(Side::Left)), ("Right", Some(Side::Right)), ("None", None)];
const START_SIDES: Names<Side> = &[("LEFT", Side::Left), ("RIGHT", Side::Right)];
const PARKING_SIDES: Names<Side> = &[("left_side", Side::Left), ("right_side", Side::Right)];
const POLICIES: Names<CandidatePolicy> = &[
    ("none", CandidatePolicy::None),
    ("stopped_candidate", CandidatePolicy::StoppedCandidate),
    ("all_candidate", CandidatePolicy::AllCandidate),
    ("stop_on_approval", CandidatePolicy::StopOnApproval),
];

/// All parameters; turns, shifts and roundabouts come first.
pub const PARAMETERS: &[DeciderParameter] = &[
    number("turn_signal_intersection_search_distance", METRES, |p| &mut p.intersection_search_distance_m),
    row2(
        "turn_signal_intersection_angle_threshold_degree",
        &["turn_signal_intersection_angle_threshold_deg"],
        Slot::Number(DEGREES, |p| &mut p.intersection_angle_threshold_deg),
    ),
    number("turn_signal_minimum_search_distance", METRES, |p| &mut p.minimum_search_distance_m),
    number("turn_signal_search_time", SECONDS, |p| &mut p.search_time_s),
    number("turn_signal_shift_length_threshold", METRES, |p| &mut p.shift_length_threshold_m),
    number("turn_signal_remaining_shift_length_threshold", METRES, |p| {
        &mut p.remaining_shift_length_threshold_m
    }),
    number("turn_signal_remaining_distance_to_bound_threshold", METRES, |p| {
        &mut p.remaining_distance_to_bound_threshold_m
    }),
    row("turn_signal_on_swerving", Slot::Flag(|p| &mut p.on_swerving)),
    row("turn_signal_roundabout_on_entry", Slot::RoundaboutSide(|p| &mut p.roundabout_on_entry)),
    row("turn_signal_roundabout_on_exit", Slot::RoundaboutSide(|p| &mut p.roundabout_on_exit)),
    row(
        "turn_signal_roundabout_entry_indicator_persistence",
        Slot::Flag(|p| &mut p.roundabout_entry_persists),
    ),
    number("turn_signal_roundabout_search_distance", METRES, |p| &mut p.roundabout_search_distance_m),
    row2(
        "turn_signal_roundabout_angle_threshold_degree",
        &["turn_signal_roundabout_angle_threshold_deg"],
        Slot::Number(DEGREES, |p| &mut p.roundabout_angle_threshold_deg),
    ),
    row("turn_signal_roundabout_backward_depth", Slot::Depth(|p| &mut p.roundabout_backward_depth)),
    number("turn_signal_path_backward_length", METRES, |p| &mut p.path_backward_length_m),
    number("forward_path_length", SPACING, |p| &mut p.path_forward_length_m),
    number("input_path_interval", SPACING, |p| &mut p.path_interval_m),
    number("ego_nearest_dist_threshold", METRES, |p| &mut p.nearest.distance_m),
    number("ego_nearest_yaw_threshold", RADIANS, |p| &mut p.nearest.yaw_rad),
    row2(
        "lane_change_min_length_for_turn_signal_activation",
        &["min_length_for_turn_signal_activation"],
        Slot::Number(METRES, |p| &mut p.lane_change_activation_length_m),
    ),
    // Upstream treats any other text as right.
    row(
        "turn_signal_on_centerline_start",
        Slot::Side(START_SIDES, "LEFT or RIGHT, in capitals", |p| &mut p.centerline_start_side),
    ),
    row2(
        "start_planner_minimum_shift_length",
        &["minimum_shift_length"],
        Slot::Number(METRES, |p| &mut p.pull_out_minimum_shift_m),
    ),
    number("th_distance_to_middle_of_the_road", METRES, |p| &mut p.pull_out_middle_distance_m),
    row("enable_back", Slot::Flag(|p| &mut p.pull_out_enable_back)),
    row("parking_policy", Slot::Side(PARKING_SIDES, "left_side or right_side", |p| &mut p.parking_side)),
    row2(
        "avoidance_max_prepare_time",
        &["max_prepare_time"],
        Slot::Number(SECONDS, |p| &mut p.avoidance_prepare_time_s),
    ),
    row("candidate_path_turn_signal", Slot::Policy(|p| &mut p.avoidance_candidate)),
];

const fn row(name: &'static str, slot: Slot) -> DeciderParameter {
    row2(name, &[], slot)
}

const fn number(
    name: &'static str,
    quantity: Quantity,
    slot: fn(&mut DeciderParameters) -> &mut f64,
) -> DeciderParameter {
    row(name, Slot::Number(quantity, slot))
}

const fn row2(name: &'static str, aliases: &'static [&'static str], slot: Slot) -> DeciderParameter {
    DeciderParameter { name, aliases, slot }
}

/// The reason a parameter was refused. Nothing changed.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[allow(missing_docs)] // the texts say it
pub enum ParameterError {
    #[error("`{name}` is not a parameter of the turn signal decider")]
    Unknown { name: String },
    #[error("`{name}` = `{value}`: give {expected}")]
    Value { name: &'static str, value: String, expected: &'static str },
}

impl DeciderParameters {
    /// Sets one parameter from text, as in a parameter file (`30.0`, `true`, `"Left"`). The name is the
    /// documented one or Autoware's spelling.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), ParameterError> {
        let parameter =
            DeciderParameter::named(name).ok_or_else(|| ParameterError::Unknown { name: name.to_owned() })?;
        parameter.set(self, value.trim()).map_err(|expected| ParameterError::Value {
            name: parameter.name,
            value: value.to_owned(),
            expected,
        })
    }
}

impl DeciderParameter {
    /// Returns the parameter with this name or alias.
    pub fn named(name: &str) -> Option<&'static Self> {
        PARAMETERS.iter().find(|row| row.name == name || row.aliases.contains(&name))
    }

    /// Returns the accepted values.
    pub fn values(&self) -> ParameterValues {
        use ParameterValues::{Flags, Numbers, Texts, WholeNumbers};
        match self.slot {
            Slot::Number(Quantity { min, max, unit, .. }, _) => Numbers(min, max, unit),
            Slot::Depth(_) => WholeNumbers,
            Slot::Flag(_) => Flags,
            Slot::RoundaboutSide(_) => Texts(words(ROUNDABOUT_SIDES)),
            Slot::Side(sides, ..) => Texts(words(sides)),
            Slot::Policy(_) => Texts(words(POLICIES)),
        }
    }

    /// Returns whether its values are numbers.
    pub const fn takes_numbers(&self) -> bool {
        matches!(self.slot, Slot::Number(..) | Slot::Depth(_))
    }

    /// Returns the value as text, in the format of [`DeciderParameters::set`].
    pub fn value(&self, parameters: &DeciderParameters) -> String {
        // The fields are accessible only through mutable references.
        let parameters = &mut parameters.clone();
        match self.slot {
            Slot::Number(_, slot) => slot(parameters).to_string(),
            Slot::Flag(slot) => slot(parameters).to_string(),
            Slot::RoundaboutSide(slot) => name_of(ROUNDABOUT_SIDES, slot(parameters)),
            Slot::Side(names, _, slot) => name_of(names, slot(parameters)),
            Slot::Depth(slot) => slot(parameters).map_or("-1".to_owned(), |depth| depth.to_string()),
            Slot::Policy(slot) => name_of(POLICIES, slot(parameters)),
        }
    }

    /// Sets the parameter; on an error nothing changes, and the error names the accepted values.
    pub(super) fn set(&self, parameters: &mut DeciderParameters, value: &str) -> Result<(), &'static str> {
        match self.slot {
            Slot::Number(quantity, slot) => {
                let number =
                    value.parse().ok().filter(|number| (quantity.min..=quantity.max).contains(number));
                *slot(parameters) = number.ok_or(quantity.expected)?;
            }
            Slot::Flag(slot) => *slot(parameters) = value.parse().map_err(|_| "true or false")?,
            // Upstream treats any other text as none, including `left`.
            Slot::RoundaboutSide(slot) => {
                *slot(parameters) = named(ROUNDABOUT_SIDES, value, "Left, Right or None, with a capital")?;
            }
            Slot::Side(names, expected, slot) => *slot(parameters) = named(names, value, expected)?,
            Slot::Depth(slot) => {
                let depth: i64 = value.parse().map_err(|_| "a whole number; negative = no limit")?;
                *slot(parameters) = match depth {
                    ..0 => None,
                    depth => Some(u32::try_from(depth).map_err(|_| "a whole number below 2^32")?),
                };
            }
            Slot::Policy(slot) => {
                let expected = "none, stopped_candidate, all_candidate or stop_on_approval";
                *slot(parameters) = named(POLICIES, value, expected)?;
            }
        }
        Ok(())
    }
}

fn name_of<T: PartialEq>(names: Names<T>, value: &T) -> String {
    names.iter().find(|(_, known)| known == value).map_or("", |(name, _)| name).to_owned()
}

/// Returns the value with a name, which may be quoted as in a parameter file.
fn named<T: Copy>(names: Names<T>, text: &str, expected: &'static str) -> Result<T, &'static str> {
    let within = |quote| text.strip_prefix(quote).and_then(|rest| rest.strip_suffix(quote));
    let name = within('"').or_else(|| within('\'')).unwrap_or(text);
    names.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).ok_or(expected)
}

fn words<T>(names: Names<T>) -> Vec<&'static str> {
    names.iter().map(|(name, _)| *name).collect()
}
