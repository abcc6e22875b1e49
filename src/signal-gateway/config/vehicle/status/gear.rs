//! `[gear]` of a profile: the signals that name the engaged gear.

use std::time::Duration;

use super::sources::sources;
use crate::config::reading::{Fields, Keywords};
use crate::config::vehicle::binder::{Binder, UNUSABLE};
use gateway_core::vehicle_status::gear::{Gear, GearBinding, GearCode, GearSource};

/// Default maximum time between two gears.
const SHIFTING: Duration = Duration::from_secs(2);

/// Keys of raw values, with the gear that they stand for.
#[rustfmt::skip]
const GEARS: &[(&str, Gear)] = &[
    ("park", Gear::Park), ("reverse", Gear::Reverse), ("reverse_2", Gear::Reverse2), ("neutral", Gear::Neutral),
    ("drive", Gear::Drive), ("drive_2", Gear::Drive2), ("drive_3", Gear::Drive3), ("drive_4", Gear::Drive4),
    ("drive_5", Gear::Drive5), ("drive_6", Gear::Drive6), ("drive_7", Gear::Drive7), ("drive_8", Gear::Drive8),
    ("drive_9", Gear::Drive9), ("drive_10", Gear::Drive10), ("drive_11", Gear::Drive11),
    ("drive_12", Gear::Drive12), ("drive_13", Gear::Drive13), ("drive_14", Gear::Drive14),
    ("drive_15", Gear::Drive15), ("drive_16", Gear::Drive16), ("drive_17", Gear::Drive17),
    ("drive_18", Gear::Drive18), ("low", Gear::Low), ("low_2", Gear::Low2),
];

/// Report while a gearbox only shows that reverse is not engaged.
const OTHERWISE: Keywords<Gear> = &[("drive", Gear::Drive)];

pub(super) fn gear(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<GearBinding> {
    let shifting = fields.limit("shifting_ms").unwrap_or(SHIFTING);
    let sources = sources(binder, fields, |binder, fields, name| {
        let otherwise = fields.keyword("otherwise", OTHERWISE);
        let not_reverse = otherwise.map_or(GearCode::NotReverse, GearCode::Engaged);
        let mut codes: Vec<_> = GEARS.iter().map(|(key, gear)| (*key, GearCode::Engaged(*gear))).collect();
        codes.extend([("between", GearCode::Between), ("not_reverse", not_reverse)]);
        if !codes.iter().any(|(key, _)| fields.has(key)) {
            let remedy = "give the raw values of park, reverse, neutral, drive … as the vehicle has them";
            fields.refuse("drive", "no gear has a raw value", remedy);
        }
        if otherwise.is_some() && !fields.has("not_reverse") {
            let remedy = "remove it, or give the raw values of not_reverse";
            fields.refuse("otherwise", "`otherwise` needs not_reverse", remedy);
        }
        let role = binder.states(fields, [&[], &codes], UNUSABLE, "a gear needs signal")?;
        Some(GearSource { name, role })
    });
    (!sources.is_empty()).then_some(GearBinding { sources, shifting })
}
