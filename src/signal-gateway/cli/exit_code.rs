//! Exit codes of several commands.

/// The arguments cannot be followed.
pub(super) const USAGE: u8 = 2;
/// No gateway can be reached.
pub(super) const UNREACHABLE: u8 = 8;
