//! Converts planning factors and the planned path to manoeuvres
//! (docs/spec/turn-signal-decider.md, "Manoeuvres from planning factors").
//!
//! Upstream's modules know more than they publish. The rest is taken from the planned path and the road; the
//! documentation of each builder names its approximations.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::inputs::{FactorFlaw, InputFinding, Timed};
use super::manoeuvre::Manoeuvre;
use super::planner_input::{FactorTopic, PlanningFactor};
pub use factor::FactorContext;
use path_offsets::PathOffsets;
pub use trajectory::{DrivenPath, trajectory_manoeuvres};

mod avoidance;
mod factor;
mod lane_change;
mod path_offsets;
mod pulling;
mod reference_line;
mod trajectory;

#[cfg(test)]
mod tests;

/// The latest factors of each module, in the order in which the planner runs them.
pub type Factors = BTreeMap<FactorTopic, Timed<Arc<[PlanningFactor]>>>;

/// Returns the manoeuvres in the order of the chain, and a finding for each factor that could not be
/// converted. A manoeuvre is as old as its factors.
pub fn manoeuvres(
    context: &FactorContext<'_>,
    factors: &Factors,
) -> (Vec<Timed<Manoeuvre>>, Vec<InputFinding>) {
    let mut findings = Vec::new();
    let mut manoeuvres = Vec::new();
    let anything = factors.values().any(|latest| !latest.value.is_empty());
    let path_offsets = if anything { PathOffsets::new(context) } else { None };
    for (topic, latest) in factors {
        let made = made(context, path_offsets.as_ref(), *topic, &latest.value, &mut findings);
        manoeuvres.extend(made.into_iter().map(|value| Timed { at: latest.at, value }));
    }
    (manoeuvres, findings)
}

fn made(
    context: &FactorContext<'_>,
    path_offsets: Option<&PathOffsets>,
    topic: FactorTopic,
    factors: &[PlanningFactor],
    findings: &mut Vec<InputFinding>,
) -> Vec<Manoeuvre> {
    let mut usable = Vec::new();
    for factor in factors {
        if factor.is_finite() {
            usable.push(factor);
        } else {
            findings.push(InputFinding::BadFactor { topic, flaw: FactorFlaw::NotFinite });
        }
    }
    let mut refuse = |flaw| findings.push(InputFinding::BadFactor { topic, flaw });
    let made = match topic {
        FactorTopic::StartPlanner => {
            let made = usable.iter().map(|factor| pulling::out(context, path_offsets, factor));
            Ok(made.filter_map(|made| made.map_err(&mut refuse).ok().flatten()).collect())
        }
        FactorTopic::StaticObstacleAvoidance => {
            avoidance::around(context, path_offsets, &usable, &mut refuse)
        }
        FactorTopic::GoalPlanner => pulling::over(context, path_offsets, &usable, &mut refuse),
        FactorTopic::AvoidanceByLaneChange
        | FactorTopic::LaneChangeLeft
        | FactorTopic::LaneChangeRight
        | FactorTopic::ExternalRequestLaneChangeLeft
        | FactorTopic::ExternalRequestLaneChangeRight => {
            let made =
                usable.iter().map(|factor| lane_change::sideways(context, path_offsets, topic, factor));
            Ok(made.filter_map(|made| made.map_err(&mut refuse).ok().flatten()).collect())
        }
    };
    match made {
        Ok(made) => made,
        Err(kind) => {
            findings.push(InputFinding::NoPathFor(kind));
            Vec::new()
        }
    }
}
