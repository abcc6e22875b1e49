//! Lights and their stores as text: `34802`, `34802 v2i_detected`
//! (docs/spec/traffic-lights.md, "Signal ids").

use std::fmt;
use std::str::FromStr;

use super::target::{Channel, Layer, StoreId, Target};
use super::text::{excerpt, is_blank};

/// Why a text names no light.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SignalIdError {
    /// More than an id and a channel.
    #[error("`{found}` is more than an id and a channel, as in `34802 v2i`")]
    Format {
        /// The whole text; a very long one is cut.
        found: String,
    },
    /// The first part.
    #[error("`{found}` is not an id: a whole number of at most 64 bits, without blanks before it")]
    Id {
        /// The first part; a very long one is cut.
        found: String,
    },
    /// The second part.
    #[error("`{found}` is not a channel: conventional, conventional_detected, v2i or v2i_detected")]
    Channel {
        /// The second part; a very long one is cut.
        found: String,
    },
}

/// A way or relation id: the whole text, decimal, with or without a sign.
pub fn parse_id(text: &str) -> Result<i64, SignalIdError> {
    text.parse().map_err(|_| SignalIdError::Id { found: shown(text) })
}

impl Target {
    /// `<id>` or `<id> <channel>`; the id alone means the ground truth of the conventional channel.
    pub fn parse(text: &str) -> Result<Self, SignalIdError> {
        let Some(end) = text.find(is_blank) else {
            return Ok(Self { id: parse_id(text)?, store: StoreId::CONVENTIONAL });
        };
        let (id, rest) = text.split_at(end);
        let channel = rest.trim_start_matches(is_blank);
        if channel.contains(is_blank) {
            return Err(SignalIdError::Format { found: shown(text) });
        }
        // An empty part is refused by what stands in its place.
        let id = if id.is_empty() { text } else { id };
        let channel = if channel.is_empty() { rest } else { channel };
        Ok(Self { id: parse_id(id)?, store: channel.parse()? })
    }
}

/// As [`Target::parse`] reads it; the default store is not printed.
impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { id, store } = self;
        if *store == StoreId::CONVENTIONAL { write!(f, "{id}") } else { write!(f, "{id} {store}") }
    }
}

impl StoreId {
    /// What is meant when no channel is named.
    pub const CONVENTIONAL: Self = Self { channel: Channel::Conventional, layer: Layer::GroundTruth };
}

/// Reads one of the four channel names.
impl FromStr for StoreId {
    type Err = SignalIdError;

    fn from_str(name: &str) -> Result<Self, SignalIdError> {
        let (channel, layer) = match name.strip_suffix(DETECTED) {
            Some(channel) => (channel, Layer::Detected),
            None => (name, Layer::GroundTruth),
        };
        let error = |_| SignalIdError::Channel { found: shown(name) };
        Ok(Self { channel: channel.parse().map_err(error)?, layer })
    }
}

/// `v2i_detected`
impl fmt::Display for StoreId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let suffix = match self.layer {
            Layer::GroundTruth => "",
            Layer::Detected => DETECTED,
        };
        write!(f, "{}{suffix}", self.channel)
    }
}

/// `conventional` or `v2i`
impl FromStr for Channel {
    type Err = SignalIdError;

    fn from_str(name: &str) -> Result<Self, SignalIdError> {
        let found = Self::ALL.into_iter().find(|channel| channel.name() == name);
        found.ok_or_else(|| SignalIdError::Channel { found: shown(name) })
    }
}

/// `v2i`
impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

const DETECTED: &str = "_detected";

impl Channel {
    const fn name(self) -> &'static str {
        match self {
            Self::Conventional => "conventional",
            Self::V2i => "v2i",
        }
    }
}

fn shown(text: &str) -> String {
    excerpt(text).escape_debug().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn errors_name_the_part_that_is_wrong() {
        let id = |found: &str| SignalIdError::Id { found: found.to_owned() };
        let channel = |found: &str| SignalIdError::Channel { found: found.to_owned() };
        let format = |found: &str| SignalIdError::Format { found: found.to_owned() };
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
            assert_eq!(Target::parse(text), Err(error), "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn what_is_printed_is_read_back(id: i64, v2i: bool, detected: bool) {
            let channel = if v2i { Channel::V2i } else { Channel::Conventional };
            let layer = if detected { Layer::Detected } else { Layer::GroundTruth };
            let target = Target { id, store: StoreId { channel, layer } };
            prop_assert_eq!(Target::parse(&target.to_string()), Ok(target));
        }

        #[test]
        fn any_text_is_read_or_refused(text in "[0-9+v2i_dct \\PC\t-]{0,20}") {
            if let Ok(target) = Target::parse(&text) {
                prop_assert_eq!(Target::parse(&target.to_string()), Ok(target));
            }
        }
    }
}
