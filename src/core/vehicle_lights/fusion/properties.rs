//! Fusion in cases and against a model that evaluates the whole history.

use proptest::prelude::*;

use super::TurnCode::{Both, Left, Off, Right};
use super::*;

type State = Result<TurnCode, &'static str>;

/// A fusion of three sources.
struct Case {
    fallbacks: [bool; 3],
    states: [State; 3],
    state: State,
    source: usize,
}

const LIMIT: Duration = Duration::from_secs(3);

fn at(millis: u64) -> MonoTime {
    MonoTime::from_millis(millis)
}
fn fusion(fallbacks: &[bool]) -> Fusion<TurnCode> {
    let sources = fallbacks.iter().map(|fallback| SourceSettings { fallback: *fallback });
    Fusion::new(sources, LIMIT, turn_codes_agree)
}

#[test]
fn first_source_decides_unless_fallback_replaces_it() {
    const NONE: [bool; 3] = [false, false, false];
    const THIRD: [bool; 3] = [false, false, true];
    const FIRST: [bool; 3] = [true, false, false];
    let case = |fallbacks, states, state, source| Case { fallbacks, states, state, source };
    for Case { fallbacks, states, state, source } in [
        case(NONE, [Ok(Left), Ok(Off), Err("z")], Ok(Left), 0),
        case(NONE, [Err("x"), Ok(Off), Ok(Right)], Err("x"), 0),
        case(THIRD, [Err("x"), Ok(Off), Ok(Right)], Ok(Right), 2),
        case(THIRD, [Err("x"), Err("y"), Err("z")], Err("x"), 0),
        case(FIRST, [Err("x"), Ok(Off), Err("z")], Err("x"), 0),
    ] {
        let fused = fusion(&fallbacks).update(states, at(0));
        assert_eq!(fused, Some(Fused { state, source }), "{fallbacks:?} {states:?}");
    }
    assert_eq!(fusion(&NONE).update::<()>([], at(0)), None, "without any state");
    let surplus = fusion(&[]).update::<()>([Ok(Left)], at(0));
    assert_eq!(surplus, None, "an undeclared source");
}

#[test]
fn contradiction_becomes_disagreement_after_limit() {
    let mut fusion = fusion(&[false, false, false]);
    let states: [State; 3] = [Ok(Left), Ok(Left), Ok(Off)];
    fusion.update(states, at(1000));
    let due = deadline_after(at(1000), LIMIT);
    assert_eq!(fusion.next_deadline(), Some(due));
    fusion.update(states, at(4000));
    assert_eq!(fusion.disagreements().count(), 0, "as long as the limit");
    fusion.update(states, due);
    let found = Disagreement { chosen: 0, chosen_value: Left, other: 2, other_value: Off, since: at(1000) };
    assert_eq!(fusion.disagreements().collect::<Vec<_>>(), [found]);
    assert_eq!(fusion.next_deadline(), None);
    fusion.update::<()>([Ok(Left); 3], at(5000));
    assert_eq!(fusion.disagreements().count(), 0, "they agree again");
}

#[test]
fn contradiction_lasts_over_changes_until_source_is_unavailable_or_replaced() {
    let table: [(&str, [State; 2], usize); 4] = [
        ("another contradiction", [Ok(Left), Ok(Right)], 1),
        ("another value of the chosen source", [Ok(Right), Ok(Off)], 1),
        ("an unavailable source", [Ok(Left), Err("y")], 0),
        ("an unavailable chosen source", [Err("x"), Ok(Off)], 0),
    ];
    for (name, then, disagreements) in table {
        let mut fusion = fusion(&[false, true]);
        fusion.update::<&str>([Ok(Left), Ok(Off)], at(0));
        fusion.update(then, at(2000));
        fusion.update(then, at(4000));
        assert_eq!(fusion.disagreements().count(), disagreements, "{name}");
    }
}

#[test]
fn hazard_agrees_with_any_side_and_sides_contradict() {
    for (one, other, agree) in
        [(Both, Left, true), (Off, Both, true), (Left, Left, true), (Left, Off, false), (Left, Right, false)]
    {
        assert_eq!(turn_codes_agree(one, other), agree);
    }
}

fn any_state() -> impl Strategy<Value = State> {
    prop_oneof![
        2 => Just(Err("?")),
        5 => prop_oneof![3 => Just(Off), 2 => Just(Left), 1 => Just(Right), 1 => Just(Both)].prop_map(Ok),
    ]
}

fn model_choice(fallbacks: [bool; 4], states: [State; 4]) -> (usize, State) {
    let fallback = (1..4).find(|source| fallbacks[*source] && states[*source].is_ok());
    let source = if states[0].is_ok() { 0 } else { fallback.unwrap_or(0) };
    (source, states[source])
}

proptest! {
    #[test]
    fn choice_and_disagreements_agree_with_model(
        fallbacks: [bool; 4],
        steps in prop::collection::vec((0..1500_u64, prop::option::weighted(0.4, [any_state(), any_state(), any_state(), any_state()])), 1..40),
    ) {
        let mut fusion = fusion(&fallbacks);
        let mut history: Vec<(MonoTime, [State; 4])> = vec![];
        let mut now = MonoTime::ZERO;
        for (step, states) in steps {
            let states = states.or(history.last().map(|(_, states)| *states)).unwrap_or([Err("?"); 4]);
            now = now.after(Duration::from_millis(step));
            history.push((now, states));
            let (source, state) = model_choice(fallbacks, states);
            prop_assert_eq!(fusion.update(states, now), Some(Fused { state, source }));

            let contradicts = |other: usize| move |(_, states): &&(MonoTime, [State; 4])| {
                match (model_choice(fallbacks, *states), states[other]) {
                    ((chosen, Ok(one)), Ok(two)) => chosen == source && !turn_codes_agree(one, two),
                    _ => false,
                }
            };
            let since = |other| history.iter().rev().take_while(contradicts(other)).last().map(|(at, _)| *at);
            let lasting: Vec<_> = (0..4)
                .filter_map(|other| Some((other, since(other)?)))
                .filter(|(_, since)| now.since(*since) > LIMIT)
                .collect();
            let found: Vec<_> = fusion.disagreements().map(|found| (found.other, found.since)).collect();
            prop_assert_eq!(&found, &lasting);
            for found in fusion.disagreements() {
                prop_assert_eq!(Ok(found.chosen_value), states[found.chosen]);
                prop_assert_eq!(Ok(found.other_value), states[found.other]);
            }
            let due = (0..4).filter_map(since).map(|since| deadline_after(since, LIMIT)).filter(|at| *at > now).min();
            prop_assert_eq!(fusion.next_deadline(), due, "exact");
        }
    }
}
