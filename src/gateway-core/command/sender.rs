//! Sends one message: periodically and immediately on a change, with a minimum interval and an unbroken
//! counter. It recognises its own frames by loopback.

use std::collections::VecDeque;
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::allow_list::{CommandFrame, SendPermission};
use super::message::{CommandMessage, FrameContents};
use can_signal::can::{Frame, MAX_DATA};
use can_signal::validation::integrity::Protection;
use gateway_base::time::{MonoTime, deadline_after};

/// Largest number of own frames expected back by loopback.
const MAX_UNCONFIRMED: usize = 8;
/// Number of successive failures after which sending counts as broken.
const BROKEN_AFTER: u32 = 10;
const FOREIGN_SHOWN: Duration = Duration::from_secs(1);

/// Reason why a frame was not sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SendFailure {
    /// The send queue is full (`ENOBUFS`, `EAGAIN`); a later attempt may succeed.
    QueueFull,
    /// The socket refused the frame; the code is the `errno`.
    Refused(i32),
}

/// Origin of a received frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FrameOrigin {
    /// The gateway does not send this message, so the frame is assumed to come from the vehicle.
    Vehicle,
    /// The loopback of a frame that the gateway sent.
    Own,
    /// The gateway sends this message, but did not send this frame: another sender commands the vehicle.
    Foreign,
}

/// Number of frames of one message since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct SendCounts {
    /// Given out to be sent and not failed.
    pub sent: u64,
    /// Number of them that request something of the vehicle.
    pub with_authority: u64,
    /// Not sent because the queue was full.
    pub queue_full: u64,
    /// Not sent because the socket refused them.
    pub refused: u64,
    /// Received back by loopback.
    pub echoed: u64,
    /// Frames of this message from another sender.
    pub foreign: u64,
}

/// The last submitted frame, which is rolled back if sending fails.
#[derive(Debug, Clone)]
struct SubmittedFrame {
    frame: Frame,
    counter: u32,
    authority: bool,
}

/// Sends the frames of one command message.
#[derive(Debug, Clone)]
pub struct Sender {
    contents: Option<FrameContents>,
    due: Option<MonoTime>,
    burst_left: u8,
    last_sent: Option<MonoTime>,
    counter: u32,
    submitted: Option<SubmittedFrame>,
    failures: u32,
    unconfirmed: VecDeque<Frame>,
    foreign_at: Option<MonoTime>,
    /// Number of frames since start, by outcome.
    pub counts: SendCounts,
}

impl Sender {
    /// Creates a sender that has sent nothing.
    pub fn new(message: &CommandMessage) -> Self {
        Self {
            contents: None,
            due: None,
            burst_left: 0,
            last_sent: None,
            counter: message.protection.as_ref().map_or(0, Protection::first_counter),
            submitted: None,
            failures: 0,
            unconfirmed: VecDeque::new(),
            foreign_at: None,
            counts: SendCounts::default(),
        }
    }

    /// Returns the frame to send now; `None` if none is due. Without `contents` nothing is sent.
    pub fn settle(
        &mut self,
        message: &CommandMessage,
        contents: Option<FrameContents>,
        now: MonoTime,
    ) -> Option<CommandFrame> {
        let timing = message.timing;
        if contents != self.contents {
            self.contents = contents;
            self.due = contents.map(|_| now);
            self.burst_left = timing.burst;
        }
        let (contents, due) = (self.contents?, self.due?);
        let allowed = self.last_sent.map_or(due, |last| last.after(timing.min_send_interval).max(due));
        if now < allowed {
            self.due = Some(allowed);
            return None;
        }
        self.burst_left = self.burst_left.saturating_sub(1);
        let next = if self.burst_left > 0 { now.after(timing.burst_gap) } else { due.after(timing.period) };
        // After a late call, missed frames are not sent.
        self.due = Some(if next > now { next } else { now.after(timing.period) });
        let counter = self.counter;
        let frame = encode(&message.permission, message.protection.as_ref(), contents.data, counter)?;
        self.counter = message.protection.as_ref().map_or(0, |protection| protection.next_counter(counter));
        self.last_sent = Some(now);
        self.counts.sent += 1;
        self.counts.with_authority += u64::from(contents.authority);
        let submitted = SubmittedFrame { frame: *frame.frame(), counter, authority: contents.authority };
        if self.submitted.replace(submitted).is_some() {
            // The previous frame has not failed.
            self.failures = 0;
        }
        if self.unconfirmed.len() == MAX_UNCONFIRMED {
            self.unconfirmed.pop_front();
        }
        self.unconfirmed.push_back(*frame.frame());
        Some(frame)
    }

