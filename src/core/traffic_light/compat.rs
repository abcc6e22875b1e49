//! Which of two behaviours is wanted where the simulator's is not the best one.

/// The divergences are Q1 to Q21 of the traffic-lights specification, section 10.1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Compat {
    /// Ours.
    #[default]
    Improved,
    /// That of `scenario_simulator_v2`, release 25.0.20.
    Upstream,
}
