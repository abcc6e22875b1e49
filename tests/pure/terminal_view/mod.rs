//! The live view in each state and width, as text: `tests/pure/terminal_view/*.txt` are what the terminal
//! shows, and below it what `status` prints of the same view.
//! `UPDATE_DOCS=1 cargo test --test pure terminal_view` writes them anew: look at what has changed.

mod demo;
mod messages;
mod svg;

use std::path::Path;
use std::time::Duration;

use can_signal::can::error_frame::ErrorFrame;
use can_signal::can::frame::CanId;
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::Level;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::style::Color;
use signal_gateway::config::files::Disk;
use signal_gateway::config::load_profile;
use signal_gateway::process_status::snapshot::{Build, ProcessSnapshot, RosSnapshot, TopicSnapshot};
use signal_gateway::report::gateway_view::{
    ChannelView, Fact, GatewayView, Lamp, LightView, LightsView, Mark, ReportView, Value,
};
use signal_gateway::report::status;
use signal_gateway::report::terminal::draw::draw;
use signal_gateway::report::terminal::view_model::{KeyRequest, Keys, Model};
use traffic_lights::bulb::Color::{Green, Red};
use traffic_lights::bulb::{Bulb, BulbShape, BulbStatus};

use crate::support::virtual_gateway::VirtualGateway;

const BUS: BusIndex = BusIndex(0);
/// The terminals on which every state is drawn.
const SIZES: [(u16, u16); 4] = [(50, 24), (80, 24), (120, 32), (200, 32)];

/// The lights of the demo vehicle; the whole vehicle is in [`demo`].
const LIGHTS_VEHICLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/support/lights_vehicle.toml");

/// The lights of the demo vehicle on a bus, watched ten times a second.
struct Drive {
    gateway: VirtualGateway,
    model: Model,
    process: Option<ProcessSnapshot>,
}

fn process() -> ProcessSnapshot {
    let build = Build { version: "1.2.3".to_owned(), ..Build::default() };
    ProcessSnapshot { vehicle: "Demo vehicle".to_owned(), pid: 42, build, ..ProcessSnapshot::default() }
}

impl Drive {
    fn new() -> Self {
        let settings = load_profile(&Disk, Path::new(LIGHTS_VEHICLE)).unwrap().gateway;
        let topic = |name: &str| TopicSnapshot { name: name.to_owned(), peers: 1, other_writers: 0 };
        let written = vec![topic("turn_indicators_status"), topic("hazard_lights_status")];
        let ros = Some(RosSnapshot { is_up: true, written, ..RosSnapshot::default() });
        Self {
            gateway: VirtualGateway::new(settings),
            model: Model { title: "run · Demo vehicle".to_owned(), has_color: true, ..Model::default() },
            process: Some(ProcessSnapshot { ros, ..process() }),
        }
    }

    /// Passes that time with these raw states of turn indicators and hazard lights; `None` is not sent.
    fn pass(mut self, ms: u64, turn: Option<u8>, hazard: Option<u8>) -> Self {
        for _ in 0..ms / 100 {
            if let Some(turn) = turn {
                self.gateway.receive(CanId::Standard(0x2A5), &[0, 0, turn << 1, 0, 0, 0, 0, 0]);
            }
            if let Some(hazard) = hazard {
                self.gateway.receive(CanId::Standard(0x2C1), &[0, hazard, 0, 0, 0, 0, 0, 0]);
            }
            self = self.look();
            self.gateway.pass(100);
        }
        self.look()
    }

    fn look(mut self) -> Self {
        let snapshot = self.gateway.snapshot();
        let snapshot = match self.process.clone() {
            Some(process) => snapshot.with_process(process, &[]),
            None => snapshot,
        };
        self.model.show(GatewayView::of(&snapshot));
        self
    }

    fn input(mut self, input: CanInput) -> Self {
        self.gateway.handle(input);
        self.look()
    }

    fn left() -> Self {
        Self::new().pass(4_000, Some(0), Some(0)).pass(3_000, Some(1), Some(0))
    }