    /// Records when the last submitted frame was sent. The minimum interval starts at this time.
    pub fn handle_sent(&mut self, at: MonoTime) {
        self.last_sent = self.last_sent.max(Some(at));
    }

    /// Records that the last submitted frame could not be sent: its counter value is used again, and a frame
    /// is due after the minimum interval. The failure of an earlier frame is ignored.
    pub fn handle_failure(
        &mut self,
        message: &CommandMessage,
        frame: &Frame,
        failure: SendFailure,
        now: MonoTime,
    ) {
        let Some(submitted) = self.submitted.take_if(|submitted| submitted.frame == *frame) else { return };
        self.counter = submitted.counter;
        self.unconfirmed.pop_back();
        self.counts.sent -= 1;
        self.counts.with_authority -= u64::from(submitted.authority);
        match failure {
            SendFailure::QueueFull => self.counts.queue_full += 1,
            SendFailure::Refused(_) => self.counts.refused += 1,
        }
        self.failures = self.failures.saturating_add(1);
        self.burst_left = self.burst_left.max(1);
        self.due = self.contents.map(|_| now.after(message.timing.min_send_interval));
    }

    /// Returns the origin of a received frame of this message.
    pub fn classify_frame(&mut self, frame: &Frame, now: MonoTime) -> FrameOrigin {
        if let Some(at) = self.unconfirmed.iter().position(|own| own == frame) {
            self.unconfirmed.remove(at);
            self.counts.echoed += 1;
            return FrameOrigin::Own;
        }
        self.counts.foreign += 1;
        self.foreign_at = Some(now);
        FrameOrigin::Foreign
    }

    /// Forgets the submitted frames, which in a dry run are not sent and do not come back.
    pub fn forget_echoes(&mut self) {
        self.unconfirmed.clear();
    }

    /// Drops all pending frames because nothing can be sent. The next contents count as a change.
    pub fn cut_off(&mut self) {
        self.contents = None;
        self.due = None;
        self.burst_left = 0;
        self.submitted = None;
        self.failures = 0;
        self.unconfirmed.clear();
    }

    /// Returns the time at which a frame is due, or a foreign frame is no longer shown.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let foreign = self.foreign_at.map(|at| deadline_after(at, FOREIGN_SHOWN)).filter(|at| *at > now);
        self.due.into_iter().chain(foreign).min()
    }

    /// Returns true if a frame is still waiting to be sent.
    pub fn is_waiting(&self) -> bool {
        self.due.is_some()
    }

    /// Returns the problem with sending; `None` if the last frame was sent.
    pub fn problem(&self) -> Option<SendProblem> {
        match self.failures {
            0 => None,
            1..BROKEN_AFTER => Some(SendProblem::Delayed),
            BROKEN_AFTER.. => Some(SendProblem::Broken),
        }
    }

    /// Returns true if another sender has sent this message within the last second.
    pub fn has_conflicting_sender(&self, now: MonoTime) -> bool {
        self.foreign_at.is_some_and(|at| now.since(at) <= FOREIGN_SHOWN)
    }
}

/// A problem with sending.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SendProblem {
    /// The last frame could not be sent.
    Delayed,
    /// None of the last frames could be sent.
    Broken,
}

/// Builds a frame with counter and checksum; `None` if they do not fit, which the configuration prevents.
fn encode(
    permission: &SendPermission,
    protection: Option<&Protection>,
    mut data: [u8; MAX_DATA],
    counter: u32,
) -> Option<CommandFrame> {
    let (id, length) = (permission.id(), permission.length());
    let is_protected = protection.is_none_or(|rules| rules.protect(id, counter, &mut data, length));
    if is_protected { permission.frame(&data) } else { None }
}
