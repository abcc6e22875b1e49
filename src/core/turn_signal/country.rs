//! The traffic law of a country about turn signals, as parameters (weakness W14).

use super::parameters::Parameters;

/// The rules of one country.
#[derive(Debug, Clone, PartialEq)]
pub struct Country {
    /// Its ISO 3166 code.
    pub code: String,
    /// Name of the law that the rules are taken from.
    pub source: String,
    /// The deployed parameters with the rules in them.
    pub parameters: Parameters,
}
