//! Simulated faults that are active.

use super::request::{FrameFault, SimulatedFault};
use can_signal::validation::meaning::Meaning;
use gateway_core::command::Turn;
use gateway_core::vehicle_lights::state::{Sides, TurnCode};

#[derive(Debug, Clone, Default)]
pub(super) struct ActiveFaults {
    /// Frame faults with the message they affect (`None` = all), the newest last.
    frames: Vec<(FrameFault, Option<String>)>,
    pub(super) false_report: Option<TurnCode>,
    /// Meaning that the reports have in place of the state.
    pub(super) quality: Option<Meaning<()>>,
    pub(super) broken: Sides,
    pub(super) ignores_commands: bool,
    pub(super) is_silent: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct FrameFaults {
    pub(super) drop: f64,
    pub(super) corrupt: f64,
    pub(super) freezes_counter: bool,
    pub(super) freezes_contents: bool,
}

impl ActiveFaults {
    /// Adds a fault. A bus-off also affects other participants, and is left to the caller.
    pub(super) fn add(&mut self, fault: SimulatedFault) {
        match fault {
            SimulatedFault::Frames(fault, message) => {
                // A later fault replaces an earlier one of its kind, which bounds the list.
                let kind = std::mem::discriminant(&fault);
                self.frames.retain(|(known, of)| std::mem::discriminant(known) != kind || *of != message);
                self.frames.push((fault, message));
            }
            SimulatedFault::FalseReport(code) => self.false_report = Some(code),
            SimulatedFault::Report(quality) => self.quality = Some(quality),
            SimulatedFault::Bulb(side) => {
                self.broken.left |= side == Turn::Left;
                self.broken.right |= side == Turn::Right;
            }
            SimulatedFault::IgnoreCommands => self.ignores_commands = true,
            SimulatedFault::BusOff(_) => {}
            SimulatedFault::Silent => self.is_silent = true,
        }
    }

    /// Returns the faults of the frames of a message; its own faults override the faults of all messages.
    pub(super) fn of(&self, name: &str) -> FrameFaults {
        let mut faults = FrameFaults::default();
        let of_all = self.frames.iter().filter(|(_, message)| message.is_none());
        let of_message = self.frames.iter().filter(|(_, message)| message.as_deref() == Some(name));
        for (fault, _) in of_all.chain(of_message) {
            match fault {
                FrameFault::Drop(share) => faults.drop = *share,
                FrameFault::Corrupt(share) => faults.corrupt = *share,
                FrameFault::FreezeCounter => faults.freezes_counter = true,
                FrameFault::FreezeContents => faults.freezes_contents = true,
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
        let mut faults = ActiveFaults::default();
        faults.add(SimulatedFault::Frames(FrameFault::Drop(0.5), Some("A".to_owned())));
        faults.add(SimulatedFault::Frames(FrameFault::Drop(0.1), None));
        faults.add(SimulatedFault::Frames(FrameFault::FreezeCounter, Some("A".to_owned())));
        let a = FrameFaults { drop: 0.5, freezes_counter: true, ..FrameFaults::default() };
        assert_eq!(
            (faults.of("A"), faults.of("B")),
            (a, FrameFaults { drop: 0.1, ..FrameFaults::default() })
        );
        (0..1000).for_each(|_| faults.add(SimulatedFault::Frames(FrameFault::Drop(0.0), None)));
        assert_eq!(faults.frames.len(), 3, "one of a kind");
        assert_eq!(faults.of("B"), FrameFaults::default());
    }
}
