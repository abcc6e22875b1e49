//! Checks on the parts of a velocity: configured, and of about the same time.

use super::binding::VelocityBinding;
use crate::vehicle_status::settings::GeometryKey;
use crate::vehicle_status::state::StatusReason;
use can_signal::can::ReceiveTime;

/// Returns a configured value.
///
/// # Errors
/// Fails with the missing key.
pub fn configured(value: Option<f64>, key: GeometryKey) -> Result<f64, StatusReason> {
    value.ok_or(StatusReason::NotConfigured(key))
}

/// Returns a part that is not much older than the frame with the speed.
///
/// # Errors
/// Fails if the part is older by more than `max_skew` of the binding.
pub fn in_step<T>(
    part: (T, ReceiveTime),
    received: ReceiveTime,
    binding: &VelocityBinding,
) -> Result<T, StatusReason> {
    let (value, since) = part;
    if received.at.is_within(binding.max_skew, since.at) { Ok(value) } else { Err(StatusReason::OutOfStep) }
}
