//! `e2e = { … }` of `[message.*]` and `[[command.message]]`: AUTOSAR end-to-end protection.

use super::checksum::sixteen_bytes;
use crate::config::reading::{Fields, Keywords};
use can_signal::validation::integrity::Protection;
use can_signal::validation::integrity::e2e::{DataIdMode, E2e, E2eProfile};

const SEE: &str = "see [message.*] e2e in config/gateway.toml";

/// AUTOSAR profiles and their variants, with their readers; each reads only its own keys.
const PROFILES: Keywords<fn(&Fields<'_>) -> Option<E2eProfile>> = &[
    ("1A", |fields| profile_1(fields, DataIdMode::Both)),
    ("1B", |fields| profile_1(fields, DataIdMode::Alternating)),
    ("1C", |fields| profile_1(fields, DataIdMode::Nibble)),
    ("1-low", |fields| profile_1(fields, DataIdMode::Low)),
    ("2", profile_2),
    ("4", |fields| Some(E2eProfile::P04 { data_id: data_id(fields, u32::MAX)? })),
    ("5", |fields| Some(E2eProfile::P05 { data_id: data_id(fields, u16::MAX)? })),
    ("6", |fields| Some(E2eProfile::P06 { data_id: data_id(fields, u16::MAX)? })),
    ("7", |fields| Some(E2eProfile::P07 { data_id: data_id(fields, u32::MAX)? })),
    ("11A", |fields| profile_1(fields, DataIdMode::Both)),
    ("11C", |fields| profile_1(fields, DataIdMode::Nibble)),
    ("22", profile_2),
];

/// Reads the profile with its offset in a frame of `length` bytes.
pub(super) fn e2e(fields: &Fields<'_>, length: usize) -> Option<Protection> {
    fields.require(&["profile"], "");
    let offset = fields.number("offset", 0..=64, "bytes").unwrap_or(0);
    let max_step = fields.whole("max_step").unwrap_or(1);
    let profile = fields.form("profile", PROFILES)?;
    fields.set_form("with this profile");
    let (checker, at) = (fields.checker, fields.location());
    let e2e = checker.accept(at, E2e::new(profile(fields)?, offset, length), SEE)?;
    checker.accept(at, Protection::e2e(e2e, max_step), SEE)
}

fn data_id<T: From<u8> + std::str::FromStr + std::fmt::Display + PartialOrd>(
    fields: &Fields<'_>,
    highest: T,
) -> Option<T> {
    fields.require(&["data_id"], SEE);
    fields.number("data_id", T::from(0)..=highest, "")
}

fn profile_1(fields: &Fields<'_>, mode: DataIdMode) -> Option<E2eProfile> {
    Some(E2eProfile::P01 { data_id: data_id(fields, u16::MAX)?, mode })
}

fn profile_2(fields: &Fields<'_>) -> Option<E2eProfile> {
    Some(E2eProfile::P02 { data_ids: sixteen_bytes(fields, "data_ids", SEE)? })
}
