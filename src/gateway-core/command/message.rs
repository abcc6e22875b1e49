//! A command message, compiled from the profile: the bits of each request.

use std::time::Duration;

use super::Turn;
use super::allow_list::SendPermission;
use super::arbitration::VehicleRequest;
use super::patch::Patch;
use super::push_button::PushButtonSettings;
use can_signal::can::MAX_DATA;
use can_signal::validation::integrity::Protection;

/// A message that the gateway sends.
#[derive(Debug, Clone)]
pub struct CommandMessage {
    /// Name in the DBC, used in texts.
    pub name: String,
    /// Permission of the allow-list to send the message.
    pub permission: SendPermission,
    /// Bits set by none of the parts below.
    pub background: [u8; MAX_DATA],
    /// Bits for the turn indicators; `None` = the message has none.
    pub turn: Option<TurnPart>,
    /// Bits for the hazard lights; `None` = the message has none.
    pub hazard: Option<HazardPart>,
    /// Bits that give the message authority.
    pub enable: Option<Enable>,
    /// Counter and checksum, of the same kinds as in received messages.
    pub protection: Option<Protection>,
    /// Frames sent without authority.
    pub idle: Idle,
    /// Interval, burst and minimum interval of its frames.
    pub timing: SendTiming,
}

/// Bits that request turn indicators. All patches set the same bits.
#[derive(Debug, Clone)]
pub struct TurnPart {
    /// Values that request neither side.
    pub off: Patch,
    /// Values that request the left side.
    pub left: Patch,
    /// Values that request the right side.
    pub right: Patch,
    /// Values that request both sides, if the same signal requests hazard lights.
    pub hazard: Option<Patch>,
    /// Values for no request; `None` = same as `off`, if the vehicle has no such value.
    pub none: Option<Patch>,
}

/// Bits that request hazard lights. All patches set the same bits.
#[derive(Debug, Clone)]
pub struct HazardPart {
    /// Values for off; for a button: not pressed.
    pub off: Patch,
    /// Values for on; for a button: pressed.
    pub on: Patch,
    /// Values for no request; `None` = same as `off`, if the vehicle has no such value.
    pub none: Option<Patch>,
    /// Timing of a momentary button; `None` for a latching switch.
    pub button: Option<PushButtonSettings>,
}

/// Bits that enable the rest of the message. Both patches set the same bits.
#[derive(Debug, Clone)]
pub struct Enable {
    /// Values with which the rest of the message takes effect.
    pub on: Patch,
    /// Values with which the rest has no effect.
    pub off: Patch,
}

/// Frames sent while nothing is requested with authority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Idle {
    /// Frames without a request.
    #[default]
    Neutral,
    /// No frames are sent.
    Silent,
}

/// Send times of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SendTiming {
    /// Interval of frames while nothing changes.
    pub period: Duration,
    /// Frames in quick succession after a change, the first included; at least 1.
    pub burst: u8,
    /// Interval between the frames of a burst.
    pub burst_gap: Duration,
    /// Minimum interval between two frames in any case; at most the period.
    pub min_send_interval: Duration,
}

/// Contents of a frame before counter and checksum are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameContents {
    /// Data without counter and checksum.
    pub data: [u8; MAX_DATA],
    /// True if the frame requests something from the vehicle.
    pub authority: bool,
}

impl CommandMessage {
    /// Returns the contents for a request; `None` when no frame is sent. `pressed` is true while its button
    /// is pressed.
    pub fn contents(&self, request: VehicleRequest, pressed: bool) -> Option<FrameContents> {
        let mut data = self.background;
        let turn = self.turn.as_ref().map(|part| part.patch(request));
        let hazard = self.hazard.as_ref().map(|part| part.patch(request.hazard, pressed));
        let mut authority = false;
        for (patch, is_request) in [turn, hazard].into_iter().flatten() {
            patch.apply(&mut data);
            authority |= is_request;
        }
        if let Some(enable) = &self.enable {
            if authority { &enable.on } else { &enable.off }.apply(&mut data);
        }
        (authority || self.idle == Idle::Neutral).then_some(FrameContents { data, authority })
    }
}

impl TurnPart {
    /// Returns the bits, and true if they request something.
    fn patch(&self, request: VehicleRequest) -> (&Patch, bool) {
        match (request.hazard, &self.hazard, request.turn) {
            (Some(true), Some(hazard), _) => (hazard, true),
            (_, _, Some(Turn::Off)) => (&self.off, true),
            (_, _, Some(Turn::Left)) => (&self.left, true),
            (_, _, Some(Turn::Right)) => (&self.right, true),
            (_, _, None) => (self.none.as_ref().unwrap_or(&self.off), false),
        }
    }
}

impl HazardPart {
    /// Returns the bits, and true if they request something.
    fn patch(&self, request: Option<bool>, pressed: bool) -> (&Patch, bool) {
        let on = if self.button.is_some() { request.map(|_| pressed) } else { request };
        match on {
            Some(true) => (&self.on, true),
            Some(false) => (&self.off, true),
            None => (self.none.as_ref().unwrap_or(&self.off), false),
        }
    }
}
