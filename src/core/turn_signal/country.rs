//! The traffic law of a country about turn signals, as parameters (weakness W14).

use super::junction::LegalDistance;
use super::parameters::DeciderParameters;

/// The rules of one country.
#[derive(Debug, Clone, PartialEq)]
pub struct Country {
    /// Its ISO 3166 code.
    pub code: String,
    /// Name of the law that the rules are taken from.
    pub source: String,
    /// The least distance over which a turn is announced, metres; `None` where the law says "in good time".
    pub turn_distance_m: Option<f64>,
    /// The deployed parameters with the rules in them.
    pub parameters: DeciderParameters,
}

impl Country {
    /// The least distance of a turn's signal with the law that demands it; `None` where the law gives none.
    pub fn legal_distance(&self) -> Option<LegalDistance> {
        let law = || format!("{}: {}", self.code, self.source);
        self.turn_distance_m.map(|least_m| LegalDistance { least_m, law: law() })
    }
}
