//! Tests lamps against a model that evaluates the whole history of frames.

use std::time::Duration;

use proptest::prelude::*;

use super::*;

/// A frame of the history.
#[derive(Debug, Clone, Copy)]
struct Frame {
    at: MonoTime,
    lamps: Option<(bool, bool)>,
}

/// States the rules in terms of the history, for lamps that are lit only in lit frames.
struct Model<'a> {
    settings: LampSettings,
    history: &'a [Frame],
}

impl Model<'_> {
    /// Returns true if frame `index` ends a run of `lamps` of at least the confirmation time.
    fn confirms(&self, index: usize, lamps: (bool, bool)) -> bool {
        let mut last = self.history[index].at;
        let same = |frame: &&Frame| frame.lamps == Some(lamps) || frame.lamps == Some((false, false));
        let first = self.history[..=index]
            .iter()
            .rev()
            .take_while(same)
            .filter(|frame| frame.lamps == Some(lamps))
            .take_while(|frame| {
                let later = std::mem::replace(&mut last, frame.at);
                later.since(frame.at) <= self.settings.hold
            })
            .last();
        let first = first.map_or(self.history[index].at, |frame| frame.at);
        self.history[index].at.since(first) >= self.settings.confirm
    }

    fn lit_within_hold(&self, until: usize, now: MonoTime, lit: impl Fn((bool, bool)) -> bool) -> bool {
        let fresh = |frame: &&Frame| now.since(frame.at) <= self.settings.hold;
        self.history[..until].iter().filter(fresh).any(|frame| frame.lamps.is_some_and(&lit))
    }

    /// Returns the side that was last lit alone, unless a frame with both or an unknown frame followed.
    fn alone(&self, until: usize) -> Option<TurnCode> {
        self.history[..until].iter().rev().find_map(|frame| match frame.lamps {
            Some((false, false)) => None,
            Some((true, false)) => Some(Some(TurnCode::Left)),
            Some((false, true)) => Some(Some(TurnCode::Right)),
            Some((true, true)) | None => Some(None),
        })?
    }

    /// Returns the state at `now` that follows from `state` and the first `until` frames.
    fn lasting(&self, state: TurnCode, until: usize, now: MonoTime) -> TurnCode {
        let left = self.lit_within_hold(until, now, |lamps| lamps.0);
        let right = self.lit_within_hold(until, now, |lamps| lamps.1);
        match state {
            TurnCode::Left if left => TurnCode::Left,
            TurnCode::Right if right => TurnCode::Right,
            TurnCode::Both if self.lit_within_hold(until, now, |lamps| lamps == (true, true)) => state,
            TurnCode::Both => match self.alone(until) {
                Some(TurnCode::Left) if left => TurnCode::Left,
                Some(TurnCode::Right) if right => TurnCode::Right,
                _ => TurnCode::Off,
            },
            TurnCode::Off | TurnCode::Left | TurnCode::Right => TurnCode::Off,
        }
    }

    fn state(&self, now: MonoTime) -> Option<TurnCode> {
        let mut state = TurnCode::Off;
        for (index, frame) in self.history.iter().enumerate() {
            state = self.lasting(state, index, frame.at);
            let confirmed = frame.lamps.is_some_and(|lamps| self.confirms(index, lamps));
            state = match frame.lamps {
                Some((true, true)) if confirmed => TurnCode::Both,
                None | Some((false, false) | (true, true)) => state,
                Some(_) if state == TurnCode::Both && !confirmed => state,
                Some((left, _)) => {
                    if left {
                        TurnCode::Left
                    } else {
                        TurnCode::Right
                    }
                }
            };
        }
        let state = self.lasting(state, self.history.len(), now);
        let watched = self.history.iter().rev().take_while(|frame| frame.lamps.is_some()).last()?;
        let proven = state != TurnCode::Off || now.since(watched.at) > self.settings.hold;
        proven.then_some(state)
    }
}

fn frames() -> impl Strategy<Value = Vec<(u64, Option<(bool, bool)>)>> {
    let lamps = prop_oneof![
        8 => any::<(bool, bool)>().prop_map(Some),
        4 => Just(Some((false, false))),
        1 => Just(None),
    ];
    let step = prop_oneof![6 => 1..60_u64, 2 => 60..400_u64, 1 => Just(0), 1 => 400..2500_u64];
    // Runs of equal frames, so that confirmation and hold times are reached.
    prop::collection::vec((step, lamps, 1..5_usize), 0..25).prop_map(|runs| {
        runs.into_iter().flat_map(|(step, lamps, count)| vec![(step, lamps); count]).collect()
    })
}

fn settings(lit_until_changed: bool) -> LampSettings {
    LampSettings {
        lit_until_changed,
        hold: Duration::from_millis(300),
        confirm: Duration::from_millis(100),
        stuck_on_after: Duration::from_millis(700),
        fast_period: Duration::from_millis(444),
    }
}

fn observe(lamp: &mut Lamp, lamps: Option<(bool, bool)>, now: MonoTime) {
    lamp.observe(lamps.map(|(left, right)| Sides { left, right }), now);
}

fn just_before(time: MonoTime) -> MonoTime {
    MonoTime::from_nanos(time.as_nanos() - 1)
}

