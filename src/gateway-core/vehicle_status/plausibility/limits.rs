//! Times and values from which a check applies.

use std::time::Duration;

pub(super) const ONE_SECOND: Duration = Duration::from_secs(1);
pub(super) const TWO_SECONDS: Duration = Duration::from_secs(2);
pub(super) const THREE_SECONDS: Duration = Duration::from_secs(3);
/// Time for which a yaw rate or a wheel speed must stay constant to count as frozen.
pub(super) const FROZEN: Duration = THREE_SECONDS;
/// Like [`FROZEN`], but for the steering, which drivers hold still on straight roads.
pub(super) const FROZEN_STEERING: Duration = Duration::from_secs(10);
/// Speed above which a constant value is suspect, m/s.
pub(super) const MOVING_MPS: f64 = 3.0;
/// Speed above which yaw rate and steering are compared, m/s.
pub(super) const TURNING_MPS: f64 = 2.0;
/// Speed above which direction and gear are compared, m/s.
pub(super) const ROLLING_MPS: f64 = 1.0;
/// Speed below which Autoware regards a vehicle or a wheel as standing still, m/s.
pub const STANDING_MPS: f64 = 0.1;
/// Minimum of both heading rates for comparing their signs, rad/s.
pub(super) const TURNING_RADPS: f64 = 0.05;
