//! Dimensions of the vehicle of a drive.

use super::reading::fields::Fields;
use turn_signal::parameters::VehicleInfo;

/// Reads the dimensions; the defaults are the dimensions of Autoware's sample vehicle.
pub(super) fn vehicle(fields: &Fields<'_>) -> VehicleInfo {
    let metres = |key, sample| fields.number(key, 0.0..=50.0, "m").unwrap_or(sample);
    let sample = VehicleInfo::SAMPLE;
    VehicleInfo {
        wheel_base_m: metres("wheel_base_m", sample.wheel_base_m),
        front_overhang_m: metres("front_overhang_m", sample.front_overhang_m),
        rear_overhang_m: metres("rear_overhang_m", sample.rear_overhang_m),
        left_m: metres("left_m", sample.left_m),
        right_m: metres("right_m", sample.right_m),
    }
}
