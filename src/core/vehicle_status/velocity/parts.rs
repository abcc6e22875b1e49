//! The parts that a velocity is assembled of: configured, and of about the same time.

use super::binding::VelocityBinding;
use crate::core::can::ReceiveTime;
use crate::core::vehicle_status::settings::GeometryKey;
use crate::core::vehicle_status::state::StatusReason;

/// A value that the configuration gives.
///
/// # Errors
/// The key that is missing.
pub fn configured(value: Option<f64>, key: GeometryKey) -> Result<f64, StatusReason> {
    value.ok_or(StatusReason::NotConfigured(key))
}

/// A part that is not much older than the frame with the speed.
///
/// # Errors
/// The part is too old.
pub fn in_step<T>(
    part: (T, ReceiveTime),
    received: ReceiveTime,
    binding: &VelocityBinding,
) -> Result<T, StatusReason> {
    let (value, since) = part;
    if received.at.is_within(binding.max_skew, since.at) { Ok(value) } else { Err(StatusReason::OutOfStep) }
}
