use proptest::prelude::*;

use super::*;
use crate::decision::BasisKind;
use crate::side::Side;
use lanelet2_map::geometry::Pose;

const CYCLE_MS: usize = 100;
const TURN: SignalSubject = SignalSubject::Turn(7);

/// A request: side, subject, time from start to end, and the time in which it is required, ms.
#[derive(Debug, Clone, Copy)]
struct Asked {
    side: Side,
    subject: SignalSubject,
    desired_ms: (u64, u64),
    required_ms: (u64, u64),
}

/// A left turn, announced at 10 s, required from 15 to 19 s, over at 20 s.
const LEFT_TURN: Asked =
    Asked { side: Side::Left, subject: TURN, desired_ms: (10_000, 20_000), required_ms: (15_000, 19_000) };

fn within((from, to): (u64, u64), ms: u64) -> bool {
    (from..to).contains(&ms)
}

fn reason() -> DeciderReason {
    DeciderReason {
        basis: BasisKind::Candidates,
        winner: None,
        rule: None,
        held: None,
        candidates: Vec::new(),
        manoeuvres: Vec::new(),
    }
}

fn asked_at(asked: &[Asked], ms: u64) -> AskedSignal {
    asked.iter().find(|asked| within(asked.desired_ms, ms)).map_or_else(
        || AskedSignal::Dark(reason()),
        |asked| AskedSignal::Side {
            side: asked.side,
            subject: Some(asked.subject),
            is_required: within(asked.required_ms, ms),
            reason: reason(),
        },
    )
}

/// Judges 40 s, in which the vehicle drives at 10 m/s along the x axis.
fn judged(
    asked: &[Asked],
    received: impl Fn(u64) -> Option<TurnCommand>,
) -> (Vec<JudgedManoeuvre>, JudgedCounts) {
    let mut judge = SignalJudge::new(JudgeSettings::DEFAULT);
    let mut over = Vec::new();
    for ms in (0..40_000).step_by(CYCLE_MS) {
        let x_m = f64::from(u32::try_from(ms).unwrap()) / 100.0;
        over.extend(judge.on_cycle(JudgedCycle {
            now: MonoTime::from_millis(ms),
            odometry: Odometry { pose: Pose::new(x_m, 0.0, 0.0), speed_mps: 10.0 },
            asked: asked_at(asked, ms),
            received: received(ms),
        }));
    }
    over.extend(judge.finish());
    (over, judge.counts().clone())
}

fn verdicts(asked: &[Asked], received: impl Fn(u64) -> Option<TurnCommand>) -> Vec<SignalVerdict> {
    judged(asked, received).0.into_iter().map(|judged| judged.verdict).collect()
}

/// Returns the side in these spans of time, dark otherwise.
fn shown(spans: &'static [(Side, u64, u64)]) -> impl Fn(u64) -> Option<TurnCommand> {
    move |ms| {
        let span = spans.iter().find(|(_, from, to)| within((*from, *to), ms));
        Some(span.map_or(TurnCommand::Disable, |(side, ..)| (*side).into()))
    }
}

#[test]
fn each_signal_gets_its_verdict() {
    use Side::{Left, Right};
    use SignalVerdict::{Agree, Early, Late, Missing, Needless, WrongSide};
    type Spans = &'static [(Side, u64, u64)];
    let cases: &[(Spans, &[SignalVerdict])] = &[
        (&[(Left, 10_000, 20_000)], &[Agree]),
        (&[(Left, 14_900, 19_000)], &[Agree]),
        (&[(Left, 15_700, 20_000)], &[Agree]),
        (&[(Left, 15_800, 20_000)], &[Late { by_ms: 800 }]),
        (&[(Left, 19_500, 20_000)], &[Late { by_ms: 4500 }]),
        (&[(Left, 8_000, 20_000)], &[Agree]),
        (&[(Left, 7_900, 20_000)], &[Early { by_ms: 2100 }]),
        (&[], &[Missing]),
        (&[(Left, 10_000, 17_900)], &[Missing]),
        (&[(Left, 10_000, 18_000)], &[Agree]),
        (&[(Left, 10_000, 16_000), (Left, 17_000, 20_000)], &[Agree]),
        (&[(Left, 10_000, 16_000), (Left, 17_100, 20_000)], &[Missing]),
        (&[(Right, 10_000, 20_000)], &[WrongSide]),
        // One fault, although it begins before and ends after its manoeuvre, as a correct signal may.
        (&[(Right, 8_000, 23_000)], &[WrongSide]),
        (&[(Right, 7_900, 20_000)], &[Needless, WrongSide]),
        (&[(Right, 10_000, 23_100)], &[WrongSide, Needless]),
        (&[(Left, 10_000, 16_000), (Right, 16_000, 16_700), (Left, 16_700, 20_000)], &[Agree]),
        (&[(Left, 10_000, 16_000), (Right, 16_000, 16_800), (Left, 16_800, 20_000)], &[WrongSide]),
        (&[(Left, 10_000, 19_000), (Right, 19_000, 20_900)], &[Agree]),
        (&[(Left, 10_000, 23_000)], &[Agree]),
        (&[(Left, 10_000, 23_100)], &[Agree, Needless]),
        (&[(Left, 10_000, 20_000), (Right, 30_000, 31_000)], &[Agree]),
        (&[(Left, 10_000, 20_000), (Right, 30_000, 31_100)], &[Agree, Needless]),
        (&[(Left, 5_000, 9_000), (Left, 10_000, 20_000)], &[Needless, Agree]),
        (&[(Right, 5_000, 12_000), (Left, 12_000, 20_000)], &[Needless, WrongSide]),
        // Not over at the last cycle, 39.9 s, and may still be early.
        (&[(Left, 10_000, 20_000), (Left, 37_900, 40_000)], &[Agree]),
        (&[(Left, 10_000, 20_000), (Left, 37_800, 40_000)], &[Agree, Needless]),
        (&[(Left, 10_000, 20_000), (Left, 37_900, 39_900)], &[Agree, Needless]),
    ];
    for (spans, expected) in cases {
        assert_eq!(verdicts(&[LEFT_TURN], shown(spans)), *expected, "{spans:?}");
    }
}

