//! `stalk = { … }` of `[turn]`: rules and times of a momentary stalk.

use crate::config::reading::{Fields, Keywords};
use gateway_core::vehicle_lights::stalk::{Comfort, OppositePress, RepeatedPress, StalkSettings};

const OPPOSITE: Keywords<OppositePress> =
    &[("cancels", OppositePress::Cancels), ("switches", OppositePress::Switches)];
const REPEATED: Keywords<RepeatedPress> =
    &[("cancels", RepeatedPress::Cancels), ("keeps", RepeatedPress::Keeps)];

/// Reads the rules and times; the defaults fit most cars.
pub(super) fn stalk_settings(fields: &Fields<'_>) -> StalkSettings {
    let default = StalkSettings::default();
    let comfort = comfort(fields, default.comfort);
    let startup_delay = default.startup_delay.max(comfort.duration());
    StalkSettings {
        comfort,
        opposite_half: fields.keyword("opposite_half", OPPOSITE).unwrap_or(default.opposite_half),
        opposite_full: fields.keyword("opposite_full", OPPOSITE).unwrap_or(default.opposite_full),
        repeat: fields.keyword("repeat", REPEATED).unwrap_or(default.repeat),
        max_on: fields.limit("max_on_ms"),
        max_gap: fields.limit("max_gap_ms").unwrap_or(default.max_gap),
        startup_delay: fields.limit("startup_delay_ms").unwrap_or(startup_delay),
    }
}

/// Reads the flashing after a tap.
fn comfort(fields: &Fields<'_>, default: Comfort) -> Comfort {
    let (flashes, time) = (fields.number("comfort_flashes", 0..=u8::MAX, ""), fields.limit("comfort_ms"));
    match (flashes, time) {
        (Some(_), Some(_)) => {
            let reason = "comfort_flashes and comfort_ms cannot be combined";
            fields.refuse("comfort_ms", reason, "keep one of them");
            default
        }
        (Some(count), None) => match default {
            Comfort::Flashes { per_minute, .. } => Comfort::Flashes { count, per_minute },
            Comfort::For(_) => default,
        },
        (None, Some(time)) => Comfort::For(time),
        (None, None) => default,
    }
}
