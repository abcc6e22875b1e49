//! Captions, and when each must hold.

use std::time::Duration;

use super::claim::Claim;
use gateway_base::time::MonoTime;

/// A caption of a demo. It is an assertion: the demo ends with an error when it does not hold.
#[derive(Debug)]
pub struct Caption {
    /// Time from which it is shown until the next caption.
    pub from: MonoTime,
    /// The caption.
    pub text: &'static str,
    /// Time after its start within which its claims need not hold yet.
    pub settling: Duration,
    /// Claims that hold from then on, until the next caption.
    pub holds: &'static [Claim],
}

/// The captions of a demo, in order.
pub type Story = &'static [Caption];

/// Default settling time of a caption: frames arrive every 20 to 100 ms.
const SETTLING: Duration = Duration::from_millis(300);

pub(super) const fn caption(from_ms: u64, text: &'static str, holds: &'static [Claim]) -> Caption {
    Caption { from: MonoTime::from_millis(from_ms), text, settling: SETTLING, holds }
}

impl Caption {
    pub(super) const fn settling_ms(self, settling_ms: u64) -> Self {
        Self { settling: Duration::from_millis(settling_ms), ..self }
    }

    pub(super) fn must_hold_from(&self) -> MonoTime {
        self.from.after(self.settling)
    }
}
