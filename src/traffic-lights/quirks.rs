//! The rules of upstream that differ from improved mode, one by one.

use crate::compat::Compat;

/// Defines the rules, and the constructor from a mode, which sets all of them at once.
macro_rules! light_quirks {
    ($($(#[$doc:meta])* $quirk:ident,)*) => {
        /// Rules of `scenario_simulator_v2` that differ from ours, each with its label and the title of its
        /// section (docs/spec/traffic-lights.md, "Improved and upstream-compatible mode"). All are off in
        /// improved mode.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[allow(clippy::struct_excessive_bools)] // rules that have nothing to do with each other
        pub struct LightQuirks {
            $($(#[$doc])* pub $quirk: bool,)*
        }

        impl From<Compat> for LightQuirks {
            fn from(compat: Compat) -> Self {
                let upstream = compat == Compat::Upstream;
                Self { $($quirk: upstream,)* }
            }
        }
    };
}

light_quirks! {
    /// State and confidence actions take a plain id, of the conventional ground truth, and confidence actions
    /// one of 32 bits (Q1 and Q16, "Signal ids").
    plain_ids,
    /// Writing an id is repeated on V2I only if the id itself names an enabled head (Q2, "Copying to V2I").
    copies_by_written_id,
    /// A detection is kept under the id as written, a group's id for its first head (Q3, "Ids and groups").
    detects_by_written_id,
    /// Explicit and copied V2I states of a phase are united (Q4, "Entering a phase").
    unites_copies,
    /// Predictions are renewed with the next phase only, and then the predictions of all controllers are
    /// forgotten (Q5, "Predictions").
    renews_predictions_late,
    /// Ids are cut to 32 bits when they are sent (Q6, "Ids and groups").
    cuts_ids,
    /// Upper diagonal arrows are sent as unknown shapes (Q7, "Bulbs and their numbers").
    loses_upper_diagonals,
    /// Actions may write `unknown` to a ground truth (Q8, "Unknown states").
    allows_unknown,
    /// Conditions compare with a single bulb (Q9, "Conditions and triggers").
    compares_single_bulbs,
    /// Predictions are of single bulbs, and none is made when the phase is longer than the cycle time, which
    /// is cut to whole seconds (Q10 and Q11, "Predictions").
    predicts_single_bulbs,
    /// A light with nothing but `solidOff` bulbs is not dark (Q13, "Conditions and triggers").
    solid_off_is_not_dark,
    /// Enabling and disabling V2I ignore unknown ids (Q14, "Ids and groups").
    ignores_unknown_ids,
    /// Reading or clearing an untouched light makes it a dark one (Q15, "Stores and channels").
    touches_by_reading,
    /// Any number is a confidence (Q16, "Actions and commands").
    takes_any_confidence,
    /// A group is sent once for each of its lit heads (Q17, "Message building").
    one_group_per_head,
    /// Architectures are distinguished by the order of their names (Q18, "Architectures").
    sorts_architectures,
    /// Each channel draws its own markers (Q19, "Markers").
    draws_each_channel,
    /// A wrong state or phase is found when it is applied, a state up to the mistake in it (Q20, "State
    /// text").
    finds_mistakes_late,
    /// The clock adds up frame times, and a phase begins with the frame in which the last one ended
    /// (Q21, "Controllers and phases" and "Frames and rates").
    slips_by_frames,
    /// Clearing a detection forgets its confidence ("Clearing").
    clears_confidence,
    /// A state of a storyboard element holds from the first time that it is reached, and every element has
    /// been standing by (Q22, "Conditions and triggers").
    remembers_element_states,
    /// An event whose trigger holds is executed as often as it may be within one frame (Q23, "Acts and
    /// events").
    repeats_events_at_once,
    /// A camera's last message counts until V2I groups show that it is old ("Inputs and tolerances").
    keeps_last_camera,
    /// A time has no value before the first frame, so that it cannot change in it ("Conditions and
    /// triggers").
    starts_without_time,
    /// Enabling V2I does not copy the present state ("Copying to V2I").
    enables_without_copy,
    /// A follower whose delay is over enters its first phase even if its cycle has reached it already
    /// ("Controllers and phases").
    repeats_first_phase,
    /// Predictions outlive the scenario ("Improved and upstream-compatible mode").
    predicts_after_end,
}
