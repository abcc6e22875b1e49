//! Parameters and references to them.

use std::collections::BTreeMap;

use super::super::reader::listed;

/// The declared parameters, those of the innermost scope last.
#[derive(Debug, Default)]
pub(super) struct Parameters {
    scopes: Vec<BTreeMap<String, String>>,
}

impl Parameters {
    /// Opens a scope; [`Self::leave`] closes it.
    pub(super) fn enter(&mut self) {
        self.scopes.push(BTreeMap::new());
    }

    /// Closes the innermost scope.
    pub(super) fn leave(&mut self) {
        self.scopes.pop();
    }

    /// Adds a parameter to the innermost scope.
    pub(super) fn declare(&mut self, name: String, value: String) {
        if let Some(scope) = self.scopes.last_mut() {
            scope.insert(name, value);
        }
    }

    /// The text itself, or the value of the parameter it refers to: `$name`, `${name}`, `${$name}`.
    ///
    /// # Errors
    /// The reason and the remedy.
    pub(super) fn value(&self, text: &str) -> Result<String, (String, String)> {
        let Some(reference) = text.strip_prefix('$') else { return Ok(text.to_owned()) };
        if reference.starts_with('(') {
            let reason = "`$(…)` is replaced by the launch system";
            return Err((reason.to_owned(), "write its value".to_owned()));
        }
        let inner = reference.strip_prefix('{').and_then(|inner| inner.strip_suffix('}'));
        let name = inner.map_or(reference, str::trim);
        let name = name.strip_prefix('$').unwrap_or(name);
        if let Some(value) = self.scopes.iter().rev().find_map(|scope| scope.get(name)) {
            return Ok(value.clone());
        }
        let is_name = |char: char| char.is_alphanumeric() || char == '_' || char == '-';
        if name.is_empty() || !name.chars().all(is_name) {
            return Err((
                format!("{text:?} is an expression"),
                "write its value: nothing is computed".into(),
            ));
        }
        let known = listed(self.scopes.iter().flat_map(BTreeMap::keys).map(String::as_str));
        Err((format!("no parameter is called {name}"), known))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reference_is_the_value_of_the_innermost_scope() {
        let scope = |value: &str| BTreeMap::from([("light".to_owned(), value.to_owned())]);
        let parameters = Parameters { scopes: vec![scope("1"), scope("2")] };
        for text in ["$light", "${light}", "${ $light }", "2"] {
            assert_eq!(parameters.value(text), Ok("2".to_owned()), "{text}");
        }
        let refused = |text| parameters.value(text).unwrap_err();
        assert_eq!(refused("$dark"), ("no parameter is called dark".into(), "there are light, light".into()));
        assert!(refused("${$light + 1}").0.contains("is an expression"));
        assert!(refused("$(find-pkg-share x)").0.contains("launch system"));
    }
}
