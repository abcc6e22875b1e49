//! Inputs from outside: received states and their expiry, refused actions, gaps in time; diagnostics.

use std::time::Duration;

use gateway_base::diagnostics::{Level, Status};
use traffic_lights::compat::Compat;
use traffic_lights::emission::{LightsContent, LightsTopic};
use traffic_lights::engine::{LightObservation, LightsSettings, TrafficLights};
use traffic_lights::refusal::ActionRefusal;
use traffic_lights::scenario::{Action, ControllerIndex, Scenario, StateText};
use traffic_lights::target::{LightChannel, StoreId, StoreLayer};
use traffic_lights::text::parse_bulbs;

use super::scene::{BOTH, SECOND, controller, set, small_map, target};
use crate::support::clock::at_ns;

fn engine(compat: Compat, phases: &[(&str, &str, &str)]) -> TrafficLights {
    let controllers = if phases.is_empty() { Vec::new() } else { vec![controller("A", phases)] };
    let scenario = Scenario { controllers, ..Scenario::default() };
    let settings = LightsSettings {
        v2i_timeout: Some(Duration::from_millis(500)),
        topics: [LightsTopic::Camera, LightsTopic::V2i, LightsTopic::Markers].into(),
        ..LightsSettings::new(small_map(), scenario, compat)
    };
    TrafficLights::new(settings, at_ns(0))
}

fn red() -> LightObservation {
    LightObservation { bulbs: parse_bulbs("red").unwrap(), confidence: 0.5 }
}

fn truth(lights: &TrafficLights, channel: LightChannel) -> Vec<(i64, String)> {
    let states = lights.states(StoreId { channel, layer: StoreLayer::GroundTruth });
    states.into_iter().map(|(id, light)| (id, light.bulbs.to_string())).collect()
}

fn status(lights: &TrafficLights, number: usize, seconds: u64) -> Status {
    lights.statuses(None, at_ns(seconds * SECOND).mono).remove(number)
}

/// Level and message of a status, as `WARN message`.
fn shown(status: &Status) -> String {
    format!("{} {}", status.level, status.message)
}

#[test]
fn v2i_states_that_are_no_longer_received_are_removed() {
    for compat in BOTH {
        for layer in [StoreLayer::GroundTruth, StoreLayer::Detected] {
            let mut lights = engine(compat, &[]);
            let store = StoreId { channel: LightChannel::V2i, layer };
            let known = |lights: &TrafficLights| lights.states(store).into_keys().collect::<Vec<_>>();
            let states = [(11, Some(red())), (21, Some(red()))];
            assert_eq!(lights.set_states(store, states, true, at_ns(0)), 0);
            lights.set_states(store, [(21, Some(red()))], true, at_ns(300_000_000));
            lights.advance(at_ns(499_999_999));
            assert_eq!(known(&lights), [11, 21]);
            lights.advance(at_ns(500_000_000));
            assert_eq!(known(&lights), [21], "{compat:?} {layer:?}");
            lights.advance(at_ns(800_000_000));
            assert_eq!(known(&lights), [] as [i64; 0]);
            let of_v2i = status(&lights, 1, 1);
            assert_eq!(shown(&of_v2i), "WARN lights are no longer received");
            assert!(of_v2i.values.contains(&("stale", "2".to_owned())));
            lights.set_states(store, [(11, Some(red())), (21, None)], true, at_ns(900_000_000));
            assert_eq!((known(&lights), status(&lights, 1, 1).level), (vec![11], Level::Ok));
        }
    }
}

#[test]
fn a_state_written_since_does_not_expire() {
    for compat in BOTH {
        let mut lights = engine(compat, &[]);
        lights.set_states(StoreId::V2I, [(11, Some(red()))], true, at_ns(0));
        lights.apply(&set("11 v2i", "red"), at_ns(SECOND / 10)).unwrap();
        lights.advance(at_ns(SECOND));
        assert_eq!(truth(&lights, LightChannel::V2i), [(11, "red solidOn circle".to_owned())], "{compat:?}");
    }
}

