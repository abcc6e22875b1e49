//! Commands as written in scenarios, and with typing errors.

use proptest::prelude::*;

use super::*;
use crate::compat::Compat;
use crate::scenario::Phase;

fn controllers() -> Vec<TrafficSignalController> {
    let phase = |name: &str| Phase { name: name.to_owned(), duration: None, entries: Vec::new() };
    let controller = |name: &str, phases: &[&str]| TrafficSignalController {
        name: name.to_owned(),
        reference: None,
        phases: phases.iter().map(|name| phase(name)).collect(),
    };
    vec![controller("empty", &[]), controller("north", &["go", "stop"]), controller("north", &["wait"])]
}

fn read(text: &str) -> Result<Action, CommandError> {
    parse_command(text, &controllers(), Compat::Improved)
}

fn target(text: &str) -> SignalTarget {
    SignalTarget::parse(text).unwrap()
}

fn v2i(id: i64, state: &str, rate_hz: Option<f64>) -> Action {
    Action::SetV2iState { id, state: StateText::new(state), rate_hz }
}

#[test]
fn every_command_becomes_its_action() {
    let set = |at: &str, state: &str| Action::SetState { target: target(at), state: StateText::new(state) };
    let confidence = |at: &str, confidence| Action::SetConfidence { target: target(at), confidence };
    let phase = |phase: &str| Action::EnterPhase { controller: ControllerIndex(1), phase: phase.to_owned() };
    #[rustfmt::skip]
    let cases = [
        ("V2ITrafficSignalStateAction(34802, \"red solidOn circle\", 20)",
            v2i(34802, "red solidOn circle", Some(20.0))),
        ("V2ITrafficSignalStateAction(-7 green)", v2i(-7, "green", None)),
        ("  V2ITrafficSignalStateAction ( 1 ,\"\",\t0.5 )\n", v2i(1, "", Some(0.5))),
        ("EnableTrafficSignalV2IFeatureAction@v1(100)", Action::EnableV2i(vec![100])),
        ("EnableTrafficSignalV2IFeatureAction@v1(9223372036854775807 2, 3)",
            Action::EnableV2i(vec![i64::MAX, 2, 3])),
        ("DisableTrafficSignalV2IFeatureAction@v1(1,2)", Action::DisableV2i(vec![1, 2])),
        ("PseudoTrafficSignalDetectorConfidenceSetAction@v1(34802, 0.7)", confidence("34802", 0.7)),
        ("PseudoTrafficSignalDetectorConfidenceSetAction@v1(\"3000000000 v2i_detected\", 1)",
            confidence("3000000000 v2i_detected", 1.0)),
        ("TrafficSignalStateAction(21, \"red, green right\")", set("21", "red, green right")),
        ("TrafficSignalStateAction(\"21 conventional_detected\", unknown)",
            set("21 conventional_detected", "unknown")),
        ("TrafficSignalControllerAction(north, stop)", phase("stop")),
        ("ClearTrafficSignal(\"21 v2i\")", Action::Clear(target("21 v2i"))),
        ("exitSuccess", Action::End(true)),
        ("exitFailure()", Action::End(false)),
    ];
    for (text, action) in cases {
        assert_eq!(read(text), Ok(action), "{text}");
    }
}

#[test]
fn other_commands_are_not_ours() {
    for (text, name) in [
        ("", ""),
        ("V2ITrafficSignal(1, red)", "V2ITrafficSignal"),
        ("ros2 topic pub \"(", "ros2"),
        ("exit", "exit"),
    ] {
        assert_eq!(read(text), Err(CommandError::NotOurs(name.to_owned())), "{text}");
    }
}

#[test]
fn a_mistyped_command_is_refused_and_upstream_takes_it_for_another() {
    #[rustfmt::skip]
    let cases = [
        ("EnableTrafficSignalV2IFeatureAction(1)", "EnableTrafficSignalV2IFeatureAction",
            "EnableTrafficSignalV2IFeatureAction@v1"),
        ("V2ITrafficSignalStateAction@v1(1, red)", "V2ITrafficSignalStateAction@v1",
            "V2ITrafficSignalStateAction"),
        ("TraficSignalStateAction(1, red)", "TraficSignalStateAction", "TrafficSignalStateAction"),
        ("exitsuccess", "exitsuccess", "exitSuccess"),
    ];
    for (text, found, known) in cases {
        assert_eq!(read(text), Err(CommandError::NearMiss { found: found.to_owned(), known }), "{text}");
        let upstream = parse_command(text, &[], Compat::Upstream);
        assert_eq!(upstream, Err(CommandError::NotOurs(found.to_owned())), "{text}");
    }
}

#[test]
fn a_wrong_argument_count_is_refused_with_the_right_one() {
    for (text, expected, actual) in [
        ("V2ITrafficSignalStateAction(34802, red solidOn circle, 20)", "2 or 3 arguments", 5),
        ("V2ITrafficSignalStateAction(34802)", "2 or 3 arguments", 1),
        ("V2ITrafficSignalStateAction", "2 or 3 arguments", 0),
        ("EnableTrafficSignalV2IFeatureAction@v1()", "at least 1 argument", 0),
        ("DisableTrafficSignalV2IFeatureAction@v1", "at least 1 argument", 0),
        ("PseudoTrafficSignalDetectorConfidenceSetAction@v1(1)", "2 arguments", 1),
        ("TrafficSignalStateAction(21 v2i, red)", "2 arguments", 3),
        ("TrafficSignalControllerAction(north)", "2 arguments", 1),
        ("ClearTrafficSignal(1, 2)", "1 argument", 2),
        ("exitSuccess(1)", "no arguments", 1),
    ] {
        let error = read(text).unwrap_err();
        let CommandError::Count { expected: named, actual: counted, .. } = error else { panic!("{error}") };
        assert_eq!((named, counted), (expected, actual), "{text}");
    }
}

