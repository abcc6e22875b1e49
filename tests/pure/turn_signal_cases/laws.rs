//! Laws for any records at any position: symmetries of the resolver, and of measuring.

use lanelet2_map::geometry::path::{NearestLimits, Path, PathFrame};
use lanelet2_map::geometry::polyline::nearest;
use lanelet2_map::geometry::{Point, Pose};
use proptest::prelude::*;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::resolve::{CandidateOutcome, CandidateSource, Candidates, PairwiseRules, resolve};
use turn_signal::section::Section;
use turn_signal::side::Side;
use turn_signal::subject::SignalSubject;

use super::line::{at, line, resolve_at};

fn any_position() -> impl Strategy<Value = f64> {
    // Whole metres often: equal starts and exact boundaries are the interesting ones.
    prop_oneof![(0..100_i32).prop_map(f64::from), 0.0..100.0_f64]
}

pub(crate) fn any_record() -> impl Strategy<Value = Section> {
    let side = prop_oneof![
        Just(TurnCommand::Left),
        Just(TurnCommand::Right),
        Just(TurnCommand::Disable),
        Just(TurnCommand::NoCommand)
    ];
    (side, [any_position(), any_position(), any_position(), any_position()]).prop_map(
        |(turn, mut positions)| {
            positions.sort_by(f64::total_cmp);
            let [desired_start, required_start, required_end, desired_end] = positions.map(at);
            Section {
                turn,
                hazard: HazardCommand::NoCommand,
                desired_start,
                desired_end,
                required_start,
                required_end,
                subject: SignalSubject::Unnamed,
                place: None,
                junction: None,
            }
        },
    )
}

pub(crate) fn any_candidates() -> impl Strategy<Value = Candidates> {
    let record = || proptest::option::weighted(0.8, any_record());
    (record(), record(), record()).prop_map(|(intersection, roundabout, manoeuvre)| Candidates {
        intersection,
        roundabout,
        manoeuvre,
    })
}

fn mapped(candidates: &Candidates, change: impl Fn(Section) -> Section) -> Candidates {
    Candidates {
        intersection: candidates.intersection.map(&change),
        roundabout: candidates.roundabout.map(&change),
        manoeuvre: candidates.manoeuvre.map(&change),
    }
}

fn with_poses(record: Section, change: impl Fn(Pose) -> Pose) -> Section {
    Section {
        desired_start: change(record.desired_start),
        desired_end: change(record.desired_end),
        required_start: change(record.required_start),
        required_end: change(record.required_end),
        ..record
    }
}

