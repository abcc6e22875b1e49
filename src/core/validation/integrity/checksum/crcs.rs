//! CRCs of 8 and 16 bits.

use std::fmt;

use crc::{Algorithm, CRC_8_AUTOSAR, Crc};

use crate::core::can::frame::CanId;

static CRC_2F: Crc<u8> = Crc::<u8>::new(&CRC_8_AUTOSAR);

/// A CRC in the parameters that catalogues use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameters<W> {
    /// Polynomial without its highest term.
    pub poly: W,
    /// Start value.
    pub init: W,
    /// Combined with the result by exclusive or.
    pub xorout: W,
    /// Whether bytes go in with their lowest bit first.
    pub refin: bool,
    /// Whether the result comes out with its lowest bit first.
    pub refout: bool,
}

/// What goes into a CRC beside the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extra {
    /// Nothing.
    #[default]
    Nothing,
    /// The identifier before the data, its low byte first: two bytes, four when it has 29 bits.
    IdentifierBefore,
    /// The identifier behind the data, likewise.
    IdentifierBehind,
    /// One of sixteen bytes behind the data, chosen by the low four bits of byte 1 (VW's counter).
    ByCounter([u8; 16]),
}

/// A CRC of 8 bits over the data without the checksum's byte.
#[derive(Clone)]
pub struct Crc8 {
    parameters: Parameters<u8>,
    extra: Extra,
    bytes: Option<usize>,
    crc: Box<Crc<u8>>,
}

/// A CRC of 16 bits over the data without the checksum's bytes.
#[derive(Clone)]
pub struct Crc16 {
    parameters: Parameters<u16>,
    extra: Extra,
    bytes: Option<usize>,
    crc: Box<Crc<u16>>,
}

/// The parts that differ in nothing but the width.
macro_rules! crc {
    ($name:ident, $word:ty, $width:literal) => {
        impl $name {
            /// A CRC over the first `bytes` bytes of the data (`None` = all) and `extra`.
            ///
            /// For start-up, once a message: a few bytes of it are never given back.
            pub fn new(parameters: Parameters<$word>, extra: Extra, bytes: Option<usize>) -> Self {
                let Parameters { poly, init, xorout, refin, refout } = parameters;
                let algorithm =
                    Algorithm { width: $width, poly, init, refin, refout, xorout, check: 0, residue: 0 };
                // The crate borrows it for ever.
                let crc = Box::new(Crc::<$word>::new(Box::leak(Box::new(algorithm))));
                Self { parameters, extra, bytes, crc }
            }

            /// The CRC of `data`, of which `before` and `behind` surround the checksum.
            pub(super) fn of(&self, id: CanId, before: &[u8], behind: &[u8], data: &[u8]) -> $word {
                let used = self.bytes.unwrap_or(data.len());
                let hidden = data.len() - behind.len();
                let mut digest = self.crc.digest();
                if self.extra == Extra::IdentifierBefore {
                    digest.update(identifier(id, &mut [0; 4]));
                }
                digest.update(&before[..used.min(before.len())]);
                digest.update(&behind[..used.saturating_sub(hidden).min(behind.len())]);
                match &self.extra {
                    Extra::Nothing | Extra::IdentifierBefore => {}
                    Extra::IdentifierBehind => digest.update(identifier(id, &mut [0; 4])),
                    Extra::ByCounter(constants) => {
                        let counter = data.get(1).copied().unwrap_or(0) & 0xF;
                        digest.update(&[constants[usize::from(counter)]]);
                    }
                }
                digest.finalize()
            }
        }

        impl PartialEq for $name {
            fn eq(&self, other: &Self) -> bool {
                (self.parameters, self.extra, self.bytes) == (other.parameters, other.extra, other.bytes)
            }
        }

        impl Eq for $name {}

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                let Self { parameters, extra, bytes, .. } = self;
                write!(f, "{}({parameters:X?}, {extra:?}, {bytes:?})", stringify!($name))
            }
        }
    };
}

crc!(Crc8, u8, 8);
crc!(Crc16, u16, 16);

impl Crc8 {
    /// SAE J1850: Chrysler and the rest of FCA, New Eagle.
    pub fn j1850() -> Self {
        Self::plain(0x1D, 0xFF, 0xFF)
    }

    /// FCA's Giorgio platform: J1850's polynomial from 0, with a last exclusive or that differs
    /// from message to message (0x0A in most).
    pub fn giorgio(last_xor: u8) -> Self {
        Self::plain(0x1D, 0, last_xor)
    }

    /// VW MQB and MEB: CRC-8 "2F" with the message's sixteen constants, chosen by the counter in
    /// the low four bits of byte 1.
    pub fn volkswagen(constants: [u8; 16]) -> Self {
        let parameters = Parameters { poly: 0x2F, init: 0xFF, xorout: 0xFF, refin: false, refout: false };
        Self::new(parameters, Extra::ByCounter(constants), None)
    }

    /// The counter of a frame known to be good, and the one constant [`Self::volkswagen`] needs for
    /// it: sixteen good frames with all counters make a table. The checksum is byte 0. `None` for a
    /// frame too short to tell.
    pub fn volkswagen_constant(data: &[u8]) -> Option<(u8, u8)> {
        let ([stored, counter, ..], [_, behind @ ..]) = (data, data) else { return None };
        let fits = |constant: &u8| {
            let mut digest = CRC_2F.digest();
            digest.update(behind);
            digest.update(&[*constant]);
            digest.finalize() == *stored
        };
        (0..=u8::MAX).find(fits).map(|constant| (counter & 0xF, constant))
    }

    fn plain(poly: u8, init: u8, xorout: u8) -> Self {
        let parameters = Parameters { poly, init, xorout, refin: false, refout: false };
        Self::new(parameters, Extra::Nothing, None)
    }
}

impl Crc16 {
    /// Hyundai and Kia on CAN FD: XMODEM over data and identifier, then an exclusive or that goes
    /// with the length. `None` for a length without a known one (known: 8, 16, 24, 32 bytes).
    pub fn hyundai_fd(length: usize) -> Option<Self> {
        let xorout = match length {
            8 => 0x5F29,
            16 => 0x041D,
            24 => 0x819D,
            32 => 0x9F5B,
            _ => return None,
        };
        let parameters = Parameters { poly: 0x1021, init: 0, xorout, refin: false, refout: false };
        Some(Self::new(parameters, Extra::IdentifierBehind, None))
    }
}

fn identifier(id: CanId, bytes: &mut [u8; 4]) -> &[u8] {
    *bytes = id.number().to_le_bytes();
    match id {
        CanId::Standard(_) => &bytes[..2],
        CanId::Extended(_) => bytes,
    }
}
