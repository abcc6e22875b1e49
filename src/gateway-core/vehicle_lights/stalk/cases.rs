//! Cases of a momentary stalk in virtual time.

use std::time::Duration;

use super::StalkPosition::{Idle, LeftFull, LeftHalf, RightFull, RightHalf};
use super::TurnCode::{Left, Off, Right};
use super::*;

const fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}
fn at(millis: u64) -> MonoTime {
    MonoTime::from_millis(millis)
}

/// Returns changes of state with their times in ms, from frames given as times in ms and positions.
fn play(settings: StalkSettings, frames: &[(u64, Option<StalkPosition>)]) -> Vec<(u64, Option<TurnCode>)> {
    let mut stalk = MomentaryStalk::new(settings);
    let mut changes = vec![];
    let mut before = None;
    let mut record = |stalk: &MomentaryStalk, now: MonoTime| {
        if stalk.state() != before {
            before = stalk.state();
            changes.push((now.as_nanos() / 1_000_000, before));
        }
    };
    let end = frames.last().map_or(0, |(millis, _)| millis + 100_000);
    for (millis, position) in
        frames.iter().map(|(millis, position)| (*millis, Some(*position))).chain([(end, None)])
    {
        while let Some(due) = stalk.next_deadline().filter(|due| *due <= at(millis)) {
            let state = stalk.state();
            stalk.advance(MonoTime::from_nanos(due.as_nanos() - 1));
            assert_eq!(stalk.state(), state, "nothing before the deadline");
            stalk.advance(due);
            record(&stalk, due);
        }
        if let Some(position) = position {
            stalk.observe(position, at(millis));
            record(&stalk, at(millis));
        }
    }
    changes
}

/// Like [`play`], but from a known idle position, with all positions and states known.
fn press(settings: StalkSettings, frames: &[(u64, StalkPosition)]) -> Vec<(u64, TurnCode)> {
    let known = frames.iter().map(|(millis, position)| (*millis, Some(*position)));
    let frames: Vec<_> = std::iter::once((0, Some(Idle))).chain(known).collect();
    let changes = play(StalkSettings { startup_delay: Duration::ZERO, ..settings }, &frames);
    changes.into_iter().skip(1).map(|(millis, state)| (millis, state.unwrap())).collect()
}

#[test]
fn tap_flashes_for_comfort_duration() {
    let tap = [(1000, LeftHalf), (1200, Idle)];
    let times = [
        (Comfort::Flashes { count: 3, per_minute: 90 }, 2000),
        (Comfort::Flashes { count: 3, per_minute: 60 }, 3000),
        (Comfort::Flashes { count: 5, per_minute: 120 }, 2500),
        (Comfort::For(ms(2400)), 2400),
    ];
    for (comfort, lasts) in times {
        let settings = StalkSettings { comfort, ..StalkSettings::default() };
        assert_eq!(press(settings, &tap), [(1000, Left), (1000 + lasts, Off)], "{comfort:?}");
    }
}

#[test]
fn held_tap_flashes_until_release() {
    let held = [(1000, RightHalf), (9000, Idle)];
    assert_eq!(press(StalkSettings::default(), &held), [(1000, Right), (9000, Off)]);
}

#[test]
fn tap_without_comfort_flashing_lasts_while_held() {
    let comfort = Comfort::Flashes { count: 0, per_minute: 0 };
    let settings = StalkSettings { comfort, ..StalkSettings::default() };
    assert_eq!(press(settings, &[(1000, RightHalf), (1500, Idle)]), [(1000, Right), (1500, Off)]);
}

#[test]
fn full_press_latches_with_or_without_half_detent_frame() {
    let frames = [(1000, LeftHalf), (1100, LeftFull), (1200, LeftHalf), (1300, Idle)];
    assert_eq!(press(StalkSettings::default(), &frames), [(1000, Left)]);
    assert_eq!(press(StalkSettings::default(), &[(1000, LeftFull), (1200, Idle)]), [(1000, Left)]);
}

/// Name, rules, positions after a full press to the left, changes of state.
type Case<'a> = (&'a str, StalkSettings, &'a [(u64, StalkPosition)], &'a [(u64, TurnCode)]);

