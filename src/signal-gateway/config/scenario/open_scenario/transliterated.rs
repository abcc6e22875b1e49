//! Converts TIER IV's YAML form of OpenSCENARIO to elements: a key with a single value is an attribute, and
//! so is one in lower case without a value; a key with a table is a child element, and a key with a list is
//! several such children.

use std::cell::Cell;
use std::rc::Rc;

use crate::config::reading::{Attribute, Element, Entry, KeyPath, Kind, Location, Problem, Text, Value};

/// Converts the table under the name of the root to the root element.
///
/// # Errors
/// Fails for lists within lists, which are not elements.
pub(in crate::config::scenario) fn from_values(text: &Text, root: &Entry) -> Result<Element, Problem> {
    let key = KeyPath::below(&KeyPath::root(), "/", &root.key);
    element(text, &root.key, Location { position: root.location.position, key }, &root.value)
}

fn element(text: &Text, name: &str, location: Location, value: &Value) -> Result<Element, Problem> {
    let mut element = Element {
        name: name.to_owned(),
        location,
        attributes: Vec::new(),
        children: Vec::new(),
        text: String::new(),
        is_text_interpreted: Cell::default(),
        is_interpreted: Cell::default(),
    };
    match &value.kind {
        Kind::Null => {}
        Kind::Scalar { text, .. } => text.trim().clone_into(&mut element.text),
        Kind::List(_) => {
            let reason = format!("{name} is a list within a list");
            return Err(text.problem(value.location.position, &reason, "write a table for each element"));
        }
        Kind::Map(entries) => {
            let key = Rc::clone(&element.location.key);
            for entry in entries {
                add(text, &mut element, &key, entry)?;
            }
        }
    }
    Ok(element)
}

fn add(text: &Text, parent: &mut Element, key: &Rc<KeyPath>, entry: &Entry) -> Result<(), Problem> {
    let name = &entry.key;
    let attribute = |value: &str| Attribute {
        name: name.clone(),
        value: value.to_owned(),
        location: Location { position: entry.value.location.position, key: KeyPath::below(key, "/@", name) },
        is_interpreted: Cell::new(false),
    };
    match &entry.value.kind {
        Kind::Scalar { text, .. } => parent.attributes.push(attribute(text)),
        Kind::Null if name.starts_with(char::is_lowercase) => parent.attributes.push(attribute("")),
        Kind::List(items) => {
            for (index, item) in items.iter().enumerate() {
                let key = KeyPath::numbered(key, name, index + 1);
                let location = Location { position: item.location.position, key };
                parent.children.push(element(text, name, location, item)?);
            }
        }
        Kind::Null | Kind::Map(_) => {
            let location =
                Location { position: entry.location.position, key: KeyPath::below(key, "/", name) };
            parent.children.push(element(text, name, location, &entry.value)?);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::reading::{from_xml, from_yaml};
    use std::path::Path;

    fn text(content: &str) -> Text {
        Text::new(Path::new("a"), content.into()).unwrap()
    }

    fn shape(element: &Element) -> String {
        let attributes: String = element
            .attributes
            .iter()
            .map(|given| format!(" {}={:?} {}", given.name, given.value, given.location.key))
            .collect();
        let children: String = element.children.iter().map(shape).collect();
        format!("({} {}{attributes} {children}{})", element.name, element.location.key, element.text)
    }

    #[test]
    fn both_forms_give_the_same_elements() {
        let yaml = text("A:\n  n: 1.0\n  B:\n    - { m: x }\n    - m: 'y'\n      C: {}\n  D:\n  E: []\n");
        let Kind::Map(entries) = from_yaml(&yaml).unwrap().kind else { panic!() };
        let xml = text("<A n='1.0'><B m='x'/><B m='y'><C/></B><D/></A>");
        let element = from_values(&yaml, &entries[0]).unwrap();
        assert_eq!(shape(&element), shape(&from_xml(&xml).unwrap()));
        assert_eq!(element.children[1].attributes[0].location.position.to_string(), "5:10");
    }

    #[test]
    fn a_key_in_lower_case_without_a_value_is_an_empty_attribute() {
        let yaml = text("A:\n  name:\n  B:\n");
        let Kind::Map(entries) = from_yaml(&yaml).unwrap().kind else { panic!() };
        let element = from_values(&yaml, &entries[0]).unwrap();
        assert_eq!(shape(&element), "(A A name=\"\" A/@name (B A/B ))");
    }

    #[test]
    fn a_list_within_a_list_is_refused() {
        let yaml = text("A:\n  B:\n    - [1]\n");
        let Kind::Map(entries) = from_yaml(&yaml).unwrap().kind else { panic!() };
        let refused = from_values(&yaml, &entries[0]).unwrap_err();
        assert!(refused.to_string().contains("a:3:7: B is a list within a list"), "{refused}");
    }
}
