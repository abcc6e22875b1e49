//! An OpenSCENARIO document while it is read: attributes with their parameters replaced.

use super::super::reader::Reader;
use super::parameters::Parameters;
use crate::config::reading::checker::LocatedText;
use crate::config::reading::element::Element;
use crate::core::traffic_light::scenario::Controller;

/// A document while it is read.
pub(super) struct Document<'r, 'c> {
    pub(super) reader: &'r mut Reader<'c>,
    pub(super) parameters: Parameters,
    /// The controllers, which are read before the storyboard.
    pub(super) controllers: Vec<Controller>,
    /// The number of conditions so far that refer to elements of the storyboard.
    pub(super) references: usize,
}

impl Document<'_, '_> {
    /// Opens the scope of an element; [`Self::leave`] closes it.
    pub(super) fn enter(&mut self, element: &Element) {
        self.parameters.enter();
        let Some(declarations) = element.child("ParameterDeclarations") else { return };
        for declaration in declarations.all("ParameterDeclaration") {
            // The type follows from the use.
            let _ = declaration.attribute("parameterType").or_else(|| declaration.attribute("type"));
            let (name, value) = (self.required(declaration, "name"), self.required(declaration, "value"));
            let (Some(name), Some(value)) = (name, value) else { continue };
            self.parameters.declare(name.text, value.text);
        }
    }

    /// Closes the scope of an element.
    pub(super) fn leave(&mut self) {
        self.parameters.leave();
    }

    /// The attribute with its parameters replaced; `None` when it is missing or refused.
    pub(super) fn given(&mut self, element: &Element, name: &str) -> Option<LocatedText> {
        let attribute = element.attribute(name)?;
        match self.parameters.value(&attribute.value) {
            Ok(text) => Some(LocatedText { text, location: attribute.location.clone() }),
            Err((reason, remedy)) => {
                self.reader.refuse(&attribute.location, reason, &remedy);
                None
            }
        }
    }

    /// The attribute like [`Self::given`], refused when it is missing.
    pub(super) fn required(&mut self, element: &Element, name: &str) -> Option<LocatedText> {
        if element.attribute(name).is_none() {
            let reason = format!("the attribute {name} is missing");
            self.reader.refuse(&element.location, reason, "OpenSCENARIO requires it");
        }
        self.given(element, name)
    }

    /// The attribute as a name, empty when it is missing.
    pub(super) fn name(&mut self, element: &Element) -> String {
        self.given(element, "name").map(|given| given.text).unwrap_or_default()
    }

    /// Refuses unknown attributes of a light's element: they are mistakes, not something to leave out.
    pub(super) fn no_others(&mut self, element: &Element) {
        for attribute in element.attributes.iter().filter(|attribute| !attribute.is_interpreted.get()) {
            attribute.is_interpreted.set(true);
            let reason = format!("{} has no attribute {}", element.name, attribute.name);
            self.reader.refuse(&attribute.location, reason, "remove it, or correct its name");
        }
    }
}
