//! Tests the survey's reports on recordings of a few frames.

use std::io;
use std::path::Path;

use super::*;
use crate::check::patch::patch;
use crate::check::survey_text::recording;
use crate::check::{CheckReport, Layout};
use crate::config::files::{Disk, TestFiles};
use crate::config::load_profile;
use crate::replay::Routes;
use can_log::Log;
use vehicle_bringup::plausibility::finding::Severity;

/// Returns the number of findings that are at least warnings.
fn concerns(report: &CheckReport) -> usize {
    report.count(Severity::Warning) + report.count(Severity::Error)
}

fn text(report: &CheckReport) -> String {
    report.text(Layout::default())
}

fn survey(text: &str) -> CheckReport {
    let lights = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/support/lights_vehicle.toml");
    survey_of(&load_profile(&Disk, &lights).unwrap(), text)
}

fn survey_of(settings: &Settings, text: &str) -> CheckReport {
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
        assert_eq!(concerns(&report), 0, "{}", text(&report));
    }
}

#[test]
fn the_time_until_the_first_frame_counts_as_unknown() {
    let text = text(&survey("(1.0) can0 111#00\n(1.3) can0 2A5#0000000000000000\n(1.4) can0 2A5#00\n"));
    assert!(text.contains("turn_indicators would be published for 0.100 s of 0.400 s"), "{text}");
}

/// Surveys a Volvo's frames at intervals of 20 ms, with these values of its two-bit counter.
fn volvo(counters: &[u8]) -> (Settings, CheckReport) {
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
    let first = "           Indicator_Stalk: 4 trusted, 1 rejected (1 first frame, no counter before it)";
    assert!(text(&report).contains(first), "{}", text(&report));
    assert_eq!(concerns(&report), 0, "{}", text(&report));
    let (_, report) = volvo(&[0, 1, 3, 3, 0, 1, 2]);
    let rejected = "warning    Indicator_Stalk: 4 trusted, 3 rejected (1 first frame, no counter before it, \
                    1 repeated counter, 1 counter not in sequence for long enough), 1 lost by the counter";
    assert!(text(&report).contains(rejected), "{}", text(&report));
    assert_eq!(concerns(&report), 1, "{}", text(&report));
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
    let text = text(&survey("(1.0) can0 2A5#0000000000000000\n(2.0) can0 2A5#00000A0000000000\n"));
    for concern in [
        "note       BCM_TurnIndicators.TurnIndicatorState = 5 (0x5) turn UNDEFINED: once, first at 1.000 s",
        "warning    BCM_TurnIndicators was missing for longer than its limit once, and so was everything else on can0",
        "warning    BCM_Hazard (2C1) was never received on can0",
        "warning    turn_indicators invalid once, 0.000 s in all, first at 1.000 s",
    ] {
        assert!(text.contains(concern), "{concern}\n{text}");
    }
}

/// A car with a counter and a checksum that its profile does not use.
const CAR: [(&str, &str); 2] = [
    (
        "car.toml",
        "name = \"Car\"\n[bus.body]\ndbc = \"car.dbc\"\n[turn]\nsignal = \"LIGHTS.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n\
         [hazard]\nfrom = \"not_visible\"\n",
    ),
    (
        "car.dbc",
        "VERSION \"\"\nBO_ 193 LIGHTS: 4 X\n SG_ TURN : 0|2@1+ (1,0) [0|3] \"\" X\n SG_ COUNTER : 8|4@1+ (1,0) [0|15] \"\" X\n \
         SG_ CHECKSUM : 24|8@1+ (1,0) [0|255] \"\" X\nBA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\n\
         BA_ \"GenMsgCycleTime\" BO_ 193 100;\nVAL_ 193 TURN 0 \"Off\" 1 \"Right\" 2 \"Left\" ;\n",
    ),
];

/// Surveys frames of the car, given by time in ms and the turn signal's raw value.
fn car(frames: impl IntoIterator<Item = (u64, u8)>, length: usize) -> CheckReport {
    let settings = load_profile(&TestFiles(&CAR), Path::new("car.toml")).unwrap();
    let mut text = String::new();
    for (index, (ms, turn)) in frames.into_iter().enumerate() {
        let counter = u8::try_from(index % 16).unwrap();
        let sum = turn.wrapping_add(counter);
        let data = format!("{turn:02X}{counter:02X}00{sum:02X}00000000");
        text += &format!("({}.{:03}) can0 0C1#{}\n", 1 + ms / 1000, ms % 1000, &data[..2 * length]);
    }
    survey_of(&settings, &text)
}

/// Returns a frame every 100 ms until `until_ms`, with the value at that time.
fn each_100_ms(until_ms: u64, turn: impl Fn(u64) -> u8) -> Vec<(u64, u8)> {
    (0..until_ms).step_by(100).map(|ms| (ms, turn(ms))).collect()
}

