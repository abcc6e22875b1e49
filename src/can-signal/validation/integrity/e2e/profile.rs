//! Header layout, data identity and CRC of each profile.

use std::ops::Range;

use crc::{Algorithm, Crc};

/// J1850's polynomial; start value and final exclusive or cancel out, so both are effectively 0.
static CRC_8_1D: Crc<u64> = Crc::<u64>::new(&const { algorithm(8, 0x1D, 0, false) });
static CRC_8_2F: Crc<u64> = Crc::<u64>::new(&const { algorithm(8, 0x2F, 0xFF, false) });
static CRC_16: Crc<u64> =
    Crc::<u64>::new(&const { Algorithm { xorout: 0, ..algorithm(16, 0x1021, 0xFFFF, false) } });
static CRC_32_P4: Crc<u64> = Crc::<u64>::new(&const { algorithm(32, 0xF4AC_FB13, 0xFFFF_FFFF, true) });
static CRC_64: Crc<u64> = Crc::<u64>::new(&const { algorithm(64, 0x42F0_E1EB_A9EA_3693, u64::MAX, true) });

/// Returns a CRC whose start value is also its final exclusive or.
const fn algorithm(width: u8, poly: u64, init: u64, reflected: bool) -> Algorithm<u64> {
    let (refin, refout) = (reflected, reflected);
    Algorithm { width, poly, init, refin, refout, xorout: init, check: 0, residue: 0 }
}

/// A profile with the Data ID of the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum E2eProfile {
    /// Profiles 1 and 11: CRC-8 "1D", counter 0 to 14.
    P01 {
        data_id: u16,
        /// Bytes of the Data ID in the CRC; distinguishes 1A, 1B, 1C, 11A and 11C.
        mode: DataIdMode,
    },
    /// Profiles 2 and 22: CRC-8 "2F", counter 0 to 15.
    P02 {
        /// One byte of Data ID for each counter value.
        data_ids: [u8; 16],
    },
    /// CRC-32 "P4", counter of 16 bits.
    P04 { data_id: u32 },
    /// CRC-16, counter of 8 bits.
    P05 { data_id: u16 },
    /// CRC-16 with the length in the header, counter of 8 bits.
    P06 { data_id: u16 },
    /// CRC-64, counter of 32 bits.
    P07 { data_id: u32 },
}

/// Bytes of the Data ID that enter the CRC of profile 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataIdMode {
    /// Both bytes, the low one first (1A, 11A).
    Both,
    /// The low byte with even counters, the high byte with odd counters (1B).
    Alternating,
    /// The low byte only.
    Low,
    /// The low byte and a zero; the low half of the high byte is sent next to the counter (1C, 11C).
    Nibble,
}

/// Fields of a header as ranges of nibbles, the high nibble of a byte first.
#[derive(Debug)]
pub(super) struct E2eHeader {
    pub(super) bytes: usize,
    crc: Range<usize>,
    /// True if the low byte of the CRC comes first; all other fields are big-endian.
    crc_is_little_endian: bool,
    pub(super) counter: Range<usize>,
    pub(super) last_counter: u32,
    pub(super) data_id: Option<Range<usize>>,
    pub(super) length: Option<Range<usize>>,
}

const P01: E2eHeader = E2eHeader {
    bytes: 2,
    crc: 0..2,
    crc_is_little_endian: false,
    counter: 3..4,
    last_counter: 14,
    data_id: None,
    length: None,
};
const P01_NIBBLE: E2eHeader = E2eHeader { data_id: Some(2..3), ..P01 };
const P02: E2eHeader = E2eHeader { last_counter: 15, ..P01 };
const P04: E2eHeader = E2eHeader {
    bytes: 12,
    length: Some(0..4),
    counter: 4..8,
    last_counter: u16::MAX as u32,
    data_id: Some(8..16),
    crc: 16..24,
    ..P01
};
const P05: E2eHeader =
    E2eHeader { bytes: 3, crc: 0..4, crc_is_little_endian: true, counter: 4..6, last_counter: 255, ..P01 };
const P06: E2eHeader =
    E2eHeader { bytes: 5, crc: 0..4, length: Some(4..8), counter: 8..10, last_counter: 255, ..P01 };
