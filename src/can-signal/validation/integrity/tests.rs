use super::checksum::{ChecksumRule, CrcRule};
use super::e2e::{DataIdMode, E2eProfile};
use super::window::WindowLimits;
use super::*;
use crate::can::CanId;
use crate::dbc::codec::{Layout, SignalCodec};
use proptest::prelude::*;

const ID: CanId = CanId::Standard(0x318);

fn signal(start: u16, length: u16) -> SignalCodec {
    SignalCodec::new(Layout::unsigned(start, length), 8).unwrap()
}

/// J1850 in the last of eight bytes, and a four-bit counter in the high half of the byte before it.
fn fca() -> MessageIntegrity {
    let checksum = Checksum::new(ChecksumRule::Crc(CrcRule::j1850()), signal(56, 8)).unwrap();
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
    let limits = |size, min_ok, max_error| WindowLimits { size, min_ok, max_error };
    Window::new(limits(2, 2, 0), limits(4, 1, 1), limits(3, 3, 0), false).unwrap()
}

fn frame(data: &[u8]) -> Frame {
    Frame::classic(ID, data).unwrap()
}

fn protected_frame(counter: u8, turn: u8) -> [u8; 8] {
    let mut data = [turn, 0, 0, 0, 0, 0, counter << 4, 0];
    assert!(
        Checksum::new(ChecksumRule::Crc(CrcRule::j1850()), signal(56, 8)).unwrap().protect(ID, &mut data)
    );
    data
}

/// A checker with its clock; frames arrive every 100 ms.
struct Receiver {
    checker: IntegrityChecker,
    now: MonoTime,
}

impl Receiver {
    fn new(rules: MessageIntegrity) -> Self {
        Self { checker: IntegrityChecker::new(rules), now: MonoTime::ZERO }
    }

    fn receive(&mut self, data: &[u8]) -> Result<(), Reject> {
        self.now = self.now.after(Duration::from_millis(100));
        self.checker.check(&frame(data), self.now)
    }

    fn counters(&mut self, counters: &[u8]) -> Vec<Result<(), Reject>> {
        counters.iter().map(|counter| self.receive(&protected_frame(*counter, 1))).collect()
    }
}

use Reject::{Initial, NotValid, Repeated, Syncing, WrongChecksum, WrongLength, WrongSequence};

#[test]
fn frame_is_trusted_when_checksum_and_counter_are_right() {
    let mut receiver = Receiver::new(fca());
    let verdicts = receiver.counters(&[3, 4, 4, 6, 12, 13, 14]);
    let wrong = Err(WrongSequence { from: 6, to: 12 });
    assert_eq!(verdicts, [Err(Initial), Ok(()), Err(Repeated), Ok(()), wrong, Err(Syncing(0)), Ok(())]);
    let mut damaged = protected_frame(15, 1);
    damaged[0] ^= 2;
    assert!(
        matches!(receiver.receive(&damaged), Err(WrongChecksum { stored, expected }) if stored != expected)
    );
    assert_eq!(receiver.receive(&[1; 7]), Err(WrongLength(7)));
    assert_eq!(receiver.counters(&[0]), [Ok(())], "a damaged frame leaves the counter unchanged");
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
    assert_eq!((receiver.checker.counts(), receiver.checker.counts().rejected()), (counts, 6));
}

#[test]
fn silence_resets_checker() {
    let mut receiver = Receiver::new(fca());
    receiver.counters(&[3, 4]);
    receiver.now = receiver.now.after(Duration::from_millis(400));
    assert_eq!(receiver.counters(&[5]), [Ok(())], "500 ms is the limit");
    receiver.now = receiver.now.after(Duration::from_millis(401));
    let from_start = [Err(Initial), Err(Syncing(0)), Ok(())];
    assert_eq!(receiver.counters(&[6, 7, 8]), from_start);
    // Damaged frames do not end a silence.
    for _ in 0..6 {
        assert!(receiver.receive(&[0; 8]).is_err());
    }
    assert_eq!(receiver.counters(&[9, 10, 11]), from_start);
    receiver.checker.forget();
    assert_eq!(receiver.counters(&[12, 13, 14]), from_start);
}

#[test]
fn a_longer_gap_is_not_trusted_sooner() {
    let Protection::Fields { checksum, counter: Some(counter) } = fca().protection else { unreachable!() };
    let mut rule = *counter.rule();
    rule.sync_after = 5;
    let counter = Counter::new(rule, counter.signal().clone()).unwrap();
    let protection = Protection::Fields { checksum, counter: Some(counter) };
    for gap_ms in [400, 501] {
        let mut receiver = Receiver::new(MessageIntegrity { protection: protection.clone(), ..fca() });
        receiver.counters(&[3, 4]);
        receiver.now = receiver.now.after(Duration::from_millis(gap_ms - 100));
        let verdicts = receiver.counters(&[9, 10, 11, 12, 13, 14, 15, 0]);
        let trusted = verdicts.iter().position(|verdict| *verdict == Ok(()));
        assert_eq!(trusted, Some(6), "frame 7 after {gap_ms} ms: {verdicts:?}");
    }
}

