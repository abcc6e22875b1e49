//! Reception of command messages: intact, in sequence and not timed out.

use std::time::Duration;

use super::output::VehicleEvent;
use can_signal::can::{BusIndex, Frame, MAX_DATA};
use can_signal::validation::integrity::{IntegrityChecker, MessageIntegrity};
use gateway_base::time::{MonoTime, deadline_after};
use gateway_core::command::Turn;
use gateway_core::command::arbitration::VehicleRequest;
use gateway_core::command::message::CommandMessage;

/// Number of periods without a frame after which a command times out by default.
const PERIODS: u32 = 5;

#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct FrameEffect {
    /// True if it presses a momentary button.
    pub(super) presses: bool,
    pub(super) event: Option<VehicleEvent>,
}

#[derive(Debug, Clone)]
pub(super) struct CommandReceiver {
    message: CommandMessage,
    checker: Option<IntegrityChecker>,
    timeout: Duration,
    pub(super) request: VehicleRequest,
    /// Receive time of the last valid frame; `None` means no request.
    received_at: Option<MonoTime>,
    is_pressed: bool,
    is_rejecting: bool,
}

impl CommandReceiver {
    pub(super) fn new(message: &CommandMessage, timeout: Option<Duration>) -> Self {
        let timeout = timeout.unwrap_or(message.timing.period * PERIODS);
        let rules = message.protection.as_ref().map(|protection| MessageIntegrity {
            length: Some(message.permission.length()),
            protection: protection.clone(),
            window: None,
            forget_after: Some(timeout),
        });
        Self {
            message: message.clone(),
            checker: rules.map(IntegrityChecker::new),
            timeout,
            request: VehicleRequest::default(),
            received_at: None,
            is_pressed: false,
            is_rejecting: false,
        }
    }

    /// Handles a frame; frames of other messages have no effect.
    pub(super) fn on_frame(&mut self, bus: BusIndex, frame: &Frame, now: MonoTime) -> FrameEffect {
        let permission = &self.message.permission;
        if (permission.bus(), permission.id()) != (bus, frame.id()) {
            return FrameEffect::default();
        }
        let verdict = self.checker.as_mut().map_or(Ok(()), |checker| checker.check(frame, now));
        let reason = match verdict {
            Err(reject) => Some(reject.to_string()),
            Ok(()) if frame.data().len() == permission.length() => None,
            Ok(()) => Some("wrong length".to_owned()),
        };
        let was_rejecting = std::mem::replace(&mut self.is_rejecting, reason.is_some());
        if let Some(why) = reason {
            let message = self.message.name.clone();
            let event = (!was_rejecting).then_some(VehicleEvent::CommandRejected { message, why });
            return FrameEffect { presses: false, event };
        }
        let (request, is_pressed) = read(&self.message, frame.padded());
        let presses = is_pressed && !self.is_pressed;
        (self.request, self.is_pressed, self.received_at) = (request, is_pressed, Some(now));
        FrameEffect { presses, event: None }
    }

    pub(super) fn settle(&mut self, now: MonoTime) -> Option<VehicleEvent> {
        self.received_at.filter(|at| now.since(*at) > self.timeout)?;
        (self.received_at, self.is_pressed) = (None, false);
        let request = std::mem::take(&mut self.request);
        let message = self.message.name.clone();
        (request != VehicleRequest::default()).then_some(VehicleEvent::CommandTimedOut { message })
    }

    pub(super) fn next_deadline(&self) -> Option<MonoTime> {
        self.received_at.map(|at| deadline_after(at, self.timeout))
    }
}

/// Returns the request of a frame, and whether it presses a button.
fn read(message: &CommandMessage, data: &[u8; MAX_DATA]) -> (VehicleRequest, bool) {
    if message.enable.as_ref().is_some_and(|enable| !enable.on.matches(data)) {
        return (VehicleRequest::default(), false);
    }
    let mut request = VehicleRequest::default();
    if let Some(part) = &message.turn {
        if part.hazard.as_ref().is_some_and(|patch| patch.matches(data)) {
            (request.turn, request.hazard) = (Some(Turn::Off), Some(true));
        } else if !part.none.as_ref().is_some_and(|patch| patch.matches(data)) {
            let states = [(&part.left, Turn::Left), (&part.right, Turn::Right), (&part.off, Turn::Off)];
            request.turn = states.into_iter().find(|(patch, _)| patch.matches(data)).map(|(_, turn)| turn);
            request.hazard = part.hazard.as_ref().map(|_| false);
        }
    }
    let Some(part) = &message.hazard else { return (request, false) };
    if part.button.is_some() {
        return (request, part.on.matches(data));
    }
    if !part.none.as_ref().is_some_and(|patch| patch.matches(data)) {
        let states = [(&part.on, true), (&part.off, false)];
        request.hazard = states.into_iter().find(|(patch, _)| patch.matches(data)).map(|(_, on)| on);
    }
    (request, false)
}
