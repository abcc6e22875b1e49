//! Groups P and Q: the arbiter, from inputs to what it publishes. Rows without a number are
//! neighbours of numbered ones.
//!
//! Times are tenths of a second around an arbitrary one. Groups are written
//! `1001: red 0.9, green right > V2I; 1002: red`: elements, each with its confidence if it is not 1,
//! then the sources of predictions.

use std::sync::Arc;
use std::time::Duration;

use signal_gateway::core::map::light_map::{GroupEntry, LightMap};
use signal_gateway::core::time::WallStamp;
use signal_gateway::core::traffic_light::arbiter::{
    Arbiter, ArbiterSettings, ArbiterStamp, Judged, NoOutput, Priority,
};
use signal_gateway::core::traffic_light::emission::{Element, GroupState, Prediction};
use signal_gateway::core::traffic_light::text::parse_bulb;

/// What comes in.
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

/// Number of the case, 0 = a neighbour; matching; priority; inputs; groups that come out of
/// the last one; groups reported as off the map.
type Row = (u32, bool, Priority, &'static [Step], &'static str, &'static [i64]);

fn map(groups: &[i64]) -> LightMap {
    let entry = |id: &i64| GroupEntry { relation_id: *id, way_ids: vec![7], is_pedestrian: *id >= 2000 };
    LightMap::new([], &groups.iter().map(entry).collect::<Vec<_>>())
}

fn arbiter(matching: bool, priority: Priority) -> Arbiter {
    let mut arbiter = Arbiter::new(ArbiterSettings {
        external_delay_tolerance: Duration::from_secs(5),
        external_time_tolerance: Duration::from_secs(5),
        perception_time_tolerance: Duration::from_secs(1),
        priority,
        matching,
    });
    arbiter.map(&map(&MAP));
    arbiter
}

fn at(tenths: i64) -> ArbiterStamp {
    ArbiterStamp(1_700_000_000_000_000_000 + tenths * 100_000_000)
}

fn take(arbiter: &mut Arbiter, step: &Step) -> Result<Judged, NoOutput> {
    match step {
        P(stamp, text) => arbiter.perception(at(*stamp), &groups(text)),
        E(stamp, clock, text) => arbiter.external(at(*stamp), &groups(text), at(*clock)),
    }
}

fn groups(text: &'static str) -> Vec<Arc<GroupState>> {
    text.split("; ").filter(|group| !group.is_empty()).map(|text| Arc::new(group(text))).collect()
}

fn group(text: &'static str) -> GroupState {
    let (id, rest) = text.split_once(':').unwrap();
    let (elements, sources) = rest.split_once('>').unwrap_or((rest, ""));
    let words = |text: &'static str| text.split(',').map(str::trim).filter(|word| !word.is_empty());
    let element = |text: &'static str| {
        let (bulb, confidence) = text.rsplit_once(' ').unwrap_or((text, ""));
        match confidence.parse() {
            Ok(confidence) => Element { bulb: parse_bulb(bulb).unwrap(), confidence },
            Err(_) => Element { bulb: parse_bulb(text).unwrap(), confidence: 1.0 },
        }
    };
    let prediction =
        |source| Prediction { at: WallStamp::from_nanos(1), elements: Vec::new(), reliability: 1.0, source };
    GroupState {
        relation_id: id.parse().unwrap(),
        elements: words(elements).map(element).collect(),
        predictions: words(sources).map(prediction).collect(),
    }
}

fn check(rows: &[Row]) {
    for (case, matching, priority, steps, expected, off_map) in rows {
        let mut arbiter = arbiter(*matching, *priority);
        // Each of the inputs is accepted and causes one output.
        let outputs: Vec<_> = steps.iter().map(|step| take(&mut arbiter, step).unwrap()).collect();
        let judged = outputs.last().unwrap();
        assert_eq!(judged.groups[..], groups(expected), "{case}: for {expected:?}");
        assert_eq!(judged.off_map, *off_map, "{case}: for {expected:?}");
    }
}

