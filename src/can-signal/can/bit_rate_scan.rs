//! Finds the bit rate of a bus: tries the usual ones in turn with a controller that only listens.
//!
//! The scan decides and touches nothing. [`BitRateScan::start`] and [`BitRateScan::answer`] return the next
//! [`ScanStep`], the caller carries it out and answers with its outcome, until [`ScanStep::Finish`]. Whatever
//! happens, the interface ends down and with its earlier settings, as far as the kernel can restore them.

use std::time::Duration;

use super::CanInput;
use super::interface_state::{ControllerModes, InterfaceKind, InterfaceState};

/// Bit rates in use on vehicles, the most frequent first, bit/s.
pub const USUAL_BITRATES: [u32; 11] =
    [500_000, 250_000, 125_000, 1_000_000, 100_000, 83_333, 33_333, 50_000, 800_000, 20_000, 10_000];

/// Frames without an error frame between them that end the scan at once. A wrong bit rate lets no frame
/// through its checksum but by chance.
const ENOUGH_FRAMES: u64 = 5;
/// Error frames without a frame between them that end the listening at a rate.
const ENOUGH_ERRORS: u64 = 100;

/// Why an interface is not scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ScanRefusal {
    /// No interface has this name.
    #[error("there is no interface of that name")]
    Missing,
    /// It is not a CAN interface.
    #[error("it is not a CAN interface")]
    NotCan,
    /// It has no controller, and so no bit rate.
    #[error("it is virtual, and has no bit rate")]
    Virtual,
    /// It is up, and so perhaps in use.
    #[error("it is up, and its bit rate is not changed while others may use it")]
    Up,
    /// Its driver cannot only listen, so that a wrong bit rate would disturb the bus.
    #[error("its driver has no listen-only mode, so that a wrong bit rate would disturb the bus")]
    NoListenOnly,
}

/// Settings that a step gives to the controller, all of which others are left unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanSettings {
    /// Bit rate, bit/s.
    pub bitrate_bps: u32,
    /// Whether error frames are turned on as well; false leaves them as they are.
    pub error_reporting: bool,
}

/// What the caller does next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanStep {
    /// Set the bit rate and turn listen-only on, in one request, while the interface is down.
    Configure(ScanSettings),
    /// Bring the interface up.
    BringUp,
    /// Count frames and error frames for at most this time, or until [`Heard::is_enough`].
    Listen(Duration),
    /// Bring the interface down.
    BringDown,
    /// Give the controller the settings back that it had before the scan.
    Restore,
    /// Nothing more: [`BitRateScan::result`] has the result.
    Finish,
}

/// Outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanAnswer {
    /// It was done.
    Done,
    /// The kernel refused it, with its `errno`.
    Refused(i32),
    /// What was counted while listening.
    Heard(Heard),
    /// The user wants an end; the step may have been left out or cut short.
    Interrupted,
}

/// Frames of a bus at one bit rate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Heard {
    /// Data frames.
    pub frames: u64,
    /// Error frames that report an error on the wire.
    pub error_frames: u64,
}

impl Heard {
    /// Counts an input.
    pub fn take(&mut self, input: &CanInput) {
        self.frames += u64::from(matches!(input, CanInput::Frame { .. }));
        self.error_frames +=
            u64::from(matches!(input, CanInput::ErrorFrame { error, .. } if !error.is_recovery()));
    }

    /// Returns true if this rate is right or wrong beyond doubt.
    pub fn is_enough(self) -> bool {
        self.fits() || self.frames == 0 && self.error_frames >= ENOUGH_ERRORS
    }

    fn fits(self) -> bool {
        self.frames >= ENOUGH_FRAMES && self.error_frames == 0
    }
}

/// One bit rate that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriedRate {
    /// Bit rate, bit/s.
    pub bitrate_bps: u32,
    /// What was heard; the `errno` where the driver refuses the rate.
    pub heard: Result<Heard, i32>,
}

