//! Reasons why an action or a phase cannot be carried out.

/// The reason why an action or a phase cannot be carried out.
///
/// An external input is then refused and changes nothing. In a scenario it ends the scenario: improved mode
/// detects it when reading the scenario, upstream when running it (docs/spec/traffic-lights.md, "State text",
/// "Ids and groups" and "Actions and commands").
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum ActionRefusal {
    #[error("{0} is neither a signal head nor a group of the map")]
    UnknownId(i64),
    #[error("the state \"{text}\" cannot be read: {mistake}")]
    State { text: String, mistake: String },
    #[error("there is no controller number {0}")]
    UnknownController(usize),
    #[error("the controller \"{controller}\" has no phase \"{phase}\"")]
    UnknownPhase { controller: String, phase: String },
    #[error("invalid rate {0} Hz: give 0.001 to 1000")]
    Rate(f64),
    #[error("{0} is not a confidence: give 0 to 1")]
    Confidence(f64),
}
