//! The commands as the vehicle hears them: whole, in sequence, with authority, and not too long ago.

use std::time::Duration;

use super::Happening;
use crate::core::bus::past;
use crate::core::command::Turn;
use crate::core::command::message::CommandMessage;
use crate::core::event::BusIndex;
use crate::core::frame::{Frame, MAX_DATA};
use crate::core::time::MonoTime;
use crate::core::trust::integrity::{Guard, MessageIntegrity, Verdict};

/// Periods without a frame after which a command is dropped.
const PERIODS: u32 = 5;

/// What is asked of the vehicle; none = nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Asked {
    pub(super) turn: Option<Turn>,
    pub(super) hazard: Option<bool>,
}

/// What came of a frame.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct Heard {
    /// Whether a button that springs back was pressed with it.
    pub(super) presses: bool,
    pub(super) told: Option<Happening>,
}

/// Listens to one command message.
#[derive(Debug, Clone)]
pub(super) struct Listener {
    message: CommandMessage,
    guard: Option<Guard>,
    timeout: Duration,
    asked: Asked,
    /// When the last believed frame came; none = what it asked for is dropped.
    heard_at: Option<MonoTime>,
    is_pressed: bool,
    is_rejecting: bool,
}

impl Listener {
    pub(super) fn new(message: &CommandMessage, timeout: Option<Duration>) -> Self {
        let timeout = timeout.unwrap_or(message.timing.period * PERIODS);
        let rules = message.protection.as_ref().map(|protection| MessageIntegrity {
            length: Some(message.permit.length()),
            protection: protection.clone(),
            window: None,
            forget_after: Some(timeout),
        });
        Self {
            message: message.clone(),
            guard: rules.map(Guard::new),
            timeout,
            asked: Asked::default(),
            heard_at: None,
            is_pressed: false,
            is_rejecting: false,
        }
    }

    /// Takes a frame; nothing comes of those of other messages.
    pub(super) fn hear(&mut self, bus: BusIndex, frame: &Frame, now: MonoTime) -> Heard {
        let permit = &self.message.permit;
        if (permit.bus(), permit.id()) != (bus, frame.id()) {
            return Heard::default();
        }
        let verdict = self.guard.as_mut().map_or(Verdict::Trusted, |guard| guard.check(frame, now));
        let why = match verdict {
            Verdict::Rejected(why) => Some(why.to_string()),
            Verdict::Trusted if frame.data().len() == permit.length() => None,
            Verdict::Trusted => Some("wrong length".to_owned()),
        };
        let was_rejecting = std::mem::replace(&mut self.is_rejecting, why.is_some());
        if let Some(why) = why {
            let message = self.message.name.clone();
            let told = (!was_rejecting).then_some(Happening::CommandRejected { message, why });
            return Heard { presses: false, told };
        }
        let (asked, is_pressed) = read(&self.message, frame.padded());
        let presses = is_pressed && !self.is_pressed;
        (self.asked, self.is_pressed, self.heard_at) = (asked, is_pressed, Some(now));
        Heard { presses, told: None }
    }

    /// Drops what was asked for too long ago.
    pub(super) fn settle(&mut self, now: MonoTime) -> Option<Happening> {
        self.heard_at.filter(|at| now.since(*at) > self.timeout)?;
        (self.heard_at, self.is_pressed) = (None, false);
        let asked = std::mem::take(&mut self.asked);
        let message = self.message.name.clone();
        (asked != Asked::default()).then_some(Happening::CommandTimedOut { message })
    }

    pub(super) fn asked(&self) -> Asked {
        self.asked
    }

    pub(super) fn next_deadline(&self) -> Option<MonoTime> {
        self.heard_at.map(|at| past(at, self.timeout))
    }
}

/// What a frame asks for, and whether it presses a button.
fn read(message: &CommandMessage, data: &[u8; MAX_DATA]) -> (Asked, bool) {
    if message.enable.as_ref().is_some_and(|enable| !enable.on.matches(data)) {
        return (Asked::default(), false);
    }
    let mut asked = Asked::default();
    if let Some(part) = &message.turn {
        if part.hazard.as_ref().is_some_and(|patch| patch.matches(data)) {
            (asked.turn, asked.hazard) = (Some(Turn::Off), Some(true));
        } else if !part.none.as_ref().is_some_and(|patch| patch.matches(data)) {
            let states = [(&part.left, Turn::Left), (&part.right, Turn::Right), (&part.off, Turn::Off)];
            asked.turn = states.into_iter().find(|(patch, _)| patch.matches(data)).map(|(_, turn)| turn);
            asked.hazard = part.hazard.as_ref().map(|_| false);
        }
    }
    let Some(part) = &message.hazard else { return (asked, false) };
    if part.button.is_some() {
        return (asked, part.on.matches(data));
    }
    if !part.none.as_ref().is_some_and(|patch| patch.matches(data)) {
        let states = [(&part.on, true), (&part.off, false)];
        asked.hazard = states.into_iter().find(|(patch, _)| patch.matches(data)).map(|(_, on)| on);
    }
    (asked, false)
}
