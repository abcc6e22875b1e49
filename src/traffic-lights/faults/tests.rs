//! Tests of the faults' frequencies, their repetition with the same seed, and their absence by default.

use proptest::prelude::*;

use super::*;
use crate::bulb::{Bulb, BulbShape, BulbStatus, Color};
use crate::emission::{GroupElement, GroupState, LightsTopic};

/// Number of messages in a statistical test; bounds are four standard deviations of the binomial
/// distribution.
const MANY: u32 = 6_000;
/// Time between messages.
const PERIOD_MS: u64 = 100;

fn element(color: Color, shape: BulbShape) -> GroupElement {
    GroupElement { bulb: Bulb { color, status: BulbStatus::SolidOn, shape }, confidence: 0.8 }
}

fn group(relation_id: i64, elements: &[GroupElement]) -> Arc<GroupState> {
    Arc::new(GroupState { relation_id, elements: elements.to_vec(), predictions: Vec::new() })
}

fn groups() -> Vec<Arc<GroupState>> {
    let red = element(Color::Red, BulbShape::Circle);
    vec![group(-5, &[red]), group(100, &[element(Color::Green, BulbShape::Right), red])]
}

fn emission(number: u64, groups: Vec<Arc<GroupState>>) -> Emission {
    let stamp = WallStamp::from_nanos(i64::try_from(number).unwrap() * 100_000_000);
    Emission { topic: LightsTopic::V2i, stamp, content: LightsContent::Groups(Arc::new(groups)) }
}

/// Returns the messages that arrive, with their times of arrival, if one is sent each period.
fn run(settings: FaultSettings, messages: impl IntoIterator<Item = Emission>) -> Vec<(MonoTime, Emission)> {
    let mut faults = ChannelFaults::new(settings).unwrap();
    let mut arrived = Vec::new();
    let mut take = |faults: &mut ChannelFaults, until: MonoTime| {
        while let Some(at) = faults.next_deadline().filter(|at| *at <= until) {
            let before = at.as_nanos().checked_sub(1).map(MonoTime::from_nanos);
            assert_eq!(before.and_then(|before| faults.poll(before)), None, "too early");
            arrived.push((at, faults.poll(at).unwrap()));
        }
    };
    for (number, emission) in (0_u64..).zip(messages) {
        let now = MonoTime::from_millis(number * PERIOD_MS);
        take(&mut faults, now);
        faults.send(emission, now);
    }
    take(&mut faults, MonoTime::from_nanos(u64::MAX));
    arrived
}

fn many() -> impl Iterator<Item = Emission> {
    (0..u64::from(MANY)).map(|number| emission(number, groups()))
}

fn groups_of(emission: &Emission) -> &[Arc<GroupState>] {
    match &emission.content {
        LightsContent::Groups(groups) => groups,
        LightsContent::Lights(_) | LightsContent::Markers(_) | LightsContent::Clock => {
            panic!("groups were sent")
        }
    }
}

fn assert_rate(what: &str, count: usize, of: u32, probability: f64) {
    let (count, of) = (f64::from(u32::try_from(count).unwrap()), f64::from(of));
    let bound = 4.0 * (of * probability * (1.0 - probability)).sqrt();
    assert!((count - of * probability).abs() <= bound, "{what}: {count} of {of}, expected {probability}");
}

fn everything(seed: u64) -> FaultSettings {
    FaultSettings {
        seed,
        latency: Duration::from_millis(150),
        jitter: Duration::from_millis(120),
        loss: 0.1,
        freeze: Spells { probability: 0.05, mean_length: 3.0 },
        stamp_offset_ns: -7,
        miss: Spells { probability: 0.1, mean_length: 2.0 },
        unknown: 0.1,
        confusions: vec![Confusion { from: Color::Red, to: Color::Green, probability: 0.2 }],
        confidence_mean: Some(0.7),
        confidence_spread: 0.2,
    }
}

