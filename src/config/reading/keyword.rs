//! Values that TOML has words for, such as `source = "topic"`.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{DeserializeSeed, EnumAccess, Error, VariantAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A type with a word for each of its values.
pub(in crate::config) trait Keywords: Copy + 'static {
    /// The words, in the order a refusal lists them.
    const WORDS: &'static [&'static str];
    /// What each word means, in the same order.
    const VALUES: &'static [Self];
}

/// Gives a type its words: `keywords!(Transmit { "off" => Transmit::Off, "on" => Transmit::On });`
macro_rules! keywords {
    ($type:ty { $($word:literal => $value:expr),+ $(,)? }) => {
        impl $crate::config::reading::keyword::Keywords for $type {
            const WORDS: &'static [&'static str] = &[$($word),+];
            const VALUES: &'static [Self] = &[$($value),+];
        }
    };
}
pub(in crate::config) use keywords;

/// A value written as one of the words of its type. Any other word is refused with the list of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Keyword<T>(pub T);

impl<'de, T: Keywords> Deserialize<'de> for Keyword<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_enum("Keyword", T::WORDS, KeywordVisitor(PhantomData))
    }
}

struct KeywordVisitor<T>(PhantomData<T>);

impl<'de, T: Keywords> Visitor<'de> for KeywordVisitor<T> {
    type Value = Keyword<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "one of {}", T::WORDS.join(", "))
    }

    fn visit_enum<A: EnumAccess<'de>>(self, access: A) -> Result<Keyword<T>, A::Error> {
        let (value, variant) = access.variant_seed(self)?;
        variant.unit_variant()?;
        Ok(value)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Keyword<T>, E> {
        let value = T::WORDS.iter().zip(T::VALUES).find(|(word, _)| **word == text);
        value.map(|(_, value)| Keyword(*value)).ok_or_else(|| E::unknown_variant(text, T::WORDS))
    }
}

impl<'de, T: Keywords> DeserializeSeed<'de> for KeywordVisitor<T> {
    type Value = Keyword<T>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Keyword<T>, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}
