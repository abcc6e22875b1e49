//! Lamp cases on virtual time: synthetic flashers, sampled by frames.

use std::time::Duration;

use super::TurnCode::{Both, Left, Off, Right};
use super::timing::Sampling;
use super::*;

const fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// Cases begin here, with dark lamps watched for long enough that off is proven.
const START: u64 = 10_000;
const DARK: (bool, bool) = (false, false);
const LEFT: (bool, bool) = (true, false);
const RIGHT: (bool, bool) = (false, true);
const BOTH: (bool, bool) = (true, true);
const fn at(millis: u64) -> MonoTime {
    MonoTime::from_millis(START + millis)
}

/// A lamp watched by someone with a timer, who writes down each change and its time.
struct Watch {
    lamp: Lamp,
    changes: Vec<(u64, Option<TurnCode>)>,
}

impl Watch {
    fn new(settings: LampSettings) -> Self {
        let mut watch = Self { lamp: Lamp::new(settings), changes: vec![] };
        watch.lamp.observe(Some(false), Some(false), MonoTime::ZERO);
        watch.wait(at(0));
        watch.changes.clear();
        watch
    }

    fn cyclic(period: u64) -> Self {
        Self::new(LampSettings::for_message(Sampling::cyclic(ms(period))))
    }

    fn observe(&mut self, left: Option<bool>, right: Option<bool>, now: MonoTime) {
        self.wait(now);
        let before = self.lamp.state();
        self.lamp.observe(left, right, now);
        self.note(before, now);
    }

    fn frame(&mut self, (left, right): (bool, bool), millis: u64) {
        self.observe(Some(left), Some(right), at(millis));
    }

    fn wait(&mut self, now: MonoTime) {
        while let Some(due) = self.lamp.next_deadline().filter(|due| *due <= now) {
            let before = (self.lamp.state(), self.lamp.findings());
            self.lamp.advance(just_before(due));
            assert_eq!((self.lamp.state(), self.lamp.findings()), before, "nothing before the deadline");
            self.lamp.advance(due);
            self.note(before.0, due);
        }
        self.lamp.advance(now);
    }

    fn note(&mut self, before: Option<TurnCode>, now: MonoTime) {
        let state = self.lamp.state();
        if state != before {
            self.changes.push(((now.as_nanos() / 1_000_000).saturating_sub(START), state));
        }
    }

    /// Frames of `period` ms that show what the script says.
    fn play(&mut self, period: u64, from: u64, until: u64, lit: impl Fn(u64) -> (bool, bool)) {
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

/// Whether a flasher is lit: cycle in ms, lit share in percent.
fn flash(millis: u64, cycle: u64, share: u64) -> bool {
    millis % cycle < cycle * share / 100
}
fn only_if(lit: bool, lamps: (bool, bool)) -> (bool, bool) {
    if lit { lamps } else { DARK }
}

/// Repeatable disorder.
struct Dice(u64);

impl Dice {
    /// 0 to `bound` − 1.
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound.max(1)
    }
}

/// Must hold for every legal flasher in every accepted message: one activation without a gap, which
/// ends a hold after the last lit frame.
fn one_activation(per_minute: u64, share: u64, period: u64, phase: u64, losses: bool) {
    let name = format!("{per_minute}/min {share} % lit, {period} ms frames, phase {phase}, losses {losses}");
    let mut dice = Dice(per_minute ^ (share << 8) ^ (period << 16) ^ (phase << 32));
    let settings = LampSettings::for_message(Sampling::cyclic(ms(period)));
    let mut watch = Watch::new(settings);
    // Flashes with up to 2 % jitter a cycle either way, within the law's 0.7 s darkness; in ms.
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
        // Never two in a row: a second loss within the hold is another story.
        lost_before = losses && !lost_before && number % 7 == 3;
        if lost_before {
            continue;
        }
        if lit {
            last_lit = millis;
        }
        watch.frame(only_if(lit, LEFT), millis);
    }
    watch.wait(at(30_000));
    assert_eq!(watch.states(), [Left, Off], "{name}: {:?}", watch.changes);
    let end = watch.changes[1].0;
    let hold = u64::try_from(settings.hold.as_millis()).unwrap();
    assert!((last_lit + hold..=last_lit + hold + 1).contains(&end), "{name}: ended {end}");
    assert_eq!(watch.lamp.findings(), LampFindings::default(), "{name}");
}

