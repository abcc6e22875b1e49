//! The reasons for a missing value in diagnostics, on small vehicles of the test's own.

use std::io;

use can_log::Log;
use signal_gateway::config::Settings;
use signal_gateway::replay::{Replay, Routes};
use signal_gateway::report::gateway::Changes;

use crate::support::files::MemoryFiles;

/// Changes of reports and statuses in a replay, each as task and text.
fn replay_changes(settings: &Settings, log: &str) -> Vec<String> {
    let log = Log::new(Box::new(io::Cursor::new(log.as_bytes().to_vec()))).unwrap();
    let mut replay =
        Replay::new(settings.gateway.clone(), log, Routes::by_interface(&settings.gateway)).unwrap();
    let (mut changes, mut lines) = (Changes::default(), Vec::new());
    loop {
        while let Some(output) = replay.poll_output() {
            lines.extend(
                changes
                    .of(&output)
                    .into_iter()
                    .map(|event| format!("{} {}", event.change.subject, event.change.text)),
            );
        }
        if !replay.step().unwrap() {
            return lines;
        }
    }
}

fn lines(interface: &str, frame: &str, tenths: std::ops::Range<u32>) -> String {
    tenths.map(|tenth| format!("({}.{}) {interface} {frame}\n", 100 + tenth / 10, tenth % 10)).collect()
}

const PAGES: &str = "\
BO_ 512 PAGES: 8 X
 SG_ PAGE M : 0|4@1+ (1,0) [0|15] \"\" X
 SG_ TURN m3 : 8|2@1+ (1,0) [0|3] \"\" X
 SG_ HAZARD m4 : 8|1@1+ (1,0) [0|1] \"\" X
";

const PAGED: &str = "\
name = \"pages\"
[bus.body]
dbc = \"car.dbc\"
[message.PAGES]
timeout_ms = 300
[turn]
signal = \"PAGES.TURN\"
off = [0]
left = [1]
right = [2]
[hazard]
from = \"signal\"
signal = \"PAGES.HAZARD\"
on = [1]
off = [0]
";

/// One message in frames of the wrong format among right ones, then in wrong ones only.
#[test]
fn a_frame_of_another_format_than_its_message_is_rejected() {
    let attribute = |name: &str| {
        format!(
            "BO_ 512 TURN: 8 X\n SG_ CODE : 0|2@1+ (1,0) [0|3] \"\" X\n\
             BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"StandardCAN_FD\";\n\
             BA_DEF_DEF_ \"VFrameFormat\" \"{name}\";\n"
        )
    };
    let profile = "name = \"car\"\n[bus.body]\ndbc = \"car.dbc\"\n[message.TURN]\ntimeout_ms = 300\n[turn]\n\
        signal = \"TURN.CODE\"\noff = [0]\nleft = [1]\nright = [2]\n[hazard]\nfrom = \"not_fitted\"\n";
    for (format, right, wrong, text) in [
        ("StandardCAN", "200#01", "200##002", "as CAN FD"),
        ("StandardCAN_FD", "200##001", "200#02", "not as CAN FD"),
    ] {
        let settings = MemoryFiles::vehicle(profile, &attribute(format)).settings();
        let mixed: String = (0..10)
            .map(|tenth| lines("can0", right, tenth..tenth + 1) + &lines("can0", wrong, tenth..tenth + 1))
            .collect();
        let changes = replay_changes(&settings, &(mixed + &lines("can0", wrong, 10..20)));
        let turn: Vec<_> = changes.iter().filter(|line| line.starts_with("turn_indicators ")).collect();
        let last = format!("turn_indicators unknown: TURN (200) is received, but {text}");
        assert_eq!(turn.last(), Some(&&last), "{turn:?}");
        assert!(!turn.iter().any(|line| line.contains("right")), "{turn:?}");
        assert!(turn.iter().any(|line| line.contains("left")), "{turn:?}");
    }
}