#[test]
fn window_requires_several_good_frames() {
    let mut receiver = Receiver::new(MessageIntegrity { window: Some(window()), ..fca() });
    let not_valid = |state| Err(NotValid(state));
    assert_eq!(receiver.checker.e2e_state(), Some(E2eState::NoData));
    assert_eq!(receiver.counters(&[1, 2, 3, 4]), [Err(Initial), not_valid(E2eState::Init), Ok(()), Ok(())]);
    assert!(receiver.receive(&[0; 8]).is_err());
    assert_eq!(receiver.counters(&[5]), [Ok(())], "one error is tolerated");
    assert!(receiver.receive(&[0; 8]).is_err());
    assert!(receiver.receive(&[0; 8]).is_err());
    assert_eq!(receiver.checker.e2e_state(), Some(E2eState::Invalid));
    let invalid = not_valid(E2eState::Invalid);
    assert_eq!(receiver.counters(&[6, 7, 8]), [invalid, invalid, Ok(())]);
}

#[test]
fn checksum_without_counter_is_sufficient() {
    let Protection::Fields { checksum, .. } = fca().protection else { unreachable!() };
    let protection = Protection::Fields { checksum, counter: None };
    let mut receiver = Receiver::new(MessageIntegrity { protection, length: None, ..fca() });
    assert_eq!(receiver.counters(&[3, 3]), [Ok(()), Ok(())]);
    assert_eq!(receiver.receive(&[0; 7]), Err(WrongLength(7)), "no checksum in it");
}

#[test]
fn e2e_profile_checks_counter_and_data_id() {
    let profile = |data_id| {
        let profile = E2eProfile::P01 { data_id, mode: DataIdMode::Nibble };
        E2e::new(profile, 0, 8).unwrap()
    };
    let rules = |e2e| MessageIntegrity { protection: Protection::e2e(e2e, 1).unwrap(), ..fca() };
    let mut receiver = Receiver::new(rules(profile(0x123)));
    let protected = |data_id, counter| {
        let mut data = [0; 8];
        assert!(profile(data_id).protect(counter, &mut data));
        data
    };
    assert_eq!(
        [13, 14, 0].map(|counter| receiver.receive(&protected(0x123, counter))),
        [Err(Initial), Ok(()), Ok(())]
    );
    assert_eq!(receiver.receive(&protected(0x123, 15)), Err(Reject::CounterOutOfRange(15)));
    let other_message = Reject::WrongDataId { stored: 4, expected: 1 };
    assert_eq!(receiver.receive(&protected(0x423, 1)), Err(other_message));
    assert_eq!(receiver.receive(&protected(0x123, 1)), Ok(()));
    assert!(Protection::e2e(profile(0x123), 15).is_err(), "a step of 15 would be a repetition");
}

proptest! {
    #[test]
    fn any_frames_are_checked_without_panic_and_counted(
        frames in prop::collection::vec((prop::collection::vec(any::<u8>(), 0..=8), any::<u64>(), any::<u8>()), 0..50),
    ) {
        let e2e = E2e::new(E2eProfile::P05 { data_id: 1 }, 1, 6).unwrap();
        let profile = MessageIntegrity { protection: Protection::e2e(e2e, 3).unwrap(), length: None, window: Some(window()), forget_after: None };
        for rules in [fca(), MessageIntegrity { window: Some(window()), length: None, ..fca() }, profile] {
            let mut checker = IntegrityChecker::new(rules);
            for (data, at, counter) in &frames {
                let good = protected_frame(*counter, 1);
                let data = if counter % 2 == 0 { data.as_slice() } else { &good };
                let before = checker.counts().trusted;
                let trusted = checker.check(&frame(data), MonoTime::from_nanos(*at)) == Ok(());
                prop_assert_eq!(checker.counts().trusted - before, u64::from(trusted));
            }
            prop_assert_eq!(checker.counts().trusted + checker.counts().rejected(), frames.len() as u64);
        }
    }
}

#[test]
fn rules_and_rejections_are_texts_with_their_numbers() {
    let rules = "a length of 8 bytes and a CRC of 8 bits and a counter of 0 to 15 in steps of at most 2";
    assert_eq!(fca().to_string(), rules);
    for (reject, text) in [
        (WrongLength(7), "wrong length: 7 bytes"),
        (WrongChecksum { stored: 0xA, expected: 0x1F }, "wrong checksum: 0xA, not 0x1F"),
        (Reject::WrongDataId { stored: 1, expected: 0x20 }, "wrong data ID: 0x1, not 0x20"),
        (Reject::CounterOutOfRange(16), "counter out of range: 16"),
        (Initial, "first frame, no counter before it"),
        (Repeated, "repeated counter"),
        (WrongSequence { from: 3, to: 1 }, "counter out of sequence: 1 after 3"),
        (Syncing(2), "counter not in sequence for long enough: 2 more needed"),
    ] {
        assert_eq!(reject.to_string(), text);
    }
}

#[test]
fn a_frame_that_ends_before_its_counter_has_the_wrong_length() {
    let counter = Counter::new(CounterRule::new(0, 15).unwrap(), signal(52, 4)).unwrap();
    let protection = Protection::Fields { checksum: None, counter: Some(counter) };
    let rules = MessageIntegrity { length: None, protection, window: None, forget_after: None };
    let mut checker = IntegrityChecker::new(rules);
    let mut verdict = |length| checker.check(&frame(&[0; 8][..length]), MonoTime::ZERO);
    assert_eq!(verdict(6), Err(WrongLength(6)));
    assert_eq!(verdict(7), Err(Initial));
}
