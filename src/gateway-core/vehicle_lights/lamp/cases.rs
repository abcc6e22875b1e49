//! Cases of lamps in virtual time: simulated flashers sampled by frames.

use std::time::Duration;

use super::TurnCode::{Both, Left, Off, Right};
use super::timing::Sampling;
use super::*;

const fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// Start of the cases, when dark lamps have been observed for long enough to prove off.
const START: u64 = 10_000;
const DARK: Sides = Sides { left: false, right: false };
const LEFT: Sides = Sides { left: true, ..DARK };
const RIGHT: Sides = Sides { right: true, ..DARK };
const BOTH: Sides = Sides { left: true, right: true };
const fn at(millis: u64) -> MonoTime {
    MonoTime::from_millis(START + millis)
}

/// Lamps with a record of each change of state and its time in ms.
struct Recorder {
    lamp: Lamp,
    changes: Vec<(u64, Option<TurnCode>)>,
}

impl Recorder {
    fn new(settings: LampSettings) -> Self {
        let mut recorder = Self { lamp: Lamp::new(settings), changes: vec![] };
        recorder.lamp.observe(Some(DARK), MonoTime::ZERO);
        recorder.wait(at(0));
        recorder.changes.clear();
        recorder
    }

    fn cyclic(period: u64) -> Self {
        Self::new(LampSettings::for_message(Sampling::cyclic(ms(period))))
    }

    fn observe(&mut self, lamps: Option<Sides>, now: MonoTime) {
        self.wait(now);
        let before = self.lamp.state();
        self.lamp.observe(lamps, now);
        self.record(before, now);
    }

    fn frame(&mut self, lamps: Sides, millis: u64) {
        self.observe(Some(lamps), at(millis));
    }

    fn wait(&mut self, now: MonoTime) {
        while let Some(due) = self.lamp.next_deadline().filter(|due| *due <= now) {
            let before = (self.lamp.state(), self.lamp.findings());
            self.lamp.advance(just_before(due));
            assert_eq!((self.lamp.state(), self.lamp.findings()), before, "nothing before the deadline");
            self.lamp.advance(due);
            self.record(before.0, due);
        }
        self.lamp.advance(now);
    }

    fn record(&mut self, before: Option<TurnCode>, now: MonoTime) {
        let state = self.lamp.state();
        if state != before {
            self.changes.push(((now.as_nanos() / 1_000_000).saturating_sub(START), state));
        }
    }

    /// Sends a frame every `period` ms with the lamps that `lit` returns.
    fn play(&mut self, period: u64, from: u64, until: u64, lit: impl Fn(u64) -> Sides) {
        for millis in (from..until).step_by(usize::try_from(period).unwrap()) {
            self.frame(lit(millis), millis);
        }
    }

    fn states(&self) -> Vec<TurnCode> {
        self.changes.iter().map(|(_, state)| state.unwrap()).collect()
    }
}

fn just_before(time: MonoTime) -> MonoTime {
    MonoTime::from_nanos(time.as_nanos() - 1)
}

/// Returns true if a flasher with this cycle in ms and lit share in percent is lit.
fn flash(millis: u64, cycle: u64, share: u64) -> bool {
    millis % cycle < cycle * share / 100
}
fn only_if(lit: bool, lamps: Sides) -> Sides {
    if lit { lamps } else { DARK }
}

/// A reproducible random generator.
struct Dice(u64);

impl Dice {
    /// Returns a number from 0 to `bound` − 1.
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound.max(1)
    }
}

/// Checks that a legal flasher gives one activation without a gap, which ends one hold time after the last
/// lit frame.
fn one_activation(per_minute: u64, share: u64, period: u64, phase: u64, losses: bool) {
    let name = format!("{per_minute}/min {share} % lit, {period} ms frames, phase {phase}, losses {losses}");
    let mut dice = Dice(per_minute ^ (share << 8) ^ (period << 16) ^ (phase << 32));
    let settings = LampSettings::for_message(Sampling::cyclic(ms(period)));
    let mut recorder = Recorder::new(settings);
    // Flashes in ms with up to 2 % jitter per cycle in either direction, within the legal 0.7 s of dark time.
    let cycle = 60_000 / per_minute;
    let mut flashes = vec![];
    let mut begin = 500 + phase;
    while begin < 20_000 {
        let wobble = if cycle == 1000 { 0 } else { dice.below(cycle / 25 + 1) };
        let length = (cycle + wobble).clamp(500, 1000);
        flashes.push((begin, begin + (length * share).div_ceil(100)));
        begin += length;
    }
    let mut last_lit = 0;
    let mut lost_before = false;
    for number in 0..22_000 / period {
        let millis = number * period + dice.below(period / 10 + 1);
        let lit = flashes.iter().any(|(on, off)| (*on..*off).contains(&millis));
        // Never two losses in a row, since a second loss within the hold time is not bridged.
        lost_before = losses && !lost_before && number % 7 == 3;
        if lost_before {
            continue;
        }
        if lit {
            last_lit = millis;
        }
        recorder.frame(only_if(lit, LEFT), millis);
    }
    recorder.wait(at(30_000));
    assert_eq!(recorder.states(), [Left, Off], "{name}: {:?}", recorder.changes);
    let end = recorder.changes[1].0;
    let hold = u64::try_from(settings.hold.as_millis()).unwrap();
    assert!((last_lit + hold..=last_lit + hold + 1).contains(&end), "{name}: ended {end}");
    assert_eq!(recorder.lamp.findings(), LampFindings::default(), "{name}");
}