#[test]
fn a_planner_may_signal_before_its_trajectory_shows_why() {
    let lane_change = SignalSubject::Manoeuvre(ManoeuvreKind::LaneChange);
    let late_seen = |subject| Asked { desired_ms: (14_000, 20_000), subject, ..LEFT_TURN };
    let early = |by_ms| SignalVerdict::Early { by_ms };
    assert_eq!(
        verdicts(&[late_seen(lane_change)], shown(&[(Side::Left, 10_000, 20_000)])),
        [SignalVerdict::Agree]
    );
    assert_eq!(verdicts(&[late_seen(lane_change)], shown(&[(Side::Left, 9_900, 20_000)])), [early(4100)]);
    // A turn is known from the map.
    assert_eq!(verdicts(&[late_seen(TURN)], shown(&[(Side::Left, 10_000, 20_000)])), [early(4000)]);
}

#[test]
fn a_vehicle_that_stands_before_it_pulls_out_need_not_signal_yet() {
    let asked = AskedSignal::Side {
        side: Side::Left,
        subject: Some(SignalSubject::Manoeuvre(ManoeuvreKind::PullOut)),
        is_required: true,
        reason: reason(),
    };
    for (starts_ms, expected) in [
        (8_000, SignalVerdict::Agree),
        (7_300, SignalVerdict::Agree),
        (7_200, SignalVerdict::Late { by_ms: 800 }),
    ] {
        let mut judge = SignalJudge::new(JudgeSettings::DEFAULT);
        for ms in (0..15_000).step_by(CYCLE_MS) {
            let speed_mps = if ms < starts_ms { 0.0 } else { 1.0 };
            let judged = judge.on_cycle(JudgedCycle {
                now: MonoTime::from_millis(ms),
                odometry: Odometry { pose: Pose::default(), speed_mps },
                asked: asked.clone(),
                received: Some(if ms < 8_000 { TurnCommand::Disable } else { TurnCommand::Left }),
            });
            assert_eq!(judged, []);
        }
        let verdicts: Vec<SignalVerdict> = judge.finish().into_iter().map(|judged| judged.verdict).collect();
        assert_eq!(verdicts, [expected], "moves at {starts_ms} ms");
    }
}

#[test]
fn a_manoeuvre_has_its_place_times_and_subject() {
    let (over, counts) =
        judged(&[LEFT_TURN], shown(&[(Side::Right, 10_000, 20_000), (Side::Right, 30_000, 32_000)]));
    let [manoeuvre, needless] = &over[..] else { panic!("{over:?}") };
    assert_eq!((manoeuvre.side, manoeuvre.subject), (Side::Left, Some(TURN)));
    assert_eq!(manoeuvre.received, Some(Side::Right));
    let times = [manoeuvre.start, manoeuvre.required_since.unwrap(), manoeuvre.end];
    assert_eq!(times, [10_000, 15_000, 20_000].map(MonoTime::from_millis));
    assert_eq!(manoeuvre.odometry.pose, Pose::new(100.0, 0.0, 0.0));
    assert_eq!((needless.side, needless.subject, needless.received), (Side::Right, None, Some(Side::Right)));
    assert_eq!([needless.start, needless.end], [30_000, 32_000].map(MonoTime::from_millis));
    assert_eq!(needless.odometry.pose, Pose::new(300.0, 0.0, 0.0));
    let of = |kind| counts.by_kind[&kind];
    assert_eq!(of(JudgedKind::Turn), VerdictCounts { wrong_side: 1, ..VerdictCounts::default() });
    assert_eq!(of(JudgedKind::Nothing), VerdictCounts { needless: 1, ..VerdictCounts::default() });
    assert_eq!(counts.total().judged(), 2);
    assert_eq!(counts.total().percent(VerdictKind::Needless), Some(50.0));
    assert_eq!(counts.total().agreement_percent(), Some(0.0));
    assert_eq!(JudgedCounts::default().total().agreement_percent(), None);
}

