//! A turn-signal decision as JSON: what is commanded, who won by which rule, why each other candidate
//! lost. One form, for the lines of a replay and of a drive.

use serde::Serialize;

use crate::core::turn_signal::decision::{Basis, Decision};
use crate::core::turn_signal::intersection::TurnAhead;
use crate::core::turn_signal::manoeuvre::ManoeuvreOutcome;
use crate::core::turn_signal::resolve::{CandidateOutcome, EvaluatedCandidate};
use crate::core::turn_signal::section::Distances;

/// A decision with its reasons.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Turn command: `NO_COMMAND`, `DISABLE`, `LEFT` or `RIGHT`.
    pub turn: String,
    /// Hazard command: `NO_COMMAND`, `DISABLE` or `ENABLE`.
    pub hazard: String,
    /// What it rests on: `no_inputs`, `hazard`, `manoeuvres` (there is no path to measure on), `candidates` or
    /// `path_generator`.
    pub basis: &'static str,
    /// Who is signalled: `intersection`, `roundabout` or `manoeuvre`.
    pub winner: Option<String>,
    /// The branch of the prior rule that decided last, `A1` to `B2`; `null` when nothing was compared.
    pub case: Option<String>,
    /// Why the command is not what the winner asks for: `LEFT is on for too short a time`, ….
    pub held: Option<String>,
    /// The turn that is signalled, when it is one at an intersection.
    pub intersection: Option<Turn>,
    /// Every candidate, in the order that settles equal starts; none unless candidates were evaluated.
    pub candidates: Vec<Candidate>,
    /// What each manoeuvre of the planner came to, in the order of the chain.
    pub manoeuvres: Vec<Outcome>,
    /// What is wrong with the inputs, in words.
    pub findings: Vec<String>,
}

/// One candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// `intersection`, `roundabout` or `manoeuvre`.
    pub source: String,
    /// What it asks for.
    pub turn: String,
    /// It is signalled.
    pub won: bool,
    /// What became of it, in words.
    pub why: String,
    /// Who it lost a comparison to.
    pub lost_to: Option<String>,
    /// The branch by which it lost.
    pub lost_by: Option<String>,
    /// How far its four points are; `null` without a record.
    pub distances: Option<Metres>,
}

/// Distances along the path, metres to the micrometre, negative = behind: starts from the front, ends
/// from the rear axle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Metres {
    /// From here it may be signalled.
    pub desired_start_m: f64,
    /// Up to here it may be signalled.
    pub desired_end_m: f64,
    /// From here it must be signalled.
    pub required_start_m: f64,
    /// Up to here it must be signalled.
    pub required_end_m: f64,
}

/// A turn at an intersection that is signalled.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Turn {
    /// `LEFT` or `RIGHT`.
    pub side: String,
    /// The front is past its start.
    pub active: bool,
    /// Front to its start, metres.
    pub distance_m: f64,
}

/// What a manoeuvre came to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Outcome {
    /// `pull-out`, `avoidance`, `lane change`, `pull-over` or `side shift`.
    pub kind: String,
    /// Why it is signalled, or not.
    pub why: String,
}

impl Explanation {
    /// The form of a decision.
    pub fn of(decision: &Decision) -> Self {
        let resolution = match &decision.basis {
            Basis::Candidates(resolution) => Some(resolution),
            Basis::NoInputs | Basis::Hazard | Basis::ManoeuvreAlone(_) | Basis::PathGenerator(_) => None,
        };
        Self {
            turn: decision.turn.to_string(),
            hazard: decision.hazard.to_string(),
            basis: match decision.basis {
                Basis::NoInputs => "no_inputs",
                Basis::Hazard => "hazard",
                Basis::ManoeuvreAlone(_) => "manoeuvres",
                Basis::PathGenerator(_) => "path_generator",
                Basis::Candidates(_) => "candidates",
            },
            winner: resolution.and_then(|all| all.winner).map(|winner| winner.source.to_string()),
            case: resolution.and_then(|all| all.case).map(|case| case.to_string()),
            held: decision.held.map(|held| held.to_string()),
            intersection: decision.intersection.turn.map(Turn::of),
            candidates: resolution
                .map(|all| all.evaluated.iter().map(Candidate::of).collect())
                .unwrap_or_default(),
            manoeuvres: decision.remarks.iter().copied().map(Outcome::of).collect(),
            findings: decision.findings.iter().map(ToString::to_string).collect(),
        }
    }

    /// On one line, without line end.
    pub fn to_json(&self) -> String {
        // Plain structs of numbers and strings: this cannot fail.
        serde_json::to_string(self).unwrap_or_default()
    }
}

impl Candidate {
    fn of(evaluated: &EvaluatedCandidate) -> Self {
        let lost = match evaluated.outcome {
            CandidateOutcome::LostTo { source, case } => Some((source.to_string(), case.to_string())),
            CandidateOutcome::Absent
            | CandidateOutcome::NoSide
            | CandidateOutcome::NotFinite
            | CandidateOutcome::NotReached
            | CandidateOutcome::Passed
            | CandidateOutcome::Finished
            | CandidateOutcome::Won => None,
        };
        let (lost_to, lost_by) = lost.unzip();
        Self {
            source: evaluated.source.to_string(),
            turn: evaluated.turn.to_string(),
            won: evaluated.outcome == CandidateOutcome::Won,
            why: evaluated.outcome.to_string(),
            lost_to,
            lost_by,
            distances: evaluated.distances.map(Metres::of),
        }
    }
}

