//! Names of variants as serde writes them: one derive supplies JSON, labels, texts and files.

use serde::de::IntoDeserializer as _;
use serde::de::value::{Error, StrDeserializer};
use serde::{Deserialize, Serialize};

/// Returns the name of a variant, without its content; empty if the type is not an enum.
pub fn variant_name(value: &impl Serialize) -> &'static str {
    serde_variant::to_variant_name(value).unwrap_or_default()
}

/// Returns the variant with this name; `None` if there is none or it has content.
pub fn variant<'a, T: Deserialize<'a>>(name: &'a str) -> Option<T> {
    let name: StrDeserializer<'a, Error> = name.into_deserializer();
    T::deserialize(name).ok()
}

/// Returns the name of a variant with blanks between its words.
pub fn words(value: &impl Serialize) -> String {
    variant_name(value).replace('_', " ")
}

/// Words for the constants of messages that no one would say as they are.
const STATE_WORDS: [(&str, &str); 7] = [
    ("DISABLE", "off"),
    ("ENABLE", "on"),
    ("ENABLE_LEFT", "left"),
    ("ENABLE_RIGHT", "right"),
    ("OPENED", "open"),
    ("AUTONOMOUS_STEER_ONLY", "autonomous, steering only"),
    ("AUTONOMOUS_VELOCITY_ONLY", "autonomous, speed only"),
];

/// Returns the word for a state that people read on every screen, e.g. `left` for `ENABLE_LEFT`.
pub fn state_word(state: &impl Serialize) -> String {
    let constant = variant_name(state);
    let word = STATE_WORDS.iter().find(|(name, _)| *name == constant);
    word.map_or_else(|| words(state).to_lowercase(), |(_, word)| (*word).to_owned())
}

/// Implements `Display` with [`variant_name`].
#[macro_export]
macro_rules! display_by_name {
    ($($type:ty),+) => {$(
        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad($crate::names::variant_name(self))
            }
        }
    )+};
}
pub use display_by_name;

/// Implements `name` with [`variant_name`].
#[macro_export]
macro_rules! named_by_variant {
    ($($type:ty),+) => {$(
        impl $type {
            /// Returns the name of the variant as serde writes it.
            pub fn name(self) -> &'static str {
                $crate::names::variant_name(&self)
            }
        }
    )+};
}
pub use named_by_variant;

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Kind {
        NoContent,
        Number(i32),
    }
    display_by_name!(Kind);

    #[derive(Serialize)]
    #[serde(rename_all = "SCREAMING_SNAKE_CASE")]
    enum Constant {
        EnableLeft,
        NotReady,
    }

    #[test]
    fn state_has_its_word_or_its_own_name_in_small_letters() {
        assert_eq!(state_word(&Constant::EnableLeft), "left");
        assert_eq!(state_word(&Constant::NotReady), "not ready");
    }

    #[test]
    fn names_are_written_and_read_as_in_json() {
        assert_eq!(
            (variant_name(&Kind::NoContent), variant_name(&Kind::Number(3))),
            ("no_content", "number")
        );
        assert_eq!(variant("no_content"), Some(Kind::NoContent));
        assert_eq!((variant::<Kind>("number"), variant::<Kind>("nothing")), (None, None));
        assert_eq!(format!("{:<12}|", Kind::NoContent), "no_content  |");
    }
}
