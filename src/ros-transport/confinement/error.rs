//! Reasons why a layer of the confinement is missing.

use thiserror::Error;

/// Reason why the kernel does not confine as requested.
#[derive(Debug, Error)]
pub(super) enum ConfinementError {
    /// The kernel supports an older version of Landlock.
    #[error("this kernel has a part of it")]
    Partial,
    /// The kernel has no Landlock.
    #[error("this kernel has none, or it is switched off")]
    Absent,
    /// Landlock refuses the rules.
    #[error(transparent)]
    Ruleset(#[from] landlock::RulesetError),
    /// The rules are not a valid filter.
    #[error(transparent)]
    Filter(#[from] seccompiler::BackendError),
    /// The kernel refuses a filter.
    #[error(transparent)]
    Kernel(#[from] std::io::Error),
}