#[test]
fn p_matching() {
    check(&[
        (209, true, Confidence, &[E(0, 0, "1001: red"), P(0, "1001: red")], "1001: red", &[]),
        (0, true, Confidence, &[P(0, "1001: red"), E(0, 0, "1001: red")], "1001: red", &[]),
        (211, true, Confidence, &[E(0, 0, "1002: green"), P(0, "1002: red")], "1002: unknown unknown", &[]),
        (0, true, Perception, &[E(0, 0, "1002: green"), P(0, "1002: red")], "1002: unknown unknown", &[]),
        (0, true, External, &[E(0, 0, "1002: green"), P(0, "1002: red")], "1002: unknown unknown", &[]),
        (213, true, Confidence, &[P(0, "1001: red")], "1001: unknown unknown", &[]),
        (0, true, Confidence, &[E(0, 0, "1001: red 0.4")], "1001: unknown unknown", &[]),
        (
            0,
            true,
            Confidence,
            &[P(0, "1001: red up, red left")],
            "1001: unknown unknown left, unknown unknown up",
            &[],
        ),
        (215, true, Confidence, &[E(0, 0, "9999: red")], "", &[9999]),
        (0, true, Confidence, &[E(0, 0, "9999: red"), P(0, "8888: red; 9999: red")], "", &[8888, 9999]),
        // Equal: neither status nor confidence nor order counts; what perception says is passed on.
        (
            0,
            true,
            Confidence,
            &[E(0, 0, "1001: green right 0.9, red flashing 0.2"), P(0, "1001: red 0.5, green right 0.6")],
            "1001: red 0.5, green right 0.6",
            &[],
        ),
        (
            0,
            true,
            Confidence,
            &[E(0, 0, "1001: red"), P(0, "1001: red, green right")],
            "1001: unknown unknown, unknown unknown right",
            &[],
        ),
        (
            0,
            true,
            Confidence,
            &[E(0, 0, "1001: red right"), P(0, "1001: red")],
            "1001: unknown unknown, unknown unknown right",
            &[],
        ),
        (0, true, Confidence, &[E(0, 0, "1001:"), P(0, "1001:")], "1001:", &[]),
        (0, true, Confidence, &[E(0, 0, "1001:"), P(0, "1001: red")], "1001: unknown unknown", &[]),
        // A group twice in a message: the last one counts.
        (0, true, Confidence, &[E(0, 0, "1001: red"), P(0, "1001: green; 1001: red")], "1001: red", &[]),
        (0, true, Confidence, &[E(0, 0, "1001: red; 1001: green"), P(0, "1001: green")], "1001: green", &[]),
        (
            217,
            true,
            Perception,
            &[E(0, 0, "2001: red 0.99"), P(0, "2001: green 0.1")],
            "2001: green 0.1",
            &[],
        ),
        (0, true, External, &[E(0, 0, "2001: red 0.1"), P(0, "2001: green 0.99")], "2001: red 0.1", &[]),
        (0, true, Confidence, &[E(0, 0, "2001: red 0.9"), P(0, "2001: green 0.6")], "2001: red 0.9", &[]),
        (0, true, Confidence, &[E(0, 0, "2001: red 0.6"), P(0, "2001: green 0.6")], "2001: green 0.6", &[]),
        // Only the preferred side's shapes, but with confidence those of both.
        (0, true, External, &[E(0, 0, "2001: red"), P(0, "2001: green right")], "2001: red", &[]),
        (
            0,
            true,
            Confidence,
            &[E(0, 0, "2001: red"), P(0, "2001: green right")],
            "2001: red, green right",
            &[],
        ),
        (219, true, External, &[P(0, "2001: green")], "2001: green", &[]),
        (0, true, Perception, &[E(0, 0, "2001: green")], "2001: green", &[]),
        (0, true, Confidence, &[P(0, "2001: red 0.5, green 0.6")], "2001: green 0.6", &[]),
    ]);
}

