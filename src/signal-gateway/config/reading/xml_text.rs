//! Reads XML as elements with their locations.

use std::borrow::Cow;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::rc::Rc;

use roxmltree::{Document, Error, Node, ParsingOptions};

use super::element::{Attribute, Element};
use super::location::{KeyPath, Location, MAX_DEPTH, MAX_NODES, Text};
use super::problem::{Position, Problem};

/// Reads an XML document.
///
/// # Errors
/// Fails for the first violation of XML, too deep nesting, or too many elements. Refuses a document type with
/// its own declarations, and entities.
pub(crate) fn from_xml(text: &Text) -> Result<Element, Problem> {
    let most = u32::try_from(MAX_NODES).unwrap_or(u32::MAX);
    let options = ParsingOptions { allow_dtd: false, nodes_limit: 3 * most, ..ParsingOptions::default() };
    if let Some(crowd) = crowded_element(&text.content) {
        return Err(text.problem(text.position(crowd.offset), crowd.reason, CrowdedElement::REMEDY));
    }
    let content = without_doctype(&text.content);
    let document = Document::parse_with_options(&content, options).map_err(|error| {
        if matches!(error, Error::DtdDetected) {
            // The parser has no position for it.
            let position = text.position(content.find(DOCTYPE).unwrap_or_default());
            let reason = "declarations of a document type cannot be read here";
            return text.problem(position, reason, "remove the <!DOCTYPE …>");
        }
        // Some of the parser's texts lack the position.
        let reason = error.to_string().replacen(&format!(" at {}", error.pos()), "", 1);
        let position = Position { line: error.pos().row as usize, column: error.pos().col as usize };
        text.problem(position, &reason, "correct the XML")
    })?;
    let root = document.root_element();
    element(text, root, KeyPath::below(&KeyPath::root(), "/", root.tag_name().name()), 1)
}

const DOCTYPE: &str = "<!DOCTYPE";

/// Maximum number of attributes of an element. The parser compares each with all previous ones.
const MAX_ATTRIBUTES: usize = 2_000;
/// Maximum number of namespace declarations in a file. For each element with a declaration, the parser stores
/// a list of all valid namespaces.
const MAX_NAMESPACES: usize = 5_000;

/// An element for which the parser would take time quadratic in its size.
pub(in crate::config) struct CrowdedElement {
    /// Byte at which it begins, or byte of the first declaration beyond the limit.
    pub(in crate::config) offset: usize,
    pub(in crate::config) reason: &'static str,
}

impl CrowdedElement {
    pub(in crate::config) const REMEDY: &str = "leave out what is not needed";
}

/// Finds an element with too many attributes, or the first namespace declaration beyond the limit, before the
/// text is parsed. A `<` begins an element or the like, and cannot be in a value of an attribute.
pub(in crate::config) fn crowded_element(content: &str) -> Option<CrowdedElement> {
    let (mut begin, mut attributes) = (0, 0);
    for (offset, byte) in content.bytes().enumerate() {
        match byte {
            b'<' => (begin, attributes) = (offset, 0),
            b'=' => attributes += 1,
            _ => {}
        }
        // Text and comments may contain that many.
        if attributes == MAX_ATTRIBUTES + 1 && is_element(&content[begin..]) {
            let reason = "an element with more than 2000 attributes cannot be read";
            return Some(CrowdedElement { offset: begin, reason });
        }
    }
    let (offset, _) = content.match_indices("xmlns").nth(MAX_NAMESPACES)?;
    Some(CrowdedElement { offset, reason: "more than 5000 declarations of namespaces cannot be read" })
}

/// Returns true if a text begins with an element that has an attribute.
fn is_element(text: &str) -> bool {
    let name = text.strip_prefix('<').unwrap_or_default();
    let end = name.find(|char: char| char.is_whitespace() || "<>/!?=".contains(char));
    end.is_some_and(|end| end > 0 && name[end..].starts_with(char::is_whitespace))
}

/// Returns the text with blanks instead of a document type without declarations, which only names a grammar.
fn without_doctype(content: &str) -> Cow<'_, str> {
    let Some((prolog, after)) = content.split_once(DOCTYPE) else { return content.into() };
    let Some((inner, rest)) = after.split_once('>') else { return content.into() };
    if inner.contains('[') || has_element(prolog) {
        return content.into();
    }
    let blank = |char: char| if char == '\n' { "\n".to_owned() } else { " ".repeat(char.len_utf8()) };
    let blanks: String = DOCTYPE.chars().chain(inner.chars()).map(blank).collect();
    format!("{prolog}{blanks} {rest}").into()
}

/// Returns true if an element begins in the text, which is then not a prolog.
fn has_element(text: &str) -> bool {
    text.split('<').skip(1).any(|after| !after.starts_with(['?', '!']))
}

