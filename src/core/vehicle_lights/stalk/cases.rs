//! A momentary stalk under a hand, on virtual time.

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

/// What comes of frames given as time in ms and position: changes of state, with the time in ms.
fn play(settings: StalkSettings, frames: &[(u64, Option<StalkPosition>)]) -> Vec<(u64, Option<TurnCode>)> {
    let mut stalk = MomentaryStalk::new(settings);
    let mut changes = vec![];
    let mut before = None;
    let mut note = |stalk: &MomentaryStalk, now: MonoTime| {
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
            note(&stalk, due);
        }
        if let Some(position) = position {
            stalk.observe(position, at(millis));
            note(&stalk, at(millis));
        }
    }
    changes
}

/// The same from known rest, without that rest, all positions known, and states never unknown.
fn press(settings: StalkSettings, frames: &[(u64, StalkPosition)]) -> Vec<(u64, TurnCode)> {
    let known = frames.iter().map(|(millis, position)| (*millis, Some(*position)));
    let frames: Vec<_> = std::iter::once((0, Some(Idle))).chain(known).collect();
    let changes = play(StalkSettings { startup_delay: Duration::ZERO, ..settings }, &frames);
    changes.into_iter().skip(1).map(|(millis, state)| (millis, state.unwrap())).collect()
}

#[test]
fn a_tap_blinks_for_the_comfort_time_counted_or_given() {
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
fn a_tap_held_longer_blinks_until_let_go() {
    let held = [(1000, RightHalf), (9000, Idle)];
    assert_eq!(press(StalkSettings::default(), &held), [(1000, Right), (9000, Off)]);
}

#[test]
fn without_comfort_blinking_a_tap_counts_while_held() {
    let comfort = Comfort::Flashes { count: 0, per_minute: 0 };
    let settings = StalkSettings { comfort, ..StalkSettings::default() };
    assert_eq!(press(settings, &[(1000, RightHalf), (1500, Idle)]), [(1000, Right), (1500, Off)]);
}

#[test]
fn a_full_press_lasts_with_or_without_a_frame_of_the_half_detent() {
    let frames = [(1000, LeftHalf), (1100, LeftFull), (1200, LeftHalf), (1300, Idle)];
    assert_eq!(press(StalkSettings::default(), &frames), [(1000, Left)]);
    assert_eq!(press(StalkSettings::default(), &[(1000, LeftFull), (1200, Idle)]), [(1000, Left)]);
}

/// Name, rules, what follows a full press to the left, what comes of it.
type Case<'a> = (&'a str, StalkSettings, &'a [(u64, StalkPosition)], &'a [(u64, TurnCode)]);

#[test]
fn each_way_to_end_a_full_press() {
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
            "opposite tap may switch to comfort blinking",
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
            "a limit after letting go",
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
fn a_second_tap_starts_comfort_blinking_anew_and_a_full_press_makes_it_last() {
    let again = [(1000, LeftHalf), (1100, Idle), (2000, LeftHalf), (2100, Idle)];
    assert_eq!(press(StalkSettings::default(), &again), [(1000, Left), (4000, Off)]);
    let full = [(1000, LeftHalf), (1100, Idle), (2000, LeftFull), (2100, Idle)];
    assert_eq!(press(StalkSettings::default(), &full), [(1000, Left)]);
}

#[test]
fn an_opposite_tap_ends_comfort_blinking() {
    let frames = [(1000, LeftHalf), (1100, Idle), (1500, RightHalf), (1600, Idle)];
    assert_eq!(press(StalkSettings::default(), &frames), [(1000, Left), (1500, Off)]);
}

#[test]
fn a_stalk_thrown_over_without_a_frame_of_rest_is_two_presses() {
    let frames = [(1000, LeftFull), (1100, RightFull), (1200, Idle)];
    assert_eq!(press(StalkSettings::default(), &frames), [(1000, Left), (1100, Right)]);
}

#[test]
fn it_is_unknown_at_start_until_watched_for_the_settling_time() {
    assert_eq!(play(StalkSettings::default(), &[(10, Some(Idle))]), [(4010, Some(Off))]);
    let pressed = [(10, Some(LeftFull)), (500, Some(Idle))];
    assert_eq!(play(StalkSettings::default(), &pressed), [(4010, Some(Left))]);
}

#[test]
fn a_short_blindness_is_bridged_and_a_long_one_forgets() {
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

#[test]
fn a_latched_stalk_says_what_it_shows() {
    let shown = [Idle, LeftHalf, LeftFull, RightHalf, RightFull].map(StalkPosition::latched);
    assert_eq!(shown, [Off, Left, Left, Right, Right]);
}
