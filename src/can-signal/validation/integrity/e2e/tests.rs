use super::*;
use crate::can::CanId;
use autosar_e2e::{E2EProfile, E2EStatus, profile4, profile5, profile6, profile7, profile11, profile22};
use proptest::prelude::*;

const LIST: [u8; 16] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16];

fn profile_1(data_id: u16, mode: DataIdMode) -> E2eProfile {
    E2eProfile::P01 { data_id, mode }
}

fn all() -> [E2eProfile; 9] {
    [
        profile_1(0x8123, DataIdMode::Both),
        profile_1(0x8123, DataIdMode::Alternating),
        profile_1(0x8123, DataIdMode::Low),
        profile_1(0x0123, DataIdMode::Nibble),
        E2eProfile::P02 { data_ids: LIST },
        E2eProfile::P04 { data_id: 0x0A0B_0C0D },
        E2eProfile::P05 { data_id: 0x1234 },
        E2eProfile::P06 { data_id: 0x1234 },
        E2eProfile::P07 { data_id: 0x0A0B_0C0D },
    ]
}

fn e2e(profile: E2eProfile, offset: usize, length: usize) -> E2e {
    E2e::new(profile, offset, length).unwrap()
}

fn frame(data: &[u8]) -> Frame {
    Frame::fd(CanId::Standard(1), data).unwrap()
}

fn protected(e2e: &E2e, counter: u32) -> Vec<u8> {
    let mut data = vec![0; e2e.length];
    assert!(e2e.protect(counter, &mut data));
    data
}

#[test]
fn published_examples_are_reproduced() {
    let starts = |profile, counter, bytes: &[u8]| {
        let data = protected(&e2e(profile, 0, 8), counter);
        assert!(data.starts_with(bytes), "{profile:?}, {counter}: {data:02X?}");
    };
    starts(profile_1(0x123, DataIdMode::Both), 0, &[0xCC, 0x00]);
    starts(profile_1(0x123, DataIdMode::Both), 1, &[0x91, 0x01]);
    starts(profile_1(0x123, DataIdMode::Nibble), 0, &[0x2A, 0x10]);
    starts(profile_1(0x123, DataIdMode::Nibble), 1, &[0x77, 0x11]);
    starts(E2eProfile::P05 { data_id: 0x1234 }, 0, &[0x1C, 0xCA, 0x00]);
    starts(E2eProfile::P02 { data_ids: LIST }, 1, &[0x1B, 0x01]);
    starts(E2eProfile::P06 { data_id: 0x1234 }, 0, &[0xB1, 0x55, 0x00, 0x08, 0x00]);
}

proptest! {
    #[test]
    fn protected_frame_passes_check_and_returns_counter(
        bytes in prop::collection::vec(any::<u8>(), 64), counter in any::<u32>(), offset in 0_usize..40,
    ) {
        for profile in all() {
            let e2e = e2e(profile, offset, 64);
            let counter = counter & (u32::MAX >> e2e.counter_range().1.leading_zeros());
            let mut data = bytes.clone();
            prop_assert!(e2e.protect(counter, &mut data));
            prop_assert_eq!(e2e.check(&frame(&data)), Ok(counter), "{:?}", profile);
            let header = offset..offset + profile.header().bytes;
            prop_assert!((0..64).filter(|at| !header.contains(at)).all(|at| data[at] == bytes[at]));
        }
    }

    #[test]
    fn any_changed_bit_fails_check(
        bytes in prop::collection::vec(any::<u8>(), 24), counter in 0_u32..15, bit in 0_usize..24 * 8,
    ) {
        for profile in all() {
            let e2e = e2e(profile, 0, 24);
            // Another counter selects another Data ID, which the CRC alone does not reveal.
            let counter_picks = matches!(profile, E2eProfile::P02 { .. } | E2eProfile::P01 { mode: DataIdMode::Alternating, .. });
            let mut data = bytes.clone();
            e2e.protect(counter, &mut data);
            data[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(
                e2e.check(&frame(&data)).is_err() || (counter_picks && (8..12).contains(&bit)),
                "{:?}, bit {}", profile, bit
            );
        }
    }

    #[test]
    fn any_frame_is_checked_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..=8), offset in 0_usize..70, length in 0_usize..70) {
        for profile in all() {
            let fits = length <= 64 && offset + profile.header().bytes <= length;
            let made = E2e::new(profile, offset, length);
            prop_assert_eq!(made.is_ok(), fits);
            if let Ok(e2e) = made {
                let judged = e2e.check(&frame(&bytes));
                prop_assert!(bytes.len() == length || judged == Err(Reject::WrongLength(bytes.len())));
            }
        }
    }

    #[test]
    fn results_agree_with_autosar_e2e(bytes in prop::collection::vec(any::<u8>(), 32), frames in 1_usize..40) {
        peer(profile_1(0x123, DataIdMode::Both), &bytes, frames, profile11::Profile11::new(profile11::Profile11Config {
            mode: profile11::Profile11IdMode::Both, data_id: 0x123, data_length: 192, ..Default::default()
        }).unwrap(), 24);
        peer(profile_1(0x123, DataIdMode::Nibble), &bytes, frames, profile11::Profile11::new(profile11::Profile11Config {
            mode: profile11::Profile11IdMode::Nibble, data_id: 0x123, data_length: 192, ..Default::default()
        }).unwrap(), 24);
        peer(E2eProfile::P02 { data_ids: LIST }, &bytes, frames, profile22::Profile22::new(profile22::Profile22Config {
            data_id_list: LIST, data_length: 256, ..Default::default()
        }).unwrap(), 32);
        peer(E2eProfile::P04 { data_id: 0x0A0B_0C0D }, &bytes, frames, profile4::Profile4::new(profile4::Profile4Config::default()).unwrap(), 32);
        peer(E2eProfile::P05 { data_id: 0x1234 }, &bytes, frames, profile5::Profile5::new(profile5::Profile5Config {
            data_length: 256, ..Default::default()
        }).unwrap(), 32);
        peer(E2eProfile::P06 { data_id: 0x1234 }, &bytes, frames, profile6::Profile6::new(profile6::Profile6Config::default()).unwrap(), 32);
        peer(E2eProfile::P07 { data_id: 0x0A0B_0C0D }, &bytes, frames, profile7::Profile7::new(profile7::Profile7Config::default()).unwrap(), 32);
    }
}

