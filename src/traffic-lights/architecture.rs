//! The generations of Autoware and their messages (docs/spec/traffic-lights.md, "Architectures").

use super::quirks::LightQuirks;

const PREFIX: &str = "awf/universe/";
/// The generation with `TrafficSignalArray`.
const SIGNALS: u32 = 20_230_906;
/// The first generation with `TrafficLightGroupArray`.
const GROUPS: u32 = 20_240_605;

/// The type of a message with traffic lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LightsType {
    /// `traffic_simulator_msgs/msg/TrafficLightArrayV1`, for
    /// [`LightsContent::Lights`](super::emission::LightsContent::Lights).
    ArrayV1,
    /// `autoware_perception_msgs/msg/TrafficSignalArray`, for
    /// [`LightsContent::Groups`](super::emission::LightsContent::Groups).
    SignalArray,
    /// `autoware_perception_msgs/msg/TrafficLightGroupArray`, for
    /// [`LightsContent::Groups`](super::emission::LightsContent::Groups).
    GroupArray,
    /// `visualization_msgs/msg/MarkerArray`, for
    /// [`LightsContent::Markers`](super::emission::LightsContent::Markers).
    MarkerArray,
    /// `rosgraph_msgs/msg/Clock`, for [`LightsContent::Clock`](super::emission::LightsContent::Clock).
    Clock,
}

/// The generation of Autoware that a configuration names, for example `awf/universe/20240605`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Architecture {
    text: String,
    generation: Generation,
}

/// Generations by their messages, including those that only upstream accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Generation {
    /// `awf/universe` without a date.
    Undated,
    /// Sorts before the first supported generation.
    Older,
    Signals,
    /// Sorts between the two supported generations.
    Between,
    Groups,
}

/// The reason why an architecture, or one of its topics, is refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum ArchitectureError {
    #[error(
        "architecture `{0}` is not of the form `{PREFIX}<yyyymmdd>`; use `{PREFIX}20240605`, for example"
    )]
    Malformed(String),
    #[error("architecture `{0}` is not supported; use `{PREFIX}20230906`, or `{PREFIX}20240605` or later")]
    Unsupported(String),
    /// A semantic error of upstream.
    #[error("architecture `{0}` has no message for traffic lights")]
    Semantic(String),
    /// An invalid argument of upstream.
    #[error("architecture `{0}` is not an argument for a traffic-light detector")]
    InvalidArgument(String),
}

impl Architecture {
    /// Parses an architecture by its date, or in upstream mode by string order (Q18), which accepts any text
    /// and refuses topics instead.
    pub fn parse(text: &str, quirks: impl Into<LightQuirks>) -> Result<Self, ArchitectureError> {
        let generation = if quirks.into().sorts_architectures { sorted(text) } else { dated(text)? };
        Ok(Self { text: text.to_owned(), generation })
    }

    /// Returns the message type of the camera topic.
    pub fn camera(&self) -> Result<LightsType, ArchitectureError> {
        match self.generation {
            Generation::Signals => Ok(LightsType::SignalArray),
            Generation::Groups => Ok(LightsType::GroupArray),
            Generation::Undated => Err(ArchitectureError::Semantic(self.text.clone())),
            Generation::Older | Generation::Between => {
                Err(ArchitectureError::InvalidArgument(self.text.clone()))
            }
        }
    }

    /// Returns the message type of the V2I topics.
    pub fn v2i(&self) -> Result<LightsType, ArchitectureError> {
        match self.generation {
            Generation::Signals | Generation::Older => Ok(LightsType::SignalArray),
            Generation::Groups => Ok(LightsType::GroupArray),
            Generation::Undated | Generation::Between => Err(ArchitectureError::Semantic(self.text.clone())),
        }
    }
}

fn dated(text: &str) -> Result<Generation, ArchitectureError> {
    match text.strip_prefix(PREFIX).and_then(date) {
        None => Err(ArchitectureError::Malformed(text.to_owned())),
        Some(SIGNALS) => Ok(Generation::Signals),
        Some(GROUPS..) => Ok(Generation::Groups),
        Some(_) => Err(ArchitectureError::Unsupported(text.to_owned())),
    }
}

/// Parses `yyyymmdd` as a number, if it can be a date.
fn date(digits: &str) -> Option<u32> {
    let is_date = digits.len() == 8 && digits.bytes().all(|byte| byte.is_ascii_digit());
    let date: u32 = digits.parse().ok().filter(|_| is_date)?;
    let (month, day) = (date / 100 % 100, date % 100);
    ((1..=12).contains(&month) && (1..=31).contains(&day)).then_some(date)
}

fn sorted(text: &str) -> Generation {
    match text {
        "awf/universe" => Generation::Undated,
        "awf/universe/20230906" => Generation::Signals,
        older if older < "awf/universe/20230906" => Generation::Older,
        between if between < "awf/universe/20240605" => Generation::Between,
        _ => Generation::Groups,
    }
}