#[test]
fn p_priority() {
    check(&[
        (
            221,
            false,
            Confidence,
            &[P(0, "1001: red"), E(0, 0, "1001: green right")],
            "1001: red, green right",
            &[],
        ),
        (223, false, Confidence, &[E(0, 0, "9999: red")], "", &[9999]),
        (
            0,
            false,
            Confidence,
            &[E(0, 0, "1002: red; 9999: red; 1001: green")],
            "1001: green; 1002: red",
            &[9999],
        ),
        (
            225,
            false,
            Confidence,
            &[P(0, "1001: red > INTERNAL_ESTIMATION"), E(0, 0, "1001: red > V2I")],
            "1001: red > INTERNAL_ESTIMATION, V2I",
            &[],
        ),
        (
            0,
            false,
            External,
            &[E(0, 0, "1001: red > V2I, V2I"), P(0, "1001: red > SIMULATION")],
            "1001: red > SIMULATION, V2I, V2I",
            &[],
        ),
        (227, false, Confidence, &[E(0, 0, "1001: red > V2I")], "1001: red > V2I", &[]),
        (0, false, Confidence, &[P(0, "1001: red > SIMULATION")], "1001: red > SIMULATION", &[]),
        (229, false, External, &[E(0, 0, "1001: red")], "1001: red", &[]),
        (0, false, External, &[P(0, "1001: red")], "1001: red", &[]),
        (0, false, External, &[E(0, 0, "1001: red 0.1"), P(0, "1001: green 0.99")], "1001: red 0.1", &[]),
        (
            231,
            false,
            Perception,
            &[E(0, 0, "1001: red 0.99"), P(0, "1001: green 0.1")],
            "1001: green 0.1",
            &[],
        ),
        (233, false, Perception, &[E(0, 0, "1001: red")], "1001: red", &[]),
        (0, false, Confidence, &[E(0, 0, "1001: red 0.9"), P(0, "1001: green 0.6")], "1001: red 0.9", &[]),
        (0, false, Confidence, &[P(0, "1001: green 0.6"), E(0, 0, "1001: red 0.9")], "1001: red 0.9", &[]),
        // Ties: perception before external, the first before later ones.
        (0, false, Confidence, &[E(0, 0, "1001: red 0.6"), P(0, "1001: green 0.6")], "1001: green 0.6", &[]),
        (0, false, Confidence, &[P(0, "1001: green, red")], "1001: green", &[]),
        (0, false, Confidence, &[P(0, "1001: green; 1001: red, up")], "1001: green, up", &[]),
        (0, false, Confidence, &[P(0, "1001: green 0.5; 1001: red 0.6")], "1001: red 0.6", &[]),
        (0, false, Confidence, &[E(0, 0, "1001: green; 1001: red")], "1001: red", &[]),
        (
            0,
            false,
            External,
            &[P(0, "1001: red 0.9, up"), E(0, 0, "1001: green 0.1, white 0.2")],
            "1001: white 0.2, up",
            &[],
        ),
        (0, false, Confidence, &[P(0, "1001: > SIMULATION")], "1001: > SIMULATION", &[]),
        // In the order of ROS, which is not that of the sort key.
        (
            0,
            false,
            Confidence,
            &[P(
                0,
                "1001: cross, lowerRight, lowerLeft, down, upperRight, upperLeft, up, right, left, circle, \
                    green solidOn unknown",
            )],
            "1001: green solidOn unknown, circle, left, right, up, upperLeft, upperRight, down, lowerLeft, \
             lowerRight, cross",
            &[],
        ),
    ]);
}