#[test]
fn mistakes_of_form_have_a_column() {
    use FormError::{NoArgument, NoClosing, NoOpening, NoQuote, NoSeparator, Surplus};
    for (text, column, kind) in [
        ("exitSuccess now", 13, NoOpening),
        (" ClearTrafficSignal(1", 22, NoClosing),
        ("ClearTrafficSignal(1,", 22, NoClosing),
        ("ClearTrafficSignal(", 20, NoClosing),
        ("ClearTrafficSignal(,1)", 20, NoArgument),
        ("ClearTrafficSignal(1,)", 22, NoArgument),
        ("ClearTrafficSignal(1,) ;", 22, NoArgument),
        ("TrafficSignalStateAction(1,,red)", 28, NoArgument),
        ("ClearTrafficSignal(\"1 v2i)", 20, NoQuote),
        ("ClearTrafficSignal(\"ü\", \"v2i)", 25, NoQuote),
        ("ClearTrafficSignal(\"1\"\"2\")", 23, NoSeparator),
        ("ClearTrafficSignal(1\"2\")", 21, NoSeparator),
        ("ClearTrafficSignal(1(2))", 21, NoSeparator),
        ("ClearTrafficSignal(1); rm", 22, Surplus),
    ] {
        assert_eq!(read(text), Err(CommandError::Form { column, kind }), "{text}");
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    for rate in ["0", "-0.0", "-1", "NaN", "inf", "1e300", "0.0001", "fast", "\"\""] {
        let text = format!("V2ITrafficSignalStateAction(1, red, {rate})");
        for compat in [Compat::Improved, Compat::Upstream] {
            let read = parse_command(&text, &[], compat);
            assert!(matches!(read, Err(CommandError::Rate(_))), "{text}: {read:?}");
        }
    }
    for (confidence, upstream_takes_it) in
        [("-0.1", true), ("1.1", true), ("NaN", false), ("inf", false), ("high", false)]
    {
        let text = format!("PseudoTrafficSignalDetectorConfidenceSetAction@v1(1, {confidence})");
        assert!(matches!(read(&text), Err(CommandError::Confidence(_))), "{text}");
        assert_eq!(parse_command(&text, &[], Compat::Upstream).is_ok(), upstream_takes_it, "{text}");
    }
}

#[test]
fn controllers_and_phases_are_the_first_of_their_name() {
    let error = read("TrafficSignalControllerAction(south, go)").unwrap_err();
    assert_eq!(error.to_string(), "no controller is called `south`; there are `empty`, `north`, `north`");
    let wait = "TrafficSignalControllerAction(north, wait)";
    let error = read(wait).unwrap_err();
    assert_eq!(error.to_string(), "controller `north` has no phase `wait`; it has `go`, `stop`");
    let upstream = parse_command(wait, &controllers(), Compat::Upstream);
    let phase = "wait".to_owned();
    assert_eq!(upstream, Ok(Action::EnterPhase { controller: ControllerIndex(1), phase }));
    assert!(parse_command("TrafficSignalControllerAction(south, go)", &[], Compat::Upstream).is_err());
}

/// docs/spec/traffic-lights.md, "Signal ids", "Unknown states" and "Actions and commands": texts that only
/// one of the two modes accepts.
#[test]
fn each_mode_takes_its_own_texts() {
    let cases = [
        ("TrafficSignalStateAction(\"21 v2i\", red)", true, false),
        ("TrafficSignalStateAction(21, unknown)", false, true),
        ("TrafficSignalStateAction(21, blue)", false, true),
        ("V2ITrafficSignalStateAction(21, \"red, unknown\")", false, true),
        ("V2ITrafficSignalStateAction(\"21 v2i\", red)", false, false),
        ("EnableTrafficSignalV2IFeatureAction@v1(\"21 v2i\")", false, false),
        ("PseudoTrafficSignalDetectorConfidenceSetAction@v1(\"21 v2i\", 1)", true, false),
        ("PseudoTrafficSignalDetectorConfidenceSetAction@v1(2147483648, 1)", true, false),
        ("PseudoTrafficSignalDetectorConfidenceSetAction@v1(2147483647, 1)", true, true),
    ];
    for (text, improved, upstream) in cases {
        let taken =
            [Compat::Improved, Compat::Upstream].map(|compat| parse_command(text, &[], compat).is_ok());
        assert_eq!(taken, [improved, upstream], "{text}");
    }
    let kept = parse_command("TrafficSignalStateAction(21, \"red, blue\")", &[], Compat::Upstream);
    let state = StateText::new("red, blue");
    assert!(state.mistake.is_some() && state.bulbs.len() == 1);
    assert_eq!(kept, Ok(Action::SetState { target: target("21"), state }));
}

proptest! {
    #[test]
    fn any_arguments_are_read_or_refused_in_one_line(
        (name, _) in proptest::sample::select(&COMMANDS[..]),
        rest in "[(),\" 0-9.a-z\\PC-]{0,30}",
        upstream: bool,
    ) {
        let compat = if upstream { Compat::Upstream } else { Compat::Improved };
        let text = format!("{name}{rest}");
        if let Err(error) = parse_command(&text, &controllers(), compat) {
            prop_assert!(!error.to_string().contains(char::is_control));
        }
    }

    #[test]
    fn quoted_arguments_are_read_whole(arguments in proptest::collection::vec("[^\"]{0,12}", 0..5)) {
        let text = arguments.iter().map(|argument| format!("\"{argument}\"")).collect::<Vec<_>>().join(" ,");
        let text = format!("({text})");
        prop_assert_eq!(super::arguments(&text), Ok(arguments.iter().map(String::as_str).collect()));
    }
}
