//! Tests a momentary stalk against a model that evaluates the whole history as a list of presses.

use std::time::Duration;

use proptest::prelude::*;

use super::*;
use crate::vehicle_lights::state::Sides;

/// One press with its side and the times of its start, of the full detent and of its release, in ms.
#[derive(Debug, Clone, Copy)]
struct PressRecord {
    left: bool,
    begin: u64,
    full: Option<u64>,
    release: Option<u64>,
}

/// Returns the presses up to and including `now` in ms, from known positions.
fn presses(frames: &[(u64, StalkPosition)], now: u64) -> Vec<PressRecord> {
    let mut presses: Vec<PressRecord> = vec![];
    let mut held: Option<bool> = None;
    for (millis, position) in frames.iter().copied().filter(|(millis, _)| *millis <= now) {
        let (side, full) = match position {
            StalkPosition::Idle => (None, false),
            StalkPosition::LeftHalf => (Some(true), false),
            StalkPosition::LeftFull => (Some(true), true),
            StalkPosition::RightHalf => (Some(false), false),
            StalkPosition::RightFull => (Some(false), true),
        };
        if side != held {
            if let (Some(_), None) = (held, side) {
                presses.last_mut().unwrap().release = Some(millis);
            }
            if let Some(left) = side {
                presses.push(PressRecord { left, begin: millis, full: None, release: None });
            }
            held = side;
        }
        if full {
            presses.last_mut().unwrap().full.get_or_insert(millis);
        }
    }
    presses
}

/// A request with its last instant in ms.
#[derive(Debug, Clone, Copy)]
struct Request {
    left: bool,
    latched: bool,
    until: u64,
}

/// Returns the request at `now` after all presses.
fn expected(settings: StalkSettings, presses: &[PressRecord], now: u64) -> Option<Request> {
    let (last, earlier) = presses.split_last()?;
    // The request at the start of the last press, from the earlier presses alone.
    let before = expected(settings, earlier, last.begin);
    let comfort = u64::try_from(settings.comfort.duration().as_millis()).unwrap();
    let limit = |from: u64| match settings.max_on {
        Some(limit) => from + u64::try_from(limit.as_millis()).unwrap(),
        None => u64::MAX,
    };
    let left = last.left;
    let until = (last.begin + comfort).max(last.release.unwrap_or(u64::MAX));
    let tapped = Request { left, latched: false, until };
    let latched = Request { left, latched: true, until: last.release.map_or(u64::MAX, limit) };
    let fresh = if last.full.is_some() { latched } else { tapped };
    let rule = if last.full.is_some() { settings.opposite_full } else { settings.opposite_half };
    let request = match before {
        Some(before) if before.left != left => (rule == OppositePress::Switches).then_some(fresh),
        Some(before) if before.latched => (settings.repeat == RepeatedPress::Keeps).then_some(latched),
        Some(_) | None => Some(fresh),
    };
    // A press without a release before the next press lasts until that press. Comfort flashing that has ended
    // by the release ends at that instant.
    let ended = |Request { latched, until, .. }: &Request| match last.release {
        Some(release) if !latched && *until == release && last.begin + comfort < release => now >= *until,
        Some(_) => now > *until,
        None => false,
    };
    request.filter(|request| !ended(request))
}

fn positions() -> impl Strategy<Value = StalkPosition> {
    prop_oneof![
        4 => Just(StalkPosition::Idle),
        2 => Just(StalkPosition::LeftHalf),
        1 => Just(StalkPosition::LeftFull),
        2 => Just(StalkPosition::RightHalf),
        1 => Just(StalkPosition::RightFull),
    ]
}

fn all_settings() -> impl Strategy<Value = StalkSettings> {
    let opposite = || prop_oneof![Just(OppositePress::Cancels), Just(OppositePress::Switches)];
    let repeat = prop_oneof![Just(RepeatedPress::Cancels), Just(RepeatedPress::Keeps)];
    let max_on = prop::option::of((0..3000_u64).prop_map(Duration::from_millis));
    (0..3000_u64, opposite(), opposite(), repeat, max_on).prop_map(|(comfort, half, full, repeat, max_on)| {
        StalkSettings {
            comfort: Comfort::For(Duration::from_millis(comfort)),
            opposite_half: half,
            opposite_full: full,
            repeat,
            max_on,
            max_gap: Duration::from_millis(100),
            startup_delay: Duration::ZERO,
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn state_agrees_with_list_of_presses(
        settings in all_settings(),
        steps in prop::collection::vec((prop_oneof![3 => 0..400_u64, 1 => 400..4000_u64], positions()), 1..40),
    ) {
        let mut stalk = MomentaryStalk::new(settings);
        let mut frames = vec![];
        let mut now = 0;
        let code = |request: Option<Request>| TurnCode::from_sides(match request {
            Some(Request { left, .. }) => Sides { left, right: !left },
            None => Sides::default(),
        });
        for (step, position) in steps {
            let next = now + step;
            // Times between frames, too: in ms, and a deadline falls a nanosecond after one.
            for millis in (now..next).step_by(97).filter(|_| !frames.is_empty()) {
                stalk.advance(MonoTime::from_millis(millis));
                let on = expected(settings, &presses(&frames, millis), millis);
                prop_assert_eq!(stalk.state(), Some(code(on)), "between frames, {} ms {:?}", millis, frames);
            }
            now = next;
            stalk.observe(Some(position), MonoTime::from_millis(now));
            frames.push((now, position));
            let on = expected(settings, &presses(&frames, now), now);
            prop_assert_eq!(stalk.state(), Some(code(on)), "{} ms {:?}", now, frames);
        }
    }

    #[test]
    fn side_is_requested_only_after_press_and_known_position(
        settings in all_settings(),
        steps in prop::collection::vec((any::<u64>(), prop::option::weighted(0.8, positions())), 0..40),
    ) {
        let mut stalk = MomentaryStalk::new(settings);
        let (mut left, mut right) = (false, false);
        let mut latest = MonoTime::ZERO;
        for (nanos, position) in steps {
            let now = MonoTime::from_nanos(nanos);
            latest = latest.max(now);
            stalk.observe(position, now);
            let side = position.and_then(StalkPosition::detent).map(|(side, _)| side.code());
            left |= side == Some(TurnCode::Left);
            right |= side == Some(TurnCode::Right);
            prop_assert!(left || stalk.state() != Some(TurnCode::Left));
            prop_assert!(right || stalk.state() != Some(TurnCode::Right));
            prop_assert_eq!(stalk.state().is_some(), position.is_some());
            prop_assert!(stalk.next_deadline().is_none_or(|due| due >= latest), "deadlines lie ahead");
        }
    }
}
