//! What diagnostics should hear although it changes no report: odd lamps, sources at odds.

use super::binding::LightsBinding;
use super::lamp::LampFindings;
use super::state::UnavailableReason;
use crate::core::validation::table::SignalIndex;

/// What is odd about the sources of one report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Warnings {
    /// Lamps that do not flash as they should; of the most trusted source that sees any.
    pub lamps: Option<LampWarning>,
    /// A source that is unavailable, and the fallback in use.
    pub fallback: Option<Fallback>,
    /// The most trusted source that contradicts the believed one for too long.
    pub disagreement: Option<Contradiction>,
}

/// A fallback at work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fallback {
    /// The source that is believed instead, by position.
    pub by: usize,
    /// Why the most trusted source is not.
    pub reason: UnavailableReason,
}

/// Odd lamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LampWarning {
    /// Left and right lamp.
    pub lamps: [SignalIndex; 2],
    /// What is odd about them.
    pub findings: LampFindings,
}

/// Two sources that say different things.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contradiction {
    /// The source that is believed, by position, and what it says.
    pub chosen: (usize, &'static str),
    /// The one that contradicts it.
    pub other: (usize, &'static str),
}

impl Warnings {
    /// Whether there is anything to say.
    pub fn any(self) -> bool {
        self != Self::default()
    }

    /// Each warning in a few words; `source_name` names a source by its position, `unavailable_text` says why
    /// a source is unavailable.
    pub fn texts<'a>(
        self,
        binding: &LightsBinding,
        source_name: impl Fn(usize) -> &'a str,
        unavailable_text: impl Fn(UnavailableReason) -> String,
    ) -> impl Iterator<Item = String> {
        let lamps = self.lamps.map(|warning| lamp_text(binding, warning));
        let disagreement = self.disagreement.map(|Contradiction { chosen, other }| {
            let [chosen, other] =
                [chosen, other].map(|(source, value)| format!("{} = {value}", source_name(source)));
            format!("sources disagree: {chosen} is used, but {other}")
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
