//! Irregularities that change no report: lamps that do not flash correctly, sources that disagree.

use super::binding::LightsBinding;
use super::catalogue;
use super::fusion::Disagreement;
use super::lamp::LampFindings;
use super::state::UnavailableReason;
use crate::vehicle_report::catalogue as report;
use can_signal::validation::table::SignalIndex;
use gateway_base::diagnostics::MessagePart;

/// Irregularities of the sources of one report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Warnings {
    /// Incorrectly flashing lamps of the most trusted source that has any.
    pub lamps: Option<LampWarning>,
    /// Fallback in use and the reason for it.
    pub fallback: Option<Fallback>,
    /// The most trusted source that has contradicted the deciding source for too long, with the names of the
    /// values.
    pub disagreement: Option<Disagreement<&'static str>>,
}

/// A fallback in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fallback {
    /// Position of the fallback in the profile.
    pub by: usize,
    /// Reason why the most trusted source is unavailable.
    pub reason: UnavailableReason,
}

/// Lamps that do not flash correctly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LampWarning {
    /// Signals of the left and the right lamp.
    pub lamps: [SignalIndex; 2],
    /// Kinds of irregularity of these lamps.
    pub findings: LampFindings,
}

impl Warnings {
    /// Returns the message of each warning; `source_name` returns the name of the source at a position,
    /// `unavailable` describes the reason why a source is unavailable.
    pub fn messages<'a>(
        self,
        binding: &LightsBinding,
        source_name: impl Fn(usize) -> &'a str,
        unavailable: impl Fn(UnavailableReason) -> MessagePart,
    ) -> impl Iterator<Item = MessagePart> {
        let lamps = self.lamps.map_or_else(Vec::new, |warning| lamp_messages(binding, warning));
        let disagreement =
            self.disagreement.map(|Disagreement { chosen, chosen_value, other, other_value }| {
                let (chosen, other) = (source_name(chosen), source_name(other));
                catalogue::sources_disagree(chosen, chosen_value, other, other_value)
            });
        let fallback = self.fallback.map(|Fallback { by, reason }| {
            unavailable(reason).within(|reason| report::fallback(source_name(by), reason))
        });
        lamps.into_iter().chain(fallback).chain(disagreement)
    }
}

fn lamp_messages(binding: &LightsBinding, LampWarning { lamps, findings }: LampWarning) -> Vec<MessagePart> {
    let [left, right] = lamps.map(|lamp| binding.table.signals[lamp.0].name.as_str());
    let mut messages = Vec::new();
    for (name, bulb, steady) in [
        (left, findings.bulb_failure.left, findings.does_not_flash.left),
        (right, findings.bulb_failure.right, findings.does_not_flash.right),
    ] {
        if bulb {
            messages.push(catalogue::bulb_failure(name));
        }
        if steady {
            messages.push(catalogue::does_not_flash(name));
        }
    }
    if findings.emergency_flashing {
        messages.push(catalogue::emergency_flashing(left, right));
    }
    messages
}