    fn press(mut self, key: KeyCode) -> Self {
        assert_eq!(self.model.press(KeyEvent::new(key, KeyModifiers::NONE)), None);
        self
    }
}

fn drawn(model: &Model, (width, height): (u16, u16)) -> Terminal<TestBackend> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(frame, model)).unwrap();
    terminal
}

pub(in crate::pure) fn text(model: &Model, (width, height): (u16, u16)) -> String {
    let terminal = drawn(model, (width, height));
    let cells: Vec<_> =
        terminal.backend().buffer().content.iter().map(ratatui::buffer::Cell::symbol).collect();
    let lines = cells.chunks(width.into()).map(|line| line.concat().trim_end().to_owned() + "\n");
    format!("{width} × {height}\n{}", lines.collect::<String>())
}

/// Compares the view with the file of that name.
fn check(name: &str, drive: &Drive) -> String {
    check_model(name, &drive.model)
}

pub(in crate::pure) fn check_model(name: &str, model: &Model) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/pure/terminal_view/{name}.txt"));
    let mut shown = SIZES.map(|size| text(model, size)).join("\n");
    if model.messages.is_none() {
        shown += &format!("\nstatus\n{}", status::text(&model.picture, Some(100)));
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &shown).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(shown == expected, "{name}: UPDATE_DOCS=1 cargo test --test pure terminal_view\n{shown}");
    shown
}

#[test]
fn left_right_and_hazard_are_in_arrows_words_and_strip() {
    let left = check("left", &Drive::left());
    assert!(left.contains("◀━━━ │") && left.contains("│ ───▷") && left.contains("turn     ✓ left"), "{left}");
    let right = check("right", &Drive::left().pass(3_000, Some(2), Some(0)));
    assert!(
        right.contains("◁─── │") && right.contains("│ ━━━▶") && right.contains("turn     ✓ right"),
        "{right}"
    );
    let hazard = check("hazard", &Drive::left().pass(3_000, Some(0), Some(1)));
    assert!(hazard.contains("◀━━━ │") && hazard.contains("│ ━━━▶") && hazard.contains("▲▲"), "{hazard}");
}

#[test]
fn report_that_is_withheld_shows_its_reason_and_no_direction() {
    let invalid = check("invalid", &Drive::left().pass(3_000, Some(5), Some(0)));
    let stale = check("stale", &Drive::left().pass(3_000, None, Some(0)));
    for (view, reason, broken) in [
        (invalid, "invalid", "turn                   ✓ ── – ──────── ✓ ──── – ──── ✓ ─ ✗     ·"),
        (stale, "is stale", "turn                   ✓ ── – ──────── ✓ ──── – ──── ✗   ·     ·"),
    ] {
        assert!(
            view.contains("not published") && view.contains("withheld") && view.contains(reason),
            "{view}"
        );
        assert!(view.contains(broken) && !view.contains("◀━"), "{view}");
    }
}

#[test]
fn bus_that_is_down_or_off_breaks_the_chain_at_link_or_controller() {
    let down = Drive::left().input(CanInput::Link { bus: BUS, state: LinkState::Down });
    let down = check("link_down", &down.pass(500, None, None));
    let off = Drive::left().input(CanInput::ErrorFrame { bus: BUS, error: ErrorFrame::new(0x40, &[]) });
    let off = check("bus_off", &off.pass(1_500, None, None));
    for (view, state, broken) in [
        (down, "link down", "all                    ✗    ·          ·"),
        (off, "bus-off", "all                    ✓ ── ✗          ·"),
    ] {
        assert!(view.contains(broken) && view.contains(state), "{view}");
    }
}

#[test]
fn network_and_start_are_shown_as_they_are() {
    let mut off = Drive::left();
    off.process = Some(process());
    let off = check("without_ros", &off.pass(100, Some(1), Some(0)));
    let mut lines = off.lines().filter(|line| line.contains("ROS 2"));
    assert!(lines.all(|line| line.ends_with(" off")) && off.contains("ROS 2"), "{off}");
    let start = check("start", &Drive::new().look());
    assert!(start.contains("not published"), "{start}");
}

