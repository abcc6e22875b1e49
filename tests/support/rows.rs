//! Tables in data files, written as lists of texts.

use serde::de::{Deserialize, Deserializer, Error};

/// Reads rows of `N` texts, no more and no less.
pub(crate) fn rows<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Vec<[String; N]>, D::Error> {
    let row = |row: Vec<String>| {
        row.try_into().map_err(|row| D::Error::custom(format!("expected {N} texts, found {row:?}")))
    };
    Vec::deserialize(deserializer)?.into_iter().map(row).collect()
}
