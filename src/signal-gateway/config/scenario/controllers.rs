//! Controllers that follow each other (docs/spec/traffic-lights.md, "Controllers and phases").

use std::collections::BTreeMap;
use std::time::Duration;

use super::naming::listed;
use super::reader::ScenarioReader;
use crate::config::reading::{LocatedText, Location};
use traffic_lights::compat::Compat;
use traffic_lights::scenario::{
    ControllerIndex, Phase, PhaseEntry, Reference, TrafficSignalController, upstream_cycle_s,
};

/// Difference below which cycle times count as equal, seconds.
const TOLERANCE_S: f64 = 0.001;

/// A controller as read, with its reference unresolved.
pub(super) struct ControllerDraft {
    pub(super) name: String,
    pub(super) location: Location,
    pub(super) reference: Option<LocatedText>,
    pub(super) delay: Option<LocatedText>,
    pub(super) phases: Vec<PhaseDraft>,
}

pub(super) struct PhaseDraft {
    pub(super) name: String,
    /// Duration, infinite for a phase that lasts until an action, negative only in upstream mode; `None` if
    /// it was refused.
    pub(super) seconds: Option<f64>,
    pub(super) entries: Vec<PhaseEntry>,
}

pub(super) fn resolve(
    reader: &ScenarioReader<'_>,
    drafts: Vec<ControllerDraft>,
) -> Vec<TrafficSignalController> {
    let mut by_name = BTreeMap::new();
    for (index, draft) in drafts.iter().enumerate() {
        let first = *by_name.entry(draft.name.as_str()).or_insert(index);
        // Upstream uses the first controller with a name everywhere.
        if first != index && reader.compat == Compat::Improved {
            let reason = format!("two controllers are called {:?}", draft.name);
            reader.refuse(&draft.location, reason, "give each a name of its own");
        }
    }
    let references: Vec<_> = drafts.iter().map(|draft| reference(reader, draft, &drafts, &by_name)).collect();
    if reader.compat == Compat::Improved {
        refuse_circles(reader, &drafts, &references);
    }
    drafts.into_iter().zip(references).map(|(draft, reference)| finish(draft, reference)).collect()
}

fn reference(
    reader: &ScenarioReader<'_>,
    draft: &ControllerDraft,
    drafts: &[ControllerDraft],
    by_name: &BTreeMap<&str, usize>,
) -> Option<Reference> {
    let delay = draft.delay.as_ref().map(|delay| (delay, reader.seconds(delay)));
    let (name, delay) = match (draft.reference.as_ref().filter(|name| !name.text.is_empty()), delay) {
        (None, None) => return None,
        // Without a delay it begins at the same time anyway; generators write it on every controller.
        (None, Some((_, Some(Duration::ZERO)))) if reader.compat == Compat::Improved => return None,
        (None, Some((delay, _))) => {
            let remedy = "name the controller to follow";
            return reader.refused(&delay.location, "a delay without a reference", remedy);
        }
        (Some(name), None) => {
            let remedy = "give the delay in seconds; it may be 0";
            return reader.refused(&name.location, "a reference without a delay", remedy);
        }
        (Some(name), Some((_, delay))) => (name, delay?),
    };
    let Some((index, followed)) =
        by_name.get(name.text.as_str()).and_then(|index| Some((*index, drafts.get(*index)?)))
    else {
        let known = listed(drafts.iter().map(|draft| draft.name.as_str()));
        return reader.refused(&name.location, format!("no controller is called {:?}", name.text), &known);
    };
    let (own, other) = (CycleTime::of(draft), CycleTime::of(followed));
    if let (Some(own), Some(other)) = (own, other)
        && !own.equals(&other, reader.compat)
    {
        let reason = format!(
            "the cycle of {:?} takes {} and that of {:?} takes {}",
            draft.name,
            own.shown(reader.compat),
            followed.name,
            other.shown(reader.compat)
        );
        return reader.refused(&name.location, reason, "give both the same sum of durations");
    }
    Some(Reference { controller: ControllerIndex(index), delay })
}

/// Refuses controllers that follow themselves, directly or indirectly: they would never begin.
fn refuse_circles(reader: &ScenarioReader<'_>, drafts: &[ControllerDraft], references: &[Option<Reference>]) {
    let next = |at: usize| Some(references.get(at)?.as_ref()?.controller.0);
    // The start from which each was first reached: a controller that is reached again from the same start is
    // in a cycle.
    let mut reached_from = vec![None; drafts.len()];
    for start in 0..drafts.len() {
        let mut at = Some(start);
        while let Some(reached) = at.and_then(|at| reached_from.get_mut(at)).filter(|from| from.is_none()) {
            *reached = Some(start);
            at = at.and_then(next);
        }
        let Some(met) = at.filter(|at| reached_from.get(*at) == Some(&Some(start))) else { continue };
        let circle = std::iter::successors(next(met), |at| next(*at).filter(|_| *at != met));
        for draft in circle.filter_map(|at| drafts.get(at)) {
            let location = draft.reference.as_ref().map_or(&draft.location, |reference| &reference.location);
            let reason = format!("{:?} waits for itself to begin", draft.name);
            reader.refuse(location, reason, "leave one controller without a reference");
        }
    }
}

fn finish(draft: ControllerDraft, reference: Option<Reference>) -> TrafficSignalController {
    let phase = |PhaseDraft { name, seconds, entries }| Phase {
        name,
        // Checked when it was read: infinite, or within the limits, or negative.
        duration: seconds
            .filter(|seconds| seconds.is_finite())
            .map(|seconds| Duration::from_secs_f64(seconds.max(0.0))),
        entries,
    };
    let phases = draft.phases.into_iter().map(phase).collect();
    TrafficSignalController { name: draft.name, reference, phases }
}

/// The duration of a cycle, exact and as upstream counts it.
struct CycleTime {
    exact_s: f64,
    truncated_s: i32,
}

impl CycleTime {
    /// Returns `None` if the duration of a phase was refused.
    fn of(draft: &ControllerDraft) -> Option<Self> {
        let seconds: Option<Vec<_>> = draft.phases.iter().map(|phase| phase.seconds).collect();
        let seconds = seconds?.into_iter();
        Some(Self { exact_s: seconds.clone().sum(), truncated_s: upstream_cycle_s(seconds) })
    }

    fn equals(&self, other: &Self, compat: Compat) -> bool {
        match compat {
            Compat::Improved => {
                let both_endless = self.exact_s.is_infinite() && other.exact_s.is_infinite();
                both_endless || (self.exact_s - other.exact_s).abs() < TOLERANCE_S
            }
            Compat::Upstream => self.truncated_s == other.truncated_s,
        }
    }

    fn shown(&self, compat: Compat) -> String {
        match compat {
            Compat::Improved if self.exact_s.is_infinite() => "forever".to_owned(),
            Compat::Improved => format!("{:.3} s", self.exact_s),
            Compat::Upstream => format!("{} s as upstream counts", self.truncated_s),
        }
    }
}
