//! `decode --live`: rows, their order, the filter, and what is lit.

use std::time::Duration;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::time::{MonoTime, Now, WallStamp};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::style::{Color, Modifier};
use signal_gateway::check::live_messages::LiveMessages;
use signal_gateway::config::built_in::BuiltIn;
use signal_gateway::config::files::Disk;
use signal_gateway::config::load_profile;
use signal_gateway::report::terminal::message_table::{MessageRow, MessageTable, Order};
use signal_gateway::report::terminal::view_model::{KeyRequest, Model};

use super::{SIZES, check_model, drawn, text};

const BUS: BusIndex = BusIndex(0);

fn at(millis: u64) -> Now {
    let wall = WallStamp::from_nanos(i64::try_from(millis).unwrap() * 1_000_000);
    Now { mono: MonoTime::from_millis(millis), wall }
}

fn send(messages: &mut LiveMessages<'_>, id: CanId, data: &[u8], millis: u64) {
    let frame = Frame::with_format(id, None, data).unwrap();
    messages.take(&CanInput::Frame { bus: BUS, frame, stamp: at(millis).wall }, at(millis));
}

/// Five seconds of the demo vehicle and of others on its bus: the turn indicators go left after three.
fn model() -> Model {
    let settings = load_profile(&Disk, &BuiltIn::Profile.path("demo_vehicle").unwrap()).unwrap();
    let mut messages = LiveMessages::new(&settings);
    messages.take(&CanInput::Link { bus: BUS, state: LinkState::Up }, at(0));
    for millis in (0..5_000).step_by(10) {
        let count = u8::try_from(millis / 10 % 256).unwrap();
        if millis % 20 == 0 {
            send(
                &mut messages,
                CanId::Standard(0x2A5),
                &[0, 0, u8::from(millis >= 3_000) << 1, 0, 0, 0, 0, 0],
                millis,
            );
        }
        if millis % 100 == 0 {
            send(&mut messages, CanId::Standard(0x2C1), &[0; 8], millis);
        }
        send(&mut messages, CanId::Standard(0x0F0), &[count, 0x7E, 0xFF], millis);
        if millis < 1_000 {
            send(&mut messages, CanId::Extended(0x18FD_CC27), &[1, 2], millis);
        }
    }
    send(&mut messages, CanId::Standard(0x700), &[0x11; 20], 4_999);
    let now = at(5_000).mono;
    let mut model = Model {
        title: format!("decode · {}", settings.vehicle),
        has_color: true,
        elapsed: Duration::from_secs(5),
        messages: Some(MessageTable::default()),
        ..Model::default()
    };
    model.show(messages.picture(now));
    model.show_messages(messages.rows(now));
    model
}

fn press(model: &mut Model, keys: &str) -> Vec<Option<KeyRequest>> {
    let code = |char| match char {
        '\n' => KeyCode::Enter,
        '\x1b' => KeyCode::Esc,
        '\x08' => KeyCode::Backspace,
        char => KeyCode::Char(char),
    };
    keys.chars().map(|char| model.press(KeyEvent::new(code(char), KeyModifiers::NONE))).collect()
}

fn ids(model: &Model) -> Vec<String> {
    model.messages.as_ref().unwrap().shown().iter().map(|row| row.id.to_string()).collect()
}

#[test]
fn each_identifier_has_a_row_with_its_data_rate_and_signals() {
    let model = model();
    check_model("messages", &model);
    for size in SIZES {
        let shown = text(&model, size);
        for part in ["0F0", "100/s", "18FDCC27", "4 s ago", "left", "link up", "data of 5 ids"] {
            assert!(shown.contains(part), "{part}: {shown}");
        }
    }
}

#[test]
fn rows_are_sorted_by_identifier_rate_or_change() {
    let mut model = model();
    assert_eq!(ids(&model), ["0F0", "2A5", "2C1", "700", "18FDCC27"]);
    press(&mut model, "s");
    assert_eq!(
        ids(&model),
        ["0F0", "2A5", "2C1", "700", "18FDCC27"],
        "100, 50, 10/s, and those without a rate"
    );
    press(&mut model, "s");
    assert_eq!(model.messages.as_ref().unwrap().order, Order::Change);
    assert_eq!(ids(&model)[..2], ["0F0", "2A5"], "just now, and two seconds ago");
    press(&mut model, "s");
    assert_eq!(model.messages.as_ref().unwrap().order, Order::Id);
}

