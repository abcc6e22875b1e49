//! Reasons why an action or a phase cannot be carried out.

/// The reason why an action or a phase cannot be carried out.
///
/// An external input is then refused and changes nothing. In a scenario it ends the scenario: improved mode
/// detects it when reading the scenario, upstream when running it (docs/spec/traffic-lights.md, "State text",
/// "Ids and groups" and "Actions and commands").
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ActionRefusal {
    /// The id is neither a head nor a group of the map.
    #[error("{0} is neither a signal head nor a group of the map")]
    UnknownId(i64),
    /// The state text has a mistake.
    #[error("the state \"{text}\" cannot be read: {mistake}")]
    State {
        /// The text as written.
        text: String,
        /// The mistake, as text.
        mistake: String,
    },
    /// The scenario has no controller at this position.
    #[error("there is no controller number {0}")]
    UnknownController(usize),
    /// The controller has no phase of this name.
    #[error("the controller \"{controller}\" has no phase \"{phase}\"")]
    UnknownPhase {
        /// Name of the controller.
        controller: String,
        /// The unknown name.
        phase: String,
    },
    /// A rate that is not from 0.001 to 1000 Hz.
    #[error("invalid rate {0} Hz: give 0.001 to 1000")]
    Rate(f64),
    /// A confidence that is not from 0 to 1.
    #[error("{0} is not a confidence: give 0 to 1")]
    Confidence(f64),
}
