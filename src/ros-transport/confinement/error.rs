//! Reasons why a layer of the confinement is missing.

use thiserror::Error;

/// Reason why the kernel does not confine as requested.
#[derive(Debug, Error)]
pub(super) enum ConfinementError {
    #[error("this kernel has a part of it")]
    Partial,
    #[error("this kernel has none, or it is switched off")]
    Absent,
    #[error(transparent)]
    Ruleset(#[from] landlock::RulesetError),
    #[error(transparent)]
    Filter(#[from] seccompiler::BackendError),
    #[error(transparent)]
    Kernel(#[from] std::io::Error),
}
