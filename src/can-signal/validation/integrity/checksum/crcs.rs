//! CRCs of 8 and 16 bits.

use std::fmt;

use crc::{Algorithm, Crc};

use crate::can::CanId;

/// Parameters of a CRC of 8 or 16 bits, named as in the catalogue of parametrised CRC algorithms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CrcParameters {
    width: u8,
    poly: u16,
    init: u16,
    xorout: u16,
    reflected: bool,
}

impl CrcParameters {
    /// Creates a CRC-8, not reflected. `poly` omits the highest term.
    pub fn crc8(poly: u8, init: u8, xorout: u8) -> Self {
        Self { width: 8, poly: poly.into(), init: init.into(), xorout: xorout.into(), reflected: false }
    }

    /// Creates a CRC-16, not reflected. `poly` omits the highest term.
    pub fn crc16(poly: u16, init: u16, xorout: u16) -> Self {
        Self { width: 16, poly, init, xorout, reflected: false }
    }

    /// Sets `refin` and `refout`: bytes are processed, and the result is returned, lowest bit first.
    #[must_use]
    pub fn with_reflection(self, reflected: bool) -> Self {
        Self { reflected, ..self }
    }
}

/// Additional input of a CRC.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extra {
    /// Nothing in addition to the data.
    #[default]
    Nothing,
    /// The identifier before the data, low byte first: two bytes, or four for a 29-bit identifier.
    IdentifierBefore,
    /// The identifier after the data, in the same form.
    IdentifierAfter,
    /// One of sixteen bytes after the data, selected by the low four bits of byte 1 (VW's counter).
    ByCounter([u8; 16]),
}

/// A CRC over the data, excluding the bytes of the checksum itself.
#[derive(Clone)]
pub struct CrcRule {
    parameters: CrcParameters,
    extra: Extra,
    bytes: Option<usize>,
    crc: Box<Crc<u16>>,
}

impl CrcRule {
    /// Creates a CRC over the first `bytes` bytes of the data (`None` = all) and `extra`.
    ///
    /// Leaks a few bytes, so call it once per message at start-up.
    pub fn new(parameters: CrcParameters, extra: Extra, bytes: Option<usize>) -> Self {
        let CrcParameters { width, poly, init, xorout, reflected } = parameters;
        let (refin, refout) = (reflected, reflected);
        let algorithm = Algorithm { width, poly, init, refin, refout, xorout, check: 0, residue: 0 };
        // The crate borrows the algorithm for 'static.
        let crc = Box::new(Crc::<u16>::new(Box::leak(Box::new(algorithm))));
        Self { parameters, extra, bytes, crc }
    }

    /// Creates the CRC of SAE J1850, used by Chrysler, other FCA brands and New Eagle.
    pub fn j1850() -> Self {
        Self::new(CrcParameters::crc8(0x1D, 0xFF, 0xFF), Extra::Nothing, None)
    }

    /// Creates the CRC of FCA's Giorgio platform: J1850's polynomial with start value 0, with a final
    /// exclusive or that differs between messages (0x0A in most).
    pub fn giorgio(xorout: u8) -> Self {
        Self::new(CrcParameters::crc8(0x1D, 0, xorout), Extra::Nothing, None)
    }

    /// Creates the CRC of VW MQB and MEB: CRC-8 "2F" with the message's sixteen constants, selected by the
    /// counter in the low four bits of byte 1.
    pub fn volkswagen(constants: [u8; 16]) -> Self {
        Self::new(CrcParameters::crc8(0x2F, 0xFF, 0xFF), Extra::ByCounter(constants), None)
    }

    /// Creates the CRC of Hyundai and Kia on CAN FD: XMODEM over data and identifier, then an exclusive or
    /// that depends on the length. `None` unless `length` is 8, 16, 24 or 32 bytes.
    pub fn hyundai_fd(length: usize) -> Option<Self> {
        let xorout = match length {
            8 => 0x5F29,
            16 => 0x041D,
            24 => 0x819D,
            32 => 0x9F5B,
            _ => return None,
        };
        Some(Self::new(CrcParameters::crc16(0x1021, 0, xorout), Extra::IdentifierAfter, None))
    }

    /// Returns the width of the result in bits, 8 or 16.
    pub fn width(&self) -> u32 {
        self.parameters.width.into()
    }

    /// Returns the CRC of `data`, whose parts `before` and `after` surround the checksum.
    pub(super) fn of(&self, id: CanId, before: &[u8], after: &[u8], data: &[u8]) -> u16 {
        let used = self.bytes.unwrap_or(data.len());
        let after_start = data.len() - after.len();
        let mut digest = self.crc.digest();
        if self.extra == Extra::IdentifierBefore {
            digest.update(identifier(id, &mut [0; 4]));
        }
        digest.update(&before[..used.min(before.len())]);
        digest.update(&after[..used.saturating_sub(after_start).min(after.len())]);
        match &self.extra {
            Extra::Nothing | Extra::IdentifierBefore => {}
            Extra::IdentifierAfter => digest.update(identifier(id, &mut [0; 4])),
            Extra::ByCounter(constants) => {
                let counter = data.get(1).copied().unwrap_or(0) & 0xF;
                digest.update(&[constants[usize::from(counter)]]);
            }
        }
        digest.finalize()
    }
}

impl PartialEq for CrcRule {
    fn eq(&self, other: &Self) -> bool {
        (self.parameters, self.extra, self.bytes) == (other.parameters, other.extra, other.bytes)
    }
}

impl Eq for CrcRule {}

impl fmt::Debug for CrcRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CrcRule({:X?}, {:?}, {:?})", self.parameters, self.extra, self.bytes)
    }
}

fn identifier(id: CanId, bytes: &mut [u8; 4]) -> &[u8] {
    *bytes = id.number().to_le_bytes();
    match id {
        CanId::Standard(_) => &bytes[..2],
        CanId::Extended(_) => bytes,
    }
}