#[test]
fn legal_flasher_is_one_activation() {
    for per_minute in [60, 75, 90, 105, 120] {
        for share in [30, 40, 50, 65, 75] {
            for period in [20, 33, 50, 75, 100, 120, 136] {
                for phase in [0, 7, 41, 99] {
                    one_activation(per_minute, share, period, phase, false);
                }
            }
        }
    }
}

#[test]
fn frames_of_200_ms_suffice_at_60_90_and_120_a_minute() {
    for per_minute in [60, 90, 120] {
        for share in [30, 40, 50, 65, 75] {
            for period in [140, 160, 180, 200] {
                for phase in 0..40 {
                    one_activation(per_minute, share, period, phase * 5, false);
                }
            }
        }
    }
}

#[test]
fn one_lost_frame_does_not_end_activation() {
    for per_minute in [60, 90, 120] {
        for (period, least) in [(20, 30), (50, 30), (68, 30), (100, 45), (113, 50)] {
            for share in [least, 60, 75] {
                for phase in 0..20 {
                    one_activation(per_minute, share, period, phase * 11, true);
                }
            }
        }
    }
}

#[test]
fn side_is_on_from_first_lit_frame_until_hold_time() {
    let mut recorder = Recorder::cyclic(100);
    recorder.frame(DARK, 0);
    recorder.frame(LEFT, 100);
    assert_eq!(recorder.changes, [(100, Some(Left))]);
    let end = deadline_after(at(100), ms(1030));
    assert_eq!(recorder.lamp.next_deadline(), Some(end));
    recorder.lamp.advance(just_before(end));
    assert_eq!(recorder.lamp.state(), Some(Left), "as old as the hold");
    recorder.lamp.advance(end);
    assert_eq!(recorder.lamp.state(), Some(Off), "older than the hold");
}

#[test]
fn three_comfort_flashes_are_one_activation() {
    for period in [20, 50, 100, 200] {
        let mut recorder = Recorder::cyclic(period);
        let hold = u64::try_from(recorder.lamp.settings.hold.as_millis()).unwrap();
        recorder.play(period, 0, 6000, |t| only_if(t < 2000 && flash(t, 667, 50), RIGHT));
        assert_eq!(recorder.states(), [Right, Off], "{period} ms");
        let end = recorder.changes[1].0;
        assert!(end <= 1334 + 334 + hold + period, "{period} ms: {end}");
    }
}

#[test]
fn change_of_sides_is_not_hazard() {
    for between in [DARK, BOTH] {
        for period in [20, 50, 100, 200] {
            for (first, second, states) in [(LEFT, RIGHT, [Left, Right]), (RIGHT, LEFT, [Right, Left])] {
                // The stalk moves while the first lamp is lit, and while it is dark.
                for moved in [1200, 1600] {
                    let mut recorder = Recorder::cyclic(period);
                    let frames = |t: u64| match t / period {
                        _ if t < moved => only_if(flash(t, 800, 50), first),
                        frame if frame == moved / period => between,
                        _ => only_if(flash(t - moved, 800, 50), second),
                    };
                    recorder.play(period, 0, 4000, frames);
                    assert_eq!(recorder.states(), states, "{period} ms, {between:?}, {moved}");
                }
            }
        }
    }
}

#[test]
fn hazard_begins_after_confirmation_time() {
    let mut recorder = Recorder::cyclic(20);
    recorder.play(20, 0, 3000, |t| only_if(flash(t, 667, 50), BOTH));
    assert_eq!(recorder.changes, [(100, Some(Both))], "in the first common flash");
    let mut slow = Recorder::cyclic(200);
    slow.play(200, 0, 6000, |t| only_if(flash(t, 500, 30), BOTH));
    assert_eq!(slow.states(), [Both], "flashes of one frame each: at the second");
}

