//! The live page: one document that shows the current state of a gateway from a stream of events.

use crate::report::page::Page;
use crate::report::palette;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
/// Concatenated, they form one script.
const SCRIPTS: [&str; 6] = [
    include_str!("draw.js"),
    include_str!("../curve.js"),
    include_str!("sections.js"),
    include_str!("history.js"),
    include_str!("past.js"),
    include_str!("page.js"),
];

pub(crate) fn page() -> Page {
    let script = SCRIPTS.concat();
    let style = palette::style() + STYLE;
    let html = TEMPLATE.replace("{{style}}", &style).replace("{{script}}", &script);
    Page::new(html, &style, &script)
}
