//! Why an action or a phase could not be carried out.

/// An input from outside is refused with it and changes nothing. In a scenario it ends the scenario;
/// ours was checked when it was read, upstream finds out when it gets there
/// (docs/spec/traffic-lights.md, "State text", "Ids and groups" and "Actions and commands").
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The map does not know the id.
    #[error("{0} is neither a signal head nor a group of the map")]
    UnknownId(i64),
    /// The state text is wrong.
    #[error("the state \"{text}\" cannot be read: {mistake}")]
    State {
        /// As written.
        text: String,
        /// The mistake.
        mistake: String,
    },
    /// The scenario has no such controller.
    #[error("there is no controller number {0}")]
    UnknownController(usize),
    /// The controller has no such phase.
    #[error("the controller \"{controller}\" has no phase \"{phase}\"")]
    UnknownPhase {
        /// Name of the controller.
        controller: String,
        /// Name of the phase.
        phase: String,
    },
    /// Not a rate messages can be sent at.
    #[error("invalid rate {0} Hz: give 0.001 to 1000")]
    Rate(f64),
    /// Not a confidence.
    #[error("{0} is not a confidence: give 0 to 1")]
    Confidence(f64),
}