#[test]
fn without_faults_messages_arrive_at_once_and_unchanged() {
    let sent: Vec<_> = many().take(100).collect();
    let arrived = run(FaultSettings { seed: 5, ..FaultSettings::default() }, sent.clone());
    assert_eq!(arrived.len(), sent.len());
    for (number, (sent, (at, arrived))) in (0_u64..).zip(sent.iter().zip(&arrived)) {
        assert_eq!((arrived, *at), (sent, MonoTime::from_millis(number * PERIOD_MS)));
        assert!(sent.content.is_shared_with(&arrived.content));
    }
}

#[test]
fn the_same_seed_gives_the_same_faults_and_another_one_others() {
    let [one, again, other] = [3, 3, 4].map(|seed| run(everything(seed), many().take(500)));
    assert_eq!(format!("{one:?}"), format!("{again:?}"));
    assert_ne!(format!("{one:?}"), format!("{other:?}"));
}

/// A seed gives the same draws in every version.
#[test]
fn draws_of_a_seed_are_fixed() {
    let draws = Draws::new(42);
    let shares = [0, 1, 2].map(|message| draws.share(DrawKind::Loss, [0, 0], message).to_bits());
    assert_eq!(shares, [4_603_812_169_380_658_795, 4_606_090_580_161_229_680, 4_602_715_296_966_638_691]);
}

#[test]
fn messages_are_lost_as_often_as_set() {
    for loss in [0.1, 0.5] {
        let arrived = run(FaultSettings { loss, ..FaultSettings::default() }, many());
        assert_rate("loss", MANY as usize - arrived.len(), MANY, loss);
    }
    assert_eq!(run(FaultSettings { loss: 1.0, ..FaultSettings::default() }, many()), []);
}

#[test]
fn groups_are_unknown_as_often_as_set_and_independently() {
    let arrived = run(FaultSettings { unknown: 0.2, ..FaultSettings::default() }, many());
    let is_unknown = |group: &Arc<GroupState>| group.elements[0].bulb.status == BulbStatus::Unknown;
    let both = |groups: &[Arc<GroupState>]| groups.iter().all(is_unknown);
    let count = |test: &dyn Fn(&[Arc<GroupState>]) -> bool| {
        arrived.iter().filter(|(_, emission)| test(groups_of(emission))).count()
    };
    assert_rate("one", count(&|groups| is_unknown(&groups[0])), MANY, 0.2);
    assert_rate("both", count(&both), MANY, 0.04);
    for (_, emission) in &arrived {
        let [one, two] = groups_of(emission) else { panic!("a group is missing") };
        let shapes: Vec<_> = two.elements.iter().map(|element| element.bulb.shape).collect();
        assert_eq!((one.elements[0].bulb.shape, shapes.len()), (BulbShape::Circle, 2));
        for element in one.elements.iter().chain(&two.elements) {
            let Bulb { color, status, .. } = element.bulb;
            assert_eq!((color == Color::Unknown, element.confidence), (status == BulbStatus::Unknown, 0.8));
        }
    }
}

#[test]
fn colors_are_confused_as_often_as_set() {
    let confusion = |to, probability| Confusion { from: Color::Red, to, probability };
    let confusions = vec![confusion(Color::Green, 0.1), confusion(Color::Yellow, 0.3)];
    let arrived = run(FaultSettings { confusions, ..FaultSettings::default() }, many());
    let bulbs = |at: usize| arrived.iter().map(move |(_, emission)| &groups_of(emission)[at].elements);
    let count = |color| bulbs(0).filter(|elements| elements[0].bulb.color == color).count();
    assert_rate("red as green", count(Color::Green), MANY, 0.1);
    assert_rate("red as yellow", count(Color::Yellow), MANY, 0.3);
    assert_eq!(count(Color::White) + count(Color::Unknown), 0);
    let green_arrow = element(Color::Green, BulbShape::Right);
    assert!(bulbs(1).all(|elements| elements.len() == 2 && elements.contains(&green_arrow)));
    assert!(bulbs(1).all(|elements| elements.is_sorted_by_key(|element| element.bulb)));
}

