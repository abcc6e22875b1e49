//! What to do stands once, in the catalogue, and everything that shows a status has it.

use std::path::Path;

use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::diagnostics::{Level, MessageRow, Section};
use signal_gateway::config::files::{DEMO_CONFIG, Embedded};
use signal_gateway::config::{Overrides, load};
use signal_gateway::io::ros::messages::diagnostic_status;
use signal_gateway::process_status::catalogue::sections;
use signal_gateway::process_status::log::LogState;
use signal_gateway::report::gateway_view::GatewayView;
use signal_gateway::report::{metrics, status};

use super::document;
use crate::support::diagnostics::reasons;
use crate::support::virtual_gateway::VirtualGateway;

#[test]
fn each_message_that_is_not_ok_leads_on_in_sentences() {
    let messages = sections().flat_map(Section::rows);
    let bad: Vec<_> = messages.filter(|row| row.level > Some(Level::Ok)).collect();
    assert!(bad.len() > 80, "{}", bad.len());
    for row in bad.into_iter().chain(reasons()) {
        let has_reason = row.template.contains("{reason}");
        assert!(has_reason || !row.remedy.is_empty(), "nothing to do: {row:?}");
        assert!(row.remedy.is_empty() || is_sentence(row), "no sentence: {row:?}");
    }
    for row in sections().flat_map(Section::rows) {
        assert!(row.level != Some(Level::Ok) || row.remedy.is_empty(), "never shown: {row:?}");
    }
}

fn is_sentence(MessageRow { remedy, .. }: &MessageRow) -> bool {
    remedy.starts_with(char::is_uppercase) && remedy.ends_with('.') && remedy.contains(' ')
}

#[test]
fn each_document_is_a_heading_of_the_page() {
    let document = document();
    let anchor = |title: &str| {
        let kept = title.chars().filter(|letter| letter.is_alphanumeric() || "_- ".contains(*letter));
        format!("docs/diagnostics.md#{}", kept.collect::<String>().to_lowercase().replace(' ', "-"))
    };
    let anchors: Vec<_> = document.lines().filter_map(|line| line.strip_prefix("## ")).map(anchor).collect();
    for section in sections() {
        assert!(anchors.contains(&section.document()), "{} is not among {anchors:#?}", section.document());
    }
}

#[test]
fn the_same_remedy_is_in_diagnostics_status_page_terminal_and_metrics() {
    let settings = load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap();
    let mut desk = VirtualGateway::new(settings.gateway);
    desk.handle(CanInput::Link { bus: BusIndex(0), state: LinkState::Missing });
    let statuses = desk.gateway.statuses(desk.now.mono);
    let turn = statuses.iter().find(|status| status.task == "turn_indicators").unwrap();
    let remedy = "Plug in the adapter, or correct `interface`.";
    let document = "docs/diagnostics.md#turn_indicators-hazard_lights";
    assert_eq!((turn.level, turn.remedy.as_str()), (Level::Error, remedy), "{turn:?}");
    // On the topic.
    let message = diagnostic_status("gw", turn, "car");
    let last: Vec<_> = message.values.iter().rev().take(2).map(|pair| (&*pair.key, &*pair.value)).collect();
    assert_eq!(last, [("document", document), ("remedy", remedy)]);
    // As JSON.
    let snapshot = desk.snapshot();
    let json = serde_json::to_value(&snapshot).unwrap();
    let listed = json["diagnostics"].as_array().unwrap();
    let listed = listed.iter().find(|status| status["task"] == "turn_indicators").unwrap();
    assert_eq!((&listed["remedy"], &listed["document"]), (&remedy.into(), &document.into()));
    // As text.
    let view = GatewayView::of(&snapshot);
    let text = status::text(&view, None);
    assert!(text.contains(&format!("→ {remedy}\n")) && text.contains(&format!("→ {document}\n")), "{text}");
    // On the live page and in the terminal.
    assert_eq!(view.reports[0].remedy, remedy);
    assert_eq!(view.diagnostics, snapshot.diagnostics);
    // For alerts.
    let series = format!(
        "signal_gateway_status_remedy{{task=\"turn_indicators\",remedy=\"{remedy}\",document=\"{document}\"}} 1"
    );
    let scraped = metrics::openmetrics(&snapshot);
    assert!(scraped.lines().any(|line| line.starts_with(&series)), "{scraped}");
    let bad = statuses.iter().filter(|status| status.level > Level::Ok).count();
    assert_eq!(scraped.matches("signal_gateway_status_remedy{").count(), bad, "a series for each bad status");
}

#[test]
fn a_status_that_is_ok_has_neither_remedy_nor_document() {
    let good = LogState::default().status();
    assert_eq!((good.level, good.remedy.as_str(), good.document()), (Level::Ok, "", None));
    assert_eq!(good.published_values().collect::<Vec<_>>(), good.values);
    let bad = LogState { is_failing: true, ..LogState::default() }.status();
    assert_eq!(bad.document().as_deref(), Some("docs/diagnostics.md#log"));
    assert_eq!(bad.published_values().count(), bad.values.len() + 2);
}
