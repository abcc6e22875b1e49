//! What diagnostics should hear although it changes no report: odd lamps, sources at odds.

use super::binding::LightsBinding;
use super::lamp::LampFindings;
use super::verdict::Doubt;
use crate::core::trust::table::SignalIndex;

/// What is odd about the sources of one report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Remarks {
    /// Lamps that do not flash as they should; of the most trusted source that sees any.
    pub lamps: Option<LampRemark>,
    /// A source in doubt, and the one that stands in for it.
    pub stand_in: Option<StandIn>,
    /// The most trusted source that contradicts the believed one for too long.
    pub disagreement: Option<Contradiction>,
}

/// A fallback at work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StandIn {
    /// The source that is believed instead, by position.
    pub by: usize,
    /// Why the most trusted source is not.
    pub doubt: Doubt,
}

/// Odd lamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LampRemark {
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

impl Remarks {
    /// Whether there is anything to say.
    pub fn any(self) -> bool {
        self != Self::default()
    }

    /// Each remark in a few words; `source_name` names a source by its position, `doubt_text` says why
    /// a source is in doubt.
    pub fn texts<'a>(
        self,
        binding: &LightsBinding,
        source_name: impl Fn(usize) -> &'a str,
        doubt_text: impl Fn(Doubt) -> String,
    ) -> impl Iterator<Item = String> {
        let lamps = self.lamps.map(|remark| lamp_text(binding, remark));
        let disagreement = self.disagreement.map(|Contradiction { chosen, other }| {
            let [chosen, other] =
                [chosen, other].map(|(source, value)| format!("{} = {value}", source_name(source)));
            format!("sources disagree: {chosen} is believed, but {other}")
        });
        let stand_in = self
            .stand_in
            .map(|StandIn { by, doubt }| format!("{} stands in: {}", source_name(by), doubt_text(doubt)));
        lamps.into_iter().chain(stand_in).chain(disagreement)
    }
}

fn lamp_text(binding: &LightsBinding, LampRemark { lamps, findings }: LampRemark) -> String {
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