#[test]
fn full_press_ends_by_each_rule() {
    use OppositePress::{Cancels, Switches};
    let rules = |opposite_half, opposite_full, repeat| StalkSettings {
        opposite_half,
        opposite_full,
        repeat,
        ..StalkSettings::default()
    };
    let usual = rules(Cancels, Switches, RepeatedPress::Cancels);
    let table: [Case; 9] = [
        ("opposite tap cancels", usual, &[(5000, RightHalf), (5200, Idle)], &[(5000, Off)]),
        (
            "opposite full press switches, through a frame of cancel",
            usual,
            &[(5000, RightHalf), (5100, RightFull), (5200, RightHalf), (5300, Idle)],
            &[(5000, Off), (5100, Right)],
        ),
        ("opposite full press at once", usual, &[(5000, RightFull), (5300, Idle)], &[(5000, Right)]),
        (
            "opposite full press may only cancel",
            rules(Cancels, Cancels, RepeatedPress::Cancels),
            &[(5000, RightHalf), (5100, RightFull), (5300, Idle)],
            &[(5000, Off)],
        ),
        (
            "opposite tap may switch to comfort flashing",
            rules(Switches, Switches, RepeatedPress::Cancels),
            &[(5000, RightHalf), (5200, Idle)],
            &[(5000, Right), (7000, Off)],
        ),
        ("a repeated tap cancels", usual, &[(5000, LeftHalf), (5200, Idle)], &[(5000, Off)]),
        (
            "a repeated full press cancels once, not on its way",
            usual,
            &[(5000, LeftHalf), (5100, LeftFull), (5200, LeftHalf), (5300, Idle)],
            &[(5000, Off)],
        ),
        (
            "a repeated press may do nothing",
            rules(Cancels, Switches, RepeatedPress::Keeps),
            &[(5000, LeftHalf), (5100, LeftFull), (5300, Idle)],
            &[],
        ),
        (
            "a limit after the release",
            StalkSettings { max_on: Some(ms(30_000)), ..usual },
            &[],
            &[(31_500, Off)],
        ),
    ];
    for (name, settings, then, changes) in table {
        let frames = [&[(1000, LeftFull), (1500, Idle)], then].concat();
        assert_eq!(press(settings, &frames), [&[(1000, Left)], changes].concat(), "{name}");
    }
}

#[test]
fn second_tap_restarts_comfort_flashing_and_full_press_latches() {
    let again = [(1000, LeftHalf), (1100, Idle), (2000, LeftHalf), (2100, Idle)];
    assert_eq!(press(StalkSettings::default(), &again), [(1000, Left), (4000, Off)]);
    let full = [(1000, LeftHalf), (1100, Idle), (2000, LeftFull), (2100, Idle)];
    assert_eq!(press(StalkSettings::default(), &full), [(1000, Left)]);
}

#[test]
fn opposite_tap_ends_comfort_flashing() {
    let frames = [(1000, LeftHalf), (1100, Idle), (1500, RightHalf), (1600, Idle)];
    assert_eq!(press(StalkSettings::default(), &frames), [(1000, Left), (1500, Off)]);
}

#[test]
fn change_of_sides_without_idle_frame_is_two_presses() {
    let frames = [(1000, LeftFull), (1100, RightFull), (1200, Idle)];
    assert_eq!(press(StalkSettings::default(), &frames), [(1000, Left), (1100, Right)]);
}

#[test]
fn state_is_unknown_until_startup_delay() {
    assert_eq!(play(StalkSettings::default(), &[(10, Some(Idle))]), [(4010, Some(Off))]);
    let pressed = [(10, Some(LeftFull)), (500, Some(Idle))];
    assert_eq!(play(StalkSettings::default(), &pressed), [(4010, Some(Left))]);
}

#[test]
fn gap_up_to_max_gap_is_bridged_and_longer_one_resets() {
    let settings = StalkSettings { startup_delay: ms(1000), ..StalkSettings::default() };
    let gap = |millis: u64| {
        let frames = [
            (0, Some(Idle)),
            (2000, Some(LeftFull)),
            (2200, Some(Idle)),
            (5000, None),
            (5000 + millis, Some(Idle)),
        ];
        play(settings, &frames)[2..].to_vec()
    };
    assert_eq!(gap(100), [(5000, None), (5100, Some(Left))]);
    assert_eq!(gap(101), [(5000, None), (6101, Some(Off))]);
}
