//! Catalogue of all statuses of the gateway with their messages.

use crate::command::catalogue::{COMMAND, COMMAND_TRANSMISSION};
use crate::{v2i_reception, vehicle_lights, vehicle_status};
use can_signal::can::catalogue::INTERFACE;
use can_signal::validation;
use gateway_base::diagnostics::{MessageRow, Section, messages};
use traffic_lights::catalogue as traffic_light;

messages! {
    /// The wall clock.
    CLOCK {
        Ok steady() "steady";
        Warn stepped(seconds) "the wall clock has stepped by {seconds} s", "Check the time synchronisation of the host; the warning ends after 10 s.";
    }
}

/// The wall clock.
pub static WALL_CLOCK: Section = Section { names: &["wall_clock"], messages: &[CLOCK] };

/// All statuses of the gateway, in the order of `docs/diagnostics.md`.
pub static SECTIONS: [&Section; 10] = [
    &vehicle_lights::catalogue::SECTION,
    &vehicle_status::catalogue::SECTION,
    &INTERFACE,
    &COMMAND,
    &COMMAND_TRANSMISSION,
    &WALL_CLOCK,
    &turn_signal::catalogue::SECTION,
    &traffic_light::CHANNELS,
    &traffic_light::TRAFFIC_LIGHTS_SCENARIO,
    &v2i_reception::catalogue::V2I_TRAFFIC_LIGHTS,
];

/// All reasons that are part of messages, in addition to [`can_signal::can::catalogue::LINK`].
pub static REASONS: [&[&MessageRow]; 7] = [
    validation::catalogue::MISSING,
    validation::catalogue::ASLEEP,
    validation::catalogue::UNUSABLE,
    validation::catalogue::REQUIREMENT,
    vehicle_lights::catalogue::REASONS,
    vehicle_status::catalogue::REASONS,
    v2i_reception::catalogue::REASONS,
];
