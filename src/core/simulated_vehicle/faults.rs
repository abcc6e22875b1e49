//! Simulated faults that are active.

use super::request::{Fault, ReportQuality};
use crate::core::command::Turn;
use crate::core::vehicle_lights::lamp::Sides;
use crate::core::vehicle_lights::state::TurnCode;

/// Active faults of the vehicle.
#[derive(Debug, Clone, Default)]
pub(super) struct Faults {
    /// Faults of frames with the message they affect (`None` = all), the newest last.
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

/// Faults that affect the frames of one message.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FrameFaults {
    pub(super) drop: f64,
    pub(super) corrupt: f64,
    pub(super) freezes_counter: bool,
    pub(super) freezes_contents: bool,
}

impl Faults {
    /// Adds a fault. A bus-off affects more than the vehicle and is left to the caller.
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
        // A later fault replaces an earlier one of its kind, which bounds the list.
        let mut kept: Vec<(FrameFault, Option<String>)> = Vec::new();
        for (fault, message) in std::mem::take(&mut self.frames) {
            kept.retain(|(known, of)| {
                std::mem::discriminant(known) != std::mem::discriminant(&fault) || *of != message
            });
            kept.push((fault, message));
        }
        self.frames = kept;
    }

    /// Faults that affect the frames of a message; those of this message override those of all messages.
    pub(super) fn of(&self, name: &str) -> FrameFaults {
        let mut faults = FrameFaults::default();
        for of_all in [true, false] {
            for (fault, message) in &self.frames {
                match message {
                    None if of_all => {}
                    Some(message) if !of_all && message == name => {}
                    None | Some(_) => continue,
                }
                match fault {
                    FrameFault::Drop(share) => faults.drop = *share,
                    FrameFault::Corrupt(share) => faults.corrupt = *share,
                    FrameFault::FreezeCounter => faults.freezes_counter = true,
                    FrameFault::FreezeContents => faults.freezes_contents = true,
                }
            }
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fault_of_one_message_overrides_fault_of_all() {
        let mut faults = Faults::default();
        faults.add(Fault::Drop(0.5, Some("A".to_owned())));
        faults.add(Fault::Drop(0.1, None));
        faults.add(Fault::FreezeCounter(Some("A".to_owned())));
        let a = FrameFaults { drop: 0.5, freezes_counter: true, ..FrameFaults::default() };
        assert_eq!(
            (faults.of("A"), faults.of("B")),
            (a, FrameFaults { drop: 0.1, ..FrameFaults::default() })
        );
        (0..1000).for_each(|_| faults.add(Fault::Drop(0.0, None)));
        assert_eq!(faults.frames.len(), 3, "one of a kind");
        assert_eq!(faults.of("B"), FrameFaults::default());
    }
}
