//! Runs the scan on recorded and random answers of the kernel and the bus.

#![allow(clippy::wildcard_enum_match_arm)] // a step that a test does not mention succeeds

use proptest::prelude::*;

use super::*;
use crate::can::interface_state::{BitTiming, ControllerSettings};

const LISTEN: Duration = Duration::from_secs(1);
const EPERM: i32 = 1;
const EBUSY: i32 = 16;
const EINVAL: i32 = 22;

/// A controller that is down, as `ip -details link` shows a PEAK PCAN-USB after it has been plugged in and
/// configured once.
fn can0() -> InterfaceState {
    let all = ControllerModes { listen_only: true, loopback: true, error_reporting: true, fd: false };
    let controller = ControllerSettings {
        bit_timing: Some(BitTiming { bitrate_bps: 250_000, sample_point_permille: 875 }),
        supported: Some(all),
        ..ControllerSettings::default()
    };
    InterfaceState {
        name: "can0".to_owned(),
        kind: InterfaceKind::Can,
        is_up: false,
        transmit_queue: Some(10),
        controller: Some(controller),
    }
}

/// The kernel's side of a scan: the state of the interface and the outcome of each step.
struct Kernel {
    is_up: bool,
    is_listen_only: bool,
    rate: u32,
    is_original: bool,
    steps: usize,
}

impl Kernel {
    /// Carries out a step unless `errno` is given, and checks that the step is permitted.
    fn carry_out(&mut self, step: ScanStep, errno: Option<i32>) {
        self.steps += 1;
        assert!(self.steps <= 4 * USUAL_BITRATES.len() + 2, "the scan is bounded");
        match step {
            ScanStep::Configure(settings) => {
                assert!(!self.is_up, "the bit rate of an interface that is up is not changed");
                if errno.is_none() {
                    (self.is_listen_only, self.rate, self.is_original) = (true, settings.bitrate_bps, false);
                }
            }
            ScanStep::BringUp => {
                assert!(self.is_listen_only, "nothing comes up that could send");
                self.is_up = errno.is_none();
            }
            ScanStep::Listen(time) => assert!(self.is_up && time == LISTEN),
            ScanStep::BringDown => self.is_up &= errno.is_some(),
            ScanStep::Restore => self.is_original |= errno.is_none() && !self.is_up,
            ScanStep::Finish => {}
        }
    }
}

/// Runs a scan; `answers` returns the outcome of each step at a rate.
fn run(mut answers: impl FnMut(ScanStep, u32) -> ScanAnswer) -> (ScanResult, Kernel) {
    let mut scan = BitRateScan::new(&can0(), LISTEN).unwrap();
    let mut kernel =
        Kernel { is_up: false, is_listen_only: false, rate: 250_000, is_original: true, steps: 0 };
    let mut step = scan.start();
    while step != ScanStep::Finish {
        let rate = if let ScanStep::Configure(settings) = step { settings.bitrate_bps } else { kernel.rate };
        let answer = answers(step, rate);
        let errno = if let ScanAnswer::Refused(errno) = answer { Some(errno) } else { None };
        kernel.carry_out(step, errno);
        step = scan.answer(answer);
    }
    (scan.result(), kernel)
}

/// A bus with this rate: `frames` frames at it, `errors` error frames at every other rate.
fn bus(rate: u32, frames: u64, errors: u64) -> impl FnMut(ScanStep, u32) -> ScanAnswer {
    move |step, tried| match step {
        ScanStep::Listen(_) if tried == rate => ScanAnswer::Heard(Heard { frames, error_frames: 0 }),
        ScanStep::Listen(_) => ScanAnswer::Heard(Heard { frames: 0, error_frames: errors }),
        _ => ScanAnswer::Done,
    }
}

#[test]
fn rate_of_the_bus_is_found_and_ends_the_scan() {
    for rate in USUAL_BITRATES {
        for errors in [0, 40] {
            let (result, kernel) = run(bus(rate, 100, errors));
            assert_eq!(result.verdict, ScanVerdict::Found(rate));
            assert_eq!(result.tried.last().unwrap().bitrate_bps, rate);
            assert!(kernel.is_original && !kernel.is_up && result.not_restored.is_none());
        }
    }
}

#[test]
fn few_frames_are_enough_when_they_come_at_one_rate_alone() {
    let (result, _) = run(bus(125_000, 2, 3));
    assert_eq!((result.verdict, result.tried.len()), (ScanVerdict::Found(125_000), USUAL_BITRATES.len()));
}

#[test]
fn silent_bus_differs_from_one_that_fits_no_rate() {
    assert_eq!(run(bus(0, 0, 0)).0.verdict, ScanVerdict::Silent);
    assert_eq!(run(bus(0, 0, 9)).0.verdict, ScanVerdict::NoRate);
}

#[test]
fn rate_among_errors_is_only_likely() {
    let (result, _) = run(|step, rate| match step {
        ScanStep::Listen(_) if rate == 50_000 => ScanAnswer::Heard(Heard { frames: 3, error_frames: 90 }),
        ScanStep::Listen(_) => ScanAnswer::Heard(Heard { frames: 0, error_frames: 9 }),
        _ => ScanAnswer::Done,
    });
    assert_eq!(result.verdict, ScanVerdict::Likely(50_000));
}