#[test]
fn equal_bulbs_are_one() {
    let confusions = vec![Confusion { from: Color::Red, to: Color::Green, probability: 1.0 }];
    let two = [element(Color::Green, BulbShape::Circle), element(Color::Red, BulbShape::Circle)];
    let settings = FaultSettings { confusions, ..FaultSettings::default() };
    let arrived = run(settings, [emission(0, vec![group(1, &two)])]);
    assert_eq!(groups_of(&arrived[0].1), [group(1, &two[..1])]);
}

#[test]
fn groups_are_missing_as_often_and_as_long_as_set() {
    for (probability, mean_length) in [(0.2, 1.0), (0.05, 4.0)] {
        let miss = Spells { probability, mean_length };
        let arrived = run(FaultSettings { miss, ..FaultSettings::default() }, many());
        assert_eq!(arrived.len(), MANY as usize, "a message without groups is a message");
        let there = |id| {
            arrived
                .iter()
                .map(move |(_, emission)| groups_of(emission).iter().any(|group| group.relation_id == id))
        };
        for id in [-5, 100] {
            let missing: Vec<bool> = there(id).map(|is_there| !is_there).collect();
            let begins = missing.windows(2).filter(|pair| !pair[0] && pair[1]).count();
            let present = missing.iter().filter(|is_missing| !**is_missing).count();
            assert_rate("beginning", begins, u32::try_from(present).unwrap(), probability);
            // A spell continues unless it ends and no other begins at once.
            let ends = missing.windows(2).filter(|pair| pair[0] && !pair[1]).count();
            let absent = u32::try_from(missing.len() - present).unwrap();
            assert_rate("ending", ends, absent, (1.0 - probability) / mean_length);
        }
    }
}

#[test]
fn a_frozen_sender_repeats_its_last_message() {
    let freeze = Spells { probability: 0.1, mean_length: 5.0 };
    let sent: Vec<_> = many().collect();
    let arrived = run(FaultSettings { freeze, ..FaultSettings::default() }, sent.clone());
    let mut repeated = 0.0;
    for at in 1..sent.len() {
        let is_new = arrived[at].1.stamp == sent[at].stamp;
        assert!(is_new || arrived[at].1.stamp == arrived[at - 1].1.stamp, "message {at}");
        repeated += f64::from(u8::from(!is_new));
    }
    // A freeze continues with probability 0.8, and otherwise begins with 0.1. Messages are not independent,
    // so the bound is wider.
    let share = 0.1 / (1.0 - 0.8 * 0.9);
    let share_found = repeated / f64::from(MANY);
    assert!((share_found - share).abs() < 0.06, "{share_found}, expected {share}");
}

#[test]
fn confidence_has_the_set_mean_and_spread() {
    let cases = [(None, 0.05, 0.8), (Some(0.5), 0.05, 0.5), (Some(0.3), 0.0, 0.3)];
    for (confidence_mean, confidence_spread, mean) in cases {
        let settings = FaultSettings { confidence_mean, confidence_spread, ..FaultSettings::default() };
        let arrived = run(settings, many());
        let found: Vec<f64> =
            arrived.iter().map(|(_, emission)| groups_of(emission)[0].elements[0].confidence).collect();
        let average = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / f64::from(MANY);
        let found_mean = average(&mut found.iter().copied());
        let found_spread = average(&mut found.iter().map(|one| (one - found_mean).powi(2))).sqrt();
        assert!((found_mean - mean).abs() < 0.003, "{found_mean}, expected {mean}");
        assert!((found_spread - confidence_spread).abs() < 0.002, "{found_spread}");
    }
    let wild = FaultSettings { confidence_spread: 1.0, ..FaultSettings::default() };
    let all = run(wild, many());
    let mut confidences = all.iter().map(|(_, emission)| groups_of(emission)[0].elements[0].confidence);
    assert!(confidences.all(|confidence| (0.0..=1.0).contains(&confidence)));
}

