//! Status messages of a V2X unit.

use gateway_base::diagnostics::{Section, messages};

messages! {
    /// The states that a V2X unit sends.
    V2I {
        Ok known(known, groups) "{known} of {groups} known";
        Warn group(group, reason) "{group}: {reason}";
    }
}

messages! {
    /// Why the state of a group cannot be used.
    REASONS {
        - states_unusable(signal, raw) "{signal} = {raw} reports that states cannot be used", "Check the V2X unit; it does not trust its own states.";
    }
}

messages! {
    /// Why a group has no state where there need not be any, in the key `groups` only.
    AWAY {
        - not_received() "not received yet";
        - not_received_again() "not received again";
    }
}

/// Reception from a V2X unit.
pub static V2I_TRAFFIC_LIGHTS: Section = Section { names: &["v2i_traffic_lights"], messages: &[V2I] };