/// What the scan has found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanVerdict {
    /// Frames came at this rate alone, and more of them than error frames.
    Found(u32),
    /// Frames came, but at several rates or among many errors; this rate fits best.
    Likely(u32),
    /// Errors came at some rate, and frames at none: an unusual bit rate, or CAN FD.
    NoRate,
    /// Nothing came at all.
    Silent,
    /// The user ended it before a rate was found.
    Interrupted,
    /// The kernel refused a step without which nothing can be tried, with its `errno`.
    Refused(i32),
}

/// Result of a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScanResult {
    /// What was found.
    pub verdict: ScanVerdict,
    /// Rates in the order in which they were tried.
    pub tried: Vec<TriedRate>,
    /// The `errno` of what could not be restored; `None` if the interface is as it was.
    pub not_restored: Option<i32>,
}

/// The scan of one interface.
#[derive(Debug)]
pub struct BitRateScan {
    /// Rates that are still to be tried, the next one last.
    left: Vec<u32>,
    listen: Duration,
    error_reporting: bool,
    step: ScanStep,
    rate: u32,
    tried: Vec<TriedRate>,
    is_changed: bool,
    is_interrupted: bool,
    refused: Option<i32>,
    not_restored: Option<i32>,
}

impl BitRateScan {
    /// Prepares a scan that listens for `listen` at each rate.
    ///
    /// # Errors
    /// An interface whose bit rate cannot or must not be changed.
    pub fn new(interface: &InterfaceState, listen: Duration) -> Result<Self, ScanRefusal> {
        let controller = match (interface.kind, &interface.controller) {
            (InterfaceKind::Missing, _) => return Err(ScanRefusal::Missing),
            (InterfaceKind::NotCan, _) => return Err(ScanRefusal::NotCan),
            (InterfaceKind::Can | InterfaceKind::Unknown(_), None) => return Err(ScanRefusal::Virtual),
            (InterfaceKind::Can | InterfaceKind::Unknown(_), Some(controller)) => controller,
        };
        if interface.is_up {
            return Err(ScanRefusal::Up);
        }
        let can = |mode: fn(ControllerModes) -> bool| controller.supported.map(mode);
        if can(|modes| modes.listen_only) == Some(false) {
            return Err(ScanRefusal::NoListenOnly);
        }
        Ok(Self {
            left: USUAL_BITRATES.into_iter().rev().collect(),
            listen,
            error_reporting: can(|modes| modes.error_reporting) == Some(true),
            step: ScanStep::Finish,
            rate: 0,
            tried: Vec::new(),
            is_changed: false,
            is_interrupted: false,
            refused: None,
            not_restored: None,
        })
    }

    /// Returns the first step.
    pub fn start(&mut self) -> ScanStep {
        self.step = self.next_rate();
        self.step
    }

    /// Takes the outcome of the last step and returns the next one.
    pub fn answer(&mut self, answer: ScanAnswer) -> ScanStep {
        self.is_interrupted |= answer == ScanAnswer::Interrupted;
        let refused = match answer {
            ScanAnswer::Refused(errno) => Some(errno),
            ScanAnswer::Done | ScanAnswer::Heard(_) | ScanAnswer::Interrupted => None,
        };
        self.step = match self.step {
            ScanStep::Configure(_) => self.configured(refused),
            ScanStep::BringUp => match refused {
                Some(errno) => self.rate_refused(errno),
                None if self.is_interrupted => ScanStep::BringDown,
                None => ScanStep::Listen(self.listen),
            },
            ScanStep::Listen(_) => {
                if let ScanAnswer::Heard(heard) = answer {
                    self.tried.push(TriedRate { bitrate_bps: self.rate, heard: Ok(heard) });
                }
                ScanStep::BringDown
            }
            ScanStep::BringDown => match refused {
                // It is up with a rate that may be wrong, but only listens.
                Some(errno) => self.give_up(errno),
                None if self.is_interrupted || self.is_certain() => ScanStep::Restore,
                None => self.next_rate(),
            },
            ScanStep::Restore => {
                self.not_restored = self.not_restored.or(refused);
                ScanStep::Finish
            }
            ScanStep::Finish => ScanStep::Finish,
        };
        self.step
    }

