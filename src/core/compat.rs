//! Which of two behaviours is wanted where upstream has weaknesses.

/// Whether the weaknesses of upstream are kept. Each is listed: W1 to W17 in docs/spec/turn-signal-decider.md, Q1 to
/// Q21 in docs/spec/traffic-lights.md, "Improved and upstream-compatible mode".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Compat {
    /// Without the weaknesses of upstream.
    #[default]
    Improved,
    /// As upstream: `scenario_simulator_v2`, release 25.0.20, or Autoware's turn-signal decider.
    Upstream,
}