const P07: E2eHeader = E2eHeader {
    bytes: 20,
    crc: 0..16,
    length: Some(16..24),
    counter: 24..32,
    last_counter: u32::MAX,
    data_id: Some(32..40),
    ..P01
};

impl E2eProfile {
    pub(super) fn header(&self) -> &'static E2eHeader {
        match self {
            Self::P01 { mode: DataIdMode::Nibble, .. } => &P01_NIBBLE,
            Self::P01 { .. } => &P01,
            Self::P02 { .. } => &P02,
            Self::P04 { .. } => &P04,
            Self::P05 { .. } => &P05,
            Self::P06 { .. } => &P06,
            Self::P07 { .. } => &P07,
        }
    }

    /// Returns the Data ID as sent in the header; 0 for profiles that do not send it.
    pub(super) fn sent_data_id(&self) -> u32 {
        match self {
            Self::P01 { data_id, .. } => u32::from(*data_id >> 8 & 0xF),
            Self::P04 { data_id } | Self::P07 { data_id } => *data_id,
            Self::P02 { .. } | Self::P05 { .. } | Self::P06 { .. } => 0,
        }
    }

    /// Returns the CRC over the Data ID and the bytes `before` and `after` the CRC.
    pub(super) fn crc(&self, before: &[u8], after: &[u8], counter: u32) -> u64 {
        match self {
            Self::P01 { data_id, mode } => {
                let [low, high] = data_id.to_le_bytes();
                let id: &[u8] = match mode {
                    DataIdMode::Both => &[low, high],
                    DataIdMode::Alternating if counter.is_multiple_of(2) => &[low],
                    DataIdMode::Alternating => &[high],
                    DataIdMode::Low => &[low],
                    DataIdMode::Nibble => &[low, 0],
                };
                crc_over(&CRC_8_1D, [id, before, after])
            }
            Self::P02 { data_ids } => {
                // Four bits.
                crc_over(&CRC_8_2F, [before, after, &data_ids[(counter & 0xF) as usize..][..1]])
            }
            Self::P05 { data_id } => crc_over(&CRC_16, [before, after, &data_id.to_le_bytes()]),
            Self::P06 { data_id } => crc_over(&CRC_16, [before, after, &data_id.to_be_bytes()]),
            Self::P04 { .. } => crc_over(&CRC_32_P4, [before, after, &[]]),
            Self::P07 { .. } => crc_over(&CRC_64, [before, after, &[]]),
        }
    }
}

impl E2eHeader {
    /// Returns the bytes of the header that hold the CRC and are excluded from it.
    pub(super) fn crc_bytes(&self) -> Range<usize> {
        self.crc.start / 2..self.crc.end / 2
    }

    pub(super) fn stored_crc(&self, header: &[u8]) -> u64 {
        let bytes = &header[self.crc_bytes()];
        let join = |crc, byte: &u8| crc << 8 | u64::from(*byte);
        if self.crc_is_little_endian { bytes.iter().rev().fold(0, join) } else { bytes.iter().fold(0, join) }
    }

    pub(super) fn write_crc(&self, crc: u64, header: &mut [u8]) {
        write(crc, &self.crc, header);
        if self.crc_is_little_endian {
            header[self.crc_bytes()].reverse();
        }
    }
}

fn crc_over(crc: &Crc<u64>, parts: [&[u8]; 3]) -> u64 {
    let mut digest = crc.digest();
    for part in parts {
        digest.update(part);
    }
    digest.finalize()
}

/// Returns the position of a nibble's lowest bit in its byte.
fn shift(nibble: usize) -> usize {
    if nibble.is_multiple_of(2) { 4 } else { 0 }
}

pub(super) fn read(header: &[u8], field: &Range<usize>) -> u32 {
    field.clone().fold(0, |value, at| value << 4 | u32::from(header[at / 2] >> shift(at) & 0xF))
}

/// Fills a field with the lowest bits of `value`.
pub(super) fn write(value: u64, field: &Range<usize>, header: &mut [u8]) {
    for (place, at) in field.clone().rev().enumerate() {
        let nibble = (value >> (4 * place) & 0xF) as u8;
        header[at / 2] = header[at / 2] & !(0xF << shift(at)) | nibble << shift(at);
    }
}
