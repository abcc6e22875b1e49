//! What is broken at the moment.

use super::request::{Fault, ReportQuality};
use crate::core::command::Turn;
use crate::core::vehicle_lights::lamp::Sides;
use crate::core::vehicle_lights::state::TurnCode;

/// All faults of the vehicle.
#[derive(Debug, Clone, Default)]
pub(super) struct Faults {
    /// Of frames, the newest last.
    frames: Vec<(FrameFault, Option<String>)>,
    pub(super) false_report: Option<TurnCode>,
    pub(super) quality: ReportQuality,
    pub(super) broken: Sides,
    pub(super) ignores_commands: bool,
    pub(super) is_silent: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum FrameFault {
    Drop(f64),
    Corrupt(f64),
    FreezeCounter,
    FreezeContents,
}

/// What becomes of the frames of one message.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FrameFate {
    pub(super) drop: f64,
    pub(super) corrupt: f64,
    pub(super) freezes_counter: bool,
    pub(super) freezes_contents: bool,
}

impl Faults {
    /// Breaks one thing more. A bus-off is no matter of the vehicle alone and left to the caller.
    pub(super) fn add(&mut self, fault: Fault) {
        match fault {
            Fault::Drop(share, message) => self.frames.push((FrameFault::Drop(share), message)),
            Fault::Corrupt(share, message) => self.frames.push((FrameFault::Corrupt(share), message)),
            Fault::FreezeCounter(message) => self.frames.push((FrameFault::FreezeCounter, message)),
            Fault::FreezeContents(message) => self.frames.push((FrameFault::FreezeContents, message)),
            Fault::FalseReport(code) => self.false_report = Some(code),
            Fault::Report(quality) => self.quality = quality,
            Fault::Bulb(side) => {
                self.broken.left |= side == Turn::Left;
                self.broken.right |= side == Turn::Right;
            }
            Fault::IgnoreCommands => self.ignores_commands = true,
            Fault::BusOff(_) => {}
            Fault::Silent => self.is_silent = true,
        }
        // A later probability stands for an earlier one, so a handful is all there is.
        let mut kept: Vec<(FrameFault, Option<String>)> = Vec::new();
        for (fault, message) in std::mem::take(&mut self.frames) {
            kept.retain(|(known, of)| {
                std::mem::discriminant(known) != std::mem::discriminant(&fault) || *of != message
            });
            kept.push((fault, message));
        }
        self.frames = kept;
    }

    /// What becomes of the frames of a message; what was said of it alone counts more than what was
    /// said of all.
    pub(super) fn of(&self, name: &str) -> FrameFate {
        let mut quality = FrameFate::default();
        for of_all in [true, false] {
            for (fault, message) in &self.frames {
                match message {
                    None if of_all => {}
                    Some(message) if !of_all && message == name => {}
                    None | Some(_) => continue,
                }
                match fault {
                    FrameFault::Drop(share) => quality.drop = *share,
                    FrameFault::Corrupt(share) => quality.corrupt = *share,
                    FrameFault::FreezeCounter => quality.freezes_counter = true,
                    FrameFault::FreezeContents => quality.freezes_contents = true,
                }
            }
        }
        quality
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_one_message_counts_more_than_what_is_said_of_all() {
        let mut faults = Faults::default();
        faults.add(Fault::Drop(0.5, Some("A".to_owned())));
        faults.add(Fault::Drop(0.1, None));
        faults.add(Fault::FreezeCounter(Some("A".to_owned())));
        let a = FrameFate { drop: 0.5, freezes_counter: true, ..FrameFate::default() };
        assert_eq!((faults.of("A"), faults.of("B")), (a, FrameFate { drop: 0.1, ..FrameFate::default() }));
        (0..1000).for_each(|_| faults.add(Fault::Drop(0.0, None)));
        assert_eq!(faults.frames.len(), 3, "one of a kind");
        assert_eq!(faults.of("B"), FrameFate::default());
    }
}
