//! The timeline as one self-contained page, with style, script and data.

use serde_json::{Value, json};

use super::{Column, OpenedAt, Span, Timeline};
use crate::report::page::Page;
use crate::report::palette;
use crate::report::text::counted;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = concat!(include_str!("../curve.js"), include_str!("page.js"));

impl Timeline {
    /// Returns the timeline as a document that works from a file, and opens at `opened_at` if given.
    pub fn to_html(&self, opened_at: Option<&OpenedAt>) -> String {
        let title = format!("{} - signal-gateway", self.title);
        let places = [
            ("{{title}}", html(&title)),
            ("{{style}}", palette::style() + STYLE),
            ("{{data}}", self.data(opened_at)),
            ("{{script}}", SCRIPT.to_owned()),
        ];
        let mut page = String::new();
        let mut rest = TEMPLATE;
        // From left to right, so that no text of the recording is mistaken for a placeholder.
        for (place, content) in places {
            let (before, after) = rest.split_once(place).unwrap_or((rest, ""));
            page.push_str(before);
            page.push_str(&content);
            rest = after;
        }
        page.push_str(rest);
        page
    }

    /// Returns the page of a document created by [`Self::to_html`].
    pub fn page(html: String) -> Page {
        Page::new(html, &(palette::style() + STYLE), SCRIPT)
    }

    /// Returns the data for the script: JSON in which no character can end the enclosing element.
    fn data(&self, opened_at: Option<&OpenedAt>) -> String {
        let lanes = self.lanes.iter().map(|lane| {
            json!({
                "group": lane.group,
                "heading": lane.section().2,
                "is_constant": lane.is_constant(),
                "label": lane.label,
                "name": lane.name(),
                "spans": lane.spans.iter().map(span).collect::<Vec<_>>(),
            })
        });
        let curves = self.curves.iter().map(|curve| {
            let (low, high) = curve.range();
            json!({
                "heading": curve.section(),
                "label": curve.label,
                "name": curve.heading(),
                "unit": curve.unit,
                "low": low,
                "high": high,
                "parts": curve.parts().map(|part| part.iter().map(column).collect()).collect::<Vec<Vec<_>>>(),
            })
        });
        let events = self.lanes.iter().map(|lane| lane.spans.len()).sum::<usize>();
        let summary = format!("{:.3} s, {}", self.length_s, counted(events as u64, "state"));
        let data = json!({
            "title": self.title,
            "subtitle": self.subtitle,
            "summary": summary,
            "length": self.length_s,
            "curves": curves.collect::<Vec<_>>(),
            "lanes": lanes.collect::<Vec<_>>(),
            "frames": self.frames,
            "remarks": self.remarks,
            "opened_at": opened_at,
        });
        data.to_string().replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
    }
}

/// Returns start, end, tone, text, frame and number of states.
fn span(span: &Span) -> Value {
    json!([span.from_s, span.to_s, span.tone, span.text, span.frame, span.states])
}

/// Returns the times of the first and the last value, and the lowest and highest value.
fn column(column: &Column) -> Value {
    // A fifth decimal would not be visible.
    let rounded = |value: f64| (value * 1e4).round() / 1e4;
    json!([rounded(column.from_s), rounded(column.to_s), rounded(column.low), rounded(column.high)])
}

fn html(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
