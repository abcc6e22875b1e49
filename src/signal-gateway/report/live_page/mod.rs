//! The live page: one document with its style and its script, which shows the present state of a
//! gateway, as a stream of events has it.

use crate::report::page::Page;
use crate::report::palette;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// One after the other they are one script.
const SCRIPTS: [&str; 5] = [
    include_str!("draw.js"),
    include_str!("sections.js"),
    include_str!("history.js"),
    include_str!("past.js"),
    include_str!("page.js"),
];

/// Puts the page together.
pub fn page() -> Page {
    let script = SCRIPTS.concat();
    let style = palette::style() + STYLE;
    let html = TEMPLATE.replace("{{style}}", &style).replace("{{script}}", &script);
    Page::new(html, &style, &script)
}
