//! The demo in the live view, as it is played: its captions, and all reports of the vehicle.

use std::io::Cursor;
use std::path::Path;
use std::time::Duration;

use can_log::Log;
use gateway_base::time::MonoTime;
use signal_gateway::config::files::{DEMO_CONFIG, Embedded, Files as _};
use signal_gateway::config::{Overrides, load};
use signal_gateway::process_status::snapshot::{ProcessSnapshot, RosSnapshot, TopicSnapshot};
use signal_gateway::replay::{Replay, Routes};
use signal_gateway::report::gateway::Changes;
use signal_gateway::report::gateway_view::GatewayView;
use signal_gateway::report::story::{DEMO, Teller};
use signal_gateway::report::terminal::line_text;
use signal_gateway::report::terminal::view_model::Model;

use super::{check_model, drawn, process, svg, text};

/// Interval at which the view looks at the state.
const LOOK: Duration = Duration::from_millis(100);

/// The view of the demo at each of these times in seconds, which ascend.
fn views(times: &[u64]) -> Vec<Model> {
    let settings = load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap();
    let topic = |name: &str| TopicSnapshot { name: name.to_owned(), peers: 1, other_writers: 0 };
    let topics =
        ["turn_indicators", "hazard_lights", "velocity", "steering", "gear", "control_mode", "doors"];
    let ros = RosSnapshot { is_up: true, written: topics.map(topic).to_vec(), ..RosSnapshot::default() };
    let process = ProcessSnapshot { ros: Some(ros), ..process() };
    let log = Embedded.read(&settings.recording.unwrap().file).unwrap();
    let (log, routes) =
        (Log::new(Box::new(Cursor::new(log))).unwrap(), Routes::by_interface(&settings.gateway));
    let mut replay = Replay::new(settings.gateway, log, routes).unwrap();
    let title = "demo · Demo vehicle, built-in recording".to_owned();
    let mut model = Model { title, has_color: true, ..Model::default() };
    let (mut changes, mut teller, mut next) = (Changes::default(), Teller::new(DEMO), MonoTime::ZERO);
    let mut times = times.iter().map(|seconds| MonoTime::from_millis(seconds * 1000)).peekable();
    let mut views = Vec::new();
    while times.peek().is_some() && replay.step().unwrap() {
        let now = replay.now().mono;
        while let Some(caption) = teller.next_caption(now) {
            caption.text.clone_into(&mut model.caption);
        }
        while let Some(output) = replay.poll_output() {
            for event in changes.of(&output) {
                let at = now.since(MonoTime::ZERO);
                model.add_line(Some(event.change.level), line_text(at, &event.to_string()));
            }
        }
        if now >= next {
            next = now.after(LOOK);
            let snapshot = replay.gateway().snapshot(replay.now()).with_process(process.clone(), &[]);
            model.elapsed = now.since(MonoTime::ZERO);
            model.show(GatewayView::of(&snapshot));
            if times.next_if(|time| *time <= now).is_some() {
                views.push(model.clone());
            }
        }
    }
    views
}

/// Returns true if a line shows the name of a report, and its value behind it.
fn shows(shown: &str, name: &str, value: &str) -> bool {
    shown.lines().any(|line| line.split_once(name).is_some_and(|(_, rest)| rest.contains(value)))
}

/// What is to be seen at a moment of the demo.
struct Shown {
    second: u64,
    name: &'static str,
    caption: &'static str,
    /// Values of velocity, steering, gear, control mode, turn indicators and hazard lights.
    reports: [&'static str; 6],
}

const REPORTS: [&str; 6] = ["velocity", "steering", "gear", "mode", "turn", "hazard"];

#[test]
fn demo_shows_its_caption_and_all_six_statuses_on_a_terminal_of_24_lines() {
    let cases = [
        Shown {
            second: 12,
            name: "turn",
            caption: "the car turns left into a street",
            reports: ["6.0", "9.", "drive", "manual", "left", "off"],
        },
        Shown {
            second: 26,
            name: "contradicted",
            caption: "the speed is withheld",
            reports: ["withheld", "0.", "drive", "autonomous", "off", "off"],
        },
        Shown {
            second: 35,
            name: "undefined",
            caption: "nothing is made up",
            reports: ["4.", "0.", "drive", "autonomous", "withheld", "off"],
        },
        Shown {
            second: 47,
            name: "right",
            caption: "the message is back, with right",
            reports: ["6.0", "-4.", "drive", "autonomous", "right", "off"],
        },
    ];
    let seconds: Vec<_> = cases.iter().map(|case| case.second).collect();
    let models = views(&seconds);
    assert_eq!(models.len(), cases.len());
    for (model, Shown { name, caption, reports, .. }) in models.iter().zip(cases) {
        check_model(&format!("demo_{name}"), model);
        let shown = text(model, (80, 24));
        let words: Vec<_> = shown.split_whitespace().collect();
        assert!(words.join(" ").contains(caption), "{caption}: {shown}");
        for (report, value) in REPORTS.iter().zip(reports) {
            assert!(shows(&shown, report, value), "{report} {value}: {shown}");
        }
    }
}

#[test]
fn picture_of_the_documentation_is_the_view() {
    let model = views(&[48]).pop().unwrap();
    let picture = svg::picture(drawn(&model, (100, 30)).backend().buffer());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/pictures/terminal.svg");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &picture).unwrap();
    }
    let is_same = std::fs::read_to_string(&path).unwrap_or_default() == picture;
    assert!(is_same, "UPDATE_DOCS=1 cargo test --test pure terminal_view");
}
