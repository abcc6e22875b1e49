//! Groups P and Q: the arbiter, from inputs to what it publishes. Rows without a number are
//! neighbours of numbered ones.
//!
//! Times are tenths of a second around an arbitrary one. Groups are written
//! `1001: red 0.9, green right > V2I; 1002: red`: elements, each with its confidence if it is not 1,
//! then the sources of predictions.

use std::sync::Arc;
use std::time::Duration;

use gateway_base::time::WallStamp;
use lanelet2_map::light_map::{GroupEntry, LightMap};
use traffic_lights::arbiter::{Arbiter, ArbiterSettings, ArbiterStamp, Priority};
use traffic_lights::emission::{GroupElement, GroupState, Groups, Prediction};
use traffic_lights::text::parse_bulb;

/// An input of the arbiter.
enum Step {
    /// Perception: stamp, groups.
    P(i64, &'static str),
    /// External: stamp, clock, groups.
    E(i64, i64, &'static str),
}

use Priority::{Confidence, External, Perception};
use Step::{E, P};

/// 2001 is at a crosswalk, 9999 is on no map.
const MAP: [i64; 5] = [1001, 1002, 1003, 1012, 2001];

/// The number of the case, 0 for a neighbour; priority; inputs; merged groups after the last of them.
type Row = (u32, Priority, &'static [Step], &'static str);

fn map(groups: &[i64]) -> LightMap {
    let entry = |id: &i64| GroupEntry { relation_id: *id, way_ids: vec![7], is_pedestrian: *id >= 2000 };
    LightMap::new([], &groups.iter().map(entry).collect::<Vec<_>>())
}

fn arbiter(matching: bool, priority: Priority) -> Arbiter {
    let settings = ArbiterSettings {
        external_delay_tolerance: Duration::from_secs(5),
        external_time_tolerance: Duration::from_secs(5),
        perception_time_tolerance: Duration::from_secs(1),
        priority,
        matching,
    };
    Arbiter::new(settings, &map(&MAP))
}

fn at(tenths: i64) -> ArbiterStamp {
    ArbiterStamp(1_700_000_000_000_000_000 + tenths * 100_000_000)
}

fn take(arbiter: &mut Arbiter, step: &Step) -> Option<Groups> {
    match step {
        P(stamp, text) => Some(arbiter.perception(at(*stamp), &groups(text))),
        E(stamp, clock, text) => arbiter.external(at(*stamp), &groups(text), at(*clock)),
    }
}

fn groups(text: &'static str) -> Vec<Arc<GroupState>> {
    text.split("; ").filter(|group| !group.is_empty()).map(|text| Arc::new(group(text))).collect()
}

fn group(text: &'static str) -> GroupState {
    let (id, rest) = text.split_once(':').unwrap();
    let (elements, sources) = rest.split_once('>').unwrap_or((rest, ""));
    let list = |text: &'static str| text.split(',').map(str::trim).filter(|item| !item.is_empty());
    let element = |text: &'static str| {
        let (bulb, confidence) = text.rsplit_once(' ').unwrap_or((text, ""));
        match confidence.parse() {
            Ok(confidence) => GroupElement { bulb: parse_bulb(bulb).unwrap(), confidence },
            Err(_) => GroupElement { bulb: parse_bulb(text).unwrap(), confidence: 1.0 },
        }
    };
    let prediction = |source: &str| {
        let (at, source) = (WallStamp::from_nanos(1), source.to_owned().into());
        Prediction { at, elements: Vec::new(), reliability: 1.0, source }
    };
    GroupState {
        relation_id: id.parse().unwrap(),
        elements: list(elements).map(element).collect(),
        predictions: list(sources).map(prediction).collect(),
    }
}

fn check(matching: bool, rows: &[Row]) {
    for (case, priority, steps, expected) in rows {
        let mut arbiter = arbiter(matching, *priority);
        // Each of the inputs is accepted and causes one output.
        let outputs: Vec<_> = steps.iter().map(|step| take(&mut arbiter, step).unwrap()).collect();
        assert_eq!(outputs.last().unwrap()[..], groups(expected), "{case}: for {expected:?}");
    }
}

#[rustfmt::skip]
const MATCHING: &[Row] = &[
    (209, Confidence, &[E(0, 0, "1001: red"), P(0, "1001: red")], "1001: red"),
    (0, Confidence, &[P(0, "1001: red"), E(0, 0, "1001: red")], "1001: red"),
    (211, Confidence, &[E(0, 0, "1002: green"), P(0, "1002: red")], "1002: unknown unknown"),
    (0, Perception, &[E(0, 0, "1002: green"), P(0, "1002: red")], "1002: unknown unknown"),
    (0, External, &[E(0, 0, "1002: green"), P(0, "1002: red")], "1002: unknown unknown"),
    (213, Confidence, &[P(0, "1001: red")], "1001: unknown unknown"),
    (0, Confidence, &[E(0, 0, "1001: red 0.4")], "1001: unknown unknown"),
    (0, Confidence, &[P(0, "1001: red up, red left")], "1001: unknown unknown left, unknown unknown up"),
    (215, Confidence, &[E(0, 0, "9999: red")], ""),
    (0, Confidence, &[E(0, 0, "9999: red"), P(0, "8888: red; 9999: red")], ""),
    // Equal: neither status nor confidence nor order counts; perception's elements are passed on.
    (0, Confidence,
        &[E(0, 0, "1001: green right 0.9, red flashing 0.2"), P(0, "1001: red 0.5, green right 0.6")],
        "1001: red 0.5, green right 0.6"),
    (0, Confidence, &[E(0, 0, "1001: red"), P(0, "1001: red, green right")],
        "1001: unknown unknown, unknown unknown right"),
    (0, Confidence, &[E(0, 0, "1001: red right"), P(0, "1001: red")],
        "1001: unknown unknown, unknown unknown right"),
    (0, Confidence, &[E(0, 0, "1001:"), P(0, "1001:")], "1001:"),
    (0, Confidence, &[E(0, 0, "1001:"), P(0, "1001: red")], "1001: unknown unknown"),
    // A group twice in a message: the last one counts.
    (0, Confidence, &[E(0, 0, "1001: red"), P(0, "1001: green; 1001: red")], "1001: red"),
    (0, Confidence, &[E(0, 0, "1001: red; 1001: green"), P(0, "1001: green")], "1001: green"),
    (217, Perception, &[E(0, 0, "2001: red 0.99"), P(0, "2001: green 0.1")], "2001: green 0.1"),
    (0, External, &[E(0, 0, "2001: red 0.1"), P(0, "2001: green 0.99")], "2001: red 0.1"),
    (0, Confidence, &[E(0, 0, "2001: red 0.9"), P(0, "2001: green 0.6")], "2001: red 0.9"),
    (0, Confidence, &[E(0, 0, "2001: red 0.6"), P(0, "2001: green 0.6")], "2001: green 0.6"),
    // Only the preferred side's shapes, but with confidence those of both.
    (0, External, &[E(0, 0, "2001: red"), P(0, "2001: green right")], "2001: red"),
    (0, Confidence, &[E(0, 0, "2001: red"), P(0, "2001: green right")], "2001: red, green right"),
    (219, External, &[P(0, "2001: green")], "2001: green"),
    (0, Perception, &[E(0, 0, "2001: green")], "2001: green"),
    (0, Confidence, &[P(0, "2001: red 0.5, green 0.6")], "2001: green 0.6"),
];

#[test]
fn p_matching() {
    check(true, MATCHING);
}

#[rustfmt::skip]
const PRIORITY: &[Row] = &[
    (221, Confidence, &[P(0, "1001: red"), E(0, 0, "1001: green right")], "1001: red, green right"),
    (223, Confidence, &[E(0, 0, "9999: red")], ""),
    (0, Confidence, &[E(0, 0, "1002: red; 9999: red; 1001: green")], "1001: green; 1002: red"),
    (225, Confidence, &[P(0, "1001: red > INTERNAL_ESTIMATION"), E(0, 0, "1001: red > V2I")],
        "1001: red > INTERNAL_ESTIMATION, V2I"),
    (0, External, &[E(0, 0, "1001: red > V2I, V2I"), P(0, "1001: red > SIMULATION")],
        "1001: red > SIMULATION, V2I, V2I"),
    (227, Confidence, &[E(0, 0, "1001: red > V2I")], "1001: red > V2I"),
    (0, Confidence, &[P(0, "1001: red > SIMULATION")], "1001: red > SIMULATION"),
    (229, External, &[E(0, 0, "1001: red")], "1001: red"),
    (0, External, &[P(0, "1001: red")], "1001: red"),
    (0, External, &[E(0, 0, "1001: red 0.1"), P(0, "1001: green 0.99")], "1001: red 0.1"),
    (231, Perception, &[E(0, 0, "1001: red 0.99"), P(0, "1001: green 0.1")], "1001: green 0.1"),
    (233, Perception, &[E(0, 0, "1001: red")], "1001: red"),
    (0, Confidence, &[E(0, 0, "1001: red 0.9"), P(0, "1001: green 0.6")], "1001: red 0.9"),
    (0, Confidence, &[P(0, "1001: green 0.6"), E(0, 0, "1001: red 0.9")], "1001: red 0.9"),
    // Ties: perception before external, the first before later ones.
    (0, Confidence, &[E(0, 0, "1001: red 0.6"), P(0, "1001: green 0.6")], "1001: green 0.6"),
    (0, Confidence, &[P(0, "1001: green, red")], "1001: green"),
    (0, Confidence, &[P(0, "1001: green; 1001: red, up")], "1001: green, up"),
    (0, Confidence, &[P(0, "1001: green 0.5; 1001: red 0.6")], "1001: red 0.6"),
    (0, Confidence, &[E(0, 0, "1001: green; 1001: red")], "1001: red"),
    (0, External, &[P(0, "1001: red 0.9, up"), E(0, 0, "1001: green 0.1, white 0.2")], "1001: white 0.2, up"),
    (0, Confidence, &[P(0, "1001: > SIMULATION")], "1001: > SIMULATION"),
    // In the order of ROS, which is not that of the sort key.
    (0, Confidence,
        &[P(0, "1001: cross, lowerRight, lowerLeft, down, upperRight, upperLeft, up, right, left, circle, \
                green solidOn unknown")],
        "1001: green solidOn unknown, circle, left, right, up, upperLeft, upperRight, down, lowerLeft, \
         lowerRight, cross"),
];

#[test]
fn p_priority() {
    check(false, PRIORITY);
}

#[rustfmt::skip]
const STALENESS: &[Row] = &[
    (237, Confidence, &[P(-5, "1001: red 0.9"), E(0, 0, "1001: green 0.7")], "1001: red 0.9"),
    (239, Confidence, &[P(-20, "1001: red > SIMULATION"), E(0, 0, "1002: green")], "1002: green"),
    (0, Confidence, &[P(-10, "1001: red"), E(0, 0, "1002: green")], "1001: red; 1002: green"),
    (0, Confidence, &[P(-11, "1001: red"), E(0, 0, "1002: green")], "1002: green"),
    (0, Confidence, &[P(-20, "9999: red"), E(0, 0, "1002: green")], "1002: green"),
    // Not for good: with the network's newer group gone or perception's stamp near, it counts again.
    (0, Confidence, &[P(-20, "1001: red"), E(0, 0, "1002: green"), E(-15, 0, "1002: red")],
        "1001: red; 1002: red"),
    (0, Confidence, &[P(0, "1001: red"), E(0, 0, "1002: green"), P(49, "1001: red")],
        "1001: red; 1002: green"),
    // Alone it is never stale, nor beside an external message without groups.
    (0, Confidence, &[P(-20, "1001: red"), E(0, 0, "")], "1001: red"),
    (247, Confidence, &[E(0, 0, "1001: red"), P(60, "1002: green")], "1002: green"),
    (0, Confidence, &[E(0, 0, "1001: red"), P(50, "1002: green")], "1001: red; 1002: green"),
    (0, Confidence, &[E(0, 0, "1001: red"), P(-51, "1002: green")], "1002: green"),
    // Each group has its own stamp; the last write wins, even an older one.
    (0, Confidence, &[E(0, 0, "1001: red; 1002: red"), E(40, 40, "1002: green"), E(51, 51, "1003: red")],
        "1002: green; 1003: red"),
    (0, Confidence, &[E(0, 0, "1001: red"), E(-10, 0, "1001: green")], "1001: green"),
    (0, Confidence, &[E(50, 0, "1001: red")], "1001: red"),
];

#[test]
fn p_staleness() {
    check(false, STALENESS);
}

#[test]
fn p_rejected_external_messages() {
    for (case, stamp, accepted) in [(245, -60, false), (0, -51, false), (0, -50, true), (0, 51, false)] {
        let mut arbiter = arbiter(false, Confidence);
        let output = take(&mut arbiter, &E(stamp, 0, "1001: red"));
        assert_eq!(output.is_some(), accepted, "P {case}");
        let kept = if accepted { "1001: red" } else { "" };
        assert_eq!(take(&mut arbiter, &P(stamp, "")).unwrap()[..], groups(kept), "P {case}: nothing is kept");
    }
}

#[test]
fn p_a_map_without_lights_gives_no_groups() {
    let mut arbiter = Arbiter::new(ArbiterSettings::default(), &map(&[]));
    assert_eq!(take(&mut arbiter, &P(0, "1001: red")).unwrap()[..], [], "P 235");
}

#[rustfmt::skip]
const MATCHING_NODE: &[Row] = &[
    (253, Confidence, &[E(0, 0, "1001: green"), P(0, "1001: red")], "1001: unknown unknown circle"),
    (255, Confidence, &[E(0, 0, "1001: red > V2I"), P(0, "1001: red > SIMULATION")],
        "1001: red > SIMULATION, V2I"),
    (0, Confidence, &[E(0, 0, "1001: green > V2I"), P(0, "1001: red > SIMULATION")],
        "1001: unknown unknown > SIMULATION, V2I"),
    (257, Confidence, &[E(0, 0, "9999: red; 1001: red"), P(0, "1001: red")], "1001: red"),
    (259, Confidence, &[E(0, 0, "2001: green 0.6"), P(0, "2001: red 0.9")], "2001: red 0.9"),
];

#[test]
fn q_node() {
    #[rustfmt::skip]
    let node: [Row; 6] = [
        (249, Confidence, &[P(0, "1001: green")], "1001: green"),
        (0, Confidence, &[E(0, 0, "1001: green")], "1001: green"),
        (261, Confidence, &[E(0, 0, "1002: red 0.5, green right 0.3"), P(0, "1001: green 0.9")],
            "1001: green 0.9; 1002: red 0.5, green right 0.3"),
        (263, Priority::default(), &[E(0, 0, "1001: green 0.7"), P(0, "1001: green 0.9")], "1001: green 0.9"),
        (267, Confidence, &[P(0, "1001: red"), E(20, 20, "1001: green")], "1001: green"),
        (0, Confidence, &[P(0, "1001: red"), E(20, 0, "1001: green")], "1001: green"),
    ];
    check(false, &node);
    check(true, MATCHING_NODE);
}

/// Case 265, and that every other input is published once.
#[test]
fn q_a_late_message_publishes_nothing_and_is_not_kept() {
    let mut arbiter = arbiter(false, Confidence);
    let red = take(&mut arbiter, &P(0, "1001: red")).unwrap();
    assert!(take(&mut arbiter, &E(-200, 0, "1001: green")).is_none(), "Q 265");
    assert_eq!(take(&mut arbiter, &P(0, "1001: red")), Some(red), "Q 265: still red");
}

/// As shipped, the more confident element wins, and perception may lag by a second.
#[test]
fn q_default_parameters() {
    let perception = P(0, "1012: red 0.9, green right 0.8");
    let as_perceived = "1012: red 0.9, green right 0.8";
    for (case, before, expected) in [
        (269, None, as_perceived),
        (271, Some(E(0, 0, "1012: green 0.6, green right 0.5")), as_perceived),
        (0, Some(E(10, 10, "1012: green 0.6, green right 0.9")), "1012: red 0.9, green right 0.9"),
        (0, Some(E(11, 11, "1001: green")), "1001: green"),
    ] {
        let mut arbiter = Arbiter::new(ArbiterSettings::default(), &map(&MAP));
        if let Some(step) = &before {
            take(&mut arbiter, step).unwrap();
        }
        assert_eq!(take(&mut arbiter, &perception).unwrap()[..], groups(expected), "Q {case}");
    }
}
