//! One command message, compiled from the profile: which bits say what.

use std::time::Duration;

use super::Turn;
use super::allow_list::SendPermission;
use super::arbitration::VehicleRequest;
use super::patch::Patch;
use super::push_button::PushButtonSettings;
use crate::core::can::frame::MAX_DATA;
use crate::core::validation::integrity::Protection;

/// A message the gateway sends.
#[derive(Debug, Clone)]
pub struct CommandMessage {
    /// DBC name, for people.
    pub name: String,
    /// Its place in the allow-list.
    pub permission: SendPermission,
    /// Every bit that nothing below sets.
    pub background: [u8; MAX_DATA],
    /// Its turn-indicator part.
    pub turn: Option<TurnPart>,
    /// Its hazard part.
    pub hazard: Option<HazardPart>,
    /// The bits that give it authority.
    pub enable: Option<Enable>,
    /// Counter and checksum; the same kinds as of received messages.
    pub protection: Option<Protection>,
    /// What goes out without authority.
    pub idle: Idle,
    /// When it goes out.
    pub timing: SendTiming,
}

/// What asks for turn indicators. All patches set the same bits.
#[derive(Debug, Clone)]
pub struct TurnPart {
    /// Neither side.
    pub off: Patch,
    /// Left.
    pub left: Patch,
    /// Right.
    pub right: Patch,
    /// Both sides, where the same signal asks for hazard lights.
    pub hazard: Option<Patch>,
    /// Nothing is asked for; as `off` where the vehicle has no such value.
    pub none: Option<Patch>,
}

/// What asks for hazard lights. All patches set the same bits.
#[derive(Debug, Clone)]
pub struct HazardPart {
    /// Off; of a button: not pressed.
    pub off: Patch,
    /// On; of a button: pressed.
    pub on: Patch,
    /// Nothing is asked for; as `off` where the vehicle has no such value.
    pub none: Option<Patch>,
    /// For a button that springs back: how to press it. None = a switch that stays.
    pub button: Option<PushButtonSettings>,
}

/// Bits that say whether the rest of the message counts. Both patches set the same bits.
#[derive(Debug, Clone)]
pub struct Enable {
    /// It counts.
    pub on: Patch,
    /// It does not.
    pub off: Patch,
}

/// What goes out while nothing is asked for with authority.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Idle {
    /// Frames that ask for nothing.
    #[default]
    Neutral,
    /// No frames.
    Silent,
}

/// When a message goes out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct SendTiming {
    /// From frame to frame while nothing changes.
    pub period: Duration,
    /// Frames in quick succession after a change, the first included; at least 1.
    pub burst: u8,
    /// From frame to frame of them.
    pub burst_gap: Duration,
    /// Least time between two frames, whatever happens; at most the period.
    pub min_send_interval: Duration,
}

/// The contents of a frame before counter and checksum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contents {
    /// The bytes.
    pub data: [u8; MAX_DATA],
    /// Whether it asks the vehicle for something.
    pub authority: bool,
}

impl CommandMessage {
    /// What to send for a request, or nothing. `pressed`: whether its button is pressed now.
    pub fn contents(&self, request: VehicleRequest, pressed: bool) -> Option<Contents> {
        let mut data = self.background;
        let turn = self.turn.as_ref().map(|part| part.patch(request));
        let hazard = self.hazard.as_ref().map(|part| part.patch(request.hazard, pressed));
        let mut authority = false;
        for (patch, asks) in [turn, hazard].into_iter().flatten() {
            patch.apply(&mut data);
            authority |= asks;
        }
        if let Some(enable) = &self.enable {
            if authority { &enable.on } else { &enable.off }.apply(&mut data);
        }
        (authority || self.idle == Idle::Neutral).then_some(Contents { data, authority })
    }
}

impl TurnPart {
    /// The bits, and whether they ask for something.
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
    /// The bits, and whether they ask for something.
    fn patch(&self, request: Option<bool>, pressed: bool) -> (&Patch, bool) {
        let on = if self.button.is_some() { request.map(|_| pressed) } else { request };
        match on {
            Some(true) => (&self.on, true),
            Some(false) => (&self.off, true),
            None => (self.none.as_ref().unwrap_or(&self.off), false),
        }
    }
}
