//! `[traffic_lights.arbiter]`: the arbiter's selection from camera and V2I.

use std::time::Duration;

use crate::config::reading::{ConfigKey, Fields, Keywords, flag, key_rows, keyword, number_as};
use traffic_lights::arbiter::{ArbiterSettings, Priority};

const PRIORITIES: Keywords<Priority> = &[
    ("confidence", Priority::Confidence),
    ("external", Priority::External),
    ("perception", Priority::Perception),
];

key_rows! {
    EXTERNAL_DELAY_TOLERANCE_S: Duration = tolerance("external_delay_tolerance_s", 5.0).doc("V2I stamp against the clock");
    EXTERNAL_TIME_TOLERANCE_S: Duration = tolerance("external_time_tolerance_s", 5.0).doc("V2I stamp against the camera's");
    PERCEPTION_TIME_TOLERANCE_S: Duration = tolerance("perception_time_tolerance_s", 1.0).doc("camera behind V2I");
    SOURCE_PRIORITY: Priority = keyword("source_priority", PRIORITIES).or_text("confidence")
        .doc("\"confidence\", \"external\" or \"perception\"");
    ENABLE_SIGNAL_MATCHING: bool = flag("enable_signal_matching", false).doc("vehicle groups only as far as camera and V2I agree");
}

const fn tolerance(name: &'static str, default: f64) -> ConfigKey<Duration> {
    number_as(name, 0.0, 3600.0, "s", |s| Some(Duration::from_secs_f64(s))).or_number(default)
}

pub(super) fn arbiter(fields: &Fields<'_>) -> ArbiterSettings {
    ArbiterSettings {
        external_delay_tolerance: fields.read(&EXTERNAL_DELAY_TOLERANCE_S),
        external_time_tolerance: fields.read(&EXTERNAL_TIME_TOLERANCE_S),
        perception_time_tolerance: fields.read(&PERCEPTION_TIME_TOLERANCE_S),
        priority: fields.read(&SOURCE_PRIORITY),
        matching: fields.read(&ENABLE_SIGNAL_MATCHING),
    }
}