#[test]
fn a_page_that_does_not_come_is_not_called_a_message_that_does_not() {
    let settings = MemoryFiles::vehicle(PAGED, PAGES).settings();
    // The first frames are overdue after two seconds.
    let late = lines("can0", "201#00", 0..25);
    let turn_only = lines("can0", "200#0301000000000000", 25..30);
    let other_pages = lines("can0", "200#0500000000000000", 30..37);
    let other_message = lines("can0", "201#00", 37..45);
    let lines = replay_changes(&settings, &(late + &turn_only + &other_pages + &other_message));
    let awaited = |task: &str| {
        format!("{task} starting: waiting for the first frame of PAGES (200) on can0, at most 2 s")
    };
    let of = |task: &str| -> Vec<_> { lines.iter().filter(|line| line.starts_with(task)).cloned().collect() };
    let start = awaited("hazard_lights");
    let expected = [
        start.as_str(),
        "hazard_lights unknown: no frame of PAGES (200) on can0 yet",
        "hazard_lights unknown: PAGES (200) is received, but without PAGES.HAZARD",
        "hazard_lights unknown: no new frame of PAGES (200) on can0 yet",
    ];
    assert_eq!(of("hazard_lights"), expected);
    let start = awaited("turn_indicators");
    let expected = [
        start.as_str(),
        "turn_indicators unknown: no frame of PAGES (200) on can0 yet",
        "turn_indicators left",
        "turn_indicators publishing",
        "turn_indicators no longer published",
        "turn_indicators unknown: PAGES (200) is received, but without PAGES.TURN",
        "turn_indicators unknown: PAGES is stale, silent for more than 300 ms",
    ];
    assert_eq!(of("turn_indicators"), expected);
}

const BODY: &str = "\
BO_ 291 BODY: 8 X
 SG_ TURN : 0|2@1+ (1,0) [0|3] \"\" X
 SG_ HAZARD : 2|1@1+ (1,0) [0|1] \"\" X
";

const TWO_BUSES: &str = "\
name = \"two buses\"
[bus.a]
dbc = \"body.dbc\"
[bus.b]
dbc = \"body.dbc\"
[message.BODY]
bus = \"a\"
timeout_ms = 300
[turn]
signal = \"a:BODY.TURN\"
off = [0]
left = [1]
right = [2]
[hazard]
from = \"not_fitted\"
";

#[test]
fn a_message_that_two_buses_have_is_named_with_its_bus() {
    let gateway = "profile = \"two.toml\"\n[can.a]\ninterface = \"can0\"\n[can.b]\ninterface = \"can1\"\n";
    let settings =
        MemoryFiles::new([("gateway.toml", gateway), ("two.toml", TWO_BUSES), ("body.dbc", BODY)]).settings();
    let log = lines("can0", "123#0100000000000000", 0..2) + &lines("can1", "123#0200000000000000", 2..9);
    let lines = replay_changes(&settings, &(log + &lines("can0", "123#0300000000000000", 9..10)));
    for text in [
        "turn_indicators starting: waiting for the first frame of a:BODY (123) on can0, at most 2 s",
        "turn_indicators left",
        "turn_indicators unknown: a:BODY is stale, silent for more than 300 ms",
        "turn_indicators invalid: a:BODY.TURN = 3 is not a defined value",
    ] {
        assert!(lines.iter().any(|line| line == text), "{text} is not in {lines:#?}");
    }
    assert!(!lines.iter().any(|line| line.ends_with("right")), "the other bus carries another value");
}

const SLOW: &str = "\
BO_ 291 BODY: 8 X
 SG_ TURN : 0|2@1+ (1,0) [0|3] \"\" X
BO_ 292 ALIVE: 8 X
 SG_ COUNT : 0|8@1+ (1,0) [0|255] \"\" X
";

#[test]
fn a_message_sent_on_change_and_slowly_repeated_has_two_limits() {
    let profile = "name = \"slow\"\n[bus.body]\ndbc = \"car.dbc\"\nheartbeat_messages = [\"ALIVE\"]\n\
        alive_timeout_ms = 500\n[message.BODY]\ntiming = \"event_cyclic\"\ntimeout_ms = 1500\n\
        [turn]\nsignal = \"BODY.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n[hazard]\nfrom = \"not_fitted\"\n";
    let settings = MemoryFiles::vehicle(profile, SLOW).settings();
    let body = |tenth| lines("can0", "123#01", tenth..tenth + 1);
    // Repeated in time on a live bus; then missing on a live bus; then the bus silent.
    let log = body(0) + &lines("can0", "124#00", 1..14) + &body(14) + &lines("can0", "124#00", 15..35);
    let log = log + &body(35) + &body(45);
    let lines = replay_changes(&settings, &log);
    let turn: Vec<_> = lines.iter().filter(|line| line.starts_with("turn_indicators unknown")).collect();
    let expected = [
        "turn_indicators unknown: BODY is stale, silent for more than 1500 ms",
        "turn_indicators unknown: BODY may have changed: no frame of the vehicle profile on can0",
    ];
    assert_eq!(turn, expected);
}