#[test]
fn rate_that_the_driver_refuses_is_left_out() {
    let mut slow_bus = bus(33_333, 50, 0);
    let (result, kernel) = run(|step, rate| match step {
        ScanStep::Configure(_) if [83_333, 1_000_000].contains(&rate) => ScanAnswer::Refused(EINVAL),
        ScanStep::BringUp if rate == 500_000 => ScanAnswer::Refused(EINVAL),
        _ => slow_bus(step, rate),
    });
    assert_eq!(result.verdict, ScanVerdict::Found(33_333));
    let refused = result.tried.iter().filter(|tried| tried.heard.is_err()).map(|tried| tried.bitrate_bps);
    assert_eq!(refused.collect::<Vec<_>>(), [500_000, 1_000_000, 83_333]);
    assert!(kernel.is_original);
}

#[test]
fn nothing_is_changed_without_the_right_to_do_so() {
    let (result, kernel) = run(|_, _| ScanAnswer::Refused(EPERM));
    assert_eq!((result.verdict, kernel.steps, kernel.is_original), (ScanVerdict::Refused(EPERM), 1, true));
}

#[test]
fn interface_that_stays_up_is_reported() {
    let (result, kernel) = run(|step, _| match step {
        ScanStep::BringDown | ScanStep::Restore => ScanAnswer::Refused(EBUSY),
        ScanStep::Listen(_) => ScanAnswer::Heard(Heard::default()),
        _ => ScanAnswer::Done,
    });
    assert_eq!((result.not_restored, kernel.is_up), (Some(EBUSY), true));
}

#[test]
fn interface_is_refused_unless_it_is_a_controller_that_is_down_and_can_only_listen() {
    let refused = |change: fn(&mut InterfaceState)| {
        let mut interface = can0();
        change(&mut interface);
        BitRateScan::new(&interface, LISTEN).err()
    };
    assert_eq!(refused(|_| ()), None);
    assert_eq!(refused(|can| can.kind = InterfaceKind::Missing), Some(ScanRefusal::Missing));
    assert_eq!(refused(|can| can.kind = InterfaceKind::NotCan), Some(ScanRefusal::NotCan));
    assert_eq!(refused(|can| can.controller = None), Some(ScanRefusal::Virtual));
    assert_eq!(refused(|can| can.is_up = true), Some(ScanRefusal::Up));
    let no_mode = |can: &mut InterfaceState| {
        can.controller.as_mut().unwrap().supported = Some(ControllerModes::default());
    };
    assert_eq!(refused(no_mode), Some(ScanRefusal::NoListenOnly));
    let older_kernel = |can: &mut InterfaceState| can.controller.as_mut().unwrap().supported = None;
    assert_eq!(refused(older_kernel), None);
}

fn any_answer() -> impl Strategy<Value = ScanAnswer> {
    let heard = (0..8_u64, 0..8_u64)
        .prop_map(|(frames, error_frames)| ScanAnswer::Heard(Heard { frames, error_frames }));
    prop_oneof![
        6 => Just(ScanAnswer::Done),
        6 => heard,
        2 => prop_oneof![Just(EPERM), Just(EBUSY), Just(EINVAL)].prop_map(ScanAnswer::Refused),
        1 => Just(ScanAnswer::Interrupted),
    ]
}

proptest! {
    /// Whatever the kernel answers and whenever the user ends it, the interface is left down and as it was,
    /// or the result says that it is not. [`Kernel`] also asserts the bound, and that nothing comes up that
    /// could send.
    #[test]
    fn interface_is_left_as_it_was_after_any_answers(answers in prop::collection::vec(any_answer(), 60)) {
        let mut next = answers.into_iter();
        let mut heard = Vec::new();
        let mut is_interrupted = false;
        let (result, kernel) = run(|step, rate| {
            prop_assert_after_interruption(is_interrupted, step);
            let answer = next.next().unwrap();
            is_interrupted |= answer == ScanAnswer::Interrupted;
            if let (ScanStep::Listen(_), ScanAnswer::Heard(counts)) = (step, answer) {
                heard.push((rate, counts));
            }
            answer
        });
        prop_assert!(kernel.is_original && !kernel.is_up || result.not_restored.is_some());
        if let ScanVerdict::Found(rate) | ScanVerdict::Likely(rate) = result.verdict {
            prop_assert!(heard.iter().any(|(tried, counts)| *tried == rate && counts.frames > 0));
        } else {
            prop_assert!(heard.iter().all(|(_, counts)| counts.frames == 0));
        }
    }
}

/// Checks that no other rate is tried after an interruption.
fn prop_assert_after_interruption(is_interrupted: bool, step: ScanStep) {
    let tries = matches!(step, ScanStep::Configure(_) | ScanStep::BringUp | ScanStep::Listen(_));
    assert!(!(is_interrupted && tries), "{step:?} after the user wanted an end");
}