/// Protects frames with both implementations, compares them byte for byte, and checks each frame with the
/// other implementation.
fn peer<P: E2EProfile + Clone>(
    profile: E2eProfile,
    bytes: &[u8],
    frames: usize,
    mut sender: P,
    length: usize,
) {
    let mut receiver = sender.clone();
    let ours = E2e::new(profile, 0, length).unwrap();
    let mut last = None;
    for _ in 0..frames {
        let mut theirs = bytes[..length].to_vec();
        sender.protect(&mut theirs).unwrap();
        let counter = read(&theirs, &ours.profile.header().counter);
        let mut mine = bytes[..length].to_vec();
        assert!(ours.protect(counter, &mut mine));
        assert_eq!(mine, theirs, "{profile:?}");
        assert_eq!(ours.check(&frame(&theirs)), Ok(counter), "{profile:?}");
        let expected = if last == Some(counter) { E2EStatus::Repeated } else { E2EStatus::Ok };
        assert_eq!(receiver.check(&mine).unwrap(), expected, "{profile:?}");
        last = Some(counter);
    }
}

#[test]
fn profile_1b_alternates_data_id_byte_with_counter() {
    // The low-byte mode with the byte that the counter selects gives the same frame.
    let [low, alternating] = [DataIdMode::Low, DataIdMode::Alternating];
    for counter in 0..15 {
        let of = |data_id, mode| protected(&e2e(profile_1(data_id, mode), 0, 8), counter);
        let picked = if counter % 2 == 0 { 0x23 } else { 0x81 };
        assert_eq!(of(0x8123, alternating), of(picked, low), "{counter}");
        assert_ne!(of(0x8123, alternating), of(picked ^ 1, low), "{counter}");
    }
}

#[test]
fn header_of_other_message_is_reported_by_field() {
    let mine = e2e(E2eProfile::P04 { data_id: 1 }, 0, 16);
    let other = protected(&e2e(E2eProfile::P04 { data_id: 2 }, 0, 16), 7);
    assert_eq!(mine.check(&frame(&other)), Err(Reject::WrongDataId { stored: 2, expected: 1 }));
    // A shorter message with padding: its CRC does not cover the padding.
    let mut longer = protected(&e2e(E2eProfile::P04 { data_id: 1 }, 0, 12), 7);
    longer.extend([0; 4]);
    assert!(matches!(mine.check(&frame(&longer)), Err(Reject::WrongChecksum { .. })));
    // A wrong length field under a CRC that covers it.
    for profile in
        [E2eProfile::P04 { data_id: 1 }, E2eProfile::P06 { data_id: 1 }, E2eProfile::P07 { data_id: 1 }]
    {
        let mine = e2e(profile, 0, 24);
        let mut data = vec![0; 24];
        mine.write_header(7, 23, &mut data);
        profile.header().write_crc(mine.crc(&data), &mut data);
        assert_eq!(mine.check(&frame(&data)), Err(Reject::WrongLength(24)), "{profile:?}");
    }
    let nibble = |id| e2e(profile_1(id, DataIdMode::Nibble), 0, 8);
    let other = protected(&nibble(0x523), 7);
    assert_eq!(nibble(0x123).check(&frame(&other)), Err(Reject::WrongDataId { stored: 5, expected: 1 }));
    assert_eq!(E2e::new(profile_1(0x1000, DataIdMode::Nibble), 0, 8), Err(E2eError::DataId(0x1000)));
}

#[test]
fn counter_15_of_profile_1_passes_check_but_is_out_of_range() {
    let mine = e2e(profile_1(0x123, DataIdMode::Both), 0, 8);
    assert_eq!((mine.counter_range(), mine.check(&frame(&protected(&mine, 15)))), ((0, 14), Ok(15)));
}
