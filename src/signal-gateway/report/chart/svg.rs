//! SVG elements as text: attributes in the order given, everything escaped.

use std::collections::BTreeSet;
use std::fmt::{self, Display, Write};

use crate::report::palette::{self, Paint};

/// A narrower bar is all border.
pub(super) const BORDERLESS_PX: f64 = 4.0;

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
    /// Properties that have a colour: `fill` and `stroke`.
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

    /// Fills it.
    pub(super) fn fill(self, paint: Paint) -> Self {
        self.painted("fill", paint)
    }

    /// Draws its border, or the line that it is.
    pub(super) fn stroke(self, paint: Paint) -> Self {
        self.painted("stroke", paint)
    }

    /// The colour on light surroundings is an attribute, which every reader knows; a class changes it on dark
    /// ones.
    fn painted(mut self, property: &'static str, paint: Paint) -> Self {
        self.attributes.push((property, paint.light.to_owned()));
        if paint.light != paint.dark {
            self.paints.push((property, paint));
        }
        self
    }

    /// True if it, or an element in it, has this class.
    pub(super) fn has_class(&self, class: &str) -> bool {
        self.attributes.iter().any(|(name, value)| *name == "class" && value == class)
            || self.children.iter().any(|child| child.has_class(class))
    }

    /// Adds the rules for dark surroundings of it and all in it.
    fn add_rules(&self, rules: &mut BTreeSet<String>) {
        let rule = |(property, paint): &(&str, Paint)| {
            format!(".{} {{ {property}: {}; }}", class(property, *paint), paint.dark)
        };
        rules.extend(self.paints.iter().map(rule));
        self.children.iter().for_each(|child| child.add_rules(rules));
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
            // At most a handful of levels: the layouts build them, not the input.
            self.children.iter().try_for_each(|child| child.write(out, depth + 1))?;
            write!(out, "{:depth$}", "")?;
        }
        writeln!(out, "</{}>", self.name)
    }
}

/// Name of the class that changes a colour on dark surroundings.
fn class(property: &str, paint: Paint) -> String {
    format!("{property}-{}", paint.name)
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

/// A field with a border, unless it would be all border.
pub(super) fn bordered(field: Element, area: Area) -> Element {
    if area.width < BORDERLESS_PX { field } else { field.stroke(palette::EDGE).with("stroke-width", 0.75) }
}

/// Draws a straight line.
pub(super) fn line(from: (f64, f64), to: (f64, f64), stroke: Paint) -> Element {
    Element::new("line").at("x1", from.0).at("y1", from.1).at("x2", to.0).at("y2", to.1).stroke(stroke)
}

/// Text on a base line.
pub(super) fn text_at(x: f64, y: f64, size_px: f64, text: &str) -> Element {
    Element::new("text").at("x", x).at("y", y).at("font-size", size_px).text(text)
}

/// A document with a background of its own, light or dark as the reader prefers.
pub(super) fn document(title: &str, (width, height): (f64, f64), content: Vec<Element>) -> String {
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
