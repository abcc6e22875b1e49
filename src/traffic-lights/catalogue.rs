//! Diagnostic messages of traffic lights.

use gateway_base::diagnostics::{Section, messages};

messages! {
    /// The lights of one channel.
    CHANNEL {
        Ok normal() "normal";
        Warn red_and_green(id) "{id} shows red and green", "Correct the phases, actions or inputs that set this light.";
        Warn rejected(id) "an input for {id} was rejected", "Correct the id or the state; shown for 10 s.";
        Warn unreadable() "an unreadable input was rejected", "Correct the sender; shown for 10 s.";
        Warn stale() "lights are no longer received", "Check the sender of the V2I states; the lights were removed.";
    }
}

messages! {
    /// The scenario and its time.
    SCENARIO {
        Ok no_scenario() "no scenario";
        Ok running() "running";
        Warn waiting_for_clock() "waiting for /clock", "Start the simulator; nothing is sent before its first time.";
        Warn clock_silent() "/clock is no longer received", "Check the simulator; time stands still without it.";
        Ok ended() "ended";
        Ok ended_in_success() "ended in success";
        Warn ended_in_failure() "ended in failure", "Read in the log which condition failed it.";
        Error cannot_continue(refusal) "cannot continue: {refusal}", "Correct the scenario.";
    }
}

/// The lights of one channel.
pub static CHANNELS: Section =
    Section { names: &["traffic_lights_conventional", "traffic_lights_v2i"], messages: &[CHANNEL] };

/// The scenario.
pub static TRAFFIC_LIGHTS_SCENARIO: Section =
    Section { names: &["traffic_lights_scenario"], messages: &[SCENARIO] };