#[test]
fn single_frames_with_both_lit_are_not_hazard() {
    let mut recorder = Recorder::cyclic(100);
    for round in 0..20 {
        for (step, lamps) in [LEFT, BOTH, RIGHT, DARK, RIGHT, BOTH, LEFT, DARK].into_iter().enumerate() {
            recorder.frame(lamps, round * 800 + 100 * step as u64);
        }
    }
    assert!(!recorder.states().contains(&Both));
}

#[test]
fn hazard_during_left_ends_with_left() {
    for period in [20, 50, 100] {
        for pressed in (2000..2800).step_by(100) {
            let mut recorder = Recorder::cyclic(period);
            let lamps = |t| if (pressed..pressed + 4000).contains(&t) { BOTH } else { LEFT };
            recorder.play(period, 0, 10_000, |t| only_if(flash(t, 800, 50), lamps(t)));
            assert_eq!(recorder.states(), [Left, Both, Left], "{period} ms, {pressed}");
            let (begin, end) = (recorder.changes[1].0, recorder.changes[2].0);
            assert!(begin <= pressed + 400 + 2 * 100 + period, "{begin}: next common flash, confirmed");
            assert!(end <= pressed + 4000 + 400 + 2 * 100 + period, "{end}: sooner than the hold");
        }
    }
}

#[test]
fn lamps_one_frame_apart_do_not_interrupt_hazard() {
    let mut recorder = Recorder::cyclic(50);
    recorder
        .play(50, 0, 6000, |t| Sides { left: flash(t, 700, 50), right: t >= 50 && flash(t - 50, 700, 50) });
    assert_eq!(recorder.states(), [Left, Both], "one frame of left before both are lit");
}

#[test]
fn emergency_flashing_is_hazard_with_finding() {
    for per_minute in [180, 240, 300] {
        let mut recorder = Recorder::cyclic(20);
        recorder.play(20, 0, 3000, |t| only_if(flash(t, 60_000 / per_minute, 50), BOTH));
        assert_eq!(recorder.states(), [Both], "{per_minute}/min");
        let found = LampFindings { emergency_flashing: true, ..LampFindings::default() };
        assert_eq!(recorder.lamp.findings(), found, "{per_minute}/min");
        recorder.play(20, 3000, 6000, |t| only_if(flash(t, 500, 50), BOTH));
        assert_eq!(recorder.lamp.findings(), LampFindings::default(), "ordinary hazard after it");
    }
}

#[test]
fn emergency_flashing_ends_with_hazard() {
    let mut recorder = Recorder::cyclic(20);
    recorder.play(20, 0, 2000, |t| only_if(flash(t, 250, 50), BOTH));
    assert!(recorder.lamp.findings().emergency_flashing);
    recorder.play(20, 2000, 4000, |_| DARK);
    assert_eq!(recorder.states(), [Both, Off]);
    assert!(!recorder.lamp.findings().emergency_flashing);
}

#[test]
fn emergency_flashing_with_early_lamp_is_not_bulb_failure() {
    let mut recorder = Recorder::cyclic(20);
    recorder
        .play(20, 0, 3000, |t| Sides { left: flash(t, 250, 50), right: t >= 20 && flash(t - 20, 250, 50) });
    let found = LampFindings { emergency_flashing: true, ..LampFindings::default() };
    assert_eq!(recorder.lamp.findings(), found);
}

#[test]
fn doubled_rate_on_one_side_is_bulb_failure() {
    let (left, right) = (Sides { left: true, right: false }, Sides { left: false, right: true });
    for (lamps, state, broken) in [(LEFT, Left, left), (RIGHT, Right, right)] {
        for (per_minute, period) in [(150, 20), (180, 50), (180, 100), (240, 20)] {
            let mut recorder = Recorder::cyclic(period);
            recorder.play(period, 0, 4000, |t| only_if(flash(t, 60_000 / per_minute, 50), lamps));
            assert_eq!(recorder.states(), [state], "{per_minute}/min");
            assert_eq!(recorder.lamp.findings().bulb_failure, broken, "{per_minute}/min");
            assert!(!recorder.lamp.findings().emergency_flashing);
            recorder.play(period, 4000, 14_000, |_| DARK);
            recorder.play(period, 14_000, 14_300, |_| lamps);
            recorder.play(period, 14_300, 16_000, |_| DARK);
            assert_eq!(recorder.lamp.findings().bulb_failure, broken, "a pause is not an ordinary rate");
            recorder.play(period, 16_000, 20_000, |t| only_if(flash(t, 600, 50), lamps));
            assert_eq!(recorder.lamp.findings().bulb_failure, Sides::default(), "replaced");
        }
    }
}

