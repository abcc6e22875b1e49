//! What sets the profiles apart: header, identity, CRC.

use std::ops::Range;

use crc::{CRC_8_AUTOSAR, CRC_8_GSM_A, CRC_16_IBM_3740, CRC_32_AUTOSAR, CRC_64_XZ, Crc};

/// J1850's polynomial; start and end value cancel out, so that both are 0 in effect.
static CRC_1D: Crc<u8> = Crc::<u8>::new(&CRC_8_GSM_A);
static CRC_2F: Crc<u8> = Crc::<u8>::new(&CRC_8_AUTOSAR);
static CRC_16: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
static CRC_32: Crc<u32> = Crc::<u32>::new(&CRC_32_AUTOSAR);
static CRC_64: Crc<u64> = Crc::<u64>::new(&CRC_64_XZ);

/// A profile and the message's identity in it.
///
/// Headers, by byte:
/// - 1 and 11: CRC, then the counter in the low half (the high half may hold part of the Data ID);
/// - 2 and 22: CRC, then the counter in the low half;
/// - 4: length (2), counter (2), Data ID (4), CRC (4), all big-endian;
/// - 5: CRC (2, little-endian), counter (1);
/// - 6: CRC (2), length (2), counter (1), big-endian;
/// - 7: CRC (8), length (4), counter (4), Data ID (4), all big-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Profiles 1 and 11: CRC-8 "1D", counter 0 to 14.
    P01 {
        /// Data ID.
        data_id: u16,
        /// How it goes into the CRC: what makes 1A, 1B, 1C, 11A and 11C.
        mode: DataIdMode,
    },
    /// Profiles 2 and 22: CRC-8 "2F", counter 0 to 15.
    P02 {
        /// One byte of identity for each counter.
        data_ids: [u8; 16],
    },
    /// CRC-32 "P4", counter of 16 bits.
    P04 {
        /// Data ID.
        data_id: u32,
    },
    /// CRC-16, counter of 8 bits.
    P05 {
        /// Data ID.
        data_id: u16,
    },
    /// CRC-16 with the length in the header, counter of 8 bits.
    P06 {
        /// Data ID.
        data_id: u16,
    },
    /// CRC-64, counter of 32 bits.
    P07 {
        /// Data ID.
        data_id: u32,
    },
}

/// How the Data ID of profile 1 goes into the CRC.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataIdMode {
    /// Both bytes, the low one first (1A, 11A).
    Both,
    /// The low byte with even counters, the high byte with odd ones (1B).
    Alternating,
    /// The low byte only.
    Low,
    /// The low byte and a zero; the low half of the high byte is sent beside the counter (1C, 11C).
    Nibble,
}

impl Profile {
    pub(super) fn header_length(&self) -> usize {
        match self {
            Self::P01 { .. } | Self::P02 { .. } => 2,
            Self::P04 { .. } => 12,
            Self::P05 { .. } => 3,
            Self::P06 { .. } => 5,
            Self::P07 { .. } => 20,
        }
    }

    /// Where the CRC is in the header: what it does not cover.
    pub(super) fn crc_bytes(&self) -> Range<usize> {
        match self {
            Self::P01 { .. } | Self::P02 { .. } => 0..1,
            Self::P04 { .. } => 8..12,
            Self::P05 { .. } | Self::P06 { .. } => 0..2,
            Self::P07 { .. } => 0..8,
        }
    }

    pub(super) fn counter_range(&self) -> (u32, u32) {
        let last = match self {
            Self::P01 { .. } => 14,
            Self::P02 { .. } => 15,
            Self::P05 { .. } | Self::P06 { .. } => u32::from(u8::MAX),
            Self::P04 { .. } => u32::from(u16::MAX),
            Self::P07 { .. } => u32::MAX,
        };
        (0, last)
    }

    /// The CRC over the bytes around it and the identity.
    pub(super) fn crc(&self, before: &[u8], behind: &[u8], counter: u32) -> u64 {
        match self {
            Self::P01 { data_id, mode } => {
                let [low, high] = data_id.to_le_bytes();
                let mut digest = CRC_1D.digest();
                match mode {
                    DataIdMode::Both => digest.update(&[low, high]),
                    DataIdMode::Alternating if counter.is_multiple_of(2) => digest.update(&[low]),
                    DataIdMode::Alternating => digest.update(&[high]),
                    DataIdMode::Low => digest.update(&[low]),
                    DataIdMode::Nibble => digest.update(&[low, 0]),
                }
                digest.update(before);
                digest.update(behind);
                digest.finalize().into()
            }
            Self::P02 { data_ids } => {
                let mut digest = CRC_2F.digest();
                digest.update(before);
                digest.update(behind);
                // Four bits.
                digest.update(&data_ids[(counter & 0xF) as usize..][..1]);
                digest.finalize().into()
            }
            Self::P05 { data_id } => crc_16(before, behind, data_id.to_le_bytes()),
            Self::P06 { data_id } => crc_16(before, behind, data_id.to_be_bytes()),
            Self::P04 { .. } => {
                let mut digest = CRC_32.digest();
                digest.update(before);
                digest.update(behind);
                digest.finalize().into()
            }
            Self::P07 { .. } => {
                let mut digest = CRC_64.digest();
                digest.update(before);
                digest.update(behind);
                digest.finalize()
            }
        }
    }

