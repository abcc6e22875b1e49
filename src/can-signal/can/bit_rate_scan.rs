//! Finds the bit rate of a bus: tries the usual rates in turn, with the controller in listen-only mode.
//!
//! The scan only decides. [`BitRateScan::start`] and [`BitRateScan::answer`] return the next [`ScanStep`];
//! the caller carries it out and answers with the outcome, until [`ScanStep::Finish`]. Whatever happens, the
//! interface ends down and with its earlier settings, as far as the kernel can restore them.

use std::time::Duration;

use super::CanInput;
use super::interface_state::{ControllerModes, InterfaceKind, InterfaceState};

/// Bit rates in use on vehicles, the most frequent first, bit/s.
pub const USUAL_BITRATES: [u32; 11] =
    [500_000, 250_000, 125_000, 1_000_000, 100_000, 83_333, 33_333, 50_000, 800_000, 20_000, 10_000];

/// Number of frames without an error frame that ends the scan at once. At a wrong bit rate a frame passes its
/// checksum only by chance.
const ENOUGH_FRAMES: u64 = 5;
/// Number of error frames without a data frame that ends the listening at a rate.
const ENOUGH_ERRORS: u64 = 100;

/// Reason why an interface is not scanned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum ScanRefusal {
    #[error("there is no interface of that name")]
    Missing,
    #[error("it is not a CAN interface")]
    NotCan,
    #[error("it is virtual, and has no bit rate")]
    Virtual,
    #[error("it is up, and its bit rate is not changed while others may use it")]
    Up,
    #[error("its driver has no listen-only mode, so that a wrong bit rate would disturb the bus")]
    NoListenOnly,
}

/// Settings that a step gives to the controller; all other settings are left unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ScanSettings {
    /// Bit rate, bit/s.
    pub bitrate_bps: u32,
    /// True to also turn error frames on; false leaves them unchanged.
    pub error_reporting: bool,
}

/// Next step for the caller.
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
    /// Restore the settings that the controller had before the scan.
    Restore,
    /// No further step: [`BitRateScan::result`] has the result.
    Finish,
}

/// Outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanAnswer {
    /// The step was carried out.
    Done,
    /// The kernel refused the step, with its `errno`.
    Refused(i32),
    /// Frames counted while listening.
    Heard(Heard),
    /// The user ended the scan; the step may have been skipped or cut short.
    Interrupted,
}

/// Frames of a bus at one bit rate.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Heard {
    /// Number of data frames.
    pub frames: u64,
    /// Error frames that report an error on the wire.
    pub error_frames: u64,
}

impl Heard {
    /// Counts one input.
    pub fn take(&mut self, input: &CanInput) {
        self.frames += u64::from(matches!(input, CanInput::Frame { .. }));
        self.error_frames +=
            u64::from(matches!(input, CanInput::ErrorFrame { error, .. } if !error.is_recovery()));
    }

    /// Returns true if this rate is clearly right or clearly wrong.
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
    /// Frames counted at this rate, or the `errno` if the driver refuses the rate.
    pub heard: Result<Heard, i32>,
}

/// Conclusion of the scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScanVerdict {
    /// Frames arrived at this rate only, and more frames than error frames.
    Found(u32),
    /// Frames arrived, but at several rates or among many errors; this rate fits best.
    Likely(u32),
    /// Errors occurred at some rate and frames at none: an unusual bit rate, or CAN FD.
    NoRate,
    /// Neither frames nor errors arrived.
    Silent,
    /// The user ended the scan before a rate was found.
    Interrupted,
    /// The kernel refused a step that the scan depends on, with its `errno`.
    Refused(i32),
}

/// Result of a scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScanResult {
    /// Conclusion from the rates tried.
    pub verdict: ScanVerdict,
    /// Rates in the order in which they were tried.
    pub tried: Vec<TriedRate>,
    /// The `errno` of a setting that could not be restored; `None` if all settings were restored.
    pub not_restored: Option<i32>,
}

/// Scan of one interface.
#[derive(Debug)]
pub struct BitRateScan {
    /// Rates still to be tried, the next one last.
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
    /// Fails if the bit rate of the interface cannot or must not be changed.
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

    /// Accepts the outcome of the last step and returns the next step.
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
                // The interface is up with a rate that may be wrong, but only listens.
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
            // A controller cannot divide its clock to every rate, and some drivers support only a few rates.
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

    /// Returns the last step but one; the last step if nothing was changed.
    fn end(&self) -> ScanStep {
        if self.is_changed { ScanStep::Restore } else { ScanStep::Finish }
    }

    /// Returns true if the last rate was so clearly right that no other needs to be tried.
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
                None if heard().count() == 0 => {
                    let last = self.tried.last().and_then(|tried| tried.heard.err());
                    ScanVerdict::Refused(last.unwrap_or(libc_errno::EINVAL))
                }
                None if heard().any(|(_, heard)| heard.error_frames > 0) => ScanVerdict::NoRate,
                None => ScanVerdict::Silent,
            },
        }
    }
}

/// Linux error numbers with which drivers refuse an unsupported rate.
mod libc_errno {
    pub(super) const EINVAL: i32 = 22;
    pub(super) const EDOM: i32 = 33;
    pub(super) const ERANGE: i32 = 34;
}

#[cfg(test)]
mod tests;