    /// Returns the result so far, complete after [`ScanStep::Finish`].
    pub fn result(&self) -> ScanResult {
        ScanResult { verdict: self.verdict(), tried: self.tried.clone(), not_restored: self.not_restored }
    }

    fn next_rate(&mut self) -> ScanStep {
        let Some(rate) = self.left.pop() else { return self.end() };
        self.rate = rate;
        ScanStep::Configure(ScanSettings { bitrate_bps: rate, error_reporting: self.error_reporting })
    }

    fn configured(&mut self, refused: Option<i32>) -> ScanStep {
        match refused {
            // A controller cannot divide its clock to every rate, and some drivers know a few rates only.
            Some(errno @ (libc_errno::EINVAL | libc_errno::EDOM | libc_errno::ERANGE)) => {
                self.rate_refused(errno)
            }
            Some(errno) => {
                self.refused = Some(errno);
                self.end()
            }
            None => {
                self.is_changed = true;
                if self.is_interrupted { ScanStep::Restore } else { ScanStep::BringUp }
            }
        }
    }

    fn rate_refused(&mut self, errno: i32) -> ScanStep {
        self.tried.push(TriedRate { bitrate_bps: self.rate, heard: Err(errno) });
        if self.is_interrupted { self.end() } else { self.next_rate() }
    }

    fn give_up(&mut self, errno: i32) -> ScanStep {
        self.refused = Some(errno);
        self.not_restored = Some(errno);
        ScanStep::Restore
    }

    /// Returns the last step but one, or the last one if nothing was changed.
    fn end(&self) -> ScanStep {
        if self.is_changed { ScanStep::Restore } else { ScanStep::Finish }
    }

    /// Returns true if the last rate was so clearly right that the others need not be tried.
    fn is_certain(&self) -> bool {
        let last = self.tried.last().and_then(|tried| tried.heard.ok());
        last.is_some_and(Heard::fits)
    }

    fn verdict(&self) -> ScanVerdict {
        let heard = || self.tried.iter().filter_map(|tried| Some((tried.bitrate_bps, tried.heard.ok()?)));
        let best = heard().filter(|(_, heard)| heard.frames > 0).max_by_key(|(_, heard)| {
            let good = heard.frames.saturating_sub(heard.error_frames);
            (good, heard.frames)
        });
        let count = heard().filter(|(_, heard)| heard.frames > 0).count();
        match best {
            Some((rate, heard)) if count == 1 && heard.frames > heard.error_frames => {
                ScanVerdict::Found(rate)
            }
            Some((rate, _)) if self.is_certain() && self.rate == rate => ScanVerdict::Found(rate),
            Some((rate, _)) => ScanVerdict::Likely(rate),
            None => match self.refused {
                Some(errno) => ScanVerdict::Refused(errno),
                None if self.is_interrupted => ScanVerdict::Interrupted,
                None if heard().count() == 0 => ScanVerdict::Refused(self.last_refusal()),
                None if heard().any(|(_, heard)| heard.error_frames > 0) => ScanVerdict::NoRate,
                None => ScanVerdict::Silent,
            },
        }
    }

    fn last_refusal(&self) -> i32 {
        self.tried.iter().rev().find_map(|tried| tried.heard.err()).unwrap_or(libc_errno::EINVAL)
    }
}

/// The numbers of Linux for what a driver answers to a rate that it cannot have.
mod libc_errno {
    pub(super) const EINVAL: i32 = 22;
    pub(super) const EDOM: i32 = 33;
    pub(super) const ERANGE: i32 = 34;
}

#[cfg(test)]
mod tests;
