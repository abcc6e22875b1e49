//! The two modes of the traffic lights, which differ where upstream has weaknesses.

/// Treatment of the weaknesses of upstream, `scenario_simulator_v2`: Q1 to Q23 in
/// docs/spec/traffic-lights.md, "Improved and upstream-compatible mode".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Compat {
    /// The weaknesses of upstream are corrected.
    #[default]
    Improved,
    /// The behaviour of `scenario_simulator_v2`, release 25.0.20, is reproduced.
    Upstream,
}
