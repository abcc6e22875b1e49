//! An OpenSCENARIO document during reading: attributes with replaced parameters.

use std::collections::BTreeMap;

use super::super::reader::ScenarioReader;
use super::parameters::{Declared, DeclaredParameter, ParameterScopes, is_name};
use crate::config::reading::{Attribute, Element, LocatedText, Position, Refusal};
use traffic_lights::compat::Compat;
use traffic_lights::scenario::TrafficSignalController;
use traffic_lights::variable::{Variable, VariableIndex, VariableValue};

const NUMBERS: [&str; 6] = ["integer", "int", "unsignedInt", "unsignedShort", "double", "float"];

pub(super) struct Document<'r, 'c> {
    pub(super) reader: &'r mut ScenarioReader<'c>,
    pub(super) parameters: ParameterScopes,
    /// Parameters of each element that can have parameters, by its position in the file.
    pub(super) scopes: BTreeMap<Position, BTreeMap<String, Declared>>,
    pub(super) variables: Vec<Variable>,
    pub(super) controllers: Vec<TrafficSignalController>,
    /// Reason why the map cannot be found, with the remedy.
    pub(super) unresolved_map: Option<String>,
}

impl Document<'_, '_> {
    /// Declares the parameters and variables of the document and of its storyboard, so that references find
    /// them regardless of their order. The document's scope stays open.
    pub(super) fn declare(&mut self, root: &Element) {
        self.declare_in(root, &[]);
        let variables = root.child("VariableDeclarations");
        for declaration in variables.into_iter().flat_map(|variables| variables.all("VariableDeclaration")) {
            let kind = declaration.attribute("variableType");
            let Some((name, value)) = self.declaration(declaration) else { continue };
            let variable = self.add_variable(&name, kind, &value);
            self.parameters.declare_variable(name, variable);
        }
        if let Some(storyboard) = root.child("Storyboard") {
            self.declare_below(storyboard, &["Story", "Act", "ManeuverGroup", "Maneuver"], &[]);
        }
    }

    fn declare_below(&mut self, parent: &Element, kinds: &[&str], path: &[String]) {
        let [kind, kinds @ ..] = kinds else { return };
        for element in parent.children.iter().filter(|child| child.name == *kind) {
            let name = element.attributes.iter().find(|attribute| attribute.name == "name");
            let path = [path, &[name.map(|name| name.value.clone()).unwrap_or_default()]].concat();
            self.declare_in(element, &path);
            self.declare_below(element, kinds, &path);
            self.leave();
        }
    }

    /// Opens the scope of an element and declares its parameters there.
    fn declare_in(&mut self, element: &Element, path: &[String]) {
        self.parameters.enter(BTreeMap::new());
        let declarations = element.children.iter().filter(|child| child.name == "ParameterDeclarations");
        for declarations in declarations {
            declarations.is_interpreted.set(true);
            for declaration in declarations.all("ParameterDeclaration") {
                let kind = declaration.attribute("parameterType").or_else(|| declaration.attribute("type"));
                if let Some((name, unknown)) = self.unknown_declaration(declaration) {
                    self.parameters.declare(path, name, Err(unknown));
                    continue;
                }
                let Some((name, value)) = self.declaration(declaration) else { continue };
                let variable = self.add_variable(&name, kind, &value);
                let given = declaration.attribute("value");
                let is_of_launch_system = given.is_some_and(|given| given.value.contains("$("));
                self.parameters.declare(
                    path,
                    name,
                    Ok(DeclaredParameter { value, is_of_launch_system, variable }),
                );
            }
        }
        self.scopes.insert(element.location.position, self.parameters.innermost());
    }

    /// Opens the scope of an element; [`Self::leave`] closes it.
    pub(super) fn enter(&mut self, element: &Element) {
        let scope = self.scopes.get(&element.location.position).cloned();
        self.parameters.enter(scope.unwrap_or_default());
    }

    /// Returns the name of a declaration whose value depends on a launch system or the choice of a run, with
    /// the reason. The declaration is listed, and refused where it is used.
    fn unknown_declaration(&mut self, element: &Element) -> Option<(String, Refusal)> {
        let value = element.attribute("value")?;
        let unknown = self.reader.modifiers.not_chosen_in(&value.value);
        let of_launch_system = || self.parameters.value(&value.value).err();
        let unknown = unknown.or_else(|| value.value.contains("$(").then(of_launch_system)?)?;
        let name = self.declared_name(element)?;
        self.reader.leave_out(&value.location, &format!("the value of {name:?}: {}", unknown.reason));
        Some((name, unknown))
    }

    fn declaration(&mut self, element: &Element) -> Option<(String, String)> {
        let (name, value) = (self.declared_name(element), self.required(element, "value"));
        Some((name?, value?.text))
    }

