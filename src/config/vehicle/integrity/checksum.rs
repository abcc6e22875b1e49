//! `checksum = { … }` of `[message.*]`.

use serde::Deserialize;
use toml::Spanned;

use super::super::binder::Binder;
use super::field::field;
use crate::config::reading::keyword::{Keyword, keywords};
use crate::core::dbc::model::Message;
use crate::core::validation::integrity::checksum::{Checksum, CrcRule, Extra, Parameters, Rule, Sum};

// What of the identifier goes into the checksum, its low byte first.
keywords!(Extra {
    "none" => Extra::Nothing,
    "before" => Extra::IdentifierBefore,
    "after" => Extra::IdentifierAfter,
});

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
    pub identifier: Keyword<Extra>,
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

/// The rule with the bits it is kept in.
pub(in crate::config::vehicle) fn checksum(
    binder: &mut Binder<'_>,
    file: &Spanned<ChecksumFile>,
    message: &Message,
) -> Option<Checksum> {
    let (span, file) = (file.span(), file.get_ref());
    let field = field(binder, message, &file.signal)?;
    let rule = match rule(file, message.length) {
        Ok(rule) => rule,
        Err(reason) => {
            binder.refuse(span, reason, "see [message.*] checksum in config/gateway.toml");
            return None;
        }
    };
    match Checksum::new(rule, field) {
        Ok(checksum) => Some(checksum),
        Err(error) => {
            binder.refuse(file.signal.span(), error.to_string(), "bind the signal that holds the checksum");
            None
        }
    }
}

fn rule(file: &ChecksumFile, length: usize) -> Result<Rule, String> {
    let start = file.start.unwrap_or(0);
    refuse_keys(file)?;
    Ok(match file.kind {
        ChecksumKind::Honda => Rule::Honda,
        ChecksumKind::Toyota => Rule::Sum(Sum::TOYOTA),
        ChecksumKind::Subaru | ChecksumKind::Tesla => Rule::Sum(Sum::IDENTIFIER),
        ChecksumKind::Mazda => Rule::Sum(Sum::MAZDA),
        ChecksumKind::J1850 => Rule::Crc(CrcRule::j1850()),
        ChecksumKind::FcaGiorgio => match file.xorout.map(u8::try_from) {
            Some(Ok(last_xor)) => Rule::Crc(CrcRule::giorgio(last_xor)),
            Some(Err(_)) | None => return Err("Giorgio needs `xorout`, the message's own 8 bits".to_owned()),
        },
        ChecksumKind::Psa => match file.start {
            Some(start @ 0..=15) => Rule::Psa { start },
            Some(_) => return Err("`start` of PSA is 0 to 15".to_owned()),
            None => return Err("PSA needs `start`, the message's own".to_owned()),
        },
        ChecksumKind::Vw => {
            let constants = file.constants.as_deref().map(<[u8; 16]>::try_from);
            let Some(Ok(constants)) = constants else {
                return Err("VW needs `constants`, sixteen of them".to_owned());
            };
            Rule::Crc(CrcRule::volkswagen(constants))
        }
        ChecksumKind::VwPq | ChecksumKind::Xor8 => Rule::Xor { start },
        ChecksumKind::HyundaiFd => {
            let crc = CrcRule::hyundai_fd(length);
            Rule::Crc(crc.ok_or_else(|| format!("Hyundai's CRC is not known for {length} bytes"))?)
        }
        ChecksumKind::Sum8 => Rule::Sum(Sum {
            start,
            identifier: file.identifier.0 != Extra::Nothing,
            bytes: file.bytes,
            ..Sum::PLAIN
        }),
        ChecksumKind::Crc8 => {
            let word = |value: Option<u16>, key: &str| {
                u8::try_from(value.unwrap_or(0)).map_err(|_| format!("`{key}` of a CRC-8 has 8 bits"))
            };
            let poly = file.poly.ok_or("a CRC needs `poly`")?;
            let parameters = Parameters::crc8(
                word(Some(poly), "poly")?,
                word(file.init, "init")?,
                word(file.xorout, "xorout")?,
            );
            crc(file, parameters)
        }
        ChecksumKind::Crc16 => {
            let poly = file.poly.ok_or("a CRC needs `poly`")?;
            crc(file, Parameters::crc16(poly, file.init.unwrap_or(0), file.xorout.unwrap_or(0)))
        }
    })
}

fn crc(file: &ChecksumFile, parameters: Parameters) -> Rule {
    Rule::Crc(CrcRule::new(parameters.with_reflection(file.reflected), file.identifier.0, file.bytes))
}

/// Refuses keys that another kind has.
fn refuse_keys(file: &ChecksumFile) -> Result<(), String> {
    let takes: &[&str] = match file.kind {
        ChecksumKind::Honda
        | ChecksumKind::Toyota
        | ChecksumKind::Subaru
        | ChecksumKind::Tesla
        | ChecksumKind::Mazda
        | ChecksumKind::HyundaiFd
        | ChecksumKind::J1850 => &[],
        ChecksumKind::FcaGiorgio => &["xorout"],
        ChecksumKind::Psa | ChecksumKind::VwPq | ChecksumKind::Xor8 => &["start"],
        ChecksumKind::Vw => &["constants"],
        ChecksumKind::Sum8 => &["start", "identifier", "bytes"],
        ChecksumKind::Crc8 | ChecksumKind::Crc16 => {
            &["poly", "init", "xorout", "reflected", "identifier", "bytes"]
        }
    };
    let given = [
        ("start", file.start.is_some()),
        ("constants", file.constants.is_some()),
        ("poly", file.poly.is_some()),
        ("init", file.init.is_some()),
        ("xorout", file.xorout.is_some()),
        ("reflected", file.reflected),
        ("identifier", file.identifier.0 != Extra::Nothing),
        ("bytes", file.bytes.is_some()),
    ];
    match given.iter().find(|(key, given)| *given && !takes.contains(key)) {
        Some((key, _)) => Err(format!("`{key}` has no meaning with this kind of checksum")),
        None => Ok(()),
    }
}
