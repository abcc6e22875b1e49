//! The decider as a flow of the gateway: commands at its rate, hazard requests, the shadow, diagnostics.

use std::sync::Arc;

use gateway_base::diagnostics::Level;
use gateway_base::time::MonoTime;
use gateway_core::gateway::event::Output;
use signal_gateway::io::ros::topics::Topics;
use signal_gateway::report::gateway::JsonTimeline;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::output::TurnSignalOutput;
use turn_signal::planner_input::{FactorTopic, PlannerInput, PlanningFactor};

use super::bench::{PERIOD, announcing, decider, factor, path, route};

fn factors(behavior: u16, forward: bool, from_m: f64, to_m: f64) -> Arc<[PlanningFactor]> {
    Arc::new([factor(behavior, forward, &[(from_m, 0.0), (to_m, 0.0)])])
}

/// From 41.21 m before the turn on: 3 s at 5 m/s and 30 m, from the front.
#[test]
fn a_turn_is_commanded_from_announcement_to_end_and_each_change_reported_once() {
    let mut bench = decider("enabled = true");
    bench.handle(route(1, &[1, 2, 3]));
    let mut commands = Vec::new();
    for step in 0..400 {
        let x_m = f64::from(step) * 0.25;
        let before = bench.turn_commands().len();
        bench.odometry(x_m, 5.0);
        bench.pass_without_end(50);
        commands.extend(bench.turn_commands()[before..].iter().map(|(_, turn)| (x_m, *turn)));
    }
    let left: Vec<f64> =
        commands.iter().filter(|(_, turn)| *turn == TurnCommand::Left).map(|(x, _)| *x).collect();
    let (first, last) = (left[0], *left.last().unwrap());
    assert!((11.21..11.75).contains(&first) && (79.5..=80.0).contains(&last), "{first} {last}");
    assert!(commands.iter().all(|(_, turn)| matches!(turn, TurnCommand::Left | TurnCommand::Disable)));
    let times: Vec<u64> = bench.turn_commands().iter().map(|(ms, _)| *ms).collect();
    let period = u64::try_from(PERIOD.as_millis()).unwrap();
    assert!(times.windows(2).all(|pair| pair[1] - pair[0] == period), "{times:?}");
    assert_eq!(bench.hazard_commands().len(), bench.turn_commands().len());
    let decided: Vec<_> = bench.decisions().iter().map(|(_, decision)| decision.turn).collect();
    // Without odometry, before, during and after the turn.
    assert_eq!(
        decided,
        [TurnCommand::NoCommand, TurnCommand::Disable, TurnCommand::Left, TurnCommand::Disable]
    );
    let messages: Vec<_> = bench.changes.iter().map(|change| change.message.as_str()).collect();
    for text in ["DISABLE: nothing to signal", "LEFT: intersection"] {
        assert!(messages.contains(&text), "{messages:?}");
    }
}

