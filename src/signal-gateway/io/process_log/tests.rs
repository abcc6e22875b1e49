use std::time::Duration;

use super::limits::*;
use super::*;

fn kind(subject: &str) -> MessageKind {
    MessageKind { subject: subject.to_owned(), ..MessageKind::default() }
}

fn admitted(limits: &mut LogLimits, subject: &str, count: u32, now: Instant) -> usize {
    let text = |number| format!("{subject}: {number}");
    (0..count).filter(|number| limits.admit(kind(subject), &text(*number), Level::INFO, now)).count()
}

#[test]
fn flood_of_one_kind_is_cut_and_summed_up_while_others_are_written() {
    let mut limits = LogLimits::default();
    let begin = Instant::now();
    assert_eq!(admitted(&mut limits, "turn", 5000, begin), 10);
    assert_eq!(admitted(&mut limits, "can0", 3, begin), 3);
    limits.settle(begin);
    assert_eq!(limits.summaries, [], "it continues");
    assert_eq!(admitted(&mut limits, "turn", 5000, begin + WINDOW), 10);
    limits.settle(begin + 2 * WINDOW);
    let summary = (Level::INFO, "4990 more times in 1 s, the last: turn: 4999".to_owned());
    assert_eq!(limits.summaries, [summary.clone(), summary]);
    assert_eq!((limits.suppressed, limits.kinds.len()), (2 * 4990, 0));
}

#[test]
fn flapping_is_summed_up_with_its_worst_level_once_it_is_quiet_and_at_the_end_of_a_window() {
    let mut limits = LogLimits::default();
    let begin = Instant::now();
    let tenth = Duration::from_millis(100);
    // Ten times a second for 5.6 s: 57 changes.
    for number in 0..57_u32 {
        let level = if number == 40 { Level::ERROR } else { Level::INFO };
        limits.admit(kind("turn"), &format!("turn: {number}"), level, begin + number * tenth);
        limits.settle(begin + number * tenth);
    }
    assert_eq!(limits.summaries, [], "it continues");
    limits.settle(begin + 56 * tenth + QUIET);
    let summary = "47 more times in 6 s, the last: turn: 56".to_owned();
    assert_eq!(limits.summaries, [(Level::ERROR, summary)]);
    assert!(limits.kinds.is_empty(), "the window is over");
    // Within an open window, messages after a summary get another summary.
    limits.summaries.clear();
    let begin = begin + 2 * WINDOW;
    assert_eq!(admitted(&mut limits, "turn", 11, begin), 10);
    limits.settle(begin + QUIET);
    assert_eq!(admitted(&mut limits, "turn", 1, begin + 2 * QUIET), 0);
    limits.settle(begin + WINDOW);
    let texts: Vec<_> = limits.summaries.iter().map(|(_, text)| text.as_str()).collect();
    assert_eq!(texts, ["once more in 1 s, the last: turn: 10", "once more in 3 s, the last: turn: 0"]);
}

#[test]
fn each_line_begins_with_its_level_and_a_timed_one_with_its_time() {
    let format = |form, has_time| LineFormat { form, has_time, has_color: false };
    assert_eq!(format(LogForm::Messages, true).prefix(Level::WARN), "warning: ");
    assert_eq!(format(LogForm::Timed, false).prefix(Level::WARN), " WARN ");
    let timed = format(LogForm::Timed, true).prefix(Level::ERROR);
    let (time, rest) = timed.split_once(' ').unwrap();
    assert_eq!((time.len(), rest), ("2026-11-30T09:17:18.000000Z".len(), "ERROR "), "{timed}");
    let colored = LineFormat { has_color: true, ..format(LogForm::Timed, false) };
    assert_eq!(colored.prefix(Level::INFO), "\u{1b}[32m INFO\u{1b}[0m ");
}

#[test]
fn kinds_are_bounded() {
    let mut limits = LogLimits::default();
    let begin = Instant::now();
    let admit = |limits: &mut LogLimits, name: &str, now| limits.admit(kind(name), "", Level::INFO, now);
    let admitted = (0..10_000).filter(|number| admit(&mut limits, &number.to_string(), begin)).count();
    assert_eq!((admitted, limits.kinds.len()), (MAX_KINDS + 10, MAX_KINDS + 1));
    assert!(admit(&mut limits, "again", begin + WINDOW));
    assert_eq!((limits.kinds.len(), limits.summaries.len()), (1, 1));
}

#[test]
fn messages_are_of_one_kind_by_their_subject_or_else_by_their_line() {
    let text = |subject: &str, interface: &str| EventText {
        message: "text".to_owned(),
        subject: subject.to_owned(),
        interface: interface.to_owned(),
        more: String::new(),
    };
    let kind = |line, text| MessageKind::new("io", Some(line), &text);
    assert_eq!(kind(1, text("turn", "")), kind(2, text("turn", "")));
    assert_ne!(kind(1, text("turn", "")), kind(1, text("hazard", "")));
    assert_ne!(kind(1, text("", "")), kind(2, text("", "")));
    assert_ne!(kind(1, text("", "can0")), kind(1, text("", "can1")));
}
