//! Lights whose ids are texts, as in maps of `OpenDRIVE`.

use std::collections::BTreeMap;

use serde_json::Value;

/// Texts used as ids. The rest of the program only uses their numbers, which no map contains.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LightNames {
    numbers: BTreeMap<String, i64>,
    /// Texts by the offset of their numbers from the first number.
    texts: Vec<String>,
}

/// Number of the first text.
const FIRST: i64 = i64::MIN;

impl LightNames {
    /// Returns the number of a text; assigns one if it has none yet.
    pub(super) fn id_of(&mut self, text: &str) -> i64 {
        if let Some(id) = self.numbers.get(text) {
            return *id;
        }
        let id = FIRST.saturating_add(i64::try_from(self.texts.len()).unwrap_or(i64::MAX));
        self.numbers.insert(text.to_owned(), id);
        self.texts.push(text.to_owned());
        id
    }

    /// Returns the text of an id; `None` for a number.
    fn of(&self, id: i64) -> Option<&str> {
        self.texts.get(usize::try_from(id.checked_sub(FIRST)?).ok()?).map(String::as_str)
    }

    /// Replaces the numbers in a text for users by their texts.
    pub fn in_text(&self, text: &str) -> String {
        let mut shown = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('-').filter(|_| !self.texts.is_empty()) {
            let end = rest[at + 1..]
                .find(|char: char| !char.is_ascii_digit())
                .map_or(rest.len(), |end| at + 1 + end);
            let name = rest[at..end].parse().ok().and_then(|id| self.of(id));
            shown.push_str(&rest[..at]);
            shown.push_str(name.unwrap_or(&rest[at..end]));
            rest = &rest[end..];
        }
        shown + rest
    }

    /// Replaces the numbers in JSON by strings.
    pub fn in_json(&self, value: Value) -> Value {
        match value {
            _ if self.texts.is_empty() => value,
            Value::Number(number) => match number.as_i64().and_then(|id| self.of(id)) {
                Some(text) => text.into(),
                None => Value::Number(number),
            },
            Value::String(text) => self.in_text(&text).into(),
            Value::Array(items) => items.into_iter().map(|item| self.in_json(item)).collect(),
            Value::Object(fields) => {
                fields.into_iter().map(|(key, value)| (self.in_text(&key), self.in_json(value))).collect()
            }
            Value::Null | Value::Bool(_) => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn numbers_of_texts_are_shown_as_their_texts() {
        let mut names = LightNames::default();
        let [a, b] = ["stop-line A", "11b"].map(|text| names.id_of(text));
        assert_eq!((names.id_of("stop-line A"), a != b), (a, true));
        assert_eq!(
            names.in_text(&format!("{a}: red; {b}: - ; -5 v2i {a}")),
            "stop-line A: red; 11b: - ; -5 v2i stop-line A"
        );
        let fields = json!({ format!("{b}"): [a, 7, 1.5, null], "does": format!("set {a} to red") });
        assert_eq!(
            names.in_json(fields),
            json!({ "11b": ["stop-line A", 7, 1.5, null], "does": "set stop-line A to red" })
        );
        assert_eq!(LightNames::default().in_text("-1 - x"), "-1 - x");
    }
}