#[test]
fn messages_are_delayed_in_order() {
    let [latency, jitter, shortest] = [150, 120, 30].map(Duration::from_millis);
    let settings = FaultSettings { latency, jitter, ..FaultSettings::default() };
    let arrived = run(settings, many());
    assert_eq!(arrived.len(), MANY as usize);
    assert!(arrived.is_sorted_by(|one, next| one.0 <= next.0 && one.1.stamp != next.1.stamp));
    let sent_ns = |emission: &Emission| u64::try_from(emission.stamp.as_nanos()).unwrap();
    let took = |(at, emission): &(MonoTime, Emission)| at.since(MonoTime::from_nanos(sent_ns(emission)));
    assert!(arrived.iter().all(|one| took(one) >= shortest && took(one) < latency + jitter));
    let fixed = FaultSettings { latency, ..FaultSettings::default() };
    assert!(run(fixed, many().take(50)).iter().all(|one| took(one) == latency));
    // Messages far apart do not wait for each other: the latencies show their mean and range.
    let apart = FaultSettings {
        latency: Duration::from_millis(50),
        jitter: Duration::from_millis(40),
        ..FaultSettings::default()
    };
    let times: Vec<f64> = run(apart, many()).iter().map(|one| took(one).as_secs_f64()).collect();
    let mean = times.iter().sum::<f64>() / f64::from(MANY);
    assert!((mean - 0.05).abs() < 0.0015, "{mean}");
    assert!(times.iter().any(|time| *time < 0.0105) && times.iter().any(|time| *time > 0.0895));
}

#[test]
fn stamps_are_off_by_the_set_offset() {
    for (stamp_offset_ns, first) in [(-3_000, -3_000), (i64::MIN, i64::MIN), (5, 5)] {
        let settings = FaultSettings { stamp_offset_ns, ..FaultSettings::default() };
        let arrived = run(settings, many().take(1));
        assert_eq!(arrived[0].1.stamp, WallStamp::from_nanos(first));
        assert_eq!(groups_of(&arrived[0].1), groups());
    }
}

#[test]
fn contradicting_settings_are_refused() {
    let red = |probability| Confusion { from: Color::Red, to: Color::Green, probability };
    let second = Duration::from_secs(1);
    let confusions = |confusions| FaultSettings { confusions, ..FaultSettings::default() };
    let jitter = FaultSettings { latency: second, jitter: second * 2, ..FaultSettings::default() };
    for (settings, part) in
        [(confusions(vec![red(0.6), red(0.6)]), "`red` add up to 1.2"), (jitter, "jitter is 2s; at most")]
    {
        let error = ChannelFaults::new(settings).unwrap_err().to_string();
        assert!(error.contains(part), "{error}: expected {part}");
    }
    assert!(ChannelFaults::new(confusions(vec![red(0.7), red(0.2), red(0.1)])).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    /// Neither other faults nor other groups change the draws of a fault.
    #[test]
    fn faults_do_not_depend_on_each_other(seed: u64) {
        let unknown = FaultSettings { seed, unknown: 0.3, ..FaultSettings::default() };
        let all = FaultSettings { freeze: Spells::default(), stamp_offset_ns: 0, unknown: 0.3, ..everything(seed) };
        let is_unknown = |emission: &Emission| {
            let group = groups_of(emission).iter().find(|group| group.relation_id == 100)?;
            Some((emission.stamp.as_nanos(), group.elements[0].bulb.status == BulbStatus::Unknown))
        };
        let alone = |number| emission(number, groups().split_off(1));
        let expected: Vec<_> =
            run(unknown, (0..60).map(alone)).iter().map(|(_, emission)| is_unknown(emission)).collect();
        for (_, emission) in run(all, many().take(60)) {
            let found = is_unknown(&emission);
            prop_assert!(found.is_none() || expected.contains(&found));
        }
    }
}