    pub(super) fn stored_crc(&self, header: &[u8]) -> u64 {
        let bytes = &header[self.crc_bytes()];
        if self.crc_is_little_endian() { number(bytes.iter().rev()) } else { number(bytes.iter()) }
    }

    pub(super) fn write_crc(&self, crc: u64, header: &mut [u8]) {
        let bytes = &mut header[self.crc_bytes()];
        write(crc, bytes);
        if self.crc_is_little_endian() {
            bytes.reverse();
        }
    }

    pub(super) fn counter(&self, header: &[u8]) -> u32 {
        match self {
            Self::P01 { .. } | Self::P02 { .. } => u32::from(header[1] & 0xF),
            Self::P04 { .. } => field(header, 2..4),
            Self::P05 { .. } => field(header, 2..3),
            Self::P06 { .. } => field(header, 4..5),
            Self::P07 { .. } => field(header, 12..16),
        }
    }

    /// The identity in the header and what it should be, for profiles that send it.
    pub(super) fn data_id(&self, header: &[u8]) -> Option<(u32, u32)> {
        match self {
            Self::P01 { data_id, mode: DataIdMode::Nibble } => {
                Some((u32::from(header[1] >> 4), u32::from(*data_id >> 8 & 0xF)))
            }
            Self::P04 { data_id } => Some((field(header, 4..8), *data_id)),
            Self::P07 { data_id } => Some((field(header, 16..20), *data_id)),
            Self::P01 { .. } | Self::P02 { .. } | Self::P05 { .. } | Self::P06 { .. } => None,
        }
    }

    /// The length in the header, for profiles that send it.
    pub(super) fn length_field(&self, header: &[u8]) -> Option<u32> {
        match self {
            Self::P04 { .. } => Some(field(header, 0..2)),
            Self::P06 { .. } => Some(field(header, 2..4)),
            Self::P07 { .. } => Some(field(header, 8..12)),
            Self::P01 { .. } | Self::P02 { .. } | Self::P05 { .. } => None,
        }
    }

    /// Everything but the CRC.
    pub(super) fn write_header(&self, counter: u32, length: usize, header: &mut [u8]) {
        let (counter, length) = (u64::from(counter), length as u64);
        let low = (counter & 0xF) as u8;
        match self {
            Self::P01 { data_id, mode: DataIdMode::Nibble } => {
                let [_, high] = data_id.to_le_bytes();
                header[1] = high << 4 | low;
            }
            Self::P01 { .. } | Self::P02 { .. } => header[1] = header[1] & 0xF0 | low,
            Self::P04 { data_id } => {
                write(length, &mut header[0..2]);
                write(counter, &mut header[2..4]);
                write((*data_id).into(), &mut header[4..8]);
            }
            Self::P05 { .. } => write(counter, &mut header[2..3]),
            Self::P06 { .. } => {
                write(length, &mut header[2..4]);
                write(counter, &mut header[4..5]);
            }
            Self::P07 { data_id } => {
                write(length, &mut header[8..12]);
                write(counter, &mut header[12..16]);
                write((*data_id).into(), &mut header[16..20]);
            }
        }
    }

    fn crc_is_little_endian(&self) -> bool {
        matches!(self, Self::P05 { .. })
    }
}

fn crc_16(before: &[u8], behind: &[u8], data_id: [u8; 2]) -> u64 {
    let mut digest = CRC_16.digest();
    digest.update(before);
    digest.update(behind);
    digest.update(&data_id);
    digest.finalize().into()
}

/// Up to four bytes, big-endian.
fn field(header: &[u8], bytes: Range<usize>) -> u32 {
    header[bytes].iter().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// Up to eight bytes, the most significant first.
fn number<'a>(bytes: impl Iterator<Item = &'a u8>) -> u64 {
    bytes.fold(0, |value, byte| value << 8 | u64::from(*byte))
}

/// Fills `bytes` with the lowest bytes of `value`, big-endian.
fn write(value: u64, bytes: &mut [u8]) {
    let all = value.to_be_bytes();
    bytes.copy_from_slice(&all[all.len() - bytes.len()..]);
}