#[test]
fn paused_picture_stands_still_and_says_so() {
    let mut paused = Drive::left().press(KeyCode::Char(' ')).pass(3_000, Some(2), Some(0));
    paused.model.caption = "the driver pushes the stalk right".to_owned();
    let shown = check("paused", &paused);
    assert!(shown.contains("PAUSED") && shown.contains("✓ left") && !shown.contains("✓ right"), "{shown}");
    let resumed = paused.press(KeyCode::Char(' ')).pass(100, Some(2), Some(0));
    assert!(text(&resumed.model, SIZES[1]).contains("✓ right"));
}

#[test]
fn help_covers_the_middle_until_it_is_closed() {
    let help = Drive::left().press(KeyCode::Char('?'));
    assert!(check("help", &help).contains("scroll the log"));
    let closed = help.press(KeyCode::Esc);
    assert!(!text(&closed.model, SIZES[1]).contains("scroll the log"));
}

#[test]
fn arrows_blink_in_amber_and_nothing_has_a_colour_that_is_not_wanted() {
    let mut drive = Drive::left();
    let amber = |model: &Model| {
        let terminal = drawn(model, SIZES[1]);
        let cells = terminal.backend().buffer().content.clone();
        let cells = cells.iter().filter(|cell| cell.fg == Color::Indexed(214));
        cells.map(|cell| cell.symbol().to_owned()).collect::<String>()
    };
    assert!(amber(&drive.model).starts_with("◀━━━"));
    drive.model.elapsed = Duration::from_millis(400);
    assert!(amber(&drive.model).starts_with("◁───"));
    drive.model.elapsed = Duration::from_millis(700);
    assert!(amber(&drive.model).starts_with("◀━━━"));
    drive.model.has_color = false;
    let plain = drawn(&drive.model, SIZES[2]);
    let cells = &plain.backend().buffer().content;
    assert!(cells.iter().all(|cell| (cell.fg, cell.bg) == (Color::Reset, Color::Reset)));
}

#[test]
fn every_size_is_drawn_and_a_tiny_one_asks_for_more() {
    let drive = Drive::left();
    for width in 1..140 {
        for height in [1, 2, 5, 11, 12, 13, 20, 30, 50] {
            let shown = text(&drive.model, (width, height));
            let is_tiny = width < 40 || height < 12;
            assert!(is_tiny || shown.contains("✓ left"), "{shown}");
        }
    }
    assert!(text(&drive.model, (30, 8)).contains("at least 40"));
}

#[test]
fn log_is_scrolled_by_keys_and_bounded() {
    let mut drive = Drive::left();
    for line in 0..20_600 {
        drive.model.add_line(Some(Level::Warn), format!("line {line} ends"));
    }
    assert_eq!(drive.model.log.len(), 20_000);
    assert!(text(&drive.model, SIZES[1]).contains("line 20599 ends"));
    let mut drive = drive.press(KeyCode::PageUp).press(KeyCode::Up);
    let shown = text(&drive.model, SIZES[1]);
    assert!(shown.contains("line 20588 ends") && !shown.contains("line 20589 ends"), "{shown}");
    // New lines do not move what is being read.
    drive.model.add_line(None, "new".to_owned());
    assert!(text(&drive.model, SIZES[1]).contains("line 20588 ends"));
    let drive = drive.press(KeyCode::Home);
    // The pane is full at the first line too.
    let first = text(&drive.model, SIZES[1]);
    let lines: Vec<_> = first.lines().skip_while(|line| !line.contains(" below ")).skip(1).collect();
    assert!(
        lines.len() > 2 && lines[0].contains("line 601 ends") && lines[1].contains("line 602 ends"),
        "{first}"
    );
    assert!(text(&drive.press(KeyCode::End).model, SIZES[1]).contains("new"));
}

#[test]
fn address_of_the_page_is_in_the_footer() {
    let mut drive = Drive::left();
    drive.model.url = Some("http://127.0.0.1:8000/".to_owned());
    for size in SIZES {
        let shown = text(&drive.model, size);
        let footer = shown.lines().last().unwrap_or_default().to_owned();
        assert!(footer.contains("q quit") && footer.contains("? help"), "{footer}");
        assert!(footer.ends_with("  http://127.0.0.1:8000/"), "{footer}");
    }
}