#[test]
fn slow_frames_do_not_clear_bulb_failure() {
    let mut recorder = Recorder::cyclic(20);
    recorder.play(20, 0, 4000, |t| only_if(flash(t, 400, 50), LEFT));
    assert!(recorder.lamp.findings().bulb_failure.left);
    recorder.play(90, 4000, 40_000, |t| only_if(flash(t, 400, 50), LEFT));
    assert!(recorder.lamp.findings().bulb_failure.left);
}

#[test]
fn unknown_frames_do_not_clear_bulb_failure() {
    let mut recorder = Recorder::cyclic(20);
    recorder.play(20, 0, 4000, |t| only_if(flash(t, 320, 50), LEFT));
    assert!(recorder.lamp.findings().bulb_failure.left);
    // Every second dark time is unknown, so the flashes appear twice as long.
    for millis in (4000..12_000).step_by(20) {
        let lit = flash(millis, 320, 50);
        let lamps = (lit || millis % 640 >= 320).then_some(Sides { left: lit, ..DARK });
        recorder.observe(lamps, at(millis));
    }
    assert!(recorder.lamp.findings().bulb_failure.left);
}

#[test]
fn steady_lamp_is_on_with_finding_until_dark() {
    for sampling in [Sampling::cyclic(ms(100)), Sampling::OnChange { latency: ms(20) }] {
        let mut recorder = Recorder::new(LampSettings::for_message(sampling));
        if recorder.lamp.settings.lit_until_changed {
            recorder.frame(LEFT, 0);
            recorder.wait(at(5000));
        } else {
            recorder.play(100, 0, 5001, |_| LEFT);
        }
        assert_eq!(recorder.changes, [(0, Some(Left))]);
        assert_eq!(recorder.lamp.findings().does_not_flash, Sides { left: true, right: false });
        recorder.frame(DARK, 5100);
        assert_eq!(recorder.lamp.findings(), LampFindings::default());
    }
}

#[test]
fn message_sent_on_change_needs_no_repetition() {
    for (cycle, share) in [(1000, 30), (1000, 75), (667, 50), (500, 30)] {
        for (lamps, state) in [(LEFT, Left), (BOTH, Both)] {
            let mut recorder =
                Recorder::new(LampSettings::for_message(Sampling::OnChange { latency: ms(20) }));
            for begin in (0..8000).step_by(cycle) {
                recorder.frame(lamps, begin as u64);
                recorder.frame(DARK, (begin + cycle * share / 100) as u64);
            }
            let last_dark = (7999 / cycle * cycle + cycle * share / 100) as u64;
            recorder.wait(at(20_000));
            let begin = if state == Both { 100 } else { 0 };
            assert_eq!(recorder.changes, [(begin, Some(state)), (last_dark + 740, Some(Off))]);
        }
    }
}

#[test]
fn dark_lamps_are_off_after_hold_time() {
    let mut lamp = Lamp::new(LampSettings::for_message(Sampling::cyclic(ms(100))));
    assert_eq!((lamp.state(), lamp.next_deadline()), (None, None));
    lamp.observe(Some(DARK), at(0));
    assert_eq!(lamp.state(), None, "may be the dark part of a flash");
    let proven = deadline_after(at(0), ms(1030));
    assert_eq!(lamp.next_deadline(), Some(proven));
    lamp.advance(proven);
    assert_eq!(lamp.state(), Some(Off));
}

#[test]
fn unknown_lamp_makes_state_unknown_and_is_bridged_within_hold() {
    let mut recorder = Recorder::cyclic(100);
    recorder.frame(LEFT, 0);
    recorder.observe(None, at(100));
    recorder.frame(DARK, 200);
    assert_eq!(recorder.changes, [(0, Some(Left)), (100, None), (200, Some(Left))]);
    recorder.wait(at(5000));
    assert_eq!(
        recorder.changes[3..],
        [(1030, None), (1230, Some(Off))],
        "off requires a hold time of frames"
    );
}

#[test]
fn backward_time_counts_as_last_time() {
    let mut recorder = Recorder::cyclic(100);
    recorder.frame(LEFT, 500);
    recorder.lamp.observe(Some(LEFT), MonoTime::ZERO);
    assert_eq!(recorder.lamp.next_deadline(), Some(deadline_after(at(500), ms(1030))));
}
