use super::checksum::{Crc8, Rule};
use super::e2e::{DataIdMode, Profile};
use super::window::Limits;
use super::*;
use crate::core::can::frame::CanId;
use crate::core::dbc::codec::{ByteOrder, Layout, SignalCodec};
use proptest::prelude::*;

const ID: CanId = CanId::Standard(0x318);

fn signal(start: u16, length: u16) -> SignalCodec {
    SignalCodec::new(Layout { start, length, order: ByteOrder::Intel, signed: false }, 8).unwrap()
}

/// J1850 in the last byte of eight, a counter of four bits in the high half of the one before.
fn fca() -> MessageIntegrity {
    let checksum = Checksum::new(Rule::Crc8(Crc8::j1850()), signal(56, 8)).unwrap();
    let rule = CounterRule::new(0, 15).unwrap().with_max_step(2).unwrap();
    let counter = Counter::new(rule, signal(52, 4)).unwrap();
    MessageIntegrity {
        length: Some(8),
        protection: Protection::Fields { checksum: Some(checksum), counter: Some(counter) },
        window: None,
        forget_after: Some(Duration::from_millis(500)),
    }
}

fn window() -> Window {
    let limits = |size, min_ok, max_error| Limits { size, min_ok, max_error };
    Window::new(limits(2, 2, 0), limits(4, 1, 1), limits(3, 3, 0), false).unwrap()
}

fn frame(data: &[u8]) -> Frame {
    Frame::classic(ID, data).unwrap()
}

fn sealed(counter: u8, turn: u8) -> [u8; 8] {
    let mut data = [turn, 0, 0, 0, 0, 0, counter << 4, 0];
    assert!(Checksum::new(Rule::Crc8(Crc8::j1850()), signal(56, 8)).unwrap().protect(ID, &mut data));
    data
}

/// A guard and its clock; frames come every 100 ms.
struct Desk {
    checker: IntegrityChecker,
    now: MonoTime,
}

impl Desk {
    fn new(rules: MessageIntegrity) -> Self {
        Self { checker: IntegrityChecker::new(rules), now: MonoTime::ZERO }
    }

    fn take(&mut self, data: &[u8]) -> IntegrityVerdict {
        self.now = self.now.after(Duration::from_millis(100));
        self.checker.check(&frame(data), self.now)
    }

    fn counters(&mut self, counters: &[u8]) -> Vec<IntegrityVerdict> {
        counters.iter().map(|counter| self.take(&sealed(*counter, 1))).collect()
    }
}

use IntegrityVerdict::{Rejected, Trusted};
use Reject::{Initial, NotValid, Repeated, Syncing, WrongChecksum, WrongLength, WrongSequence};

#[test]
fn a_frame_is_trusted_after_the_first_and_only_when_all_is_right() {
    let mut desk = Desk::new(fca());
    let told = desk.counters(&[3, 4, 4, 6, 12, 13, 14]);
    let wrong = Rejected(WrongSequence { from: 6, to: 12 });
    assert_eq!(
        told,
        [Rejected(Initial), Trusted, Rejected(Repeated), Trusted, wrong, Rejected(Syncing(0)), Trusted]
    );
    let mut damaged = sealed(15, 1);
    damaged[0] ^= 2;
    assert!(
        matches!(desk.take(&damaged), Rejected(WrongChecksum { stored, expected }) if stored != expected)
    );
    assert_eq!(desk.take(&[1; 7]), Rejected(WrongLength(7)));
    assert_eq!(desk.counters(&[0]), [Trusted], "what is not whole does not move the counter");
    let counts = IntegrityCounts {
        trusted: 4,
        lost: 2,
        wrong_length: 1,
        wrong_checksum: 1,
        initial: 1,
        repeated: 1,
        wrong_sequence: 1,
        syncing: 1,
        ..IntegrityCounts::default()
    };
    assert_eq!((desk.checker.counts(), desk.checker.counts().rejected()), (counts, 6));
}

#[test]
fn after_a_silence_everything_starts_anew() {
    let mut desk = Desk::new(fca());
    desk.counters(&[3, 4]);
    desk.now = desk.now.after(Duration::from_millis(400));
    assert_eq!(desk.counters(&[5]), [Trusted], "500 ms is the limit");
    desk.now = desk.now.after(Duration::from_millis(401));
    assert_eq!(desk.counters(&[6, 7]), [Rejected(Initial), Trusted]);
    // Damaged frames are not a sign of life.
    for _ in 0..6 {
        desk.take(&[0; 8]);
    }
    assert_eq!(desk.counters(&[8, 9]), [Rejected(Initial), Trusted]);
    desk.checker.forget();
    assert_eq!(desk.counters(&[10, 11]), [Rejected(Initial), Trusted]);
}