#[test]
fn what_there_is_no_room_for_is_counted() {
    let mut model = Model::default();
    let light = |id: usize| Fact { name: format!("light {id}"), text: "red".to_owned() };
    let lights = LightsView { channels: Vec::new(), controllers: (0..40).map(light).collect() };
    model.show(GatewayView { traffic_lights: Some(lights), ..GatewayView::default() });
    let shown = text(&model, SIZES[1]);
    let visible = (0..40).filter(|id| shown.contains(&format!("light {id} "))).count();
    assert!(shown.contains(&format!("… {} more", 40 - visible)), "{shown}");
}

#[test]
fn vehicle_says_in_full_who_decides() {
    let function = ReportView {
        name: "turn",
        mark: Mark::Right,
        reported: Value::new(None, "right (command)"),
        ..ReportView::default()
    };
    let mut model = Model { keys: Keys::Driver, ..Model::default() };
    model.show(GatewayView { reports: vec![function], ..GatewayView::default() });
    for size in SIZES {
        let shown = text(&model, size);
        assert!(shown.contains("right (command)") && shown.contains("h hazard"), "{shown}");
    }
}

#[test]
fn lamps_of_traffic_lights_have_their_own_colours_and_words() {
    let bulb = |color, shape| Bulb { color, status: BulbStatus::SolidOn, shape };
    let light = LightView {
        name: "11".to_owned(),
        groups: vec![1],
        bulbs: vec![bulb(Green, BulbShape::Left), bulb(Red, BulbShape::Circle)],
        text: "green left, red".to_owned(),
    };
    let (name, counts) = ("conventional".to_owned(), "1 light".to_owned());
    let mut model = Model { has_color: true, ..Model::default() };
    let phase = Fact { name: "main road".to_owned(), text: "stop, then go".to_owned() };
    let channels = vec![ChannelView { name, counts, lights: vec![light] }];
    let lights = LightsView { channels, controllers: vec![phase] };
    model.caption =
        "the camera loses light 11: what it detects is unknown, what the light shows is not".to_owned();
    model.show(GatewayView { traffic_lights: Some(lights), ..GatewayView::default() });
    for (width, height) in SIZES {
        let shown = text(&model, (width, height));
        for part in ["conventional 11", "● green left  ● red", "stop, then go", "is not"] {
            assert!(shown.contains(part), "{part}: {shown}");
        }
    }
    let terminal = drawn(&model, SIZES[1]);
    let cells = terminal.backend().buffer().content.iter();
    let colors: Vec<_> = cells.filter(|cell| cell.symbol() == "●").map(|cell| cell.fg).collect();
    assert_eq!(colors, [Color::Green, Color::Red]);
}

#[test]
fn keys_end_it_and_move_the_driver_only_where_there_is_one() {
    let key = |code| KeyEvent::new(code, KeyModifiers::NONE);
    let mut model = Model::default();
    assert_eq!(model.press(key(KeyCode::Char('q'))), Some(KeyRequest::Quit));
    let control_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    assert_eq!(model.press(control_c), Some(KeyRequest::Quit));
    assert_eq!(model.press(key(KeyCode::Left)), None);
    model.keys = Keys::Driver;
    assert_eq!(model.press(key(KeyCode::Left)), Some(KeyRequest::Driver("stalk left")));
    assert_eq!(model.press(key(KeyCode::Char('h'))), Some(KeyRequest::Driver("hazard press")));
    assert_eq!(model.press(control_c), Some(KeyRequest::Quit));
}

#[test]
fn unknown_lights_are_never_drawn_as_off() {
    let stale = Drive::left().pass(3_000, None, None);
    assert_eq!(stale.model.picture.lamps, [Lamp::Unknown; 2]);
    assert_eq!(Drive::left().model.picture.lamps, [Lamp::Flashing, Lamp::Off]);
}
