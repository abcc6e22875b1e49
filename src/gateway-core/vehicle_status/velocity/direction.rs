//! The direction of an unsigned speed: from a signal, or from the gear.

use super::binding::{DirectionSource, Motion, VelocityBinding};
use super::speed::SpeedReading;
use crate::vehicle_status::gear::Gear;
use crate::vehicle_status::state::{Judged, StatusContext, StatusReason};

/// Direction of the current motion; `None` at standstill, or while it is unknown.
#[derive(Debug, Clone, Copy, Default)]
pub struct DirectionMemory(Option<f64>);

impl DirectionMemory {
    /// Forgets the motion, which is no longer known.
    pub fn forget(&mut self) {
        self.0 = None;
    }

    /// Returns the sign of a speed: 1 forward, −1 backward. A vehicle that rolls without a gear keeps its
    /// direction until `is_standing`.
    pub fn sign(
        &mut self,
        binding: &VelocityBinding,
        reading: SpeedReading,
        is_standing: bool,
        gear: Judged<Gear>,
        context: StatusContext<'_>,
    ) -> Result<f64, StatusReason> {
        if reading.speed_mps == 0.0 {
            self.0 = self.0.filter(|_| !is_standing);
            return Ok(1.0);
        }
        if reading.is_signed {
            self.0 = Some(reading.speed_mps.signum());
            return Ok(1.0);
        }
        let mut first_reason = None;
        for source in &binding.directions {
            let told = match source {
                DirectionSource::Signal(role) => context.defined(role).map(|(motion, _)| match motion {
                    Motion::Forward => Some(1.0),
                    Motion::Backward => Some(-1.0),
                    Motion::Standstill => None,
                }),
                DirectionSource::Gear => gear.map(|(gear, _)| gear.direction()),
            };
            match told {
                Ok(Some(sign)) => {
                    self.0 = Some(sign);
                    return Ok(sign);
                }
                // Neutral, park, or a sensor that does not detect slow motion.
                Ok(None) => {}
                Err(reason) => first_reason = first_reason.or(Some(reason)),
            }
        }
        self.0
            .filter(|_| first_reason.is_none())
            .ok_or(first_reason.unwrap_or(StatusReason::DirectionNotTold))
    }
}
