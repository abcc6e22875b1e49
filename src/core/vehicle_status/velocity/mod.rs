//! Speed and heading rate at the middle of the rear axle.

/// Motion of the middle of the rear axle. The lateral speed is 0 by the model of a car whose rear wheels do not steer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Velocity {
    /// Speed, m/s, forward positive.
    pub longitudinal_mps: f64,
    /// Heading rate, rad/s, counter-clockwise positive.
    pub heading_rate_radps: f64,
}
