//! `checksum = { … }` of `[message.*]` and `[[command.message]]`.

use std::fmt::Display;
use std::str::FromStr;

use super::super::binder::Binder;
use crate::config::reading::{Fields, Keywords};
use can_signal::dbc::model::Message;
use can_signal::validation::integrity::checksum::{
    Checksum, ChecksumRule, CrcParameters, CrcRule, Extra, Sum,
};

const SEE: &str = "see [message.*] checksum in config/gateway.toml";

/// The part of the identifier in the checksum, its low byte first.
const IDENTIFIER: Keywords<Extra> =
    &[("none", Extra::Nothing), ("before", Extra::IdentifierBefore), ("after", Extra::IdentifierAfter)];

/// Kinds of checksum, with their readers; each reads only its own keys.
const KINDS: Keywords<fn(&Fields<'_>, &Message) -> Option<ChecksumRule>> = &[
    ("honda", |_, _| Some(ChecksumRule::Honda)),
    ("toyota", |_, _| Some(ChecksumRule::Sum(Sum::TOYOTA))),
    ("j1850", |_, _| Some(ChecksumRule::Crc(CrcRule::j1850()))),
    ("fca_giorgio", giorgio),
    ("subaru", |_, _| Some(ChecksumRule::Sum(Sum::IDENTIFIER))),
    ("tesla", |_, _| Some(ChecksumRule::Sum(Sum::IDENTIFIER))),
    ("mazda", |_, _| Some(ChecksumRule::Sum(Sum::MAZDA))),
    ("psa", psa),
    ("vw", volkswagen),
    ("vw_pq", |fields, _| Some(xor(fields))),
    ("hyundai_fd", hyundai_fd),
    ("sum8", |fields, _| Some(sum8(fields))),
    ("xor8", |fields, _| Some(xor(fields))),
    ("crc8", crc8),
    ("crc16", crc16),
];

pub(super) fn checksum(binder: &Binder<'_>, fields: &Fields<'_>, message: &Message) -> Option<Checksum> {
    fields.require(&["kind", "signal"], "");
    let field = fields.string("signal").and_then(|signal| binder.field(message, &signal));
    let rule = fields.form("kind", KINDS)?;
    fields.set_form("with this kind of checksum");
    let checksum = Checksum::new(rule(fields, message)?, field?);
    binder.checker.accept(fields.at("signal"), checksum, "bind the signal that holds the checksum")
}

fn giorgio(fields: &Fields<'_>, _: &Message) -> Option<ChecksumRule> {
    fields.require(&["xorout"], SEE);
    Some(ChecksumRule::Crc(CrcRule::giorgio(fields.number("xorout", 0..=0xFF, "")?)))
}

fn psa(fields: &Fields<'_>, _: &Message) -> Option<ChecksumRule> {
    fields.require(&["start"], SEE);
    Some(ChecksumRule::Psa { start: fields.number("start", 0..=15, "")? })
}

fn volkswagen(fields: &Fields<'_>, _: &Message) -> Option<ChecksumRule> {
    Some(ChecksumRule::Crc(CrcRule::volkswagen(sixteen_bytes(fields, "constants", SEE)?)))
}

fn xor(fields: &Fields<'_>) -> ChecksumRule {
    ChecksumRule::Xor { start: fields.number("start", 0..=0xFF, "").unwrap_or(0) }
}

fn hyundai_fd(fields: &Fields<'_>, message: &Message) -> Option<ChecksumRule> {
    let crc = CrcRule::hyundai_fd(message.length);
    let crc = crc.ok_or_else(|| format!("Hyundai's CRC is not known for {} bytes", message.length));
    fields.checker.accept(fields.at("kind"), crc, SEE).map(ChecksumRule::Crc)
}

fn sum8(fields: &Fields<'_>) -> ChecksumRule {
    let start = fields.number("start", 0..=0xFF, "").unwrap_or(0);
    let (identifier, bytes) = (identifier(fields) != Extra::Nothing, bytes(fields));
    ChecksumRule::Sum(Sum { start, identifier, bytes, ..Sum::PLAIN })
}

fn crc8(fields: &Fields<'_>, _: &Message) -> Option<ChecksumRule> {
    let [poly, init, xorout] = crc_parameters(fields, 0xFF);
    Some(crc(fields, CrcParameters::crc8(poly?, init.unwrap_or(0), xorout.unwrap_or(0))))
}

fn crc16(fields: &Fields<'_>, _: &Message) -> Option<ChecksumRule> {
    let [poly, init, xorout] = crc_parameters(fields, 0xFFFF);
    Some(crc(fields, CrcParameters::crc16(poly?, init.unwrap_or(0), xorout.unwrap_or(0))))
}

/// Reads `poly`, `init` and `xorout`, each up to `highest`.
fn crc_parameters<T: From<u8> + Copy + FromStr + Display + PartialOrd>(
    fields: &Fields<'_>,
    highest: T,
) -> [Option<T>; 3] {
    fields.require(&["poly"], SEE);
    let parameters = ["poly", "init", "xorout"].map(|key| fields.number(key, T::from(0)..=highest, ""));
    if parameters[0].is_none() {
        fields.accept_rest();
    }
    parameters
}

fn crc(fields: &Fields<'_>, parameters: CrcParameters) -> ChecksumRule {
    let is_reflected = fields.flag("reflected").unwrap_or_default();
    let parameters = parameters.with_reflection(is_reflected);
    ChecksumRule::Crc(CrcRule::new(parameters, identifier(fields), bytes(fields)))
}

fn identifier(fields: &Fields<'_>) -> Extra {
    fields.keyword("identifier", IDENTIFIER).unwrap_or_default()
}

/// Reads the number of data bytes in the checksum, from the first byte; all if absent.
fn bytes(fields: &Fields<'_>) -> Option<usize> {
    fields.number("bytes", 0..=64, "bytes")
}

/// Reads the list of sixteen bytes under a key that must be present.
pub(super) fn sixteen_bytes(fields: &Fields<'_>, key: &'static str, remedy: &str) -> Option<[u8; 16]> {
    fields.require(&[key], remedy)?;
    let items = fields.list(key, remedy).iter();
    let bytes: Vec<u8> = items.filter_map(|item| fields.checker.number(item, &(0..=0xFF), "")).collect();
    let found = format!("expected 16 bytes, found {}", bytes.len());
    fields.checker.accept(fields.at(key), bytes.try_into().map_err(|_: Vec<u8>| found), remedy)
}
