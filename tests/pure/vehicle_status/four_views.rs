//! A report that is withheld reads the same in `/diagnostics`, status text, page and terminal.

use can_signal::can::CanId;
use signal_gateway::report::gateway_view::GatewayView;
use signal_gateway::report::status;
use signal_gateway::report::terminal::view_model::Model;

use crate::pure::terminal_view;
use crate::support::files::MemoryFiles;
use crate::support::status_vehicle;
use crate::support::virtual_gateway::VirtualGateway;

/// Wide enough for a message in a line beside the car, and too narrow for the log there.
const SIZE: (u16, u16) = (158, 50);

/// The bench vehicle with a steering wheel whose ratio is not given, hazard lights that no signal shows, a
/// speed that can be faulty, and a bus that may sleep.
fn gateway() -> VirtualGateway {
    let profile = [
        ("[bus.body]\n", "[bus.body]\nmay_sleep = true\n"),
        ("from = \"signal\"\nsignal = \"BODY.HAZARD\"\non = [1]\noff = [0]\n", "from = \"not_visible\"\n"),
        ("tire = {", "wheel = {"),
        ("not_available = [65535]", "fault = [65535]"),
    ];
    let profile = profile.into_iter().fold(status_vehicle::PROFILE.to_owned(), |profile, (part, other)| {
        assert!(profile.contains(part), "{part}");
        profile.replacen(part, other, 1)
    });
    let config = "profile = \"bench.toml\"\n[can.body]\ninterface = \"can0\"\n[vehicle_geometry]\nwheel_base_m = 2.8\n";
    let files =
        [("gateway.toml", config), ("bench.toml", profile.as_str()), ("bench.dbc", status_vehicle::DBC)];
    VirtualGateway::new(MemoryFiles::new(files).settings().gateway)
}

/// Compares what the four views say of a report whose state has these words.
fn assert_same(gateway: &VirtualGateway, key: &str, words: &str) {
    let message = gateway.status(key).message;
    let begin = format!("{words}: ");
    assert!(message.starts_with(&begin) && message.len() > begin.len(), "{key}: {message}");
    let view = GatewayView::of(&gateway.snapshot());
    let text = status::text(&view, None);
    let row = text.lines().find(|line| line.starts_with(&format!("  {key} "))).unwrap();
    assert!(row.contains("withheld") && row.ends_with(&format!(": {message}")), "{row}");
    let feed = serde_json::to_value(&view).unwrap();
    let report = feed["reports"].as_array().unwrap().iter().find(|report| report["key"] == key).unwrap();
    assert_eq!((&report["state"], &report["message"]), (&words.into(), &message.as_str().into()));
    assert_eq!(report["reported"]["text"], "withheld");
    let name = report["name"].as_str().unwrap().to_owned();
    let mut model = Model::default();
    model.show(view);
    let shown = terminal_view::text(&model, SIZE);
    let mut lines = shown.lines().skip_while(|line| !line.contains(&format!(" {name} ")));
    let (first, second) = (lines.next().unwrap(), lines.next().unwrap());
    assert!(first.contains("withheld") && second.ends_with(&message), "{shown}");
    // A level above OK on the badge of the page, wherever a report has one.
    assert!(gateway.status(key).level <= gateway.snapshot().level);
}

#[test]
fn each_state_without_a_value_reads_the_same_in_all_four_views() {
    let mut gateway = gateway();
    for _ in 0..20 {
        // The speed is faulty, the turn indicators are on the left.
        gateway.receive(CanId::Standard(768), &[0xFF, 0xFF, 0, 0, 0, 0, 0, 0]);
        gateway.receive(CanId::Standard(769), &[0x41, 0, 0, 0, 0, 0, 0, 0]);
        gateway.pass(50);
    }
    assert_same(&gateway, "steering", "not configured");
    assert_same(&gateway, "hazard_lights", "not visible");
    assert_same(&gateway, "velocity", "hardware fault");
    gateway.pass(60_000);
    for key in ["turn_indicators", "gear"] {
        assert_same(&gateway, key, "asleep");
    }
}

#[test]
fn a_page_is_not_all_well_while_a_report_is_withheld() {
    let mut gateway = gateway();
    gateway.pass(1_000);
    let view = GatewayView::of(&gateway.snapshot());
    let worst = view.reports.iter().filter_map(|report| report.reported.level).max();
    assert!(worst > Some(gateway_base::diagnostics::Level::Ok) && worst <= view.level, "{worst:?}");
}