#[test]
fn p_staleness() {
    check(&[
        (237, false, Confidence, &[P(-5, "1001: red 0.9"), E(0, 0, "1001: green 0.7")], "1001: red 0.9", &[]),
        (
            239,
            false,
            Confidence,
            &[P(-20, "1001: red > SIMULATION"), E(0, 0, "1002: green")],
            "1002: green",
            &[],
        ),
        (0, false, Confidence, &[P(-10, "1001: red"), E(0, 0, "1002: green")], "1001: red; 1002: green", &[]),
        (0, false, Confidence, &[P(-11, "1001: red"), E(0, 0, "1002: green")], "1002: green", &[]),
        (0, false, Confidence, &[P(-20, "9999: red"), E(0, 0, "1002: green")], "1002: green", &[]),
        // Not for good: with the network's newer group gone or perception's stamp near, it counts again.
        (
            0,
            false,
            Confidence,
            &[P(-20, "1001: red"), E(0, 0, "1002: green"), E(-15, 0, "1002: red")],
            "1001: red; 1002: red",
            &[],
        ),
        (
            0,
            false,
            Confidence,
            &[P(0, "1001: red"), E(0, 0, "1002: green"), P(49, "1001: red")],
            "1001: red; 1002: green",
            &[],
        ),
        // Alone it is never stale, and an external message without groups is nobody to lag behind.
        (0, false, Confidence, &[P(-20, "1001: red"), E(0, 0, "")], "1001: red", &[]),
        (247, false, Confidence, &[E(0, 0, "1001: red"), P(60, "1002: green")], "1002: green", &[]),
        (0, false, Confidence, &[E(0, 0, "1001: red"), P(50, "1002: green")], "1001: red; 1002: green", &[]),
        (0, false, Confidence, &[E(0, 0, "1001: red"), P(-51, "1002: green")], "1002: green", &[]),
        // Each group has its own stamp; the last write wins, even an older one.
        (
            0,
            false,
            Confidence,
            &[E(0, 0, "1001: red; 1002: red"), E(40, 40, "1002: green"), E(51, 51, "1003: red")],
            "1002: green; 1003: red",
            &[],
        ),
        (0, false, Confidence, &[E(0, 0, "1001: red"), E(-10, 0, "1001: green")], "1001: green", &[]),
        (0, false, Confidence, &[E(50, 0, "1001: red")], "1001: red", &[]),
    ]);
}

#[test]
fn p_rejected_external_messages() {
    for (case, stamp, accepted) in [(245, -60, false), (0, -51, false), (0, -50, true), (0, 51, false)] {
        let mut arbiter = arbiter(false, Confidence);
        let output = take(&mut arbiter, &E(stamp, 0, "1001: red"));
        assert_eq!(output.is_ok(), accepted, "P {case}");
        assert_eq!(output.err(), (!accepted).then_some(NoOutput::ExternalDelay), "P {case}");
        assert_eq!(arbiter.latest_input(), accepted.then_some(at(stamp)), "P {case}: nothing is kept");
    }
}

/// Each output has the stamp of its input, and says when there is a newer one.
#[test]
fn p_latest_input() {
    let cases: [(u32, &[Step], Option<i64>, bool); 6] = [
        (0, &[], None, false),
        (241, &[P(0, "1001: red"), E(5, 5, "1001: red")], Some(5), false),
        (243, &[P(5, "1001: red")], Some(5), false),
        (0, &[E(5, 5, "1001: red")], Some(5), false),
        (0, &[E(5, 5, "1001: red"), P(0, "1001: red")], Some(5), true),
        (0, &[P(5, "1001: red"), E(0, 0, "1001: red")], Some(5), true),
    ];
    for (case, steps, latest, newer_input) in cases {
        let mut arbiter = arbiter(false, Confidence);
        let judged = steps.iter().map(|step| take(&mut arbiter, step).unwrap()).last();
        assert_eq!(arbiter.latest_input(), latest.map(at), "P {case}");
        let stamp = steps.last().map(|(P(stamp, _) | E(stamp, ..))| at(*stamp));
        assert_eq!(judged.as_ref().map(|judged| judged.stamp), stamp, "P {case}");
        assert_eq!(judged.is_some_and(|judged| judged.newer_input), newer_input, "P {case}");
    }
}

