//! U01 to U69: three ready-made records, one position each; and the positions between them.

use lanelet2_map::geometry::path::{NearestLimits, PathFrame};
use turn_signal::light_command::TurnCommand;
use turn_signal::resolve::{Candidates, PairwiseRules, resolve};
use turn_signal::section::Section;
use turn_signal::side::Side;

use super::line::{at, line, record};

fn set(number: u32) -> Candidates {
    use Side::{Left, Right};
    // A record that is not there is upstream's empty one.
    let absent = Some(Section::default());
    let some = |side, desired, required| Some(record(side, desired, required));
    let (intersection, roundabout, manoeuvre) = match number {
        1 => (some(Left, [0.0, 65.0], [35.0, 48.0]), absent, some(Right, [5.0, 70.0], [45.0, 50.0])),
        2 => (some(Left, [0.0, 65.0], [35.0, 50.0]), absent, some(Right, [5.0, 70.0], [40.0, 45.0])),
        3 => (some(Left, [0.0, 65.0], [35.0, 50.0]), absent, some(Right, [5.0, 70.0], [30.0, 45.0])),
        4 => (absent, some(Right, [0.0, 70.0], [20.0, 25.0]), some(Left, [30.0, 60.0], [40.0, 50.0])),
        5 => (absent, some(Right, [25.0, 70.0], [35.0, 55.0]), some(Left, [0.0, 40.0], [20.0, 30.0])),
        _ => (some(Left, [0.0, 40.0], [20.0, 30.0]), some(Right, [20.0, 60.0], [35.0, 50.0]), absent),
    };
    Candidates { intersection, roundabout, manoeuvre }
}

fn signal_at(candidates: &Candidates, x_m: f64) -> TurnCommand {
    let path = line(0, 69);
    let limits = NearestLimits { distance_m: 5.0, yaw_rad: std::f64::consts::FRAC_PI_3 };
    let path_frame = PathFrame::new(&path, at(x_m), 1.0, limits);
    resolve(&path_frame, candidates, &PairwiseRules::default()).signal()
}

#[test]
fn every_listed_position_gives_its_command() {
    use TurnCommand::{Disable, Left, Right};
    let cases = [
        ("U01", 1, 4.9, Left),
        ("U03", 1, 34.99, Left),
        ("U05", 1, 45.0, Left),
        ("U07", 1, 48.1, Right),
        ("U09", 1, 50.1, Right),
        ("U11", 1, 65.1, Right),
        ("U13", 2, 4.9, Left),
        ("U15", 2, 34.99, Left),
        ("U17", 2, 45.0, Left),
        ("U19", 2, 50.1, Left),
        ("U21", 2, 65.1, Right),
        ("U23", 3, 4.9, Right),
        ("U25", 3, 29.9, Right),
        ("U27", 3, 33.9, Right),
        ("U29", 3, 44.9, Left),
        ("U31", 3, 49.9, Left),
        ("U33", 3, 65.0, Left),
        ("U35", 3, 70.1, Disable),
        ("U37", 4, 30.0, Right),
        ("U39", 4, 40.1, Left),
        ("U41", 4, 50.01, Left),
        ("U43", 4, 60.1, Right),
        ("U45", 4, 70.1, Disable),
        ("U47", 5, 20.0, Left),
        ("U49", 5, 25.0, Left),
        ("U51", 5, 30.0, Left),
        ("U53", 5, 35.1, Right),
        ("U55", 5, 40.1, Right),
        ("U57", 5, 55.1, Right),
        ("U59", 5, 70.1, Disable),
        ("U61", 6, 20.0, Left),
        ("U63", 6, 30.0, Left),
        ("U65", 6, 40.0, Right),
        ("U67", 6, 50.0, Right),
        ("U69", 6, 60.0, Right),
    ];
    assert_eq!(cases.len(), 35);
    for (id, number, x_m, expected) in cases {
        assert_eq!(signal_at(&set(number), x_m), expected, "{id}");
        // Single precision, as upstream feeds it, answers alike.
        #[allow(clippy::cast_possible_truncation)]
        let single = f64::from(x_m as f32);
        assert_eq!(signal_at(&set(number), single), expected, "{id} in single precision");
    }
}

#[test]
fn a_record_that_is_not_there_is_as_good_as_an_empty_one() {
    for number in 1..=6 {
        let with_empty = set(number);
        let present = |record: Option<Section>| record.filter(|record| record.turn != TurnCommand::NoCommand);
        let without = Candidates {
            intersection: present(with_empty.intersection),
            roundabout: present(with_empty.roundabout),
            manoeuvre: present(with_empty.manoeuvre),
        };
        for x in (0..720).map(|tenth| f64::from(tenth) / 10.0) {
            assert_eq!(signal_at(&with_empty, x), signal_at(&without, x), "set {number} at {x}");
        }
    }
}

/// Drawn between the listed positions: where each set changes over, from the rule itself.
#[test]
fn changeovers_lie_where_sections_begin_and_end() {
    use TurnCommand::{Disable, Left, Right};
    for (number, x_m, expected) in [
        (1, 48.0, Left),
        (1, 70.0, Right),
        (1, 70.1, Disable),
        (2, 65.0, Left),
        (2, 70.0, Right),
        (3, 3.9, Left),
        (3, 4.0, Right),
        (3, 34.0, Left),
        (3, 65.1, Right),
        (3, 70.1, Disable),
        (4, 38.9, Right),
        (4, 39.0, Left),
        (4, 60.0, Left),
        (5, 30.1, Left),
        (5, 33.9, Left),
        (5, 34.0, Right),
        (6, 33.9, Left),
        (6, 34.0, Right),
        (6, 60.1, Disable),
    ] {
        assert_eq!(signal_at(&set(number), x_m), expected, "set {number} at {x_m}");
    }
}