#[test]
fn rejected_inputs_are_counted_and_the_others_written() {
    for compat in BOTH {
        let mut lights = engine(compat, &[]);
        let with = |confidence| Some(LightObservation { confidence, ..red() });
        let states = [
            (5, Some(red())),
            (11, Some(red())),
            (12, with(1.5)),
            (21, with(f64::NAN)),
            (6, None),
            (100, None),
            (12, Some(red())),
        ];
        assert_eq!(lights.set_states(StoreId::CONVENTIONAL, states, true, at_ns(0)), 4);
        let known: Vec<_> = lights.states(StoreId::CONVENTIONAL).into_keys().collect();
        assert_eq!(known, [12], "removed by their group, then set again: {compat:?}");
        let of_camera = status(&lights, 0, 1);
        assert_eq!(shown(&of_camera), "WARN an input for 6 was rejected");
        assert!(of_camera.values.contains(&("rejected", "4".to_owned())));
        assert_eq!(status(&lights, 0, 10).level, Level::Ok, "long ago");
        lights.count_rejected(LightChannel::Conventional, 0, at_ns(11 * SECOND));
        assert_eq!(status(&lights, 0, 11).level, Level::Ok, "none");
        lights.count_rejected(LightChannel::Conventional, 2, at_ns(11 * SECOND));
        let of_camera = status(&lights, 0, 11);
        assert_eq!(of_camera.level, Level::Warn, "unreadable ones count as well");
        assert!(of_camera.values.contains(&("rejected", "6".to_owned())));
    }
}

#[test]
fn states_from_outside_are_copied_and_sent() {
    let mut lights = engine(Compat::Improved, &[]);
    lights.apply(&Action::EnableV2i(vec![100]), at_ns(0)).unwrap();
    lights.set_states(StoreId::CONVENTIONAL, [(100, Some(red()))], true, at_ns(0));
    let both = [(11, "red solidOn circle".to_owned()), (12, "red solidOn circle".to_owned())];
    assert_eq!(truth(&lights, LightChannel::V2i), both);
    lights.advance(at_ns(SECOND / 10));
    let camera = std::iter::from_fn(|| lights.poll_output()).find(|sent| sent.topic == LightsTopic::Camera);
    let LightsContent::Groups(groups) = &camera.unwrap().content else { unreachable!() };
    assert_eq!((groups.len(), groups[0].relation_id, groups[0].elements.len()), (1, 100, 1));
    assert!((groups[0].elements[0].confidence - 0.5).abs() < f64::EPSILON);
}

#[test]
fn refused_actions_change_nothing() {
    let mut lights = engine(Compat::Improved, &[("p1", "inf", "21=green")]);
    lights.advance(at_ns(SECOND));
    let before = truth(&lights, LightChannel::Conventional);
    let enter = |index, phase: &str| Action::EnterPhase {
        controller: ControllerIndex(index),
        phase: phase.to_owned(),
    };
    let v2i = |rate_hz| Action::SetV2iState { id: 21, state: StateText::new("red"), rate_hz: Some(rate_hz) };
    let confidence = |confidence| Action::SetConfidence { target: target("21"), confidence };
    let unknown = ActionRefusal::UnknownPhase { controller: "A".to_owned(), phase: "p2".to_owned() };
    for (action, refusal) in [
        (set("5", "red"), ActionRefusal::UnknownId(5)),
        (enter(1, "p1"), ActionRefusal::UnknownController(1)),
        (enter(0, "p2"), unknown),
        (v2i(0.0), ActionRefusal::Rate(0.0)),
        (v2i(-1.0), ActionRefusal::Rate(-1.0)),
        (confidence(1.01), ActionRefusal::Confidence(1.01)),
        (Action::EnableV2i(vec![21, 5]), ActionRefusal::UnknownId(5)),
    ] {
        assert_eq!(lights.apply(&action, at_ns(SECOND)), Err(refusal));
    }
    assert!(matches!(lights.apply(&set("21", "red,,"), at_ns(SECOND)), Err(ActionRefusal::State { .. })));
    assert_eq!(
        (truth(&lights, LightChannel::Conventional), truth(&lights, LightChannel::V2i)),
        (before, Vec::new())
    );
    assert_eq!(lights.verdict(), None, "the scenario continues");
    let mut upstream = engine(Compat::Upstream, &[]);
    assert_eq!(upstream.apply(&Action::EnableV2i(vec![5]), at_ns(0)), Ok(()), "Q14");
}

