//! The elements of an OpenSCENARIO document, whichever form it was written in.
//!
//! Reading an element or attribute marks it as interpreted. Those without the mark in the end are listed.

use std::cell::Cell;

use super::location::Location;

/// An element with its content.
#[derive(Debug)]
pub(in crate::config) struct Element {
    /// Name without namespace.
    pub(in crate::config) name: String,
    pub(in crate::config) location: Location,
    pub(in crate::config) attributes: Vec<Attribute>,
    pub(in crate::config) children: Vec<Element>,
    /// Text between the tags, trimmed.
    pub(in crate::config) content: Content,
    pub(in crate::config) is_interpreted: Cell<bool>,
}

/// Text between tags.
#[derive(Debug, Default)]
pub(in crate::config) struct Content {
    pub(in crate::config) text: String,
    pub(in crate::config) is_interpreted: Cell<bool>,
}

/// An attribute of an element.
#[derive(Debug)]
pub(in crate::config) struct Attribute {
    pub(in crate::config) name: String,
    pub(in crate::config) value: String,
    /// Location of the value.
    pub(in crate::config) location: Location,
    pub(in crate::config) is_interpreted: Cell<bool>,
}

impl Element {
    /// The first child with a name; others are not marked.
    pub(in crate::config) fn child(&self, name: &str) -> Option<&Element> {
        let found = self.children.iter().find(|child| child.name == name)?;
        found.is_interpreted.set(true);
        Some(found)
    }

    /// All children with a name.
    pub(in crate::config) fn all<'e>(&'e self, name: &'e str) -> impl Iterator<Item = &'e Element> {
        let named = self.children.iter().filter(move |child| child.name == name);
        named.inspect(|child| child.is_interpreted.set(true))
    }

    /// The attribute with a name.
    pub(in crate::config) fn attribute(&self, name: &str) -> Option<&Attribute> {
        let found = self.attributes.iter().find(|attribute| attribute.name == name)?;
        found.is_interpreted.set(true);
        Some(found)
    }

    /// The text between the tags.
    pub(in crate::config) fn text(&self) -> &str {
        self.content.is_interpreted.set(true);
        &self.content.text
    }

    /// Marks the element and everything in it as interpreted.
    pub(in crate::config) fn mark_all_interpreted(&self) {
        self.is_interpreted.set(true);
        self.content.is_interpreted.set(true);
        self.attributes.iter().for_each(|attribute| attribute.is_interpreted.set(true));
        self.children.iter().for_each(Element::mark_all_interpreted);
    }

    /// Returns whether everything in it was interpreted, which is so for an empty element.
    pub(in crate::config) fn is_all_interpreted(&self) -> bool {
        self.is_empty()
            || self.is_interpreted.get()
                && (self.content.is_interpreted.get() || self.content.text.is_empty())
                && self.attributes.iter().all(|attribute| attribute.is_interpreted.get())
                && self.children.iter().all(Element::is_all_interpreted)
    }

    /// Returns whether it has neither attributes nor text nor children.
    pub(in crate::config) fn is_empty(&self) -> bool {
        self.attributes.is_empty() && self.children.is_empty() && self.content.text.is_empty()
    }

    /// The number of elements in it, itself included.
    pub(in crate::config) fn count(&self) -> usize {
        1 + self.children.iter().map(Element::count).sum::<usize>()
    }
}