fn other_side(turn: TurnCommand) -> TurnCommand {
    turn.side().map_or(turn, |side| side.opposite().into())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn left_and_right_are_treated_alike(candidates in any_candidates(), x in any_position()) {
        let swapped = mapped(&candidates, |record| Section { turn: other_side(record.turn), ..record });
        let (one, other) = (
            resolve_at(x, 2.0, &candidates, &PairwiseRules::default()),
            resolve_at(x, 2.0, &swapped, &PairwiseRules::default()),
        );
        prop_assert_eq!(one.signal(), other_side(other.signal()));
        prop_assert_eq!(one.winner.map(|w| w.source), other.winner.map(|w| w.source));
        prop_assert_eq!(one.case, other.case);
    }

    #[test]
    fn moving_and_turning_the_road_changes_nothing(
        candidates in any_candidates(), x in 0..100_i32, quarter in 0..4_u32, dx in -500..500_i32,
    ) {
        // Quarter turns and whole metres keep every distance exact.
        let turned = |pose: Pose| {
            let (mut point, mut yaw) = (pose.position, pose.yaw_rad);
            for _ in 0..quarter {
                point = Point::new(-point.y_m, point.x_m);
                yaw += std::f64::consts::FRAC_PI_2;
            }
            Pose { position: Point::new(point.x_m + f64::from(dx), point.y_m), yaw_rad: yaw }
        };
        let rounded =
            mapped(&candidates, |record| with_poses(record, |pose| at(pose.position.x_m.round())));
        let change = |record| with_poses(record, turned);
        let path = Path::new(line(-20, 140).poses().iter().map(|pose| turned(*pose))).unwrap();
        let limits = NearestLimits { distance_m: 3.0, yaw_rad: 1.046 };
        let path_frame = PathFrame::new(&path, turned(at(f64::from(x))), 2.0, limits);
        let moved = resolve(&path_frame, &mapped(&rounded, change), &PairwiseRules::default());
        prop_assert_eq!(moved, resolve_at(f64::from(x), 2.0, &rounded, &PairwiseRules::default()));
    }

    #[test]
    fn exactly_one_valid_candidate_wins(candidates in any_candidates(), x in any_position()) {
        let got = resolve_at(x, 2.0, &candidates, &PairwiseRules::default());
        let winners: Vec<CandidateSource> =
            got.evaluated.iter().filter(|w| w.outcome == CandidateOutcome::Won).map(|w| w.source).collect();
        prop_assert_eq!(winners, got.winner.map(|w| w.source).into_iter().collect::<Vec<_>>());
        for evaluated in got.evaluated {
            let distances = evaluated.distances.filter(|d| d.desired_start_m <= 0.0 && d.desired_end_m >= 0.0);
            let valid = distances.is_some() && evaluated.turn.side().is_some();
            let competed = matches!(evaluated.outcome, CandidateOutcome::Won | CandidateOutcome::LostTo { .. });
            prop_assert_eq!(valid, competed, "{:?}", evaluated);
        }
        if got.winner.is_none() {
            prop_assert_eq!(got.signal(), TurnCommand::Disable);
        }
    }

    #[test]
    fn an_invalid_record_changes_nothing(candidates in any_candidates(), x in any_position()) {
        let got = resolve_at(x, 2.0, &candidates, &PairwiseRules::default());
        let keep = |source: CandidateSource, record: Option<Section>| {
            let outcome = got.evaluated.iter().find(|w| w.source == source).unwrap().outcome;
            record.filter(|_| matches!(outcome, CandidateOutcome::Won | CandidateOutcome::LostTo { .. }))
        };
        let valid = Candidates {
            intersection: keep(CandidateSource::Intersection, candidates.intersection),
            roundabout: keep(CandidateSource::Roundabout, candidates.roundabout),
            manoeuvre: keep(CandidateSource::Manoeuvre, candidates.manoeuvre),
        };
        prop_assert_eq!(resolve_at(x, 2.0, &valid, &PairwiseRules::default()).winner, got.winner);
    }

    #[test]
    fn improved_and_upstream_agree_off_boundaries(candidates in any_candidates(), x in any_position()) {
        let on_start = |record: &Section| (record.required_start.position.x_m - x - 2.0).abs() < 1e-9;
        let records = [candidates.intersection, candidates.roundabout, candidates.manoeuvre];
        prop_assume!(!records.iter().flatten().any(on_start));
        let improved = PairwiseRules { start_belongs_to_before: true, ..PairwiseRules::default() };
        prop_assert_eq!(resolve_at(x, 2.0, &candidates, &improved), resolve_at(x, 2.0, &candidates, &PairwiseRules::default()));
    }

    #[test]
    fn a_point_that_is_not_a_number_never_wins(
        candidates in any_candidates(), x in any_position(), which in 0..4_usize, bad in prop_oneof![Just(f64::NAN), Just(f64::INFINITY)],
    ) {
        let spoil = |mut record: Section| {
            let pose = Pose::new(bad, 0.0, 0.0);
            match which {
                0 => record.desired_start = pose,
                1 => record.desired_end = pose,
                2 => record.required_start = pose,
                _ => record.required_end = pose,
            }
            record
        };
        let got = resolve_at(x, 2.0, &mapped(&candidates, spoil), &PairwiseRules::default());
        prop_assert_eq!(got.signal(), TurnCommand::Disable);
    }

    /// Compared with the nearest point among all pieces.
    #[test]
    fn stations_are_those_of_the_nearest_piece(
        turns in proptest::collection::vec(-12.0..12.0_f64, 4..40), ahead in 0.05..0.95_f64, aside in -1.5..1.5_f64,
    ) {
        let mut pose = Pose::new(5.0, -3.0, 0.4);
        let mut poses = vec![pose];
        for turn in &turns {
            let position = pose.point_at(2.0, 0.0);
            pose = Pose { position, yaw_rad: pose.yaw_rad + turn.to_radians() };
            poses.push(pose);
        }
        let path = Path::new(poses.clone()).unwrap();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]
        let piece = ((turns.len() as f64) * ahead) as usize;
        let query = Pose { position: poses[piece].point_at(1.0, aside), yaw_rad: poses[piece].yaw_rad };
        let points: Vec<Point> = poses.iter().map(|pose| pose.position).collect();
        let projection = nearest(&points, query.position).unwrap();
        let limits = NearestLimits { distance_m: 3.0, yaw_rad: 1.046 };
        // Projections on a bent path differ from the projection by what the bend makes of the offset.
        prop_assert!((path.station_m(query, limits) - projection.arc_m).abs() < 0.5);
    }
}

#[test]
fn only_the_first_visit_counts() {
    let out_and_back = (0..=20)
        .map(|x| at(f64::from(x)))
        .chain((0..=20).rev().map(|x| Pose::new(f64::from(x), 1.0, std::f64::consts::PI)));
    let path = Path::new(out_and_back).unwrap();
    let limits = NearestLimits { distance_m: 3.0, yaw_rad: 1.0 };
    assert_eq!(path.nearest_index(Pose::new(5.0, 1.0, 0.0), limits), 5, "facing out");
    assert_eq!(path.nearest_index(Pose::new(5.0, 0.0, 3.1), limits), 36, "facing back");
    let sideways = Pose::new(5.0, 1.0, std::f64::consts::FRAC_PI_2);
    assert_eq!(path.nearest_index(sideways, limits), 5, "near only: the first run counts, though less near");
    let far = Pose::new(5.0, 50.0, std::f64::consts::PI);
    assert_eq!(path.nearest_index(far, limits), 36, "aligned only");
    let nowhere = Pose::new(5.0, 50.0, std::f64::consts::FRAC_PI_2);
    assert_eq!(path.nearest_index(nowhere, limits), 36, "nearest of all");
}

#[test]
fn beyond_the_ends_a_path_goes_on_straight() {
    let path = line(0, 69);
    let path_frame = PathFrame::new(&path, at(-4.0), 1.0, NearestLimits { distance_m: 3.0, yaw_rad: 1.0 });
    assert!((path_frame.from_base_m(at(75.5)) - 79.5).abs() < 1e-12);
    assert!((path_frame.from_front_m(at(-10.0)) + 7.0).abs() < 1e-12);
    assert_eq!(Side::Left.opposite(), Side::Right);
}

#[test]
fn poses_that_are_not_a_path_are_refused() {
    use lanelet2_map::geometry::path::PathError::{NotFinite, TooShort};
    for (poses, error) in [
        (vec![], TooShort),
        (vec![at(0.0)], TooShort),
        (vec![at(0.0), at(1e-9)], TooShort),
        (vec![at(0.0), at(f64::NAN)], NotFinite(1)),
        (vec![at(0.0), at(1.0), Pose::new(2.0, 0.0, f64::INFINITY)], NotFinite(2)),
    ] {
        assert_eq!(Path::new(poses), Err(error));
    }
}
