//! Recordings of a few frames, and what the survey reports of them.

use std::path::Path;

use super::*;
use crate::check::Layout;
use crate::config::files::{DEMO_CONFIG, Disk, Embedded};
use crate::config::{Overrides, load, load_profile};
use crate::core::plausibility::finding::Severity;
use crate::io::can::log::Log;
use crate::replay::Routes;

/// Number of findings from warnings up.
fn concerns(report: &Report) -> usize {
    report.count(Severity::Warning) + report.count(Severity::Error)
}

fn survey(text: &str) -> Report {
    survey_of(&load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap(), text)
}

fn survey_of(settings: &Settings, text: &str) -> Report {
    let log = Log::new(Box::new(io::Cursor::new(text.as_bytes().to_vec()))).unwrap();
    let routes = Routes::by_interface(&settings.gateway);
    let replay = Replay::surveying(settings.gateway.clone(), log, routes).unwrap();
    let (report, outcome) = recording(settings, replay);
    outcome.unwrap();
    report
}

#[test]
fn waiting_for_the_first_frame_is_not_a_warning() {
    let both = "(1.3) can0 2A5#0000000000000000\n(1.3) can0 2C1#0000000000000000\n(1.5) can0 111#\n";
    for before in ["", "(1.0) can9 111#00\n", "(1.0) can0 111#00\n"] {
        let report = survey(&format!("{before}{both}"));
        assert_eq!(concerns(&report), 1, "only that nothing is on: {}", report.text(Layout::default()));
    }
}

#[test]
fn the_time_until_the_first_frame_counts_as_unknown() {
    let report = survey("(1.0) can0 111#00\n(1.3) can0 2A5#0000000000000000\n(1.4) can0 2A5#00\n");
    assert!(
        report.text(Layout::default()).contains("turn_indicators unknown once, 0.300 s in all"),
        "{}",
        report.text(Layout::default())
    );
    assert!(
        report.text(Layout::default()).contains("turn_indicators would be published for 0.100 s of 0.400 s")
    );
}

/// The Volvo's two bits of counter, and 20 ms between frames.
fn volvo(counters: &[u8]) -> (Settings, Report) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles/volvo_s60_2002.toml");
    let settings = load_profile(&Disk, &path).unwrap();
    let line = |(at, counter): (usize, &u8)| {
        format!("(1.{:03}) can0 0261300A#{:02X}00000000000000\n", at * 20, counter << 6)
    };
    let text: String = counters.iter().enumerate().map(line).collect();
    let report = survey_of(&settings, &text);
    (settings, report)
}

#[test]
fn rejected_frames_are_a_warning_unless_they_are_the_first() {
    let (settings, report) = volvo(&[0, 1, 2, 3, 0]);
    let text = "           Indicator_Stalk: 4 trusted, 1 rejected (1 first frame, no counter before it)";
    assert!(report.text(Layout::default()).contains(text), "{}", report.text(Layout::default()));
    assert_eq!(concerns(&report), 1, "only that nothing is on: {}", report.text(Layout::default()));
    let (_, report) = volvo(&[0, 1, 3, 3, 0, 1, 2]);
    let text = "warning    Indicator_Stalk: 4 trusted, 3 rejected (1 first frame, no counter before it, \
                1 repeated counter, 1 counter not in sequence for long enough), 1 lost by the counter";
    assert!(report.text(Layout::default()).contains(text), "{}", report.text(Layout::default()));
    assert_eq!(concerns(&report), 2, "{}", report.text(Layout::default()));
    let text = super::super::binding(&settings).text(Layout::default());
    assert!(text.contains("integrity check: a counter of 0 to 3 in steps of at most 2"), "{text}");
}

#[test]
fn a_message_that_is_missing_while_others_come_is_told_from_a_silent_bus() {
    let before = "(1.0) can0 2A5#0000000000000000\n(1.0) can0 2C1#0000000000000000\n";
    let between = "(1.5) can0 111#00\n";
    let after = "(2.0) can0 2A5#0000000000000000\n";
    let text = survey(&format!("{before}{between}{after}")).text(Layout::default());
    let missing = "BCM_TurnIndicators was missing for longer than its limit once";
    assert!(text.contains(&format!("warning    {missing}, while other frames came on can0\n")), "{text}");
    let text = survey(&format!("{before}{after}")).text(Layout::default());
    assert!(text.contains(&format!("warning    {missing}, and so was everything else on can0\n")), "{text}");
}

#[test]
fn error_frames_are_listed_by_class() {
    let text = survey(
        "(1.0) can0 2A5#0000000000000000\n(1.1) can0 20000204#0008000000006000\n(1.2) can0 20000088#0000000000000000\n\
         (1.3) can0 20000008#0000000000000000\n(1.4) can9 20000088#0000000000000000\n",
    )
    .text(Layout::default());
    let line = "warning    can0: 3 error frames, first at 0.100 s: controller once, protocol 2 times, bus-error once\n";
    assert!(text.contains(line), "{text}");
}

#[test]
fn a_message_that_came_otherwise_is_said() {
    let text =
        survey("(1.0) can0 000002A5#00\n(1.1) can1 2C1#00\n(1.2) can0 000002A5#00\n").text(Layout::default());
    for line in [
        "warning    BCM_TurnIndicators (2A5) was never received on can0, but 2 frames of 000002A5 with 29 bits came\n",
        "warning    BCM_Hazard (2C1) was never received on can0, but 1 frame of 2C1 came on can1 (--map can1=body)\n",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
}

#[test]
fn undefined_values_and_silences_are_warnings() {
    let report = survey("(1.0) can0 2A5#0000000000000000\n(2.0) can0 2A5#00000A0000000000\n");
    for concern in [
        "note       BCM_TurnIndicators.TurnIndicatorState = 5 (0x5) turn UNDEFINED: once, first at 1.000 s",
        "warning    BCM_TurnIndicators was missing for longer than its limit once, and so was everything else on can0",
        "warning    BCM_Hazard (2C1) was never received on can0",
        "warning    turn_indicators invalid once, 0.000 s in all, first at 1.000 s",
    ] {
        assert!(
            report.text(Layout::default()).contains(concern),
            "{concern}\n{}",
            report.text(Layout::default())
        );
    }
}