fn element(text: &Text, node: Node<'_, '_>, key: Rc<KeyPath>, depth: usize) -> Result<Element, Problem> {
    let position = text.position(node.range().start);
    if depth > MAX_DEPTH {
        return Err(text.problem(position, "nested too deeply", "nest less deeply"));
    }
    // Attributes with a namespace are for XML tools.
    let own = node.attributes().filter(|attribute| attribute.namespace().is_none());
    let attributes = own.map(|attribute| Attribute {
        name: attribute.name().to_owned(),
        value: attribute.value().to_owned(),
        location: Location {
            position: text.position(attribute.range_value().start),
            key: KeyPath::below(&key, "/@", attribute.name()),
        },
        is_interpreted: Cell::new(false),
    });
    let attributes = attributes.collect();
    let mut children = Vec::new();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for child in node.children().filter(Node::is_element) {
        let name = child.tag_name().name();
        let count = counts.entry(name).and_modify(|count| *count += 1).or_insert(1);
        let key = KeyPath::numbered(&key, name, *count);
        children.push(element(text, child, key, depth + 1)?);
    }
    let content: String = node.children().filter(Node::is_text).filter_map(|text| text.text()).collect();
    Ok(Element {
        name: node.tag_name().name().to_owned(),
        location: Location { position, key },
        attributes,
        children,
        text: content.trim().to_owned(),
        is_text_interpreted: Cell::default(),
        is_interpreted: Cell::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read(text: &str) -> Result<Element, String> {
        from_xml(&Text::new(Path::new("a"), text.into()).unwrap()).map_err(|problem| problem.to_string())
    }

    #[test]
    fn elements_and_attributes_have_locations() {
        let root = read("<o:A xmlns:o='u'>\n <B o:c='1' d='2'/><B d='3'> x <!-- y -->z</B></o:A>").unwrap();
        assert_eq!((root.name.as_str(), root.children.len()), ("A", 2));
        let second = &root.children[1];
        assert_eq!(second.location.key.to_string(), "A/B[2]");
        assert_eq!(second.attributes[0].location.key.to_string(), "A/B[2]/@d");
        let positions = [second.location.position, second.attributes[0].location.position];
        assert_eq!(positions.map(|position| position.to_string()), ["2:20", "2:26"]);
        assert_eq!(second.text(), "x z");
        assert_eq!(root.children[0].attributes.len(), 1);
    }

    #[test]
    fn a_document_type_that_declares_nothing_has_no_effect() {
        let root = read("<?xml version='1.0'?>\n<!DOCTYPE A\n SYSTEM 'ä.dtd'>\n<A b='1'/>").unwrap();
        assert_eq!((root.name.as_str(), root.location.position), ("A", Position { line: 4, column: 1 }));
        let kept = read("<A><!-- <!DOCTYPE A> --><b>x</b></A>").unwrap();
        assert_eq!(kept.children.len(), 1);
    }

    #[test]
    fn anything_but_plain_xml_is_refused_at_its_location() {
        let deep = "<a>".repeat(100) + &"</a>".repeat(100);
        let deeper = "<a>".repeat(200_000) + &"</a>".repeat(200_000);
        let laughs = "<?xml version='1.0'?>\n <!DOCTYPE a [<!ENTITY b 'x'><!ENTITY c '&b;&b;'>]>\n<a>&c;</a>";
        let attributes = |count| (0..count).map(|number| format!(" a{number}=''")).collect::<String>();
        let crowded = format!("<a>\n<b{}/></a>", attributes(2_001));
        assert!(read(&format!("<a>\n<b{}/></a>", attributes(2_000))).is_ok());
        assert!(read(&format!("<a>{0}<!--{0}--></a>", "=".repeat(10_000))).is_ok());
        let named = "<b xmlns:c='d'/>".repeat(5_001);
        let named = format!("<a>{named}</a>");
        let rows = [
            (crowded.as_str(), "a:2:1: an element with more than 2000 attributes cannot be read; leave out"),
            (named.as_str(), "more than 5000 declarations of namespaces"),
            (deep.as_str(), "a:1:193: nested too deeply"),
            (deeper.as_str(), "nested too deeply"),
            (laughs, "a:2:2: declarations of a document type cannot be read here; remove the <!DOCTYPE …>"),
            ("<a>\n<b></a>", "a:2:4: expected 'b' tag, not 'a'; correct the XML"),
            ("<a b='1' b='2'/>", "a:1:10: attribute 'b' is already defined; correct the XML"),
            ("<a>&b;</a>", "a:1:4: "),
        ];
        for (text, part) in rows {
            let refused = read(text).unwrap_err();
            assert!(refused.contains(part), "{text:.40}: {refused}");
        }
    }
}
