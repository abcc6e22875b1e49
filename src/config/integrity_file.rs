//! What a profile says of checksums, counters and E2E protection: the keys below `[message.*]`.

use serde::Deserialize;
use toml::Spanned;

/// `checksum = { kind = …, signal = … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChecksumFile {
    /// The rule.
    pub kind: ChecksumKind,
    /// Signal of the same message that holds it.
    pub signal: Spanned<String>,
    /// PSA: the message's start value. VW PQ and `xor8`, `sum8`: start value.
    pub start: Option<u8>,
    /// VW: the message's sixteen constants.
    pub constants: Option<Vec<u8>>,
    /// CRC: polynomial.
    pub poly: Option<u16>,
    /// CRC: start value.
    pub init: Option<u16>,
    /// CRC: combined with the result by exclusive or.
    pub xorout: Option<u16>,
    /// CRC: bytes go in, and the result comes out, with the lowest bit first.
    #[serde(default)]
    pub reflected: bool,
    /// CRC: what of the identifier goes in.
    #[serde(default)]
    pub identifier: IdentifierFile,
    /// CRC and sum: how many bytes of the data, from the first; all when not given.
    pub bytes: Option<usize>,
}

/// `kind = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChecksumKind {
    /// Honda and Acura, a nibble.
    Honda,
    /// Toyota and Lexus.
    Toyota,
    /// Chrysler, FCA: CRC-8 SAE J1850.
    J1850,
    /// FCA Giorgio: J1850's polynomial; needs the message's `xorout`.
    FcaGiorgio,
    /// Subaru Global.
    Subaru,
    /// Tesla.
    Tesla,
    /// Mazda's 0x091.
    Mazda,
    /// PSA, a nibble; needs `start`.
    Psa,
    /// VW MQB and MEB; needs `constants`.
    Vw,
    /// VW PQ: exclusive or of the bytes.
    VwPq,
    /// Hyundai and Kia CAN FD: CRC-16.
    HyundaiFd,
    /// Sum of bytes, modulo 256.
    Sum8,
    /// Exclusive or of bytes.
    Xor8,
    /// Any CRC of 8 bits; needs `poly`.
    Crc8,
    /// Any CRC of 16 bits; needs `poly`.
    Crc16,
}

/// `identifier = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IdentifierFile {
    /// Not in the checksum.
    #[default]
    None,
    /// Before the data, low byte first.
    Before,
    /// Behind the data, low byte first.
    Behind,
}

/// `counter = { signal = … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CounterFile {
    /// Signal of the same message.
    pub signal: Spanned<String>,
    /// First value; the signal's lowest when not given.
    pub first: Option<u32>,
    /// Last value; the signal's highest when not given.
    pub last: Option<u32>,
    /// Largest step that is still believed.
    #[serde(default = "one_step")]
    pub max_step: u32,
    /// Equal counters in a row that are tolerated, though not believed.
    #[serde(default)]
    pub tolerated_repeats: u8,
    /// Frames in sequence needed after a break.
    #[serde(default = "one")]
    pub sync_after: u8,
    /// What it counts.
    #[serde(default)]
    pub counts: CountsFile,
}

fn one_step() -> u32 {
    1
}

fn one() -> u8 {
    1
}

/// `counts = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CountsFile {
    /// Every frame.
    #[default]
    Sends,
    /// New contents.
    Changes,
}

/// `e2e = { profile = …, … }`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct E2eFile {
    /// The AUTOSAR profile and its variant.
    pub profile: E2eProfile,
    /// Data ID, of all profiles but 2 and 22.
    pub data_id: Option<u32>,
    /// Sixteen Data IDs, of profiles 2 and 22.
    pub data_ids: Option<Vec<u8>>,
    /// First byte of the header.
    #[serde(default)]
    pub offset: usize,
    /// Largest step of the counter that is still believed.
    #[serde(default = "one_step")]
    pub max_step: u32,
}

/// `profile = …`
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub enum E2eProfile {
    /// Both bytes of the Data ID.
    #[serde(rename = "1A")]
    P1A,
    /// One byte in turn.
    #[serde(rename = "1B")]
    P1B,
    /// The high byte's low half is sent.
    #[serde(rename = "1C")]
    P1C,
    /// Only the low byte.
    #[serde(rename = "1-low")]
    P1Low,
    /// List of Data IDs.
    #[serde(rename = "2")]
    P2,
    /// CRC-32.
    #[serde(rename = "4")]
    P4,
    /// CRC-16.
    #[serde(rename = "5")]
    P5,
    /// CRC-16 with length.
    #[serde(rename = "6")]
    P6,
    /// CRC-64.
    #[serde(rename = "7")]
    P7,
    /// As 1A.
    #[serde(rename = "11A")]
    P11A,
    /// As 1C.
    #[serde(rename = "11C")]
    P11C,
    /// As 2.
    #[serde(rename = "22")]
    P22,
}

/// `window = { init = …, valid = …, invalid = … }`: the E2E state machine.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindowFile {
    /// Limits before the message was valid.
    pub init: LimitsFile,
    /// Limits while it is.
    pub valid: LimitsFile,
    /// Limits after it was invalid.
    pub invalid: LimitsFile,
    /// Results before a fall into the invalid state do not count for the way out.
    #[serde(default)]
    pub clear_to_invalid: bool,
}

/// `{ size = …, min_ok = …, max_error = … }`
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LimitsFile {
    /// Newest results looked at, 1 to 64.
    pub size: u8,
    /// Good ones needed.
    pub min_ok: u8,
    /// Errors allowed.
    pub max_error: u8,
}