impl Metres {
    fn of(distances: Distances) -> Self {
        Self {
            desired_start_m: to_the_micrometre(distances.desired_start_m),
            desired_end_m: to_the_micrometre(distances.desired_end_m),
            required_start_m: to_the_micrometre(distances.required_start_m),
            required_end_m: to_the_micrometre(distances.required_end_m),
        }
    }
}

impl Turn {
    fn of(turn: TurnAhead) -> Self {
        let TurnAhead { side, active, distance_m, .. } = turn;
        Self { side: side.to_string(), active, distance_m: to_the_micrometre(distance_m) }
    }
}

impl Outcome {
    fn of(remark: ManoeuvreOutcome) -> Self {
        Self { kind: remark.kind.to_string(), why: remark.why.to_string() }
    }
}

/// Zero has no sign.
fn to_the_micrometre(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e6 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::map::geometry::Pose;
    use crate::core::map::geometry::path::{NearestLimits, Path, PathFrame};
    use crate::core::turn_signal::inputs::Finding;
    use crate::core::turn_signal::intersection::IntersectionInfo;
    use crate::core::turn_signal::manoeuvre::{ManoeuvreKind, SignalReason};
    use crate::core::turn_signal::min_duration::Held;
    use crate::core::turn_signal::path_generator::TaggedLanelet;
    use crate::core::turn_signal::resolve::{Candidates, Rules, resolve};
    use crate::core::turn_signal::section::Section;
    use crate::core::turn_signal::shift::ShiftVerdict;
    use crate::core::turn_signal::signal::{Hazard, Side, Signal};

    fn decision(basis: Basis) -> Decision {
        Decision {
            turn: Signal::Left,
            hazard: Hazard::Disable,
            basis,
            held: None,
            intersection: IntersectionInfo::default(),
            remarks: Vec::new(),
            findings: Vec::new(),
            next_deadline: None,
        }
    }

    #[test]
    fn winner_rule_distances_and_losers_are_told() {
        let at = |x: f64| Pose::new(x, 0.0, 0.0);
        let path = Path::new((0..80).map(|x| at(f64::from(x)))).unwrap();
        let limits = NearestLimits { distance_m: 3.0, yaw_rad: 1.0 };
        let record = |side, from: f64, to: f64| {
            Section::blinking(side, (at(from), at(to)), (at(from + 10.0), at(to - 10.0)))
        };
        let candidates = Candidates {
            intersection: Some(record(Side::Left, 0.0, 60.0)),
            roundabout: None,
            manoeuvre: Some(record(Side::Right, 5.0, 70.0)),
        };
        let path_frame = PathFrame::new(&path, at(12.250_001), 2.0, limits);
        let resolution = resolve(&path_frame, &candidates, Rules::default());
        let remarks = vec![ManoeuvreOutcome {
            kind: ManoeuvreKind::Avoidance,
            why: SignalReason::Shift(ShiftVerdict::TooSmall),
        }];
        let held = Some(Held::On(Side::Left));
        let findings = vec![Finding::EmptyPlannedPath];
        let evaluated = Decision { held, remarks, findings, ..decision(Basis::Candidates(resolution)) };
        assert_eq!(
            Explanation::of(&evaluated).to_json(),
            concat!(
                r#"{"turn":"LEFT","hazard":"DISABLE","basis":"candidates","winner":"intersection","case":"A2","#,
                r#""held":"LEFT is on for too short a time","intersection":null,"candidates":["#,
                r#"{"source":"intersection","turn":"LEFT","won":true,"why":"won","lost_to":null,"lost_by":null,"#,
                r#""distances":{"desired_start_m":-14.250001,"desired_end_m":47.749999,"required_start_m":-4.250001,"required_end_m":37.749999}},"#,
                r#"{"source":"roundabout","turn":"NO_COMMAND","won":false,"why":"no record","lost_to":null,"lost_by":null,"distances":null},"#,
                r#"{"source":"manoeuvre","turn":"RIGHT","won":false,"why":"lost to intersection by A2","lost_to":"intersection","lost_by":"A2","#,
                r#""distances":{"desired_start_m":-9.250001,"desired_end_m":57.749999,"required_start_m":0.749999,"required_end_m":47.749999}}],"#,
                r#""manoeuvres":[{"kind":"avoidance","why":"shift too small"}],"findings":["the planned path is empty"]}"#,
            )
        );
    }

    #[test]
    fn decisions_without_candidates_name_their_basis() {
        for (basis, name) in [
            (Basis::NoInputs, "no_inputs"),
            (Basis::Hazard, "hazard"),
            (Basis::ManoeuvreAlone(Signal::Left), "manoeuvres"),
            (Basis::PathGenerator(TaggedLanelet::Own(7)), "path_generator"),
        ] {
            let told = Explanation::of(&decision(basis));
            assert_eq!((told.basis, told.winner, told.candidates.len()), (name, None, 0));
        }
    }
}