#[test]
fn p_maps() {
    let mut arbiter = Arbiter::new(ArbiterSettings::default());
    assert_eq!(take(&mut arbiter, &E(0, 0, "1001: green 0.5")), Err(NoOutput::NoMap), "P 0: no map");
    assert_eq!(take(&mut arbiter, &P(0, "1001: red")), Err(NoOutput::NoMap), "Q 251");
    arbiter.map(&map(&[]));
    let judged = take(&mut arbiter, &P(0, "1001: red")).unwrap();
    assert_eq!(
        (judged.stamp, &judged.groups[..], &judged.off_map[..]),
        (at(0), &[][..], &[][..]),
        "P 235: map without lights"
    );
    arbiter.map(&map(&[1001, 1002]));
    let judged = take(&mut arbiter, &P(0, "1002: red")).unwrap();
    assert_eq!(
        judged.groups[..],
        groups("1001: green 0.5; 1002: red"),
        "P 0: what came before the map counts"
    );
}

#[test]
fn q_node() {
    check(&[
        (249, false, Confidence, &[P(0, "1001: green")], "1001: green", &[]),
        (0, false, Confidence, &[E(0, 0, "1001: green")], "1001: green", &[]),
        (
            253,
            true,
            Confidence,
            &[E(0, 0, "1001: green"), P(0, "1001: red")],
            "1001: unknown unknown circle",
            &[],
        ),
        (
            255,
            true,
            Confidence,
            &[E(0, 0, "1001: red > V2I"), P(0, "1001: red > SIMULATION")],
            "1001: red > SIMULATION, V2I",
            &[],
        ),
        (
            0,
            true,
            Confidence,
            &[E(0, 0, "1001: green > V2I"), P(0, "1001: red > SIMULATION")],
            "1001: unknown unknown > SIMULATION, V2I",
            &[],
        ),
        (257, true, Confidence, &[E(0, 0, "9999: red; 1001: red"), P(0, "1001: red")], "1001: red", &[9999]),
        (259, true, Confidence, &[E(0, 0, "2001: green 0.6"), P(0, "2001: red 0.9")], "2001: red 0.9", &[]),
        (
            261,
            false,
            Confidence,
            &[E(0, 0, "1002: red 0.5, green right 0.3"), P(0, "1001: green 0.9")],
            "1001: green 0.9; 1002: red 0.5, green right 0.3",
            &[],
        ),
        (
            263,
            false,
            Priority::named("invalid_value").unwrap_or_default(),
            &[E(0, 0, "1001: green 0.7"), P(0, "1001: green 0.9")],
            "1001: green 0.9",
            &[],
        ),
        (267, false, Confidence, &[P(0, "1001: red"), E(20, 20, "1001: green")], "1001: green", &[]),
        (0, false, Confidence, &[P(0, "1001: red"), E(20, 0, "1001: green")], "1001: green", &[]),
    ]);
    let words = ["confidence", "external", "perception", "Confidence", ""].map(Priority::named);
    assert_eq!(words, [Some(Confidence), Some(External), Some(Perception), None, None]);
}

/// 265, and that every other input is published once.
#[test]
fn q_a_late_message_publishes_nothing_and_leaves_no_trace() {
    let mut arbiter = arbiter(false, Confidence);
    let red = take(&mut arbiter, &P(0, "1001: red")).unwrap();
    assert!(take(&mut arbiter, &E(-200, 0, "1001: green")).is_err(), "Q 265");
    assert_eq!(take(&mut arbiter, &P(0, "1001: red")), Ok(red), "Q 265: still red");
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
        let mut arbiter = Arbiter::new(ArbiterSettings::default());
        arbiter.map(&map(&MAP));
        if let Some(step) = &before {
            take(&mut arbiter, step).unwrap();
        }
        let judged = take(&mut arbiter, &perception).unwrap();
        assert_eq!(judged.groups[..], groups(expected), "Q {case}");
    }
}
