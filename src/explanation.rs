//! A turn-signal decision as JSON: what is commanded, who won by which rule, why each other candidate
//! lost. One form, for the lines of a replay and of a drive.

use serde::Serialize;

use crate::core::turn_signal::decision::{Decision, Ground};
use crate::core::turn_signal::intersection::TurnAhead;
use crate::core::turn_signal::manoeuvre::Remark;
use crate::core::turn_signal::resolve::{Fate, Weighed};
use crate::core::turn_signal::section::Distances;

/// A decision with its reasons.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Turn command: `NO_COMMAND`, `DISABLE`, `LEFT` or `RIGHT`.
    pub turn: String,
    /// Hazard command: `NO_COMMAND`, `DISABLE` or `ENABLE`.
    pub hazard: String,
    /// What it rests on: `blind`, `hazard`, `manoeuvres` (there is no path to measure on) or `weighed`.
    pub ground: &'static str,
    /// Who is signalled: `intersection`, `roundabout` or `behaviour`.
    pub winner: Option<String>,
    /// The branch of the prior rule that decided last, `A1` to `B2`; `null` when nothing was compared.
    pub case: Option<String>,
    /// Why the command is not what the winner asks for: `LEFT is on for too short a time`, ….
    pub held: Option<String>,
    /// The turn that is signalled, when it is one at an intersection.
    pub intersection: Option<Turn>,
    /// Every candidate, in the order that settles equal starts; none unless weighed.
    pub candidates: Vec<Candidate>,
    /// What each manoeuvre of the planner came to, in the order of the chain.
    pub manoeuvres: Vec<Outcome>,
    /// What is wrong with the inputs, in words.
    pub findings: Vec<String>,
}

/// One candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// `intersection`, `roundabout` or `behaviour`.
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
        let resolution = match &decision.ground {
            Ground::Weighed(resolution) => Some(resolution),
            Ground::Blind | Ground::Hazard | Ground::BehaviourAlone(_) => None,
        };
        Self {
            turn: decision.turn.to_string(),
            hazard: decision.hazard.to_string(),
            ground: match decision.ground {
                Ground::Blind => "blind",
                Ground::Hazard => "hazard",
                Ground::BehaviourAlone(_) => "manoeuvres",
                Ground::Weighed(_) => "weighed",
            },
            winner: resolution.and_then(|all| all.winner).map(|winner| winner.source.to_string()),
            case: resolution.and_then(|all| all.case).map(|case| case.to_string()),
            held: decision.held.map(|held| held.to_string()),
            intersection: decision.intersection.turn.map(Turn::of),
            candidates: resolution
                .map(|all| all.weighed.iter().map(Candidate::of).collect())
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
    fn of(weighed: &Weighed) -> Self {
        let lost = match weighed.fate {
            Fate::LostTo { source, case } => Some((source.to_string(), case.to_string())),
            Fate::Absent
            | Fate::NoSide
            | Fate::NotFinite
            | Fate::NotReached
            | Fate::Passed
            | Fate::Finished
            | Fate::Won => None,
        };
        let (lost_to, lost_by) = lost.unzip();
        Self {
            source: weighed.source.to_string(),
            turn: weighed.turn.to_string(),
            won: weighed.fate == Fate::Won,
            why: weighed.fate.to_string(),
            lost_to,
            lost_by,
            distances: weighed.distances.map(Metres::of),
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
    fn of(remark: Remark) -> Self {
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
    use crate::core::turn_signal::geometry::Pose;
    use crate::core::turn_signal::geometry::path::{NearestLimits, Path, Ruler};
    use crate::core::turn_signal::inputs::Finding;
    use crate::core::turn_signal::intersection::IntersectionInfo;
    use crate::core::turn_signal::manoeuvre::{ManoeuvreKind, Why};
    use crate::core::turn_signal::resolve::{Candidates, Rules, resolve};
    use crate::core::turn_signal::section::Section;
    use crate::core::turn_signal::shift::ShiftVerdict;
    use crate::core::turn_signal::signal::{Hazard, Side, Signal};
    use crate::core::turn_signal::steady::Held;

    fn decision(ground: Ground) -> Decision {
        Decision {
            turn: Signal::Left,
            hazard: Hazard::Disable,
            ground,
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
            behaviour: Some(record(Side::Right, 5.0, 70.0)),
        };
        let ruler = Ruler::new(&path, at(12.250_001), 2.0, limits);
        let resolution = resolve(&ruler, &candidates, Rules::default());
        let remarks =
            vec![Remark { kind: ManoeuvreKind::Avoidance, why: Why::Shift(ShiftVerdict::TooSmall) }];
        let held = Some(Held::On(Side::Left));
        let findings = vec![Finding::EmptyPlannedPath];
        let weighed = Decision { held, remarks, findings, ..decision(Ground::Weighed(resolution)) };
        assert_eq!(
            Explanation::of(&weighed).to_json(),
            concat!(
                r#"{"turn":"LEFT","hazard":"DISABLE","ground":"weighed","winner":"intersection","case":"A2","#,
                r#""held":"LEFT is on for too short a time","intersection":null,"candidates":["#,
                r#"{"source":"intersection","turn":"LEFT","won":true,"why":"won","lost_to":null,"lost_by":null,"#,
                r#""distances":{"desired_start_m":-14.250001,"desired_end_m":47.749999,"required_start_m":-4.250001,"required_end_m":37.749999}},"#,
                r#"{"source":"roundabout","turn":"NO_COMMAND","won":false,"why":"no record","lost_to":null,"lost_by":null,"distances":null},"#,
                r#"{"source":"behaviour","turn":"RIGHT","won":false,"why":"lost to intersection by A2","lost_to":"intersection","lost_by":"A2","#,
                r#""distances":{"desired_start_m":-9.250001,"desired_end_m":57.749999,"required_start_m":0.749999,"required_end_m":47.749999}}],"#,
                r#""manoeuvres":[{"kind":"avoidance","why":"shift too small"}],"findings":["the planned path is empty"]}"#,
            )
        );
    }

    #[test]
    fn what_cannot_be_weighed_says_on_what_ground_it_stands() {
        for (ground, name) in [
            (Ground::Blind, "blind"),
            (Ground::Hazard, "hazard"),
            (Ground::BehaviourAlone(Signal::Left), "manoeuvres"),
        ] {
            let told = Explanation::of(&decision(ground));
            assert_eq!((told.ground, told.winner, told.candidates.len()), (name, None, 0));
        }
    }
}