#[test]
fn a_window_wants_more_than_one_good_frame() {
    let mut desk = Desk::new(MessageIntegrity { window: Some(window()), ..fca() });
    let not_valid = |phase| Rejected(NotValid(phase));
    assert_eq!(desk.checker.phase(), Some(E2eState::NoData));
    assert_eq!(
        desk.counters(&[1, 2, 3, 4]),
        [Rejected(Initial), not_valid(E2eState::Init), Trusted, Trusted]
    );
    desk.take(&[0; 8]);
    assert_eq!(desk.counters(&[5]), [Trusted], "one error is tolerated");
    desk.take(&[0; 8]);
    desk.take(&[0; 8]);
    assert_eq!(desk.checker.phase(), Some(E2eState::Invalid));
    let invalid = not_valid(E2eState::Invalid);
    assert_eq!(desk.counters(&[6, 7, 8]), [invalid, invalid, Trusted]);
}

#[test]
fn frames_that_do_not_come_count_when_told() {
    let mut desk = Desk::new(MessageIntegrity { window: Some(window()), ..fca() });
    desk.counters(&[1, 2, 3]);
    for _ in 0..4 {
        desk.checker.no_new_data();
    }
    assert_eq!(desk.checker.phase(), Some(E2eState::Invalid));
    let mut desk = Desk::new(fca());
    desk.counters(&[1, 2]);
    desk.checker.no_new_data();
    desk.checker.no_new_data();
    assert_eq!((desk.counters(&[3]), desk.checker.phase()), (vec![Rejected(Syncing(0))], None));
}

#[test]
fn a_checksum_alone_is_enough_to_be_trusted_when_there_is_no_counter() {
    let Protection::Fields { checksum, .. } = fca().protection else { unreachable!() };
    let protection = Protection::Fields { checksum, counter: None };
    let mut desk = Desk::new(MessageIntegrity { protection, length: None, ..fca() });
    assert_eq!(desk.counters(&[3, 3]), [Trusted, Trusted]);
    assert_eq!(desk.take(&[0; 7]), Rejected(WrongLength(7)), "no checksum in it");
}

#[test]
fn a_profile_brings_its_own_counter_and_identity() {
    let profile = |data_id| {
        let profile = Profile::P01 { data_id, mode: DataIdMode::Nibble };
        E2e::new(profile, 0, 8).unwrap()
    };
    let rules = |e2e| MessageIntegrity { protection: Protection::e2e(e2e, 1).unwrap(), ..fca() };
    let mut desk = Desk::new(rules(profile(0x123)));
    let protected = |data_id, counter| {
        let mut data = [0; 8];
        assert!(profile(data_id).protect(counter, &mut data));
        data
    };
    assert_eq!(
        [13, 14, 0].map(|counter| desk.take(&protected(0x123, counter))),
        [Rejected(Initial), Trusted, Trusted]
    );
    assert_eq!(desk.take(&protected(0x123, 15)), Rejected(Reject::CounterOutOfRange(15)));
    let stranger = Reject::WrongDataId { stored: 4, expected: 1 };
    assert_eq!(desk.take(&protected(0x423, 1)), Rejected(stranger));
    assert_eq!(desk.take(&protected(0x123, 1)), Trusted);
    assert!(Protection::e2e(profile(0x123), 15).is_err(), "a step of 15 is none of 15 values");
}

proptest! {
    #[test]
    fn any_frames_are_judged_without_a_panic_and_each_is_counted(
        frames in prop::collection::vec((prop::collection::vec(any::<u8>(), 0..=8), any::<u64>(), any::<u8>()), 0..50),
    ) {
        let e2e = E2e::new(Profile::P05 { data_id: 1 }, 1, 6).unwrap();
        let profile = MessageIntegrity { protection: Protection::e2e(e2e, 3).unwrap(), length: None, window: Some(window()), forget_after: None };
        for rules in [fca(), MessageIntegrity { window: Some(window()), length: None, ..fca() }, profile] {
            let mut checker = IntegrityChecker::new(rules);
            for (data, at, counter) in &frames {
                let good = sealed(*counter, 1);
                let data = if counter % 2 == 0 { data.as_slice() } else { &good };
                let before = checker.counts().trusted;
                let trusted = checker.check(&frame(data), MonoTime::from_nanos(*at)) == Trusted;
                prop_assert_eq!(checker.counts().trusted - before, u64::from(trusted));
            }
            prop_assert_eq!(checker.counts().trusted + checker.counts().rejected(), frames.len() as u64);
        }
    }
}