#[test]
fn unused_counters_and_checksums_are_proposed_and_sides_that_look_swapped_are_found() {
    let report = car(each_100_ms(20_000, |ms| [0, 1, 0, 2][usize::try_from(ms / 3_000 % 4).unwrap()]), 4);
    let expected = "# car.toml, at the end:\n[message.LIGHTS]\ncounter = { signal = \"COUNTER\", max_step = 4 }\n\
                    checksum = { kind = \"sum8\", signal = \"CHECKSUM\" }\n";
    let (_, profile) = CAR[0];
    let patch = patch(Path::new("car.toml"), profile, "", &report.fixes());
    assert_eq!(patch, expected, "{}", text(&report));
    assert_eq!(concerns(&report), 2, "{}", text(&report));
    let settings = load_profile(&TestFiles(&CAR), Path::new("car.toml")).unwrap();
    let text = super::super::binding(&settings).text(Layout::default());
    for part in [
        "turn       LIGHTS.TURN: 0 off, 1 left (\"Right\"), 2 right (\"Left\"); anything",
        "warning    LIGHTS.TURN: 1 is turn left in the profile and \"Right\" in the DBC",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
}

/// A profile of two lamps without hazard lights, so that both lamps together are not a state of their own.
const LAMPS: [(&str, &str); 2] = [
    (
        "lamps.toml",
        "name = \"Lamps\"\n[bus.body]\ndbc = \"lamps.dbc\"\n[turn]\nboth_on = \"hazard\"\n\
         left_signal = { signal = \"LAMPS.LEFT\", on = [1], off = [0] }\n\
         right_signal = { signal = \"LAMPS.RIGHT\", on = [1], off = [0] }\n[hazard]\nfrom = \"not_visible\"\n\
         [message.LAMPS]\ntimeout_ms = 500\n",
    ),
    (
        "lamps.dbc",
        "VERSION \"\"\nBO_ 193 LAMPS: 1 X\n SG_ LEFT : 0|1@1+ (1,0) [0|1] \"\" X\n SG_ RIGHT : 1|1@1+ (1,0) [0|1] \"\" X\n",
    ),
];

#[test]
fn a_state_that_never_changes_is_named_as_it_was() {
    let settings = load_profile(&TestFiles(&LAMPS), Path::new("lamps.toml")).unwrap();
    let cases = [
        ("00", "nothing but off was received, which"),
        ("01", "left was on throughout (LAMPS.LEFT and LAMPS.RIGHT, 20 frames), which"),
        ("02", "right was on throughout (LAMPS.LEFT and LAMPS.RIGHT, 20 frames), which"),
        ("03", "left and right were both on throughout (LAMPS.LEFT and LAMPS.RIGHT, 20 frames), which"),
    ];
    for (data, expected) in cases {
        let frame = |index: u64| format!("(1.{:03}) can0 0C1#{data}\n", index * 40);
        let text = text(&survey_of(&settings, &(0..20).map(frame).collect::<String>()));
        let severity = if data == "00" { "note       " } else { "warning    " };
        assert!(text.contains(&format!("{severity}{expected} ")), "{expected}\n{text}");
        assert_eq!(text.contains("nothing but off"), data == "00", "{text}");
    }
}

#[test]
fn each_thing_that_a_vehicle_of_this_profile_does_not_do_is_found() {
    let weights = |report: &CheckReport, text: &str| {
        let found = report.findings().into_iter().find(|finding| finding.text.contains(text));
        found.map(|finding| finding.severity)
    };
    #[rustfmt::skip]
    let cases = [
        (car(each_100_ms(5_000, |_| 0), 3), "50 of 50 frames with another length: 3 bytes, not 4",
            Severity::Error),
        (car((0..40).map(|index| (index * 20, u8::from(index % 2 == 0))), 4), "no driver and no lamp",
            Severity::Error),
        (car(each_100_ms(9_000, |ms| u8::from(ms / 300 % 2 == 0)), 4), "kind = \"lamp\"", Severity::Warning),
        (car(each_100_ms(9_000, |ms| 1 + u8::from(ms / 300 % 2 == 0)), 4), "from one side to the other",
            Severity::Warning),
        (car(each_100_ms(5_000, |_| 3), 4), "50 frames of 50 with a value that", Severity::Error),
        (car((0..20).map(|index| (index * 300, 0)), 4), "usually every 300 ms, by the DBC every 100 ms",
            Severity::Warning),
        (car(each_100_ms(5_000, |_| 0), 4), "nothing but off was received", Severity::Note),
        (car(each_100_ms(5_000, |_| 2), 4), "right was on throughout (LIGHTS.TURN, 50 frames), which other", Severity::Warning),
        (car(each_100_ms(5_000, |ms| u8::from(ms > 3_000)), 4), "right was never seen: record it",
            Severity::Note),
    ];
    for (report, part, severity) in cases {
        assert_eq!(weights(&report, part), Some(severity), "{part}\n{}", text(&report));
    }
}
