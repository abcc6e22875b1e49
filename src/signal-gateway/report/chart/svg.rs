//! SVG elements as text: attributes in insertion order, everything escaped.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Write};
use std::ops::Range;

use crate::report::palette::{self, Paint};

/// Minimum width of a bar with a border, pixels; a narrower bar would be all border.
pub(super) const BORDERLESS_PX: f64 = 4.0;

/// A rectangle of the chart, pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Area {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    /// Colours of the properties `fill` and `stroke`.
    paints: Vec<(&'static str, Paint)>,
    text: String,
    children: Vec<Element>,
}

impl Element {
    pub(super) fn new(name: &'static str) -> Self {
        Self { name, attributes: Vec::new(), paints: Vec::new(), text: String::new(), children: Vec::new() }
    }

    pub(super) fn with(mut self, name: &'static str, value: impl Display) -> Self {
        self.attributes.push((name, value.to_string()));
        self
    }

    pub(super) fn fill(self, paint: Paint) -> Self {
        self.painted("fill", paint)
    }

    pub(super) fn stroke(self, paint: Paint) -> Self {
        self.painted("stroke", paint)
    }

    /// Sets the colour of the light scheme, which all viewers show; a class overrides it in the dark scheme.
    fn painted(mut self, property: &'static str, paint: Paint) -> Self {
        self.attributes.push((property, paint.light.to_owned()));
        if paint.light != paint.dark {
            self.paints.push((property, paint));
        }
        self
    }

    /// Returns true if the element or a descendant has this class.
    pub(super) fn has_class(&self, class: &str) -> bool {
        self.attributes.iter().any(|(name, value)| *name == "class" && value == class)
            || self.children.iter().any(|child| child.has_class(class))
    }

    /// Adds the dark-scheme rules of the element and its descendants.
    fn add_rules(&self, rules: &mut BTreeSet<String>) {
        let rule = |(property, paint): &(&str, Paint)| {
            format!(".{} {{ {property}: {}; }}", class(property, *paint), paint.dark)
        };
        rules.extend(self.paints.iter().map(rule));
        self.children.iter().for_each(|child| child.add_rules(rules));
    }

    /// Sets an attribute in pixels, to a hundredth.
    pub(super) fn at(self, name: &'static str, px: f64) -> Self {
        self.with(name, pixels(px))
    }

    /// Sets its text, which precedes its child elements.
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
        for (name, value) in self.attributes.iter().filter(|(name, _)| *name != "class") {
            write!(out, " {name}=\"{}\"", Escaped(value))?;
        }
        let own = self.attributes.iter().filter(|(name, _)| *name == "class").map(|(_, class)| class.clone());
        let paints = self.paints.iter().map(|(property, paint)| class(property, *paint));
        let classes: Vec<_> = own.chain(paints).collect();
        if !classes.is_empty() {
            write!(out, " class=\"{}\"", classes.join(" "))?;
        }
        if self.children.is_empty() && self.text.is_empty() {
            return out.write_str("/>\n");
        }
        write!(out, ">{}", Escaped(&self.text))?;
        if !self.children.is_empty() {
            out.write_str("\n")?;
            // Only a few levels deep, since the layouts determine the depth, not the input.
            self.children.iter().try_for_each(|child| child.write(out, depth + 1))?;
            write!(out, "{:depth$}", "")?;
        }
        writeln!(out, "</{}>", self.name)
    }
}

/// Returns the name of the class that changes a colour in the dark scheme.
fn class(property: &str, paint: Paint) -> String {
    format!("{property}-{}", paint.name)
}

impl Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write(f, 0)
    }
}

impl Area {
    pub(super) fn rect(self) -> Element {
        rect(self.x, self.y, self.width, self.height)
    }
}

pub(super) fn rect(x: f64, y: f64, width: f64, height: f64) -> Element {
    Element::new("rect").at("x", x).at("y", y).at("width", width).at("height", height)
}

/// Adds a border to a field, unless it would be all border.
pub(super) fn bordered(field: Element, area: Area) -> Element {
    if area.width < BORDERLESS_PX { field } else { field.stroke(palette::EDGE).with("stroke-width", 0.75) }
}

pub(super) fn horizontal(x: Range<f64>, y: f64, stroke: Paint) -> Element {
    Element::new("line").at("x1", x.start).at("y1", y).at("x2", x.end).at("y2", y).stroke(stroke)
}

pub(super) fn vertical(x: f64, y: Range<f64>, stroke: Paint) -> Element {
    Element::new("line").at("x1", x).at("y1", y.start).at("x2", x).at("y2", y.end).stroke(stroke)
}

/// Creates a text on a base line.
pub(super) fn text_at(x: f64, y: f64, size_px: f64, text: &str) -> Element {
    Element::new("text").at("x", x).at("y", y).at("font-size", size_px).text(text)
}

/// Creates a document with its own background, light or dark by the viewer's preference.
pub(super) fn document(title: &str, width: f64, height: f64, content: Vec<Element>) -> String {
    let view = format!("0 0 {} {}", pixels(width), pixels(height));
    let background = rect(0.0, 0.0, width, height).fill(palette::CARD);
    let mut rules = BTreeSet::new();
    content.iter().chain([&background]).for_each(|element| element.add_rules(&mut rules));
    let rules: Vec<_> = rules.into_iter().collect();
    let style = format!("@media (prefers-color-scheme: dark) {{ {} }}", rules.join(" "));
    let root = Element::new("svg")
        .with("xmlns", "http://www.w3.org/2000/svg")
        .at("width", width)
        .at("height", height)
        .with("viewBox", view)
        .with("font-family", "sans-serif")
        .with("role", "img")
        .child(Element::new("title").text(title))
        .child(Element::new("style").text(&style))
        .child(background)
        .children(content);
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{root}")
}

/// Formats a number of pixels to a hundredth, without trailing zeros.
pub(super) fn pixels(px: f64) -> String {
    let rounded = (px * 100.0).round() / 100.0;
    // Avoids minus zero, which prints its sign.
    if rounded == 0.0 { "0".to_owned() } else { rounded.to_string() }
}

/// Writes text as valid XML: escaped, with a replacement for characters that XML forbids.
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