#[test]
fn every_legal_flasher_in_every_accepted_message_is_one_activation() {
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
fn at_60_90_and_120_a_minute_frames_of_200_ms_are_enough() {
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
fn one_lost_frame_does_not_end_an_activation() {
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
fn a_side_is_on_at_its_first_lit_frame_and_off_when_the_hold_has_passed() {
    let mut watch = Watch::cyclic(100);
    watch.frame(DARK, 0);
    watch.frame(LEFT, 100);
    assert_eq!(watch.changes, [(100, Some(Left))]);
    let end = deadline_after(at(100), ms(1030));
    assert_eq!(watch.lamp.next_deadline(), Some(end));
    watch.lamp.advance(just_before(end));
    assert_eq!(watch.lamp.state(), Some(Left), "as old as the hold");
    watch.lamp.advance(end);
    assert_eq!(watch.lamp.state(), Some(Off), "older than the hold");
}

#[test]
fn three_comfort_flashes_are_one_activation() {
    for period in [20, 50, 100, 200] {
        let mut watch = Watch::cyclic(period);
        let hold = u64::try_from(watch.lamp.settings.hold.as_millis()).unwrap();
        watch.play(period, 0, 6000, |t| only_if(t < 2000 && flash(t, 667, 50), RIGHT));
        assert_eq!(watch.states(), [Right, Off], "{period} ms");
        let end = watch.changes[1].0;
        assert!(end <= 1334 + 334 + hold + period, "{period} ms: {end}");
    }
}

#[test]
fn a_switch_over_shows_no_hazard_whatever_lamps_its_frame_shows() {
    for between in [DARK, BOTH] {
        for period in [20, 50, 100, 200] {
            for (first, second, states) in [(LEFT, RIGHT, [Left, Right]), (RIGHT, LEFT, [Right, Left])] {
                // The lever moves while the first lamp is lit, and while it is dark.
                for moved in [1200, 1600] {
                    let mut watch = Watch::cyclic(period);
                    let frames = |t: u64| match t / period {
                        _ if t < moved => only_if(flash(t, 800, 50), first),
                        frame if frame == moved / period => between,
                        _ => only_if(flash(t - moved, 800, 50), second),
                    };
                    watch.play(period, 0, 4000, frames);
                    assert_eq!(watch.states(), states, "{period} ms, {between:?}, {moved}");
                }
            }
        }
    }
}

#[test]
fn hazard_begins_when_both_are_lit_for_the_confirmation_and_not_before() {
    let mut watch = Watch::cyclic(20);
    watch.play(20, 0, 3000, |t| only_if(flash(t, 667, 50), BOTH));
    assert_eq!(watch.changes, [(100, Some(Both))], "in the first common flash");
    let mut slow = Watch::cyclic(200);
    slow.play(200, 0, 6000, |t| only_if(flash(t, 500, 30), BOTH));
    assert_eq!(slow.states(), [Both], "flashes of one frame each: at the second");
}

#[test]
fn both_lit_once_with_one_side_around_it_is_never_hazard() {
    let mut watch = Watch::cyclic(100);
    for round in 0..20 {
        for (step, lamps) in [LEFT, BOTH, RIGHT, DARK, RIGHT, BOTH, LEFT, DARK].into_iter().enumerate() {
            watch.frame(lamps, round * 800 + 100 * step as u64);
        }
    }
    assert!(!watch.states().contains(&Both));
}

#[test]
fn hazard_during_left_comes_and_goes_back_to_left() {
    for period in [20, 50, 100] {
        for pressed in (2000..2800).step_by(100) {
            let mut watch = Watch::cyclic(period);
            let lamps = |t| if (pressed..pressed + 4000).contains(&t) { BOTH } else { LEFT };
            watch.play(period, 0, 10_000, |t| only_if(flash(t, 800, 50), lamps(t)));
            assert_eq!(watch.states(), [Left, Both, Left], "{period} ms, {pressed}");
            let (begin, end) = (watch.changes[1].0, watch.changes[2].0);
            assert!(begin <= pressed + 400 + 2 * 100 + period, "{begin}: next common flash, confirmed");
            assert!(end <= pressed + 4000 + 400 + 2 * 100 + period, "{end}: sooner than the hold");
        }
    }
}

#[test]
fn lamps_that_change_a_frame_apart_do_not_interrupt_hazard() {
    let mut watch = Watch::cyclic(50);
    watch.play(50, 0, 6000, |t| (flash(t, 700, 50), t >= 50 && flash(t - 50, 700, 50)));
    assert_eq!(watch.states(), [Left, Both], "one frame of left before both can be told");
}

#[test]
fn emergency_flashing_is_hazard_and_a_finding() {
    for per_minute in [180, 240, 300] {
        let mut watch = Watch::cyclic(20);
        watch.play(20, 0, 3000, |t| only_if(flash(t, 60_000 / per_minute, 50), BOTH));
        assert_eq!(watch.states(), [Both], "{per_minute}/min");
        let found = LampFindings { emergency_flashing: true, ..LampFindings::default() };
        assert_eq!(watch.lamp.findings(), found, "{per_minute}/min");
        watch.play(20, 3000, 6000, |t| only_if(flash(t, 500, 50), BOTH));
        assert_eq!(watch.lamp.findings(), LampFindings::default(), "ordinary hazard after it");
    }
}

#[test]
fn emergency_flashing_is_over_with_the_hazard_it_showed_in() {
    let mut watch = Watch::cyclic(20);
    watch.play(20, 0, 2000, |t| only_if(flash(t, 250, 50), BOTH));
    assert!(watch.lamp.findings().emergency_flashing);
    watch.play(20, 2000, 4000, |_| DARK);
    assert_eq!(watch.states(), [Both, Off]);
    assert!(!watch.lamp.findings().emergency_flashing);
}

#[test]
fn emergency_flashing_with_one_lamp_a_frame_early_is_no_bulb_failure() {
    let mut watch = Watch::cyclic(20);
    watch.play(20, 0, 3000, |t| (flash(t, 250, 50), t >= 20 && flash(t - 20, 250, 50)));
    let found = LampFindings { emergency_flashing: true, ..LampFindings::default() };
    assert_eq!(watch.lamp.findings(), found);
}

#[test]
fn a_doubled_rate_on_one_side_is_a_bulb_failure_and_changes_no_state() {
    let (left, right) = (Sides { left: true, right: false }, Sides { left: false, right: true });
    for (lamps, state, broken) in [(LEFT, Left, left), (RIGHT, Right, right)] {
        for (per_minute, period) in [(150, 20), (180, 50), (180, 100), (240, 20)] {
            let mut watch = Watch::cyclic(period);
            watch.play(period, 0, 4000, |t| only_if(flash(t, 60_000 / per_minute, 50), lamps));
            assert_eq!(watch.states(), [state], "{per_minute}/min");
            assert_eq!(watch.lamp.findings().bulb_failure, broken, "{per_minute}/min");
            assert!(!watch.lamp.findings().emergency_flashing);
            watch.play(period, 4000, 14_000, |_| DARK);
            watch.play(period, 14_000, 14_300, |_| lamps);
            watch.play(period, 14_300, 16_000, |_| DARK);
            assert_eq!(watch.lamp.findings().bulb_failure, broken, "a pause is not an ordinary rate");
            watch.play(period, 16_000, 20_000, |t| only_if(flash(t, 600, 50), lamps));
            assert_eq!(watch.lamp.findings().bulb_failure, Sides::default(), "replaced");
        }
    }
}

#[test]
fn frames_too_slow_to_measure_a_fast_rate_do_not_disprove_it() {
    let mut watch = Watch::cyclic(20);
    watch.play(20, 0, 4000, |t| only_if(flash(t, 400, 50), LEFT));
    assert!(watch.lamp.findings().bulb_failure.left);
    watch.play(90, 4000, 40_000, |t| only_if(flash(t, 400, 50), LEFT));
    assert!(watch.lamp.findings().bulb_failure.left);
}

#[test]
fn flashes_seen_as_one_because_of_unknown_frames_prove_no_ordinary_rate() {
    let mut watch = Watch::cyclic(20);
    watch.play(20, 0, 4000, |t| only_if(flash(t, 320, 50), LEFT));
    assert!(watch.lamp.findings().bulb_failure.left);
    // Each second darkness hidden: what is seen looks like flashes twice as long.
    for millis in (4000..12_000).step_by(20) {
        let lit = flash(millis, 320, 50);
        let seen = (lit || millis % 640 >= 320).then_some(lit);
        watch.observe(seen, seen.map(|_| false), at(millis));
    }
    assert!(watch.lamp.findings().bulb_failure.left);
}

#[test]
fn a_lamp_that_stays_lit_is_on_and_a_finding_until_dark() {
    for sampling in [Sampling::cyclic(ms(100)), Sampling::OnChange { latency: ms(20) }] {
        let mut watch = Watch::new(LampSettings::for_message(sampling));
        if watch.lamp.settings.lit_until_changed {
            watch.frame(LEFT, 0);
            watch.wait(at(5000));
        } else {
            watch.play(100, 0, 5001, |_| LEFT);
        }
        assert_eq!(watch.changes, [(0, Some(Left))]);
        assert_eq!(watch.lamp.findings().does_not_flash, Sides { left: true, right: false });
        watch.frame(DARK, 5100);
        assert_eq!(watch.lamp.findings(), LampFindings::default());
    }
}

#[test]
fn a_message_sent_at_each_change_needs_no_frames_between() {
    for (cycle, share) in [(1000, 30), (1000, 75), (667, 50), (500, 30)] {
        for (lamps, state) in [(LEFT, Left), (BOTH, Both)] {
            let mut watch = Watch::new(LampSettings::for_message(Sampling::OnChange { latency: ms(20) }));
            for begin in (0..8000).step_by(cycle) {
                watch.frame(lamps, begin as u64);
                watch.frame(DARK, (begin + cycle * share / 100) as u64);
            }
            let last_dark = (7999 / cycle * cycle + cycle * share / 100) as u64;
            watch.wait(at(20_000));
            let begin = if state == Both { 100 } else { 0 };
            assert_eq!(watch.changes, [(begin, Some(state)), (last_dark + 740, Some(Off))]);
        }
    }
}

#[test]
fn dark_lamps_are_off_only_after_a_hold_of_watching() {
    let mut lamp = Lamp::new(LampSettings::for_message(Sampling::cyclic(ms(100))));
    assert_eq!((lamp.state(), lamp.next_deadline()), (None, None));
    lamp.observe(Some(false), Some(false), at(0));
    assert_eq!(lamp.state(), None, "may be the dark part of a flash");
    let proven = deadline_after(at(0), ms(1030));
    assert_eq!(lamp.next_deadline(), Some(proven));
    lamp.advance(proven);
    assert_eq!(lamp.state(), Some(Off));
}

#[test]
fn an_unknown_lamp_makes_the_state_unknown_and_bridges_within_the_hold() {
    for unknown in [(None, Some(false)), (Some(true), None), (None, None)] {
        let mut watch = Watch::cyclic(100);
        watch.frame(LEFT, 0);
        watch.observe(unknown.0, unknown.1, at(100));
        watch.frame(DARK, 200);
        assert_eq!(watch.changes, [(0, Some(Left)), (100, None), (200, Some(Left))]);
        watch.wait(at(5000));
        assert_eq!(watch.changes[3..], [(1030, None), (1230, Some(Off))], "off needs a hold of watching");
    }
}

#[test]
fn a_clock_that_jumps_back_counts_as_standing_still() {
    let mut watch = Watch::cyclic(100);
    watch.frame(LEFT, 500);
    watch.lamp.observe(Some(true), Some(false), MonoTime::ZERO);
    assert_eq!(watch.lamp.next_deadline(), Some(deadline_after(at(500), ms(1030))));
}
