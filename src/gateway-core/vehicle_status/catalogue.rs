//! Status messages of velocity, steering, gear, control mode and doors.

use crate::vehicle_report::catalogue::REPORT;
use gateway_base::diagnostics::{Section, messages};

messages! {
    /// Irregularities, and why a report is withheld without a failure.
    STATUS {
        Warn dimension_missing(key, consequence) "not configured: [vehicle_geometry] {key} is missing, and without this report {consequence}", "Write the dimension into [vehicle_geometry]. For the steering ratio, `car = \"…\"` there takes the listed ratio of a car, and `signal-gateway check LOG` measures it in a drive that turns.";
        Warn source_without_dimension(key) "not configured: [vehicle_geometry] {key} is missing", "Write the dimension into [vehicle_geometry]; `car = \"…\"` there takes the wheel base and steering ratio listed for a car.";
        Warn ratio_listed(ratio, car) "publishing; the steering ratio {ratio} is from opendbc's list for {car}, not measured on this car", "Run `signal-gateway check LOG` on a drive that turns, and put the lines that it prints into [vehicle_geometry].";
        Warn shifting(signal) "shifting: {signal} is between gears", "Nothing is to be done; a shift takes a moment.";
        Warn only_reverse_shown(signal) "not visible: {signal} tells reverse from all other gears only", "Nothing is to be done; `otherwise` of the profile can name a gear for them.";
        Warn fallback_heading_rate(source, reason) "fallback heading rate of the {source}: {reason}", "The heading rate continues from the named source meanwhile.";
        Warn heading_rate_replaced(reason) "heading rate published as 0: {reason}", "Another source of the heading rate in the profile avoids this.";
        Warn doors_without_state(reason) "publishing; {reason}", "The door is published as UNKNOWN or NOT_AVAILABLE meanwhile.";
        Warn implausible(what, remedy) "{what}: {remedy}", "Do as the message says.";
    }
}

messages! {
    /// Why a value is unavailable.
    REASONS {
        - between_gears_too_long(signal) "{signal} stays between gears", "Have the gearbox checked; `shifting_ms` is the longest time of a shift.";
        - out_of_range(signal) "{signal} is beyond what the vehicle can do", "Check unit, factor and sign of the quantity in the profile.";
        - direction_unknown() "the vehicle began to roll, and nothing tells forward from backward", "Nothing is to be done if it rolls without a gear; otherwise bind a signal that tells the direction.";
        - out_of_step() "its last frame is much older than that of the speed", "Check the sender of the heading rate; `max_skew_ms` is the limit.";
        - no_source() "the profile describes no source of it", "Describe one in `[[velocity.heading_rate]]`, or choose `heading_rate_unknown = \"zero\"`.";
        - no_source_at_this_speed() "each source counts only while it reads a lower speed", "Describe a source without `below_mps` in `[[velocity.source]]`.";
        - heading_rate_out_of_range() "it is beyond what the vehicle can do", "Check the quantities it is made of (steering, rear wheels) in the profile, and their sensors.";
        - no_rear_wheels() "a rear wheel has no speed", "Act on the status of the speed, whose source the wheel belongs to.";
        - other_vehicle() "the profile is for another vehicle, see turn_indicators", "Do as the status `turn_indicators` says.";
        - waiting_for_requirement() "waiting for what tells this vehicle from others, see turn_indicators", "Do as the status `turn_indicators` says.";
        - speed_unknown() "the steering ratio depends on the speed, which is unknown", "Do as the status `velocity` says.";
        - bad_quality(sensor, signal, raw) "{sensor}: {signal} = {raw}", "Have the sensor repaired, or wait until it is calibrated.";
        - contradicted(what, remedy) "{what}; {remedy}", "Do as the message says.";
    }
}

/// Reports on the vehicle's status.
pub static SECTION: Section = Section {
    names: &["velocity", "steering", "gear", "control_mode", "doors"],
    messages: &[REPORT, STATUS],
};