/// Advances to `now` by deadlines, which must lie in the future and before which nothing may change.
fn wait(lamp: &mut Lamp, now: MonoTime, mut each: impl FnMut(&Lamp, MonoTime)) {
    for _ in 0..20 {
        let answers = (lamp.state(), lamp.findings());
        let due = lamp.next_deadline();
        let quiet = due.map_or(now, |due| just_before(due).min(now));
        lamp.advance(quiet);
        assert_eq!((lamp.state(), lamp.findings()), answers, "changed before its deadline");
        let Some(due) = due.filter(|due| *due <= now) else { return };
        assert!(due > MonoTime::ZERO && quiet < due, "deadlines lie ahead");
        lamp.advance(due);
        each(lamp, due);
    }
    panic!("deadlines without end");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn state_agrees_with_model(frames in frames()) {
        let settings = settings(false);
        let mut lamp = Lamp::new(settings);
        let mut history = vec![];
        let mut now = MonoTime::ZERO;
        for (step, lamps) in frames {
            now = now.after(Duration::from_millis(step));
            wait(&mut lamp, now, |lamp, due| {
                assert_eq!(lamp.state(), Model { settings, history: &history }.state(due));
            });
            observe(&mut lamp, lamps, now);
            history.push(Frame { at: now, lamps });
            let expected = Model { settings, history: &history }.state(now);
            prop_assert_eq!(lamp.state(), expected, "{:?}", history);
        }
    }

    #[test]
    fn state_ends_with_hold_and_hazard_requires_both_sides(
        frames in frames(),
        lit_until_changed: bool,
    ) {
        let settings = settings(lit_until_changed);
        let mut lamp = Lamp::new(settings);
        let mut now = MonoTime::ZERO;
        // Last time at which each was known to be lit.
        let (mut left, mut right, mut both) = (None, None, None);
        let mut before = None;
        let check = |lamp: &Lamp, now: MonoTime, [left, right, both]: [Option<MonoTime>; 3]| {
            let fresh = |frame: Option<MonoTime>| {
                frame.is_some_and(|at: MonoTime| now.since(at) <= settings.hold)
            };
            assert!(match lamp.state() {
                Some(TurnCode::Left) => fresh(left),
                Some(TurnCode::Right) => fresh(right),
                Some(TurnCode::Both) => fresh(both),
                Some(TurnCode::Off) | None => true,
            }, "{:?} at {now:?}, last lit {left:?} {right:?} {both:?}", lamp.state());
        };
        for (step, lamps) in frames {
            let later = now.after(Duration::from_millis(step));
            let stays = |lit: bool, frame: Option<MonoTime>| if lit && lit_until_changed { Some(later) } else { frame };
            let (left_lit, right_lit) = before.unwrap_or_default();
            (left, right, both) =
                (stays(left_lit, left), stays(right_lit, right), stays(left_lit && right_lit, both));
            wait(&mut lamp, later, |lamp, due| check(lamp, due, [left, right, both]));
            now = later;
            observe(&mut lamp, lamps, now);
            before = lamps;
            let (left_lit, right_lit) = lamps.unwrap_or_default();
            left = if left_lit { Some(now) } else { left };
            right = if right_lit { Some(now) } else { right };
            both = if left_lit && right_lit { Some(now) } else { both };
            check(&lamp, now, [left, right, both]);
            prop_assert_eq!(lamp.state().is_some() && lamps.is_none(), false, "unknown is unknown");
            if lamps == Some((true, false)) && lamp.state() != Some(TurnCode::Both) {
                prop_assert_eq!(lamp.state(), Some(TurnCode::Left), "on at the first lit frame");
            }
        }
    }

    #[test]
    fn single_side_is_never_hazard_or_other_side(
        frames in prop::collection::vec((1..500_u64, any::<Option<bool>>()), 0..100),
        lit_until_changed: bool,
    ) {
        let mut lamp = Lamp::new(settings(lit_until_changed));
        let mut now = MonoTime::ZERO;
        for (step, left) in frames {
            now = now.after(Duration::from_millis(step));
            observe(&mut lamp, left.map(|left| (left, false)), now);
            prop_assert!(!matches!(lamp.state(), Some(TurnCode::Both | TurnCode::Right)));
            prop_assert!(!lamp.findings().emergency_flashing && !lamp.findings().bulb_failure.right);
        }
    }

    #[test]
    fn any_times_and_settings_are_accepted(
        times in prop::collection::vec((any::<u64>(), any::<Option<(bool, bool)>>()), 0..50),
        hold: u64, confirm: u64, stuck_on: u64, fast: u64, lit_until_changed: bool,
    ) {
        let mut lamp = Lamp::new(LampSettings {
            lit_until_changed,
            hold: Duration::from_nanos(hold),
            confirm: Duration::from_nanos(confirm),
            stuck_on_after: Duration::from_nanos(stuck_on),
            fast_period: Duration::from_nanos(fast),
        });
        let mut latest = MonoTime::ZERO;
        for (nanos, lamps) in times {
            latest = latest.max(MonoTime::from_nanos(nanos));
            observe(&mut lamp, lamps, MonoTime::from_nanos(nanos));
            prop_assert!(lamp.next_deadline().is_none_or(|due| due > latest), "deadlines lie ahead");
        }
    }
}
