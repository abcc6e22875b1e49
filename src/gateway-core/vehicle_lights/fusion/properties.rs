//! Tests fusion by cases and against a model that evaluates the whole history.

use proptest::prelude::*;

use super::TurnCode::{Both, Left, Off, Right};
use super::*;

type State = Result<TurnCode, &'static str>;

/// A fusion of three sources.
struct Case {
    fallbacks: [bool; 3],
    states: [Option<State>; 3],
    source: usize,
}

const LIMIT: Duration = Duration::from_secs(3);

fn at(millis: u64) -> MonoTime {
    MonoTime::from_millis(millis)
}
fn fusion(fallbacks: &[bool]) -> Fusion<TurnCode> {
    Fusion::new(fallbacks.iter().copied(), LIMIT, turn_codes_agree)
}

#[test]
fn first_source_decides_unless_fallback_replaces_it() {
    const NONE: [bool; 3] = [false, false, false];
    const THIRD: [bool; 3] = [false, false, true];
    const FIRST: [bool; 3] = [true, false, false];
    let case = |fallbacks, states: [State; 3], source| Case { fallbacks, states: states.map(Some), source };
    let without_first = |case: Case| Case { states: [None, case.states[1], case.states[2]], ..case };
    for Case { fallbacks, states, source } in [
        case(NONE, [Ok(Left), Ok(Off), Err("z")], 0),
        case(NONE, [Err("x"), Ok(Off), Ok(Right)], 0),
        case(THIRD, [Err("x"), Ok(Off), Ok(Right)], 2),
        case(THIRD, [Err("x"), Err("y"), Err("z")], 0),
        case(FIRST, [Err("x"), Ok(Off), Err("z")], 0),
        without_first(case(NONE, [Ok(Left), Ok(Off), Ok(Right)], 1)),
        without_first(case(THIRD, [Err("x"), Err("y"), Ok(Right)], 2)),
        without_first(case(NONE, [Ok(Left), Err("y"), Ok(Right)], 1)),
    ] {
        let deciding = fusion(&fallbacks).update(states, at(0));
        assert_eq!(deciding, Some(source), "{fallbacks:?} {states:?}");
    }
    assert_eq!(fusion(&NONE).update::<()>([], at(0)), None, "without any state");
    assert_eq!(fusion(&NONE).update::<()>([None; 3], at(0)), None, "no source applies");
    let surplus = fusion(&[]).update::<()>([Some(Ok(Left))], at(0));
    assert_eq!(surplus, None, "an undeclared source");
}

#[test]
fn contradiction_becomes_disagreement_after_limit() {
    let mut fusion = fusion(&[false, false, false]);
    let states: [Option<State>; 3] = [Some(Ok(Left)), Some(Ok(Left)), Some(Ok(Off))];
    fusion.update(states, at(1000));
    let due = deadline_after(at(1000), LIMIT);
    assert_eq!(fusion.next_deadline(), Some(due));
    fusion.update(states, at(4000));
    assert_eq!(fusion.disagreements().count(), 0, "as long as the limit");
    fusion.update(states, due);
    let found = Disagreement { chosen: 0, chosen_value: Left, other: 2, other_value: Off };
    assert_eq!(fusion.disagreements().collect::<Vec<_>>(), [found]);
    assert_eq!(fusion.next_deadline(), None);
    fusion.update::<()>([Some(Ok(Left)); 3], at(5000));
    assert_eq!(fusion.disagreements().count(), 0, "they agree again");
}

#[test]
fn contradiction_lasts_over_changes_until_source_is_unavailable_or_replaced() {
    let table: [(&str, [Option<State>; 2], usize); 6] = [
        ("another contradiction", [Some(Ok(Left)), Some(Ok(Right))], 1),
        ("another value of the chosen source", [Some(Ok(Right)), Some(Ok(Off))], 1),
        ("an unavailable source", [Some(Ok(Left)), Some(Err("y"))], 0),
        ("an unavailable chosen source", [Some(Err("x")), Some(Ok(Off))], 0),
        ("a source that does not apply", [Some(Ok(Left)), None], 0),
        ("a chosen source that does not apply", [None, Some(Ok(Off))], 0),
    ];
    for (name, then, disagreements) in table {
        let mut fusion = fusion(&[false, true]);
        fusion.update::<&str>([Some(Ok(Left)), Some(Ok(Off))], at(0));
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

fn any_state() -> impl Strategy<Value = Option<State>> {
    let state = prop_oneof![
        2 => Just(Err("?")),
        5 => prop_oneof![3 => Just(Off), 2 => Just(Left), 1 => Just(Right), 1 => Just(Both)].prop_map(Ok),
    ];
    prop::option::weighted(0.8, state)
}

/// Returns the deciding source and its state; `None` if no source applies.
fn model_choice(fallbacks: [bool; 4], states: [Option<State>; 4]) -> Option<(usize, State)> {
    let first = (0..4).find(|source| states[*source].is_some())?;
    let is_ok = |source: &usize| states[*source].is_some_and(|state| state.is_ok());
    let fallback = (first + 1..4).find(|source| fallbacks[*source] && is_ok(source));
    let source = if is_ok(&first) { first } else { fallback.unwrap_or(first) };
    Some((source, states[source]?))
}

proptest! {
    #[test]
    fn choice_and_disagreements_agree_with_model(
        fallbacks: [bool; 4],
        steps in prop::collection::vec((0..1500_u64, prop::option::weighted(0.4, [any_state(), any_state(), any_state(), any_state()])), 1..40),
    ) {
        let mut fusion = fusion(&fallbacks);
        let mut history: Vec<(MonoTime, [Option<State>; 4])> = vec![];
        let mut now = MonoTime::ZERO;
        for (step, states) in steps {
            let states = states.or(history.last().map(|(_, states)| *states)).unwrap_or([Some(Err("?")); 4]);
            now = now.after(Duration::from_millis(step));
            history.push((now, states));
            let choice = model_choice(fallbacks, states);
            prop_assert_eq!(fusion.update(states, now), choice.map(|(source, _)| source));

            let contradicts = |other: usize| move |(_, states): &&(MonoTime, [Option<State>; 4])| {
                match (model_choice(fallbacks, *states), states[other]) {
                    (Some((chosen, Ok(one))), Some(Ok(two))) => {
                        Some(chosen) == choice.map(|(source, _)| source) && !turn_codes_agree(one, two)
                    }
                    _ => false,
                }
            };
            let since = |other| history.iter().rev().take_while(contradicts(other)).last().map(|(at, _)| *at);
            let lasting: Vec<_> = (0..4)
                .filter(|other| since(*other).is_some_and(|since| now.since(since) > LIMIT))
                .collect();
            let found: Vec<_> = fusion.disagreements().map(|found| found.other).collect();
            prop_assert_eq!(&found, &lasting);
            for found in fusion.disagreements() {
                prop_assert_eq!(Some(Ok(found.chosen_value)), states[found.chosen]);
                prop_assert_eq!(Some(Ok(found.other_value)), states[found.other]);
            }
            let due = (0..4).filter_map(since).map(|since| deadline_after(since, LIMIT)).filter(|at| *at > now).min();
            prop_assert_eq!(fusion.next_deadline(), due, "exact");
        }
    }
}
