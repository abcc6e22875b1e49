//! Phases that end between frames, followers, and controllers that are skipped while idle.

use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

use super::*;
use crate::compat::Compat;
use crate::periodic_timer::{FrameClock, Rate};
use crate::scenario::{Phase, Reference, upstream_cycle_s};

fn controller(durations_s: &[f64]) -> TrafficSignalController {
    let phase = |duration: &f64| Phase {
        name: String::new(),
        duration: duration.is_finite().then(|| Duration::from_secs_f64(*duration)),
        entries: Vec::new(),
    };
    TrafficSignalController {
        name: String::new(),
        reference: None,
        phases: durations_s.iter().map(phase).collect(),
    }
}

fn following(mut follower: TrafficSignalController, delay_s: f64) -> TrafficSignalController {
    let delay = Duration::from_secs_f64(delay_s);
    follower.reference = Some(Reference { controller: ControllerIndex(0), delay });
    follower
}

/// Returns (controller, phase, frame) of all transitions within a number of frames at 30 Hz.
fn transitions(
    controllers: Vec<TrafficSignalController>,
    compat: Compat,
    frames: u64,
) -> Vec<(usize, usize, u64)> {
    transitions_of(controllers, compat, frames, false)
}

/// Like `transitions`, with the option to evaluate every controller in every frame (`all`).
fn transitions_of(
    controllers: Vec<TrafficSignalController>,
    compat: Compat,
    frames: u64,
    all: bool,
) -> Vec<(usize, usize, u64)> {
    let scenario = Scenario { controllers, ..Scenario::default() };
    let mut states = Controllers::new(&scenario, compat.into());
    let (mut clock, mut previous, mut found) = (FrameClock::new(Rate::THIRTY_HZ, 1), None, Vec::new());
    for number in 1..=frames {
        let now = clock.tick();
        let frame = FrameTimes { now, previous: previous.replace(now) };
        if all {
            (0..scenario.controllers.len()).for_each(|index| states.set_idle(index, 0));
        }
        let mut from = 0;
        while let Some(index) = states.next_awake(from, frame) {
            from = index + 1;
            if let Some(to) = states.due(index, &scenario.controllers[index], frame) {
                assert!(to.start.nanos <= now.nanos);
                states.enter(index, to, WallStamp::default());
                found.push((index, to.phase, number));
            }
        }
    }
    found
}

#[test]
fn upstreams_phases_last_a_frame_longer() {
    let frames = |compat| {
        let found = transitions(vec![controller(&[3.0; 4])], compat, 300);
        found.into_iter().map(|(_, _, frame)| frame).collect::<Vec<_>>()
    };
    assert_eq!(frames(Compat::Upstream), [1, 92, 183, 274], "P1");
    assert_eq!(frames(Compat::Improved), [1, 91, 181, 271]);
}

#[test]
fn upstreams_cycle_time_is_cut_after_each_addition() {
    let sum = |durations: &[f64]| upstream_cycle_s(durations.iter().copied());
    assert_eq!((sum(&[1.9, 1.9]), sum(&[0.5, 0.5, 0.5]), sum(&[10.5])), (2, 0, 10));
    assert_eq!((sum(&[f64::INFINITY]), sum(&[-1.5, 3.0])), (i32::MIN, 2));
    assert_eq!(sum(&[f64::INFINITY, 5.0]), i32::MIN + 5);
}

#[test]
fn an_improved_schedule_does_not_slip() {
    // 1.01 s is 30.3 frames: after 100 phases the transition is in the first frame after 101 s, not after 100
    // times 31 frames.
    let found = transitions(vec![controller(&[1.01])], Compat::Improved, 4_000);
    assert_eq!((found[1].2, found[100].2), (32, 1 + 3_030));
    let slipping = transitions(vec![controller(&[1.01])], Compat::Upstream, 4_000);
    assert_eq!((slipping[1].2, slipping[100].2), (32, 1 + 3_100));
}

#[test]
fn phases_shorter_than_a_frame_take_a_frame_each() {
    for compat in [Compat::Improved, Compat::Upstream] {
        let found = transitions(vec![controller(&[0.0, 0.001, 0.0])], compat, 7);
        let expected: Vec<_> = (1..=7).zip([0, 1, 2].into_iter().cycle()).map(|(f, p)| (0, p, f)).collect();
        assert_eq!(found, expected, "{compat:?}");
    }
}

#[test]
fn an_improved_follower_begins_each_cycle_once() {
    for delay_s in [0.0, 0.01, 1.0, 2.005] {
        let pair = || vec![controller(&[1.505, 1.5]), following(controller(&[1.5, 1.505]), delay_s)];
        let found = transitions(pair(), Compat::Improved, 3_000);
        let phases: Vec<_> = found.iter().filter(|found| found.0 == 1).map(|found| found.1).collect();
        assert!(
            phases.len() > 60 && phases.iter().zip([0, 1].into_iter().cycle()).all(|(a, b)| *a == b),
            "{delay_s}"
        );
    }
}

#[test]
fn a_controller_without_phases_informs_followers_each_frame() {
    // P4: with a delay longer than a frame the time never comes; without a delay the first phase begins in
    // each frame.
    for compat in [Compat::Improved, Compat::Upstream] {
        let pair = |delay_s| vec![controller(&[]), following(controller(&[1.0, 1.0]), delay_s)];
        assert_eq!(transitions(pair(0.05), compat, 100), [], "{compat:?}");
        let entered = transitions(pair(0.0), compat, 3);
        assert_eq!(entered, [], "informed again before its own turn: {compat:?}");
        let swapped = || {
            let mut follower = following(controller(&[1.0, 1.0]), 0.0);
            follower.reference = Some(Reference { controller: ControllerIndex(1), delay: Duration::ZERO });
            vec![follower, controller(&[])]
        };
        // Improved mode does not restart a phase that has begun in the meantime.
        let frames: &[u64] = if compat == Compat::Improved { &[2, 4, 6] } else { &[2, 3, 4, 5, 6] };
        let expected: Vec<_> = frames.iter().map(|frame| (0, 0, *frame)).collect();
        assert_eq!(transitions(swapped(), compat, 6), expected, "{compat:?}");
    }
}

#[test]
fn a_reference_to_an_unknown_or_the_same_controller_never_begins() {
    for reference in [0, 7] {
        let mut alone = controller(&[1.0]);
        alone.reference = Some(Reference { controller: ControllerIndex(reference), delay: Duration::ZERO });
        assert_eq!(transitions(vec![alone], Compat::Improved, 100), []);
    }
}

proptest! {
    #[test]
    fn idle_controllers_miss_no_transition(
        drafts in vec((vec(option::of(0..30_u8), 0..4), option::of((0..5_usize, 0..20_u8))), 1..5),
    ) {
        let count = drafts.len();
        let controllers: Vec<_> = drafts
            .into_iter()
            .map(|(tenths, follows)| {
                let seconds = |tenths: Option<u8>| tenths.map_or(f64::INFINITY, |tenths| f64::from(tenths) / 10.0);
                let mut controller = controller(&tenths.into_iter().map(seconds).collect::<Vec<_>>());
                controller.reference = follows.map(|(reference, tenths)| Reference {
                    controller: ControllerIndex(reference % count),
                    delay: Duration::from_millis(u64::from(tenths) * 100),
                });
                controller
            })
            .collect();
        let found = transitions(controllers.clone(), Compat::Improved, 300);
        prop_assert_eq!(found, transitions_of(controllers, Compat::Improved, 300, true));
    }
}
