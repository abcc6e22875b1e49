//! Formats a decision of the turn signal decider: fields for programs, reasons for users.

use std::fmt::Display;

use serde_json::{Value, json};

use super::joined;
use turn_signal::decision::{Basis, Decision};
use turn_signal::inputs::InputFinding;
use turn_signal::intersection::TurnAhead;
use turn_signal::junction::JunctionRemark;
use turn_signal::manoeuvre::ManoeuvreOutcome;
use turn_signal::resolve::{CandidateOutcome, EvaluatedCandidate};
use turn_signal::section::Distances;

/// Returns the commands, the winner with its rule, and the reason why each other candidate lost, as an object
/// that `decide --help` describes. Distances are metres to the micrometre, negative behind the vehicle.
pub fn fields(decision: &Decision) -> Value {
    let intersection = decision.intersection.map(|TurnAhead { side, active, distance_m, .. }| {
        json!({
            "side": side.to_string(), "active": active, "distance_m": to_the_micrometre(distance_m)
        })
    });
    let manoeuvre = |outcome: &ManoeuvreOutcome| json!({ "kind": outcome.kind.to_string(), "why": outcome.why.to_string() });
    let mut fields = json!({
        "turn": decision.turn.to_string(),
        "hazard": decision.hazard.to_string(),
        "basis": decision.basis.kind(),
        "winner": text(decision.winner()),
        "case": text(decision.case()),
        "held": text(decision.held),
        "intersection": intersection,
        "junction": decision.junction.as_ref().map(junction),
        "candidates": decision.evaluated().iter().map(candidate).collect::<Vec<_>>(),
        "manoeuvres": decision.remarks.iter().map(manoeuvre).collect::<Vec<_>>(),
        "findings": decision.findings.iter().map(InputFinding::to_string).collect::<Vec<_>>(),
    });
    if let Basis::PathGenerator(tagged) = decision.basis {
        fields = joined(fields, json!({ "lanelet": tagged.to_string() }));
    }
    fields
}

fn junction(remark: &JunctionRemark) -> Value {
    json!({
        "lanelet": remark.ahead.way.lane, "side": remark.ahead.way.side.to_string(), "why": remark.key(),
        "least_m": remark.least_m().map(to_the_micrometre),
        "law": remark.country.as_ref().map(|country| country.law()),
    })
}

fn candidate(evaluated: &EvaluatedCandidate) -> Value {
    let outcome = evaluated.outcome;
    let lost =
        if let CandidateOutcome::LostTo { source, case } = outcome { Some((source, case)) } else { None };
    let (lost_to, lost_by) = lost.unzip();
    let distances = |distances: Distances| {
        json!({
            "desired_start_m": to_the_micrometre(distances.desired_start_m),
            "desired_end_m": to_the_micrometre(distances.desired_end_m),
            "required_start_m": to_the_micrometre(distances.required_start_m),
            "required_end_m": to_the_micrometre(distances.required_end_m),
        })
    };
    json!({
        "source": evaluated.source.to_string(),
        "subject": evaluated.subject.name(evaluated.turn),
        "turn": evaluated.turn.to_string(),
        "won": evaluated.outcome == CandidateOutcome::Won,
        "why": evaluated.outcome.to_string(),
        "lost_to": text(lost_to),
        "lost_by": text(lost_by),
        "distances": evaluated.distances.map(distances),
    })
}

fn text(value: Option<impl Display>) -> Option<String> {
    value.map(|value| value.to_string())
}

/// Rounds metres to the micrometre; zero has no sign.
fn to_the_micrometre(metres: f64) -> f64 {
    (metres * 1e6).round() / 1e6 + 0.0
}

pub(super) fn basis(decision: &Decision) -> String {
    match &decision.basis {
        Basis::NoInputs => "no inputs".to_owned(),
        Basis::Hazard => "hazard lights".to_owned(),
        Basis::ManoeuvreAlone(_) => "manoeuvres alone".to_owned(),
        Basis::PathGenerator(tagged) => format!("path generator, {tagged}"),
        Basis::Candidates(resolution) => match (resolution.winner, resolution.case) {
            (Some(winner), Some(case)) => format!("{} by {case}", winner.source),
            (Some(winner), None) => format!("{}, alone", winner.source),
            (None, _) => "no candidate".to_owned(),
        },
    }
}