#[test]
fn enabling_v2i_predicts_and_copies_states_that_are_not_explicit() {
    let phases = [("p1", "4", "21=green;11=green;11 v2i=red"), ("p2", "4", "21=red")];
    let mut lights = engine(Compat::Improved, &phases);
    lights.apply(&Action::EnableV2i(vec![21, 100]), at_ns(SECOND)).unwrap();
    let expected = [(11, "red solidOn circle".to_owned()), (21, "green solidOn circle".to_owned())];
    assert_eq!(truth(&lights, LightChannel::V2i), expected);
    let predicted = |lights: &mut TrafficLights, until: u64| {
        lights.advance(at_ns(until * SECOND));
        let sent = std::iter::from_fn(|| lights.poll_output()).filter(|sent| sent.topic == LightsTopic::V2i);
        let LightsContent::Groups(groups) = &sent.last().unwrap().content else { unreachable!() };
        groups.iter().find(|group| group.relation_id == 200).map_or(0, |group| group.predictions.len())
    };
    assert_eq!(predicted(&mut lights, 2), 6);
    lights.apply(&Action::DisableV2i(vec![200]), at_ns(2 * SECOND)).unwrap();
    assert_eq!(predicted(&mut lights, 3), 0);
}

#[test]
fn a_long_gap_is_skipped() {
    for compat in BOTH {
        let mut lights = engine(compat, &[("p1", "1", "21=green"), ("p2", "1", "21=red")]);
        lights.advance(at_ns(SECOND));
        assert_eq!(lights.skipped(), 0);
        while lights.poll_output().is_some() {}
        lights.advance(at_ns(100_000 * SECOND));
        let sent = std::iter::from_fn(|| lights.poll_output()).count();
        assert!(sent <= 1_024 && lights.skipped() > 3_000_000, "{sent} sent, {} skipped", lights.skipped());
        assert!(lights.next_deadline().as_nanos() > 100_000 * SECOND);
        assert!(lights.next_deadline().as_nanos() < 100_001 * SECOND);
        // Time does not run backwards.
        lights.advance(at_ns(5));
        assert!(lights.poll_output().is_none());
    }
}

#[test]
fn diagnostics_show_the_phases_and_the_end_of_the_scenario() {
    let mut lights = engine(Compat::Improved, &[("p1", "3", "21=green"), ("p2", "inf", "21=unknown")]);
    let of_scenario = |lights: &TrafficLights, at| {
        let status = status(lights, 2, at);
        let controller = status.values.iter().find(|(key, _)| *key == "controller").unwrap().1.clone();
        format!("{}; {controller}", shown(&status))
    };
    assert_eq!(of_scenario(&lights, 0), "OK running; A: no phase yet");
    lights.advance(at_ns(SECOND));
    assert_eq!(of_scenario(&lights, 1), "OK running; A: p1, 2.0 s left");
    lights.advance(at_ns(4 * SECOND));
    assert_eq!(of_scenario(&lights, 4), "OK running; A: p2, until an action");
    let values = status(&lights, 0, 4).values;
    assert!(values.contains(&("lights", "1".to_owned())) && values.contains(&("unknown", "1".to_owned())));
    lights.apply(&Action::End(false), at_ns(4 * SECOND)).unwrap();
    assert_eq!(of_scenario(&lights, 4), "WARN ended in failure; A: p2, stopped");
    assert_eq!(status(&engine(Compat::Improved, &[]), 2, 0).message, "no scenario");
}

#[test]
fn markers_come_from_one_timer_or_two() {
    for (compat, expected) in [(Compat::Improved, 29), (Compat::Upstream, 29 + 9)] {
        let mut lights = engine(compat, &[("p1", "inf", "21=green")]);
        lights.advance(at_ns(SECOND));
        let drawn: Vec<_> = std::iter::from_fn(|| lights.poll_output())
            .filter(|sent| sent.topic == LightsTopic::Markers)
            .map(|sent| sent.content)
            .collect();
        assert_eq!(drawn.len(), expected, "{compat:?}");
        if compat == Compat::Improved {
            assert!(drawn.windows(2).all(|pair| pair[0].is_shared_with(&pair[1])));
        }
    }
}
