//! The elements of an OpenSCENARIO document, whichever form it was written in.
//!
//! Whoever reads an element or attribute marks it as seen. What nobody has seen in the end was not
//! interpreted, and is told.

mod transliterated;
mod xml;

pub(super) use transliterated::from_values;
pub(super) use xml::from_xml;

use std::cell::Cell;

use crate::config::values::place::Spot;

/// An element with what stands in it.
#[derive(Debug)]
pub(super) struct Element {
    /// Without namespace.
    pub(super) name: String,
    pub(super) spot: Spot,
    pub(super) attributes: Vec<Attribute>,
    pub(super) children: Vec<Element>,
    /// Text between the tags, trimmed.
    pub(super) content: Content,
    pub(super) is_seen: Cell<bool>,
}

/// Text between tags.
#[derive(Debug, Default)]
pub(super) struct Content {
    pub(super) text: String,
    pub(super) is_seen: Cell<bool>,
}

/// An attribute of an element.
#[derive(Debug)]
pub(super) struct Attribute {
    pub(super) name: String,
    pub(super) value: String,
    /// Of the value.
    pub(super) spot: Spot,
    pub(super) is_seen: Cell<bool>,
}

impl Element {
    /// The first child of that name. Others are left unseen.
    pub(super) fn child(&self, name: &str) -> Option<&Element> {
        let found = self.children.iter().find(|child| child.name == name)?;
        found.is_seen.set(true);
        Some(found)
    }

    /// All children of that name.
    pub(super) fn all<'e>(&'e self, name: &'e str) -> impl Iterator<Item = &'e Element> {
        let named = self.children.iter().filter(move |child| child.name == name);
        named.inspect(|child| child.is_seen.set(true))
    }

    /// The attribute of that name.
    pub(super) fn attribute(&self, name: &str) -> Option<&Attribute> {
        let found = self.attributes.iter().find(|attribute| attribute.name == name)?;
        found.is_seen.set(true);
        Some(found)
    }

    /// The text between the tags.
    pub(super) fn text(&self) -> &str {
        self.content.is_seen.set(true);
        &self.content.text
    }

    /// Marks it and all that stands in it as seen.
    pub(super) fn see_all(&self) {
        self.is_seen.set(true);
        self.content.is_seen.set(true);
        self.attributes.iter().for_each(|attribute| attribute.is_seen.set(true));
        self.children.iter().for_each(Element::see_all);
    }

    /// Whether all of it was seen, but for elements that say nothing.
    pub(super) fn is_all_seen(&self) -> bool {
        self.says_nothing()
            || self.is_seen.get()
                && (self.content.is_seen.get() || self.content.text.is_empty())
                && self.attributes.iter().all(|attribute| attribute.is_seen.get())
                && self.children.iter().all(Element::is_all_seen)
    }

    /// It has neither attributes nor text nor children.
    pub(super) fn says_nothing(&self) -> bool {
        self.attributes.is_empty() && self.children.is_empty() && self.content.text.is_empty()
    }

    /// How many elements it is, itself included.
    pub(super) fn count(&self) -> usize {
        1 + self.children.iter().map(Element::count).sum::<usize>()
    }
}