/// Returns every reason, one per line: candidates, hold, manoeuvres, findings.
pub fn reasons(decision: &Decision) -> impl Iterator<Item = String> {
    let candidates = decision.evaluated().iter().map(EvaluatedCandidate::to_string);
    let junction = decision.junction.as_ref().map(|junction| format!("junction: {junction}"));
    let held = decision.held.map(|held| format!("held: {held}"));
    let manoeuvres = decision.remarks.iter().map(ManoeuvreOutcome::to_string);
    let findings = decision.findings.iter().map(|finding| format!("finding: {finding}"));
    candidates.chain(junction).chain(held).chain(manoeuvres).chain(findings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanelet2_map::geometry::Pose;
    use lanelet2_map::geometry::path::{NearestLimits, Path, PathFrame};
    use turn_signal::light_command::{HazardCommand, TurnCommand};
    use turn_signal::manoeuvre::{ManoeuvreKind, SignalReason};
    use turn_signal::min_duration::Held;
    use turn_signal::path_generator::TaggedLanelet;
    use turn_signal::resolve::{Candidates, PairwiseRules, resolve};
    use turn_signal::section::Section;
    use turn_signal::shift::ShiftVerdict;
    use turn_signal::side::Side;
    use turn_signal::subject::SignalSubject;

    fn decision(basis: Basis) -> Decision {
        Decision {
            turn: TurnCommand::Left,
            hazard: HazardCommand::Disable,
            basis,
            held: None,
            sections: Candidates::default(),
            intersection: None,
            junction: None,
            remarks: Vec::new(),
            findings: Vec::new(),
            next_deadline: None,
        }
    }

    #[test]
    fn fields_hold_winner_rule_distances_and_losers() {
        let at = |x: f64| Pose::new(x, 0.0, 0.0);
        let path = Path::new((0..80).map(|x| at(f64::from(x)))).unwrap();
        let limits = NearestLimits { distance_m: 3.0, yaw_rad: 1.0 };
        let record = |side, from: f64, to: f64| {
            Section::blinking(side, at(from)..at(to), at(from + 10.0)..at(to - 10.0))
        };
        let candidates = Candidates {
            intersection: Some(Section {
                subject: SignalSubject::Turn(111),
                ..record(Side::Left, 0.0, 60.0)
            }),
            roundabout: None,
            manoeuvre: Some(record(Side::Right, 5.0, 70.0)),
        };
        let path_frame = PathFrame::new(&path, at(12.250_001), 2.0, limits);
        let resolution = resolve(&path_frame, &candidates, &PairwiseRules::default());
        let remarks = vec![ManoeuvreOutcome {
            kind: ManoeuvreKind::Avoidance,
            why: SignalReason::Shift(ShiftVerdict::TooSmall),
        }];
        let held = Some(Held::On(Side::Left));
        let findings = vec![InputFinding::EmptyPlannedPath];
        let evaluated =
            Decision { held, remarks, findings, ..decision(Basis::Candidates(Box::new(resolution))) };
        assert_eq!(
            fields(&evaluated).to_string(),
            concat!(
                r#"{"turn":"LEFT","hazard":"DISABLE","basis":"candidates","winner":"intersection","case":"A2","#,
                r#""held":"LEFT is on for too short a time","intersection":null,"junction":null,"candidates":["#,
                r#"{"source":"intersection","subject":"left turn on 111","turn":"LEFT","won":true,"why":"won","lost_to":null,"lost_by":null,"#,
                r#""distances":{"desired_start_m":-14.250001,"desired_end_m":47.749999,"required_start_m":-4.250001,"required_end_m":37.749999}},"#,
                r#"{"source":"roundabout","subject":null,"turn":"NO_COMMAND","won":false,"why":"no record","lost_to":null,"lost_by":null,"distances":null},"#,
                r#"{"source":"manoeuvre","subject":null,"turn":"RIGHT","won":false,"why":"lost to intersection by A2","lost_to":"intersection","lost_by":"A2","#,
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
            (Basis::ManoeuvreAlone(TurnCommand::Left), "manoeuvres"),
            (Basis::PathGenerator(TaggedLanelet::Own(7)), "path_generator"),
        ] {
            let fields = fields(&decision(basis));
            assert_eq!(fields["basis"], name);
            assert_eq!((&fields["winner"], &fields["candidates"]), (&Value::Null, &json!([])));
        }
    }
}
