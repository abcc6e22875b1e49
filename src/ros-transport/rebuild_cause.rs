//! The causes for which a DDS participant is replaced by a new one.
//!
//! A participant of RustDDS cannot be repaired from outside, but it can be replaced. So most workarounds for
//! its defects (`docs/development/rustdds.md`) consist of a watch that detects a condition, and of a new
//! participant.

/// A condition in which only a new participant helps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RebuildCause {
    /// A peer that was lost is back: the probe for it becomes our participant.
    PeerReturned,
    /// The wall clock was set back.
    ClockSetBack,
    /// A writer sends and is not received: the probe that receives it becomes our participant.
    WriterUnheard,
    /// A reader has not acknowledged for too long.
    Unacknowledged,
    /// There is an address or interface that the participant was not created with.
    NewAddress,
    /// RustDDS did not take a sample.
    WriteFailed,
    /// This process was stopped or hung, and peers may have given up its participant for good. Time without a
    /// processor does not count before the end of the lease.
    StoodStill,
    /// Too many writers of the participant were replaced.
    WornOut,
}

/// Facts of a cause.
#[derive(Debug, Clone, Copy)]
pub struct CauseRow {
    /// The cause itself.
    pub cause: RebuildCause,
    /// Log line of its own when the participant is replaced; `None` for the common line.
    pub log: Option<&'static str>,
    /// True if it is observed only at the checks of the network, and not soon after another participant was
    /// created.
    pub waits: bool,
    /// Title of the defect of RustDDS behind it, see `tests/rustdds_defects.toml`.
    pub defect: &'static str,
}

/// All causes, in the order in which they are observed. Each of those with a log line of its own leads to a
/// replacement; at a check, one replacement serves all that are observed.
pub const CAUSES: [CauseRow; 8] = [
    at_once(
        RebuildCause::PeerReturned,
        "a DDS peer is back after an outage: continuing with a new participant",
        "A peer that was lost is not found again",
    ),
    at_once(
        RebuildCause::ClockSetBack,
        "the wall clock was set back: continuing with a new DDS participant",
        "A step back of the wall clock silences best-effort readers",
    ),
    at_once(
        RebuildCause::WriterUnheard,
        "a writer is not heard any more, but sends: continuing with a new DDS participant",
        "A number far ahead in a writer's name",
    ),
    at_checks(RebuildCause::Unacknowledged, "A reader that forgot us seems never to acknowledge"),
    at_checks(RebuildCause::NewAddress, "Addresses are read once"),
    at_checks(RebuildCause::WriteFailed, "A writer does not take a sample"),
    at_checks(RebuildCause::StoodStill, "A stopped process is given up by its peers"),
    at_checks(RebuildCause::WornOut, "A replaced writer leaves memory behind"),
];

const fn at_once(cause: RebuildCause, log: &'static str, defect: &'static str) -> CauseRow {
    CauseRow { cause, log: Some(log), waits: false, defect }
}

const fn at_checks(cause: RebuildCause, defect: &'static str) -> CauseRow {
    CauseRow { cause, log: None, waits: true, defect }
}
