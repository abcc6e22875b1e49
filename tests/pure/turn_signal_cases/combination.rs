//! docs/spec/turn-signal-decider.md, "Joining records": the record of a manoeuvre joined with that of the one
//! before it.

use lanelet2_map::geometry::path::PathFrame;
use turn_signal::chain::{overwrite, pairwise_prior};
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::section::Section;
use turn_signal::side::Side;

use super::line::{FRONT_M, NEAREST, at, line, record};

fn hazard() -> Section {
    Section { hazard: HazardCommand::Enable, ..Section::default() }
}

/// The same points without a command.
fn silenced(record: Section) -> Section {
    Section { turn: TurnCommand::NoCommand, ..record }
}

#[test]
fn overwrite_takes_the_new_record_unless_it_starts_later() {
    let path = line(-20, 120);
    let path_frame = PathFrame::new(&path, at(30.0), FRONT_M, NEAREST);
    let previous = record(Side::Left, [0.0, 60.0], [20.0, 50.0]);
    let right = |start: f64| record(Side::Right, [start, 100.0], [start, 100.0]);
    let none = Section { turn: TurnCommand::NoCommand, ..right(-5.0) };
    for (what, previous, new, expected) in [
        ("desired start beyond the end", previous, right(80.0), previous),
        ("desired start at the end", previous, right(60.0), right(60.0)),
        ("just beyond it", previous, right(60.01), previous),
        ("a record without a command", previous, none, none),
        ("without a command, but beyond the end", previous, silenced(right(61.0)), previous),
        ("previous without a command", silenced(previous), right(80.0), right(80.0)),
        ("previous off", Section { turn: TurnCommand::Disable, ..previous }, right(80.0), right(80.0)),
        ("hazard lights", hazard(), right(80.0), right(80.0)),
    ] {
        assert_eq!(overwrite(&path_frame, previous, new), expected, "{what}");
    }
}

#[test]
fn the_pairwise_rule_goes_by_position() {
    let path = line(-20, 120);
    let previous = record(Side::Left, [0.0, 50.0], [20.0, 40.0]);
    let new = record(Side::Right, [30.0, 80.0], [45.0, 70.0]);
    for (x, expected) in [
        (-3.0, None),
        (-2.0, Some(previous)),
        (20.0, Some(previous)),
        (28.0, Some(previous)),
        (41.0, Some(previous)),
        (42.9, Some(previous)),
        (43.0, Some(new)),
        (51.0, Some(new)),
        (80.0, Some(new)),
        (81.0, None),
    ] {
        let path_frame = PathFrame::new(&path, at(x), 2.0, NEAREST);
        assert_eq!(pairwise_prior(&path_frame, previous, new), expected, "x = {x}");
        // Which came first plays a part only when starts are equal.
        assert_eq!(pairwise_prior(&path_frame, new, previous), expected, "x = {x}, in reverse");
    }
}

#[test]
fn an_empty_record_at_the_origin_takes_part_upstream() {
    let path = line(-20, 120);
    let path_frame = PathFrame::new(&path, at(10.0), 2.0, NEAREST);
    let new = record(Side::Right, [0.0, 80.0], [45.0, 70.0]);
    // All its points lie behind: it is passed, and the other one stays.
    assert_eq!(pairwise_prior(&path_frame, Section::default(), new), Some(new));
    // Before the origin neither has begun.
    let before = PathFrame::new(&path, at(-10.0), 2.0, NEAREST);
    assert_eq!(pairwise_prior(&before, Section::default(), new), None);
}