#[test]
fn the_signal_of_one_side_may_linger_into_the_announcement_of_the_other() {
    let lane_change = Asked {
        side: Side::Right,
        subject: SignalSubject::Manoeuvre(ManoeuvreKind::LaneChange),
        desired_ms: (20_000, 30_000),
        required_ms: (25_000, 30_000),
    };
    let both = [LEFT_TURN, lane_change];
    let lingering = shown(&[(Side::Left, 10_000, 23_000), (Side::Right, 23_000, 30_000)]);
    assert_eq!(verdicts(&both, lingering), [SignalVerdict::Agree; 2]);
    let stuck = shown(&[(Side::Left, 10_000, 24_000), (Side::Right, 24_000, 30_000)]);
    assert_eq!(verdicts(&both, stuck), [SignalVerdict::Agree, SignalVerdict::WrongSide]);
}

#[test]
fn what_is_not_known_is_not_judged() {
    let (over, counts) = judged(&[LEFT_TURN], |_| None);
    assert_eq!((over, counts.unjudged, counts.total().judged()), (Vec::new(), 1, 0));
    let mut judge = SignalJudge::new(JudgeSettings::DEFAULT);
    let mut cycle = |ms, asked| {
        let now = MonoTime::from_millis(ms);
        judge.on_cycle(JudgedCycle {
            now,
            odometry: Odometry::default(),
            asked,
            received: Some(TurnCommand::Left),
        })
    };
    let side =
        |subject| AskedSignal::Side { side: Side::Right, subject, is_required: true, reason: reason() };
    assert_eq!(cycle(0, side(Some(TURN))), []);
    assert_eq!(cycle(5_000, AskedSignal::Unknown), [], "the decider lost its inputs");
    assert_eq!(cycle(10_000, AskedSignal::Unknown), [], "nor is the signal needless");
    assert_eq!(judge.finish(), []);
    assert_eq!(judge.counts().unjudged, 1);
}

#[test]
fn a_held_signal_continues_its_manoeuvre() {
    let mut judge = SignalJudge::new(JudgeSettings::DEFAULT);
    let side =
        |subject, is_required| AskedSignal::Side { side: Side::Left, subject, is_required, reason: reason() };
    let mut over = Vec::new();
    for (ms, asked) in
        [(0, side(Some(TURN), true)), (2_000, side(None, false)), (4_000, AskedSignal::Dark(reason()))]
    {
        let (now, received) = (MonoTime::from_millis(ms), Some(TurnCommand::NoCommand));
        over.extend(judge.on_cycle(JudgedCycle { now, odometry: Odometry::default(), asked, received }));
    }
    let [judged] = &over[..] else { panic!("{over:?}") };
    assert_eq!((judged.subject, judged.verdict), (Some(TURN), SignalVerdict::Missing));
    assert_eq!((judged.start, judged.end), (MonoTime::ZERO, MonoTime::from_millis(4_000)));
}

fn any_asked() -> impl Strategy<Value = Vec<(AskedSignal, u64)>> {
    let side = prop_oneof![Just(Side::Left), Just(Side::Right)];
    let asked =
        (side, 0..3_i64, any::<bool>(), 0..4_u8).prop_map(|(side, lane, is_required, what)| match what {
            0 => AskedSignal::Dark(reason()),
            _ => AskedSignal::Side {
                side,
                subject: Some(SignalSubject::Turn(lane)),
                is_required,
                reason: reason(),
            },
        });
    prop::collection::vec((asked, 50..4_000_u64), 1..60)
}

fn judged_beside(cycles: Vec<(AskedSignal, u64)>, swap: bool) -> Vec<JudgedManoeuvre> {
    let mut judge = SignalJudge::new(JudgeSettings::DEFAULT);
    let (mut over, mut ms) = (Vec::new(), 0);
    for (asked, after_ms) in cycles {
        let received = match &asked {
            AskedSignal::Side { side, .. } => TurnCommand::from(if swap { side.opposite() } else { *side }),
            AskedSignal::Dark(_) | AskedSignal::Unknown => TurnCommand::Disable,
        };
        let (now, received) = (MonoTime::from_millis(ms), Some(received));
        over.extend(judge.on_cycle(JudgedCycle { now, odometry: Odometry::default(), asked, received }));
        ms += after_ms;
    }
    over.extend(judge.finish());
    over
}

proptest! {
    #[test]
    fn the_signal_of_the_decider_always_agrees_and_its_mirror_never(cycles in any_asked()) {
        let asks = cycles.iter().any(|(asked, _)| matches!(asked, AskedSignal::Side { .. }));
        for (swap, expected) in [(false, SignalVerdict::Agree), (true, SignalVerdict::WrongSide)] {
            let over = judged_beside(cycles.clone(), swap);
            prop_assert_eq!(over.is_empty(), !asks);
            for judged in over {
                prop_assert_eq!(judged.verdict, expected, "{:?}", judged);
            }
        }
    }
}
