//! Status messages of turn indicators and hazard lights.

use crate::vehicle_report::catalogue::REPORT;
use gateway_base::diagnostics::{Section, messages};

messages! {
    /// Faults, irregularities, and why a report is withheld that no other status has.
    LIGHTS {
        Warn waking_up(reason) "waking up: {reason}";
        Warn not_visible(reason) "not visible: {reason}";
        Ok acknowledged() "not visible: never published, as acknowledged in the configuration";
        Error fault_published(device, signal, raw) "hardware fault: {device} ({signal} = {raw}), still published", "Have the vehicle repaired; the state itself is still known.";
        Error fault_not_published(device, signal, raw) "hardware fault: {device} ({signal} = {raw}), not published", "Have the vehicle repaired; `on_fault` withholds the report meanwhile.";
        Warn bulb_failure(lamp) "bulb failure: {lamp} flashes too fast", "Replace the bulb.";
        Warn does_not_flash(lamp) "{lamp} is lit and does not flash", "Check the flasher and the lamp's signal.";
        Warn emergency_flashing(left, right) "emergency flashing: {left} and {right} flash too fast", "Nothing is to be done; the vehicle signals hard braking.";
        Warn sources_disagree(source, state, other, other_state) "sources disagree: {source} = {state} is used, but {other} = {other_state}", "Find out which source is wrong; the more trusted one is used.";
    }
}

messages! {
    /// Why the state of the lights is unavailable.
    REASONS {
        - hazard_not_visible() "no signal shows the hazard lights, and without their report Autoware's /api/vehicle/status never appears", "Bind a signal in the profile, or accept it with `hazard_not_visible = \"acknowledged\"` in `[reports]`; `not_fitted` is for a vehicle without these lights.";
        - no_source_applies(signal, raw) "no source applies while {signal} = {raw}", "Give a source for this value in the profile (`when`).";
        - both_on(left, left_raw, right, right_raw) "{left} = {left_raw} and {right} = {right_raw} at once is not defined", "Check `both_on` of the lamps.";
        - observing_lamps(left, right) "observing the lamps {left} and {right}", "Wait; lamps are observed for a flash before off is reported.";
        - observing_stalk(signal) "observing {signal}, which may have been pressed before", "Wait, or operate the stalk or button.";
    }
}

/// Reports on turn indicators and hazard lights.
pub static SECTION: Section =
    Section { names: &["turn_indicators", "hazard_lights"], messages: &[REPORT, LIGHTS] };
