//! The keys of `[turn_signal]` that use the vehicle's own signals.

use crate::config::reading::{Fields, Keywords, flag, key_rows, keyword};
use crate::config::vehicle::Vehicle;
use turn_signal::vehicle_state::{VehicleHazard, VehicleUse};

/// Origins of the speed; true for the vehicle.
const SPEEDS: Keywords<bool> = &[("odometry", false), ("vehicle", true)];

key_rows! {
    SPEED: bool = keyword("speed", SPEEDS).or_text("odometry")
        .doc("speed for distances and standstill: \"odometry\", or \"vehicle\": [velocity] of the profile, and the odometry while that is unknown");
    HAZARD_AT_OPEN_DOOR: bool = flag("hazard_at_open_door", false)
        .doc("true: hazard lights while a door is open at standstill, not in park; needs [gear] and [[doors.door]] of the profile");
    HAZARD_IN_REVERSE: bool = flag("hazard_in_reverse", false)
        .doc("true: hazard lights in reverse gear; needs [gear] of the profile");
}

/// Reads the keys. `profile` is `None` if the profile was refused.
pub(super) fn vehicle_use(fields: &Fields<'_>, profile: Option<&Vehicle>) -> VehicleUse {
    let takes_speed = fields.read(&SPEED);
    let (at_open_door, in_reverse) = (fields.read(&HAZARD_AT_OPEN_DOOR), fields.read(&HAZARD_IN_REVERSE));
    if let Some(profile) = profile {
        let status = &profile.status;
        let (velocity, gear, doors) =
            (status.velocity.is_some(), status.gear.is_some(), !status.doors.is_empty());
        let needed = [
            ("speed", takes_speed && !velocity, "[velocity]"),
            ("hazard_at_open_door", at_open_door && !gear, "[gear]"),
            ("hazard_at_open_door", at_open_door && !doors, "[[doors.door]]"),
            ("hazard_in_reverse", in_reverse && !gear, "[gear]"),
        ];
        for (key, _, section) in needed.into_iter().filter(|(_, is_missing, _)| *is_missing) {
            let reason = format!("the vehicle profile has no {section}");
            fields.refuse(key, reason, &format!("add {}, or remove this key", profile.place_of(section)));
        }
    }
    let hazards = [(at_open_door, VehicleHazard::OpenDoor), (in_reverse, VehicleHazard::Reverse)];
    let hazards = hazards.into_iter().filter_map(|(is_on, hazard)| is_on.then_some(hazard));
    VehicleUse { takes_speed, hazards: hazards.collect() }
}