    /// Returns the name in a declaration. Some ASAM examples write it like a reference, with `$`, which
    /// upstream treats as a reference.
    fn declared_name(&mut self, element: &Element) -> Option<String> {
        let as_reference = element.attribute("name").and_then(|name| name.value.strip_prefix('$'));
        match as_reference.filter(|name| is_name(name) && self.reader.compat == Compat::Improved) {
            Some(name) => Some(name.to_owned()),
            None => self.required(element, "name").map(|given| given.text),
        }
    }

    /// Adds a variable of a type; if its value is not of this type, it is a text.
    fn add_variable(&mut self, name: &str, kind: Option<&Attribute>, value: &str) -> VariableIndex {
        let text = || VariableValue::Text(value.to_owned());
        let value = match kind.map(|kind| kind.value.as_str()) {
            Some("boolean") => VariableValue::Boolean(false).parse_as(value),
            Some(kind) if NUMBERS.contains(&kind) => VariableValue::Number(0.0).parse_as(value),
            Some(_) | None => None,
        };
        self.variables.push(Variable { name: name.to_owned(), value: value.unwrap_or_else(text) });
        VariableIndex(self.variables.len() - 1)
    }

    /// Finds the parameter or variable that an attribute names, with or without `$`.
    pub(super) fn variable(&mut self, element: &Element, name: &'static str) -> Option<VariableIndex> {
        let attribute = self.required_attribute(element, name)?;
        let named = attribute.value.trim_start_matches('$');
        let found = match name {
            "variableRef" => self.parameters.variable(named),
            _ => self.parameters.parameter(named).map(|parameter| parameter.variable),
        };
        self.accept(attribute, found)
    }

    fn required_attribute<'e>(&self, element: &'e Element, name: &str) -> Option<&'e Attribute> {
        let attribute = element.attribute(name);
        if attribute.is_none() {
            let reason = format!("the attribute {name} is missing");
            self.reader.refuse(&element.location, reason, "OpenSCENARIO requires it");
        }
        attribute
    }

    fn accept<T>(&self, attribute: &Attribute, result: Result<T, Refusal>) -> Option<T> {
        let refuse = |Refusal { reason, remedy }| self.reader.refuse(&attribute.location, reason, &remedy);
        result.map_err(refuse).ok()
    }

    /// Reads a value for a variable, of the kind that it has.
    pub(super) fn value_of(
        &mut self,
        variable: VariableIndex,
        given: &LocatedText,
    ) -> Option<(VariableIndex, VariableValue)> {
        let Variable { name, value } = self.variables.get(variable.0)?;
        let read = value.parse_as(&given.text);
        if read.is_none() {
            let kind = if matches!(value, VariableValue::Boolean(_)) { "true or false" } else { "a number" };
            let reason = format!("{name} is {kind}, and {:?} is not", given.text);
            self.reader.refuse(&given.location, reason, "give a value of the declared type");
        }
        Some((variable, read?))
    }

    pub(super) fn leave(&mut self) {
        self.parameters.leave();
    }

    /// Returns the attribute with its parameters replaced; `None` if it is missing or refused.
    pub(super) fn given(&mut self, element: &Element, name: &str) -> Option<LocatedText> {
        let attribute = element.attribute(name)?;
        let text = self.accept(attribute, self.value(&attribute.value))?;
        Some(LocatedText { text, location: attribute.location.clone() })
    }

    /// Returns the text with its references replaced.
    fn value(&self, text: &str) -> Result<String, Refusal> {
        match self.reader.modifiers.not_chosen_in(text) {
            Some(unknown) => Err(unknown),
            None => self.parameters.value(text),
        }
    }

    /// Returns the attribute like [`Self::given`], but refuses a missing one.
    pub(super) fn required(&mut self, element: &Element, name: &str) -> Option<LocatedText> {
        self.required_attribute(element, name)?;
        self.given(element, name)
    }

    /// Returns the attribute as a name, empty if it is missing.
    pub(super) fn name(&mut self, element: &Element) -> String {
        self.given(element, "name").map(|given| given.text).unwrap_or_default()
    }

    /// Returns the name of an element to which nothing refers: as written, if it cannot be read as a
    /// reference. Upstream refuses such a name.
    pub(super) fn label(&mut self, element: &Element) -> String {
        let written = element.attribute("name").filter(|_| self.reader.compat == Compat::Improved);
        match written.map(|name| (name, self.value(&name.value))) {
            Some((name, Err(_))) => name.value.clone(),
            Some((_, Ok(_))) | None => self.name(element),
        }
    }

    /// Refuses unknown attributes of a light's element: they are mistakes rather than parts to omit.
    pub(super) fn no_others(&mut self, element: &Element) {
        for attribute in element.attributes.iter().filter(|attribute| !attribute.is_interpreted.get()) {
            attribute.is_interpreted.set(true);
            let reason = format!("{} has no attribute {}", element.name, attribute.name);
            self.reader.refuse(&attribute.location, reason, "remove it, or correct its name");
        }
    }
}
