//! Irregularities that change no report: lamps that do not flash as they should, sources that disagree.

use super::binding::LightsBinding;
use super::lamp::LampFindings;
use super::state::UnavailableReason;
use crate::core::validation::table::SignalIndex;

/// Irregularities of the sources of one report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Warnings {
    /// Lamps that do not flash as they should, of the most trusted source with any.
    pub lamps: Option<LampWarning>,
    /// The fallback in use and the reason for it.
    pub fallback: Option<Fallback>,
    /// The most trusted source that contradicts the deciding one for too long.
    pub disagreement: Option<Contradiction>,
}

/// A fallback in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fallback {
    /// Position of the fallback.
    pub by: usize,
    /// Reason why the most trusted source is unavailable.
    pub reason: UnavailableReason,
}

/// Lamps that do not flash as they should.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LampWarning {
    /// Signals of the left and the right lamp.
    pub lamps: [SignalIndex; 2],
    /// Irregularities of the lamps.
    pub findings: LampFindings,
}

/// Two sources with contradictory values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contradiction {
    /// Position of the deciding source.
    pub chosen: usize,
    /// Name of its value.
    pub chosen_value: &'static str,
    /// Position of the contradicting source.
    pub other: usize,
    /// Name of its value.
    pub other_value: &'static str,
}

impl Warnings {
    /// True if there is any irregularity.
    pub fn any(self) -> bool {
        self != Self::default()
    }

    /// Text of each warning; `source_name` names a source by its position, `unavailable_text` describes the
    /// reason why a source is unavailable.
    pub fn texts<'a>(
        self,
        binding: &LightsBinding,
        source_name: impl Fn(usize) -> &'a str,
        unavailable_text: impl Fn(UnavailableReason) -> String,
    ) -> impl Iterator<Item = String> {
        let lamps = self.lamps.map(|warning| lamp_text(binding, warning));
        let disagreement =
            self.disagreement.map(|Contradiction { chosen, chosen_value, other, other_value }| {
                let (chosen, other) = (source_name(chosen), source_name(other));
                format!("sources disagree: {chosen} = {chosen_value} is used, but {other} = {other_value}")
            });
        let fallback = self.fallback.map(|Fallback { by, reason }| {
            format!("fallback {}: {}", source_name(by), unavailable_text(reason))
        });
        lamps.into_iter().chain(fallback).chain(disagreement)
    }
}

fn lamp_text(binding: &LightsBinding, LampWarning { lamps, findings }: LampWarning) -> String {
    let [left, right] = lamps.map(|lamp| binding.table.signals[lamp.0].name.as_str());
    let mut texts = Vec::new();
    for (name, bulb, steady) in [
        (left, findings.bulb_failure.left, findings.does_not_flash.left),
        (right, findings.bulb_failure.right, findings.does_not_flash.right),
    ] {
        if bulb {
            texts.push(format!("bulb failure: {name} flashes too fast"));
        }
        if steady {
            texts.push(format!("{name} is lit and does not flash"));
        }
    }
    if findings.emergency_flashing {
        texts.push(format!("emergency flashing: {left} and {right} flash too fast"));
    }
    texts.join("; ")
}