#[test]
fn rows_of_one_rate_keep_their_places() {
    let row = |id, micros| MessageRow {
        interface: "can0".to_owned(),
        id: CanId::Standard(id),
        name: None,
        bytes: Vec::new(),
        period: Some(Duration::from_micros(micros)),
        age: Duration::ZERO,
        rejected: None,
        bound_signals: Vec::new(),
        other_signals: Vec::new(),
    };
    for jitter in [9_700, 10_000, 10_300] {
        let rows = vec![row(1, 50_000), row(2, jitter), row(3, 10_000), row(4, 20_300 - jitter)];
        let table = MessageTable { rows, order: Order::Rate, ..MessageTable::default() };
        let ids: Vec<_> = table.shown().iter().map(|row| row.id.number()).collect();
        assert_eq!(ids, [2, 3, 4, 1]);
    }
}

#[test]
fn filter_takes_every_key_until_it_is_kept_and_finds_names_and_values() {
    let mut model = model();
    assert_eq!(press(&mut model, "/qs"), [None, None, None], "q is a letter of the filter");
    assert_eq!(ids(&model), [""; 0]);
    assert!(text(&model, SIZES[0]).contains("no message contains the filter"));
    press(&mut model, "\x08\x08LEFT\n");
    assert_eq!(ids(&model), ["2A5"]);
    let shown = check_model("messages_filter", &model);
    assert!(shown.contains("1 of 5 ids") && shown.contains("/ LEFT"), "{shown}");
    press(&mut model, "\x1b/18fd");
    assert_eq!(ids(&model), ["18FDCC27"]);
    press(&mut model, "\x1b");
    assert_eq!(ids(&model).len(), 5);
    let control_c = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
    press(&mut model, "/");
    assert_eq!(model.press(control_c), Some(KeyRequest::Quit));
}

#[test]
fn changed_bytes_are_lit_and_fade_with_and_without_colours() {
    let mut model = model();
    let cells = |model: &Model, wanted: fn(&ratatui::buffer::Cell) -> bool| {
        let terminal = drawn(model, SIZES[0]);
        let table = terminal.backend().buffer().content.iter().skip(3 * 50);
        table.filter(|cell| wanted(cell)).map(|cell| cell.symbol().to_owned()).collect::<String>()
    };
    let is_bright = |cell: &ratatui::buffer::Cell| cell.modifier.contains(Modifier::REVERSED);
    assert_eq!(cells(&model, is_bright), "F3", "the counter, whose last value is 499 modulo 256");
    assert_eq!(cells(&model, |cell| cell.fg == Color::Indexed(179)), "02", "the lights, two seconds ago");
    model.has_color = false;
    assert_eq!(cells(&model, is_bright), "F3");
    let is_faint = |cell: &ratatui::buffer::Cell| cell.modifier.contains(Modifier::UNDERLINED);
    assert_eq!(cells(&model, is_faint), "02");
    let plain = drawn(&model, SIZES[2]);
    let cells = &plain.backend().buffer().content;
    assert!(cells.iter().all(|cell| (cell.fg, cell.bg) == (Color::Reset, Color::Reset)));
}

#[test]
fn paused_table_stands_still_and_its_keys_go_on() {
    let mut model = model();
    press(&mut model, " ");
    model.show_messages(Vec::new());
    assert_eq!(ids(&model).len(), 5);
    assert!(text(&model, SIZES[0]).contains("PAUSED"));
    press(&mut model, "ss");
    assert_eq!(ids(&model)[0], "0F0");
    press(&mut model, " ");
    model.show_messages(Vec::new());
    assert_eq!(ids(&model), [""; 0]);
    assert_eq!(press(&mut model, "q"), [Some(KeyRequest::Quit)]);
}

#[test]
fn table_is_drawn_in_every_size_with_help_log_and_all_signals() {
    let mut model = model();
    model.add_line(None, "can0 is down".to_owned());
    for _ in 0..2 {
        for width in (40..140).step_by(9) {
            for height in [12, 13, 20, 50] {
                let shown = text(&model, (width, height));
                assert!(
                    shown.contains("0F0") && shown.contains("can0 is down") && shown.contains("q quit"),
                    "{shown}"
                );
            }
        }
        press(&mut model, "d");
    }
    press(&mut model, "?");
    let help = check_model("messages_help", &model);
    assert!(help.contains("sort by id, rate or last change"), "{help}");
    press(&mut model, "\x1b");
    model.press(KeyEvent::new(KeyCode::End, KeyModifiers::NONE));
    let last = text(&model, SIZES[0]);
    assert!(last.contains("18FDCC27") && !last.contains("0F0"), "{last}");
}
