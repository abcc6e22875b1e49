//! The rules of upstream that differ from ours, one by one.

use crate::core::compat::Compat;

/// Rules of `scenario_simulator_v2` that differ from ours, each with its label and the title of its section
/// (docs/spec/traffic-lights.md, "Improved and upstream-compatible mode"). All are off in improved mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools)] // rules that have nothing to do with each other
pub struct LightQuirks {
    /// State and confidence actions take a plain id, of the conventional ground truth, and confidence actions one
    /// of 32 bits (Q1 and Q16, "Signal ids").
    pub plain_ids: bool,
    /// Writing an id is repeated on V2I only if the id itself is that of an enabled head (Q2, "Copying to V2I").
    pub copies_by_written_id: bool,
    /// A detection is kept under the id as written, that of a group for its first head (Q3, "Ids and groups").
    pub detects_by_written_id: bool,
    /// Explicit and copied V2I states of a phase are united (Q4, "Entering a phase").
    pub unites_copies: bool,
    /// Predictions are renewed with the next phase only, when those of all controllers are forgotten
    /// (Q5, "Predictions").
    pub renews_predictions_late: bool,
    /// Ids are cut to 32 bits when they are sent (Q6, "Ids and groups").
    pub cuts_ids: bool,
    /// Upper diagonal arrows are sent as unknown shapes (Q7, "Bulbs and their numbers").
    pub loses_upper_diagonals: bool,
    /// Actions may write `unknown` to a ground truth (Q8, "Unknown states").
    pub allows_unknown: bool,
    /// Conditions compare with a single bulb (Q9, "Conditions and triggers").
    pub compares_single_bulbs: bool,
    /// Predictions are of single bulbs, and none is made when the phase is longer than the cycle time, which is
    /// cut to whole seconds (Q10 and Q11, "Predictions").
    pub predicts_single_bulbs: bool,
    /// A light with nothing but `solidOff` bulbs is not dark (Q13, "Conditions and triggers").
    pub solid_off_is_not_dark: bool,
    /// Enabling and disabling V2I ignore unknown ids (Q14, "Ids and groups").
    pub ignores_unknown_ids: bool,
    /// Reading or clearing an untouched light makes it a dark one (Q15, "Stores and channels").
    pub touches_by_reading: bool,
    /// Any number is a confidence (Q16, "Actions and commands").
    pub takes_any_confidence: bool,
    /// A group is sent once for each of its lit heads (Q17, "Message building").
    pub one_group_per_head: bool,
    /// Architectures are distinguished by the order of their names (Q18, "Architectures").
    pub sorts_architectures: bool,
    /// Each channel draws its own markers (Q19, "Markers").
    pub draws_each_channel: bool,
    /// A wrong state or phase is found when it is applied, a state up to the mistake in it (Q20, "State text").
    pub finds_mistakes_late: bool,
    /// The clock adds up frame times, and a phase begins with the frame in which the last one ended
    /// (Q21, "Controllers and phases" and "Frames and rates").
    pub slips_by_frames: bool,
    /// Clearing a detection forgets its confidence ("Clearing").
    pub clears_confidence: bool,
    /// A state of a storyboard element holds from the first time that it is reached, and every element has been
    /// standing by (Q22, "Conditions and triggers").
    pub remembers_element_states: bool,
    /// An event whose trigger holds is executed as often as it may be within one frame (Q23, "Acts and events").
    pub repeats_events_at_once: bool,
    /// A camera's last message counts until V2I groups show that it is old ("Inputs and tolerances").
    pub keeps_last_camera: bool,
    /// A time has no value before the first frame, so that it cannot change in it ("Conditions and triggers").
    pub starts_without_time: bool,
    /// Enabling V2I does not copy the present state ("Copying to V2I").
    pub enables_without_copy: bool,
    /// A follower whose delay is over enters its first phase even if its cycle has reached it already
    /// ("Controllers and phases").
    pub repeats_first_phase: bool,
    /// Predictions outlive the scenario ("Improved and upstream-compatible mode").
    pub predicts_after_end: bool,
}

impl From<Compat> for LightQuirks {
    fn from(compat: Compat) -> Self {
        let upstream = compat == Compat::Upstream;
        Self {
            plain_ids: upstream,
            copies_by_written_id: upstream,
            detects_by_written_id: upstream,
            unites_copies: upstream,
            renews_predictions_late: upstream,
            cuts_ids: upstream,
            loses_upper_diagonals: upstream,
            allows_unknown: upstream,
            compares_single_bulbs: upstream,
            predicts_single_bulbs: upstream,
            solid_off_is_not_dark: upstream,
            ignores_unknown_ids: upstream,
            touches_by_reading: upstream,
            takes_any_confidence: upstream,
            one_group_per_head: upstream,
            sorts_architectures: upstream,
            draws_each_channel: upstream,
            finds_mistakes_late: upstream,
            slips_by_frames: upstream,
            clears_confidence: upstream,
            remembers_element_states: upstream,
            repeats_events_at_once: upstream,
            keeps_last_camera: upstream,
            starts_without_time: upstream,
            enables_without_copy: upstream,
            repeats_first_phase: upstream,
            predicts_after_end: upstream,
        }
    }
}
