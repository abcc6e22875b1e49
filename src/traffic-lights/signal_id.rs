//! Lights and their stores as text: `34802`, `34802 v2i_detected`
//! (docs/spec/traffic-lights.md, "Signal ids").

use std::fmt;
use std::str::FromStr;

use super::target::{LightChannel, SignalTarget, StoreId, StoreLayer};
use super::text::{is_blank, printable};

/// The reason why a text is not the id of a light, with the faulty part, shortened if it is very long.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum SignalIdError {
    #[error("`{0}` is more than an id and a channel, as in `34802 v2i`")]
    Format(String),
    /// The part before the first blank is not an id.
    #[error("`{0}` is not an id: a whole number of at most 64 bits, without blanks before it")]
    Id(String),
    /// The part after the blanks is not the name of a store.
    #[error("`{0}` is not a channel: conventional, conventional_detected, v2i or v2i_detected")]
    Channel(String),
}

/// Parses a way or relation id: the whole text, decimal, with an optional sign.
pub fn parse_id(text: &str) -> Result<i64, SignalIdError> {
    text.parse().map_err(|_| SignalIdError::Id(printable(text)))
}

impl SignalTarget {
    /// Parses `<id>` or `<id> <channel>`; the id alone means the ground truth of the conventional channel.
    pub fn parse(text: &str) -> Result<Self, SignalIdError> {
        let Some(end) = text.find(is_blank) else {
            return Ok(Self { id: parse_id(text)?, store: StoreId::CONVENTIONAL });
        };
        let (id, rest) = text.split_at(end);
        let channel = rest.trim_start_matches(is_blank);
        if channel.contains(is_blank) {
            return Err(SignalIdError::Format(printable(text)));
        }
        // An empty part is shown in the error together with the adjacent blanks.
        let id = if id.is_empty() { text } else { id };
        let channel = if channel.is_empty() { rest } else { channel };
        Ok(Self { id: parse_id(id)?, store: channel.parse()? })
    }
}

/// Writes the format that [`SignalTarget::parse`] reads, without the default store.
impl fmt::Display for SignalTarget {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, store } = self;
        if *store == StoreId::CONVENTIONAL { write!(f, "{id}") } else { write!(f, "{id} {store}") }
    }
}

impl StoreId {
    /// Returns the name of the store in scenarios and configurations.
    pub const fn name(self) -> &'static str {
        match (self.channel, self.layer) {
            (LightChannel::Conventional, StoreLayer::GroundTruth) => "conventional",
            (LightChannel::Conventional, StoreLayer::Detected) => "conventional_detected",
            (LightChannel::V2i, StoreLayer::GroundTruth) => "v2i",
            (LightChannel::V2i, StoreLayer::Detected) => "v2i_detected",
        }
    }
}

impl FromStr for StoreId {
    type Err = SignalIdError;

    fn from_str(name: &str) -> Result<Self, SignalIdError> {
        let found = Self::ALL.into_iter().find(|store| store.name() == name);
        found.ok_or_else(|| SignalIdError::Channel(printable(name)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn errors_name_the_wrong_part() {
        let id = |found: &str| SignalIdError::Id(found.to_owned());
        let channel = |found: &str| SignalIdError::Channel(found.to_owned());
        let format = |found: &str| SignalIdError::Format(found.to_owned());
        let cases = [
            ("", id("")),
            (" 34802", id(" 34802")),
            ("34802.0", id("34802.0")),
            ("0x10 v2i", id("0x10")),
            ("9223372036854775808", id("9223372036854775808")),
            ("-", id("-")),
            ("34802 ", channel(" ")),
            ("34802 V2I", channel("V2I")),
            ("34802 _detected", channel("_detected")),
            ("34802 v2i_detected_detected", channel("v2i_detected_detected")),
            ("34802 v2i ", format("34802 v2i ")),
            ("one two three", format("one two three")),
        ];
        for (text, error) in cases {
            assert_eq!(SignalTarget::parse(text), Err(error), "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn printed_targets_are_read_back(id: i64, store in proptest::sample::select(&StoreId::ALL[..])) {
            let target = SignalTarget { id, store };
            prop_assert_eq!(SignalTarget::parse(&target.to_string()), Ok(target));
        }

        #[test]
        fn any_text_is_read_or_refused_without_a_panic(text in "[0-9+v2i_dct \\PC\t-]{0,20}") {
            if let Ok(target) = SignalTarget::parse(&text) {
                prop_assert_eq!(SignalTarget::parse(&target.to_string()), Ok(target));
            }
        }
    }
}
