//! The elements of an ARXML file by their paths, and its numbers.

use std::collections::HashMap;

use derive_more::{Display, From};
use roxmltree::{Document, Node, NodeId};

/// Maximum number of children among which a single child is searched for. More children form a list, with
/// names of its own.
const MAX_SINGLE: usize = 128;

/// Maximum length of a reference, bytes.
const MAX_PATH: usize = 8 << 10;

/// Reason why an element is not read.
#[derive(Debug, Display, From)]
#[from(String, &str)]
pub(super) struct Unread(String);

pub(super) struct NamedElements<'d> {
    document: &'d Document<'d>,
    /// Elements by their enclosing named element (the document itself at the top) and their names.
    names: HashMap<(NodeId, &'d str), NodeId>,
    /// Offsets of the line ends, bytes.
    lines: Vec<usize>,
}

impl<'d> NamedElements<'d> {
    pub(super) fn of(document: &'d Document<'d>) -> Self {
        let mut names = HashMap::new();
        // Elements still to visit, each with its enclosing named element.
        let mut rest = vec![(document.root_element(), document.root().id())];
        while let Some((element, around)) = rest.pop() {
            let mut inside = around;
            if let Some(name) = text_of(element, "SHORT-NAME") {
                inside = *names.entry((around, name)).or_insert(element.id());
            }
            rest.extend(element.children().filter(Node::is_element).map(|child| (child, inside)));
        }
        let text = document.input_text();
        let lines = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at).collect();
        Self { document, names, lines }
    }

    pub(super) fn first(&self, kind: &str) -> Option<Node<'d, 'd>> {
        self.document.descendants().find(|node| node.tag_name().name() == kind)
    }

    pub(super) fn line(&self, element: Node<'_, '_>) -> usize {
        1 + self.lines.partition_point(|end| *end < element.range().start)
    }

    /// Returns the target of a reference below `element`; `None` without the reference, or if it has no
    /// target.
    pub(super) fn follow(&self, element: Node<'d, 'd>, reference: &str) -> Option<Node<'d, 'd>> {
        self.at(text_of(element, reference)?)
    }

    /// Returns the element with an absolute path, such as `/Signals/Turn`.
    pub(super) fn at(&self, path: &str) -> Option<Node<'d, 'd>> {
        let mut names = path.strip_prefix('/').filter(|_| path.len() <= MAX_PATH)?.split('/');
        let top = self.document.root().id();
        let id = names.try_fold(top, |around, name| self.names.get(&(around, name)).copied())?;
        self.document.get_node(id)
    }
}

/// Returns the first child with this name. Names have no namespace here, since the whole file has only one.
pub(super) fn child<'d>(element: Node<'d, 'd>, name: &str) -> Option<Node<'d, 'd>> {
    let mut children = element.children().filter(Node::is_element).take(MAX_SINGLE);
    children.find(|child| child.tag_name().name() == name)
}

/// Returns the element at the end of a path of single children.
pub(super) fn descend<'d>(element: Node<'d, 'd>, path: &[&str]) -> Option<Node<'d, 'd>> {
    path.iter().try_fold(element, |element, name| child(element, name))
}

/// Returns the children of `list`, a single child of the element, with this name.
pub(super) fn listed<'d>(
    element: Node<'d, 'd>,
    list: &str,
    name: &'static str,
) -> impl Iterator<Item = Node<'d, 'd>> + use<'d> {
    let children = child(element, list).into_iter().flat_map(|list| list.children());
    children.filter(move |child| child.tag_name().name() == name)
}

/// Returns the text of a single child, without blanks around it.
pub(super) fn text_of<'d>(element: Node<'d, 'd>, name: &str) -> Option<&'d str> {
    child(element, name)?.text().map(str::trim).filter(|text| !text.is_empty())
}

/// Returns the whole number in the text of a single child.
pub(super) fn whole_of<T: TryFrom<i128>>(element: Node<'_, '_>, name: &str) -> Option<T> {
    whole(text_of(element, name)?)?.try_into().ok()
}

/// Reads a whole number in AUTOSAR notation: in C's notation, as `12.0`, or as a truth value.
pub(super) fn whole(text: &str) -> Option<i128> {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let digits = match digits.split_once('.') {
        Some((whole, fraction)) if fraction.bytes().all(|digit| digit == b'0') => whole,
        Some(_) | None => digits,
    };
    let lower = digits.to_ascii_lowercase();
    let (digits, radix) = match (lower.as_str(), lower.as_bytes()) {
        ("true", _) => ("1", 10),
        ("false", _) => ("0", 10),
        (hexadecimal, [b'0', b'x', ..]) => (&hexadecimal[2..], 16),
        (binary, [b'0', b'b', ..]) => (&binary[2..], 2),
        (octal, [b'0', b'0'..=b'9', ..]) => (&octal[1..], 8),
        (decimal, _) => (decimal, 10),
    };
    let is_plain = digits.bytes().all(|digit| digit.is_ascii_alphanumeric());
    u64::from_str_radix(digits, radix).ok().filter(|_| is_plain).map(|number| sign * i128::from(number))
}

/// Reads a number, whole or not; `None` unless it is finite.
#[allow(clippy::cast_precision_loss)] // a factor or an offset
pub(super) fn number(text: &str) -> Option<f64> {
    let number = whole(text).map(|number| number as f64).or_else(|| text.parse().ok())?;
    number.is_finite().then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_autosar_writes_them() {
        for (text, expected) in [
            ("12", Some(12)),
            ("-12", Some(-12)),
            ("0x1F", Some(31)),
            ("0b101", Some(5)),
            ("017", Some(15)),
            ("0", Some(0)),
            ("12.0", Some(12)),
            ("true", Some(1)),
            ("12.5", None),
            ("--1", None),
            ("x", None),
            ("99999999999999999999", None),
            ("1e300", None),
        ] {
            assert_eq!(whole(text), expected, "{text}");
        }
        assert_eq!((number("0.25"), number("-1e-3"), number("inf")), (Some(0.25), Some(-0.001), None));
    }

    #[test]
    fn references_lead_to_elements_by_the_names_around_them() {
        let text = "<A>\n<P><SHORT-NAME>p</SHORT-NAME>\n<E><B><SHORT-NAME> b </SHORT-NAME></B></E>\n\
                    <C><R-REF>/p/b</R-REF></C></P></A>";
        let document = Document::parse(text).unwrap();
        let names = NamedElements::of(&document);
        let found = names.at("/p/b").unwrap();
        assert_eq!((found.tag_name().name(), names.line(found)), ("B", 3));
        let referring = document.descendants().find(|node| node.tag_name().name() == "C").unwrap();
        assert_eq!(names.follow(referring, "R-REF"), Some(found));
        assert_eq!(
            [names.at("p/b"), names.at("/p"), names.at("/b")].map(|found| found.is_some()),
            [false, true, false]
        );
    }
}
