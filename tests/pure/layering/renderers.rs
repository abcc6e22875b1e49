//! The terminal, the live page and the status text lay out one view: what a snapshot says in words is decided
//! once, in `report::gateway_view`.

use std::fs;

use super::SOURCES;
use crate::support::sources::{files_of_kind, project};

const REPORT: &str = "src/signal-gateway/report";

#[test]
fn terminal_page_and_status_text_name_no_snapshot() {
    let is_renderer = |path: &std::path::Path| {
        let name = path.strip_prefix(REPORT).ok();
        name.is_some_and(|name| name.starts_with("terminal") || name.starts_with("status.rs"))
    };
    let renderers: Vec<_> = SOURCES.iter().filter(|source| is_renderer(&source.path)).collect();
    assert!(renderers.len() > 5, "the renderers were not found");
    let mut breaches = Vec::new();
    for source in renderers {
        let paths = source.mentions.iter().map(|mention| mention.path.join("::"));
        let found = paths.filter(|path| path.to_lowercase().contains("snapshot"));
        breaches.extend(found.map(|path| format!("{}: `{path}`", source.path.display())));
    }
    let scripts = files_of_kind(&format!("{REPORT}/live_page"), "js");
    assert!(scripts.len() > 2, "the scripts of the page were not found");
    for script in scripts {
        let text = fs::read_to_string(project().join(&script)).unwrap().to_lowercase();
        if text.contains("snapshot") {
            breaches.push(format!("{}: names a snapshot", script.display()));
        }
    }
    assert!(breaches.is_empty(), "\n{}", breaches.join("\n"));
}
