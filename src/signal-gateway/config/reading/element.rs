//! The elements of an OpenSCENARIO document in any notation.
//!
//! Reading an element or attribute marks it as interpreted. Elements and attributes that are never marked are
//! listed at the end.

use std::cell::Cell;

use super::location::Location;

#[derive(Debug)]
pub(crate) struct Element {
    /// The name without its namespace.
    pub(crate) name: String,
    pub(crate) location: Location,
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) children: Vec<Element>,
    /// Text between the tags, trimmed, which is read separately from the element.
    pub(crate) text: String,
    pub(crate) is_text_interpreted: Cell<bool>,
    pub(crate) is_interpreted: Cell<bool>,
}

#[derive(Debug)]
pub(crate) struct Attribute {
    pub(crate) name: String,
    pub(crate) value: String,
    /// Location of the value, not of the name.
    pub(crate) location: Location,
    pub(crate) is_interpreted: Cell<bool>,
}

impl Element {
    /// Returns the first child with a name; other children are not marked.
    pub(crate) fn child(&self, name: &str) -> Option<&Element> {
        let found = self.children.iter().find(|child| child.name == name)?;
        found.is_interpreted.set(true);
        Some(found)
    }

    pub(crate) fn all<'e>(&'e self, name: &'e str) -> impl Iterator<Item = &'e Element> {
        let named = self.children.iter().filter(move |child| child.name == name);
        named.inspect(|child| child.is_interpreted.set(true))
    }

    pub(crate) fn attribute(&self, name: &str) -> Option<&Attribute> {
        let found = self.attributes.iter().find(|attribute| attribute.name == name)?;
        found.is_interpreted.set(true);
        Some(found)
    }

    pub(crate) fn text(&self) -> &str {
        self.is_text_interpreted.set(true);
        &self.text
    }

    pub(crate) fn mark_all_interpreted(&self) {
        self.is_interpreted.set(true);
        self.is_text_interpreted.set(true);
        self.attributes.iter().for_each(|attribute| attribute.is_interpreted.set(true));
        self.children.iter().for_each(Element::mark_all_interpreted);
    }

    /// Returns true if everything in the element was interpreted, as in an empty element.
    pub(crate) fn is_all_interpreted(&self) -> bool {
        self.is_empty()
            || self.is_interpreted.get()
                && (self.is_text_interpreted.get() || self.text.is_empty())
                && self.attributes.iter().all(|attribute| attribute.is_interpreted.get())
                && self.children.iter().all(Element::is_all_interpreted)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.attributes.is_empty() && self.children.is_empty() && self.text.is_empty()
    }

    pub(crate) fn count(&self) -> usize {
        1 + self.children.iter().map(Element::count).sum::<usize>()
    }
}
