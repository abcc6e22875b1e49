//! Dimensions of a vehicle, in a section of the gateway's file and in drives.

use super::reading::fields::Fields;
use super::reading::row::{ConfigKey, key_rows, number};
use crate::core::turn_signal::parameters::VehicleInfo;

key_rows! {
    WHEEL_BASE_M: f64 = metres("wheel_base_m", VehicleInfo::SAMPLE.wheel_base_m).doc("from axle to axle");
    FRONT_OVERHANG_M: f64 = metres("front_overhang_m", VehicleInfo::SAMPLE.front_overhang_m).doc("front axle to the front end");
    REAR_OVERHANG_M: f64 = metres("rear_overhang_m", VehicleInfo::SAMPLE.rear_overhang_m).doc("rear axle to the rear end");
    LEFT_M: f64 = metres("left_m", VehicleInfo::SAMPLE.left_m).doc("centre line to the left side");
    RIGHT_M: f64 = metres("right_m", VehicleInfo::SAMPLE.right_m).doc("centre line to the right side");
}

const fn metres(name: &'static str, default: f64) -> ConfigKey<f64> {
    number(name, 0.0, 50.0, "m").or_number(default)
}

/// Reads the dimensions; the defaults are the dimensions of Autoware's sample vehicle.
pub(super) fn vehicle(fields: Fields<'_>) -> VehicleInfo {
    let vehicle = VehicleInfo {
        wheel_base_m: fields.read(&WHEEL_BASE_M),
        front_overhang_m: fields.read(&FRONT_OVERHANG_M),
        rear_overhang_m: fields.read(&REAR_OVERHANG_M),
        left_m: fields.read(&LEFT_M),
        right_m: fields.read(&RIGHT_M),
    };
    fields.done();
    vehicle
}
