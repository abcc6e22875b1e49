//! Parameters by name, and what countries make of them.

use std::path::Path;

use signal_gateway::config::country::{NoCountry, built_in, country};
use signal_gateway::config::files::Disk;
use turn_signal::parameters::table::{PARAMETERS, ParameterError};
use turn_signal::parameters::{CandidatePolicy, DeciderParameters};
use turn_signal::side::Side::{Left, Right};

/// The fourteen documented parameters: name, a value, what it makes of the defaults.
type Row = (&'static str, &'static str, fn(&mut DeciderParameters));

const DOCUMENTED: [Row; 14] = [
    ("turn_signal_intersection_search_distance", "31.5", |p| p.intersection_search_distance_m = 31.5),
    ("turn_signal_intersection_angle_threshold_degree", "20", |p| p.intersection_angle_threshold_deg = 20.0),
    ("turn_signal_minimum_search_distance", "11.0", |p| p.minimum_search_distance_m = 11.0),
    ("turn_signal_search_time", "4.5", |p| p.search_time_s = 4.5),
    ("turn_signal_shift_length_threshold", "0.4", |p| p.shift_length_threshold_m = 0.4),
    ("turn_signal_remaining_shift_length_threshold", "0.2", |p| {
        p.remaining_shift_length_threshold_m = 0.2;
    }),
    ("turn_signal_remaining_distance_to_bound_threshold", "1.4", |p| {
        p.remaining_distance_to_bound_threshold_m = 1.4;
    }),
    ("turn_signal_on_swerving", "false", |p| p.on_swerving = false),
    ("turn_signal_roundabout_on_entry", "\"Right\"", |p| p.roundabout_on_entry = Some(Right)),
    ("turn_signal_roundabout_on_exit", "None", |p| p.roundabout_on_exit = None),
    ("turn_signal_roundabout_entry_indicator_persistence", "false", |p| p.roundabout_entry_persists = false),
    ("turn_signal_roundabout_search_distance", "32", |p| p.roundabout_search_distance_m = 32.0),
    ("turn_signal_roundabout_angle_threshold_degree", "25.0", |p| p.roundabout_angle_threshold_deg = 25.0),
    ("turn_signal_roundabout_backward_depth", "-1", |p| p.roundabout_backward_depth = None),
];

#[test]
fn documented_names_set_their_parameter_and_nothing_else() {
    for (name, value, change) in DOCUMENTED {
        let (mut set, mut expected) = (DeciderParameters::DEPLOYED, DeciderParameters::DEPLOYED);
        set.set(name, value).unwrap();
        change(&mut expected);
        assert_eq!(set, expected, "{name}");
        assert_ne!(set, DeciderParameters::DEPLOYED, "{name}: the value is another one than before");
    }
}

#[test]
fn autoware_spellings_are_accepted() {
    for name in ["turn_signal_intersection_angle_threshold", "turn_signal_roundabout_angle_threshold"] {
        let (mut one, mut other) = (DeciderParameters::DEPLOYED, DeciderParameters::DEPLOYED);
        one.set(&format!("{name}_deg"), "40").unwrap();
        other.set(&format!("{name}_degree"), "40").unwrap();
        assert_eq!(one, other);
        assert_ne!(one, DeciderParameters::DEPLOYED);
    }
    let mut parameters = DeciderParameters::DEPLOYED;
    parameters.set("candidate_path_turn_signal", "\"all_candidate\"").unwrap();
    assert_eq!(parameters.avoidance_candidate, CandidatePolicy::AllCandidate);
}

#[test]
fn no_two_parameters_share_a_name() {
    let mut names: Vec<&str> =
        PARAMETERS.iter().flat_map(|row| row.aliases.iter().copied().chain([row.name])).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    for (name, value, expected) in [
        ("turn_signal_search_time", "-1", "seconds"),
        ("turn_signal_search_time", "soon", "seconds"),
        ("turn_signal_search_time", "NaN", "seconds"),
        ("turn_signal_intersection_search_distance", "inf", "metres"),
        ("turn_signal_intersection_angle_threshold_degree", "181", "degrees"),
        ("turn_signal_on_swerving", "yes", "true or false"),
        ("turn_signal_roundabout_backward_depth", "2.5", "whole number"),
        ("turn_signal_roundabout_backward_depth", "99999999999", "whole number"),
        ("input_path_interval", "0", "metres"),
        ("parking_policy", "middle", "left_side"),
        ("turn_signal_roundabout_on_exit", "left", "Left, Right or None"),
        ("turn_signal_roundabout_on_entry", "", "Left, Right or None"),
        ("turn_signal_on_centerline_start", "left", "LEFT or RIGHT"),
        ("candidate_path_turn_signal", "always", "stop_on_approval"),
    ] {
        let mut parameters = DeciderParameters::DEPLOYED;
        let error = parameters.set(name, value).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(value) && error.contains(expected), "{error}");
        assert_eq!(parameters, DeciderParameters::DEPLOYED, "{name}");
    }
    let unknown = DeciderParameters::DEPLOYED.clone().set("turn_signal_search_tim", "3");
    assert_eq!(unknown, Err(ParameterError::Unknown { name: "turn_signal_search_tim".to_owned() }));
}

#[test]
fn sides_of_roundabouts_are_spelt_exactly() {
    for (value, side) in [("Left", Some(Left)), ("\"Right\"", Some(Right)), ("None", None)] {
        let mut parameters = DeciderParameters::DEPLOYED;
        parameters.set("turn_signal_roundabout_on_exit", value).unwrap();
        assert_eq!(parameters.roundabout_on_exit, side, "{value}");
    }
}

#[test]
fn countries_differ_where_their_law_does() {
    let cases = [
        ("AT", 30.0, None, Right, Right),
        ("CH", 30.0, None, Right, Right),
        ("DE", 30.0, None, Right, Right),
        ("GB", 30.0, None, Left, Left),
        ("JP", 30.0, None, Left, Left),
        ("KR", 30.0, Some(Left), Right, Right),
        ("US-CA", 30.48, None, Right, Right),
    ];
    assert_eq!(built_in(), cases.map(|(code, ..)| code));
    for (code, distance, entry, exit, parks) in cases {
        let country = country(&Disk, Path::new(""), code).unwrap();
        let parameters = country.parameters();
        assert_eq!(parameters.intersection_search_distance_m, distance, "{code}");
        assert_eq!(parameters.roundabout_on_entry, entry, "{code}");
        assert_eq!(parameters.roundabout_on_exit, Some(exit), "{code}");
        assert_eq!(parameters.parking_side, parks, "{code}");
        assert_eq!((country.code.as_str(), country.source.is_empty()), (code, false));
    }
    for unknown in ["jp", "", "../demo", "JP.yaml"] {
        let refused = country(&Disk, Path::new(""), unknown).unwrap_err();
        assert!(matches!(refused, NoCountry::Nowhere { .. }), "{unknown}: {refused:?}");
    }
}
