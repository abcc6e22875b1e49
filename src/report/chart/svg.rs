//! SVG elements as text: attributes in the order given, everything escaped.

use std::fmt::{self, Display, Write};

/// A rectangle of the chart, pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Area {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

/// An element with what is in it.
#[derive(Debug, Clone)]
pub(super) struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    text: String,
    children: Vec<Element>,
}

impl Element {
    pub(super) fn new(name: &'static str) -> Self {
        Self { name, attributes: Vec::new(), text: String::new(), children: Vec::new() }
    }

    pub(super) fn with(mut self, name: &'static str, value: impl Display) -> Self {
        self.attributes.push((name, value.to_string()));
        self
    }

    /// An attribute in pixels, to a hundredth.
    pub(super) fn at(self, name: &'static str, px: f64) -> Self {
        self.with(name, pixels(px))
    }

    /// Its text, which stands before the elements in it.
    pub(super) fn text(mut self, text: &str) -> Self {
        text.clone_into(&mut self.text);
        self
    }

    pub(super) fn child(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    pub(super) fn children(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }

    fn write(&self, out: &mut impl Write, depth: usize) -> fmt::Result {
        write!(out, "{:depth$}<{}", "", self.name)?;
        for (name, value) in &self.attributes {
            write!(out, " {name}=\"{}\"", Escaped(value))?;
        }
        if self.children.is_empty() && self.text.is_empty() {
            return out.write_str("/>\n");
        }
        write!(out, ">{}", Escaped(&self.text))?;
        if !self.children.is_empty() {
            out.write_str("\n")?;
            // At most a handful of levels: the layouts build them, not the input.
            self.children.iter().try_for_each(|child| child.write(out, depth + 1))?;
            write!(out, "{:depth$}", "")?;
        }
        writeln!(out, "</{}>", self.name)
    }
}

impl Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, 0)
    }
}

/// Draws a rectangle; the unit is pixels.
pub(super) fn rect(x: f64, y: f64, width: f64, height: f64) -> Element {
    Element::new("rect").at("x", x).at("y", y).at("width", width).at("height", height)
}

/// Draws a straight line.
pub(super) fn line(from: (f64, f64), to: (f64, f64), stroke: &str) -> Element {
    let line = Element::new("line").at("x1", from.0).at("y1", from.1).at("x2", to.0).at("y2", to.1);
    line.with("stroke", stroke)
}

/// Text on a base line.
pub(super) fn text_at(x: f64, y: f64, size_px: f64, text: &str) -> Element {
    Element::new("text").at("x", x).at("y", y).at("font-size", size_px).text(text)
}

/// A document with a white background.
pub(super) fn document(width: f64, height: f64, content: Vec<Element>) -> String {
    let view = format!("0 0 {} {}", pixels(width), pixels(height));
    let root = Element::new("svg")
        .with("xmlns", "http://www.w3.org/2000/svg")
        .at("width", width)
        .at("height", height)
        .with("viewBox", view)
        .with("font-family", "sans-serif")
        .child(rect(0.0, 0.0, width, height).with("fill", "#ffffff"))
        .children(content);
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{root}")
}

/// To a hundredth, without needless zeros.
pub(super) fn pixels(px: f64) -> String {
    let rounded = (px * 100.0).round() / 100.0;
    // Minus zero prints its sign.
    if rounded == 0.0 { "0".to_owned() } else { rounded.to_string() }
}

/// Text as XML may hold it: what has a meaning is escaped, what XML bars becomes a replacement mark.
struct Escaped<'a>(&'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|char| match char {
            '&' => f.write_str("&amp;"),
            '<' => f.write_str("&lt;"),
            '>' => f.write_str("&gt;"),
            '"' => f.write_str("&quot;"),
            '\n' | '\t' | '\r' => f.write_str(" "),
            char if char.is_control() || matches!(char, '\u{FFFE}' | '\u{FFFF}') => f.write_str("\u{FFFD}"),
            char => f.write_char(char),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_foreign_is_escaped() {
        let element = Element::new("text").with("data", "a\"<b>&\n").text("x<y & \u{0}z");
        assert_eq!(
            element.to_string(),
            "<text data=\"a&quot;&lt;b&gt;&amp; \">x&lt;y &amp; \u{FFFD}z</text>\n"
        );
    }

    #[test]
    fn pixels_are_short() {
        let cases = [(1.0, "1"), (1.236, "1.24"), (-0.001, "0"), (1.5, "1.5"), (1e3, "1000")];
        for (px, text) in cases {
            assert_eq!(pixels(px), text);
        }
    }
}