#[test]
fn a_decision_is_a_json_line_with_its_reasons() {
    let bench = announcing();
    let timeline = JsonTimeline { topics: Topics::default(), hardware_id: "car".into(), buses: vec![] };
    let (_, decision) = bench.decisions().pop().unwrap();
    let line = timeline
        .line(
            &Output::TurnSignal(TurnSignalOutput::Decision(Arc::clone(&decision))),
            MonoTime::from_millis(1_500),
        )
        .unwrap();
    let start = r#"{"t":1.5,"topic":"turn_signal_decision","data":{"turn":"LEFT","hazard":"DISABLE","basis":"candidates","winner":"intersection","#;
    assert!(line.starts_with(start), "{line}");
    assert!(line.contains(r#""desired_start_m":-3.79,"#), "{line}");
}

#[test]
fn a_decider_that_is_not_enabled_sends_and_reports_nothing() {
    let mut bench = decider("");
    bench.handle(route(1, &[1, 2, 3]));
    bench.stay(36.0, 5.0, 1_000);
    assert!(
        bench.turn_commands().is_empty()
            && bench.hazard_commands().is_empty()
            && bench.decisions().is_empty()
    );
}

#[test]
fn diagnostics_name_winner_rule_distances_and_losers() {
    let mut bench = announcing();
    bench.handle(PlannerInput::PlannedPath(path(30.0, 100).into()));
    bench.handle(PlannerInput::Factors {
        topic: FactorTopic::LaneChangeLeft,
        factors: factors(5, true, 58.0, 90.0),
    });
    bench.stay(45.0, 5.0, 200);
    assert_eq!(bench.decider_value("command"), "LEFT");
    assert_eq!(bench.decider_value("winner"), "intersection");
    assert_eq!(bench.decider_value("rule"), "B1");
    assert_eq!(bench.decider_value("required_end_m"), "35.00");
    let lost = bench.decider_value("manoeuvre");
    assert!(lost.starts_with("lost to intersection by B1 (RIGHT, ds "), "{lost}");
    assert_eq!(bench.decider_value("roundabout"), "no record");
    assert_eq!(bench.decider_value("manoeuvres"), "lane change: signalled");
    assert_eq!(bench.decider_value("findings"), "none");
    assert_eq!(bench.decider_value("route"), format!("{:032x}", 1));
}

/// The requests of planner and system, and the command.
#[test]
fn hazard_requests_are_joined() {
    use HazardCommand::{Disable, Enable, NoCommand};
    for (backing, request, age_ms, joined) in [
        (false, None, 0, Disable),
        (false, Some(Disable), 0, Disable),
        (false, Some(NoCommand), 0, Disable),
        (false, Some(Enable), 0, Enable),
        (true, None, 0, Enable),
        (true, Some(Disable), 0, Enable),
        // The request is too old: off is not assumed.
        (false, Some(Enable), 1_200, NoCommand),
        (false, Some(Disable), 1_200, NoCommand),
        (true, Some(Disable), 1_200, Enable),
    ] {
        let mut bench = announcing();
        bench.handle(request.map_or(PlannerInput::LaneDriving(true), PlannerInput::HazardRequest));
        bench.stay(36.0, 5.0, age_ms);
        bench.handle(PlannerInput::LaneDriving(true));
        let topic = FactorTopic::StartPlanner;
        bench.handle(PlannerInput::Factors { topic, factors: factors(1, !backing, 36.0, 46.0) });
        bench.stay(36.0, 5.0, 200);
        assert_eq!(bench.hazard(), Some(joined), "{backing} {request:?} {age_ms}");
        let turn = if backing { TurnCommand::Disable } else { TurnCommand::Left };
        assert_eq!(bench.turn(), Some(turn));
        let status = bench.status("turn_signal_decider");
        assert_eq!(status.level == Level::Warn, age_ms > 0, "{status:?}");
    }
}

#[test]
fn without_odometry_only_a_request_for_hazard_lights_is_passed_on() {
    let mut bench = decider("enabled = true");
    bench.handle(PlannerInput::HazardRequest(HazardCommand::Disable));
    bench.pass_without_end(200);
    assert_eq!(
        (bench.turn(), bench.hazard()),
        (Some(TurnCommand::NoCommand), Some(HazardCommand::NoCommand))
    );
    bench.handle(PlannerInput::HazardRequest(HazardCommand::Enable));
    bench.pass_without_end(200);
    assert_eq!((bench.turn(), bench.hazard()), (Some(TurnCommand::NoCommand), Some(HazardCommand::Enable)));
}

#[test]
fn a_shadow_compares_and_is_silent() {
    let mut bench = decider("shadow = true\nshadow_tolerance_ms = 300");
    bench.handle(route(1, &[1, 2, 3]));
    let mut stay = |own: Option<u8>, ms: u64| {
        for _ in 0..ms / 100 {
            if let Some(own) = own {
                bench.handle(PlannerInput::OwnTurnCommand(own.into()));
            }
            bench.odometry(36.0, 5.0);
            bench.pass_without_end(100);
        }
        (
            bench.decider_value("turn_compared"),
            bench.decider_value("turn_disagreement"),
            bench.status("turn_signal_decider").level,
        )
    };
    let none = "none".to_owned();
    // The first cycle was before the first command of Autoware.
    let alike = stay(Some(2), 1_000);
    assert_eq!(alike.0, "9 alike, 0 tolerated, 0 different, 1 skipped");
    assert_eq!((alike.1, alike.2), (none.clone(), Level::Ok));
    let tolerated = stay(Some(1), 400);
    assert_eq!(tolerated.0, "9 alike, 4 tolerated, 0 different, 1 skipped");
    assert_eq!(tolerated.2, Level::Ok);
    let different = stay(Some(1), 400);
    assert_eq!(different.0, "9 alike, 4 tolerated, 4 different, 1 skipped");
    assert_eq!(different.1, "LEFT here, DISABLE of Autoware, for 800 ms");
    assert_eq!(different.2, Level::Warn);
    let undefined = stay(Some(9), 100);
    assert!(undefined.1.contains("9 of Autoware"), "{}", undefined.1);
    let silent = stay(None, 1_500);
    assert_eq!((silent.1, silent.2), (none, Level::Ok), "what is too old is not compared");
    let percent = bench.decider_value("turn_agreement_percent");
    assert_eq!(percent.len(), 5, "{percent}");
    assert_eq!(bench.decider_value("hazard_agreement_percent"), "nothing compared");
    assert!(bench.turn_commands().is_empty() && bench.hazard_commands().is_empty());
}
