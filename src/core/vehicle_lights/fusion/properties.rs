//! Sources of one state: cases, and a model that looks back over all that was ever said.

use proptest::prelude::*;

use super::Statement::{NotStated, Unavailable, Value};
use super::TurnCode::{Both, Left, Off, Right};
use super::*;

type Said = Statement<TurnCode, &'static str>;
/// Who may stand in, what all say, what comes out, who decided.
type Case<'a> = (&'a [bool], [Said; 3], Result<TurnCode, &'a str>, usize);
const LIMIT: Duration = Duration::from_secs(3);

fn at(millis: u64) -> MonoTime {
    MonoTime::from_millis(millis)
}
fn fusion(fallbacks: &[bool]) -> Fusion<TurnCode> {
    let sources = fallbacks.iter().map(|fallback| SourceSettings { fallback: *fallback });
    Fusion::new(sources, LIMIT, turn_codes_agree)
}

#[test]
fn the_first_source_that_speaks_decides_and_its_doubt_stands_unless_another_may_stand_in() {
    const NONE: &[bool] = &[false, false, false];
    const THIRD: &[bool] = &[false, false, true];
    let table: [Case; 8] = [
        (NONE, [Value(Left), Value(Off), Unavailable("z")], Ok(Left), 0),
        (NONE, [NotStated, Value(Off), Value(Right)], Ok(Off), 1),
        (NONE, [Unavailable("x"), Value(Off), Value(Right)], Err("x"), 0),
        (THIRD, [Unavailable("x"), Value(Off), Value(Right)], Ok(Right), 2),
        (THIRD, [Unavailable("x"), Unavailable("y"), Unavailable("z")], Err("x"), 0),
        (THIRD, [Unavailable("x"), NotStated, NotStated], Err("x"), 0),
        (THIRD, [NotStated, Unavailable("y"), Value(Left)], Ok(Left), 2),
        (&[true, false, false], [Unavailable("x"), Value(Off), NotStated], Err("x"), 0),
    ];
    for (fallbacks, statements, state, source) in table {
        let fused = fusion(fallbacks).update(&statements, at(0));
        assert_eq!(fused, Some(Fused { state, source }), "{fallbacks:?} {statements:?}");
    }
    assert_eq!(fusion(NONE).update::<()>(&[NotStated; 3], at(0)), None);
    assert_eq!(fusion(NONE).update::<()>(&[], at(0)), None, "nothing said at all");
    let surplus = fusion(&[]).update::<()>(&[Value(Left)], at(0));
    assert_eq!(surplus, None, "a source nobody declared");
}

#[test]
fn a_contradiction_becomes_a_finding_after_the_limit_and_names_both_sources() {
    let mut fusion = fusion(&[false, false, false]);
    let statements: [Said; 3] = [Value(Left), Value(Left), Value(Off)];
    fusion.update(&statements, at(1000));
    let due = deadline_after(at(1000), LIMIT);
    assert_eq!(fusion.next_deadline(), Some(due));
    fusion.update(&statements, at(4000));
    assert_eq!(fusion.disagreements().count(), 0, "as long as the limit");
    fusion.update(&statements, due);
    let found = Disagreement { chosen: 0, chosen_value: Left, other: 2, other_value: Off, since: at(1000) };
    assert_eq!(fusion.disagreements().collect::<Vec<_>>(), [found]);
    assert_eq!(fusion.next_deadline(), None);
    fusion.update::<()>(&[Value(Left); 3], at(5000));
    assert_eq!(fusion.disagreements().count(), 0, "they agree again");
}

#[test]
fn changing_its_mind_does_not_end_a_contradiction_but_doubt_and_another_choice_do() {
    let table: [(&str, [Said; 2], usize); 4] = [
        ("another contradiction", [Value(Left), Value(Right)], 1),
        ("the chosen one contradicts anew", [Value(Right), Value(Off)], 1),
        ("doubt", [Value(Left), Unavailable("y")], 0),
        ("silence of the chosen one", [NotStated, Value(Off)], 0),
    ];
    for (name, then, findings) in table {
        let mut fusion = fusion(&[false, false]);
        fusion.update::<&str>(&[Value(Left), Value(Off)], at(0));
        fusion.update(&then, at(2000));
        fusion.update(&then, at(4000));
        assert_eq!(fusion.disagreements().count(), findings, "{name}");
    }
}

#[test]
fn hazard_contradicts_no_side_and_opposite_sides_contradict() {
    for (one, other, agree) in
        [(Both, Left, true), (Off, Both, true), (Left, Left, true), (Left, Off, false), (Left, Right, false)]
    {
        assert_eq!(turn_codes_agree(one, other), agree);
    }
}

fn statement() -> impl Strategy<Value = Said> {
    prop_oneof![
        1 => Just(NotStated),
        1 => Just(Unavailable("?")),
        5 => prop_oneof![3 => Just(Off), 2 => Just(Left), 1 => Just(Right), 1 => Just(Both)].prop_map(Value),
    ]
}

fn model_choice(fallbacks: [bool; 4], statements: [Said; 4]) -> Option<(usize, Said)> {
    let first = (0..4).find(|source| statements[*source] != NotStated)?;
    let stands_in =
        (first + 1..4).find(|source| fallbacks[*source] && matches!(statements[*source], Value(_)));
    let source = match statements[first] {
        Unavailable(_) => stands_in.unwrap_or(first),
        Value(_) | NotStated => first,
    };
    Some((source, statements[source]))
}

proptest! {
    #[test]
    fn choice_and_contradictions_are_what_the_whole_history_says(
        fallbacks: [bool; 4],
        steps in prop::collection::vec((0..1500_u64, prop::option::weighted(0.4, [statement(), statement(), statement(), statement()])), 1..40),
    ) {
        let mut fusion = fusion(&fallbacks);
        let mut history: Vec<(MonoTime, [Said; 4])> = vec![];
        let mut now = MonoTime::ZERO;
        for (step, statements) in steps {
            let statements = statements.or(history.last().map(|(_, statements)| *statements)).unwrap_or([NotStated; 4]);
            now = now.after(Duration::from_millis(step));
            history.push((now, statements));
            let fused = fusion.update(&statements, now);
            let choice = model_choice(fallbacks, statements);
            prop_assert_eq!(fused.map(|fused| fused.source), choice.map(|(source, _)| source));
            let state = fused.map(|fused| fused.state.map_or_else(Unavailable, Value));
            prop_assert_eq!(state, choice.map(|(_, statements)| statements));

            let contradicts = |other: usize| move |(_, statements): &&(MonoTime, [Said; 4])| {
                match (model_choice(fallbacks, *statements), statements[other]) {
                    (Some((source, Value(one))), Value(two)) => {
                        Some(source) == choice.map(|(source, _)| source) && !turn_codes_agree(one, two)
                    }
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
                prop_assert_eq!(Value(found.chosen_value), statements[found.chosen]);
                prop_assert_eq!(Value(found.other_value), statements[found.other]);
            }
            let due = (0..4).filter_map(since).map(|since| deadline_after(since, LIMIT)).filter(|at| *at > now).min();
            prop_assert_eq!(fusion.next_deadline(), due, "exact");
        }
    }
}
