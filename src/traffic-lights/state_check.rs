//! Rules for writing states (docs/spec/traffic-lights.md, "Unknown states").

use super::quirks::LightQuirks;
use super::scenario::StateText;
use super::target::{StoreId, StoreLayer};
use super::text::printable;

/// The writer of a state. States received on topics or over CAN are not checked, so they are not included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StateWriter {
    /// A phase of a controller.
    PhaseEntry,
    /// An action of a scenario or a command.
    Action,
}

/// The reason why a state must not be written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // the texts say it
pub enum StateError {
    #[error("state `{text}`: {mistake}", text = printable(text))]
    Mistake { text: String, mistake: String },
    #[error(
        "state `{text}`: `unknown` is what a pipeline reports, so it can be written to `{store}_detected` but \
         not to `{store}`",
        text = printable(text)
    )]
    Reserved { text: String, store: StoreId },
}

/// Refuses a state with a mistake, which upstream detects when applying the state (Q20), and `unknown`
/// anywhere in a state of a ground truth, which upstream permits in actions (Q8).
pub fn check_state(
    store: StoreId,
    state: &StateText,
    writer: StateWriter,
    quirks: impl Into<LightQuirks>,
) -> Result<(), StateError> {
    let (quirks, text) = (quirks.into(), || state.text.clone());
    if let Some(mistake) = state.mistake.as_ref().filter(|_| !quirks.finds_mistakes_late) {
        return Err(StateError::Mistake { text: text(), mistake: mistake.clone() });
    }
    let is_checked = writer == StateWriter::PhaseEntry || !quirks.allows_unknown;
    if is_checked && store.layer == StoreLayer::GroundTruth && state.text.contains("unknown") {
        return Err(StateError::Reserved { text: text(), store });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compat::Compat;
    use crate::target::LightChannel;

    /// docs/spec/traffic-lights.md, "Unknown states": every row of its table except the last, for both
    /// channels.
    #[test]
    fn unknown_is_for_detected_states() {
        use Compat::{Improved, Upstream};
        use StateWriter::{Action, PhaseEntry};
        use StoreLayer::{Detected, GroundTruth};
        let cases = [
            (PhaseEntry, GroundTruth, Upstream, false),
            (PhaseEntry, GroundTruth, Improved, false),
            (PhaseEntry, Detected, Upstream, true),
            (PhaseEntry, Detected, Improved, true),
            (Action, GroundTruth, Upstream, true),
            (Action, GroundTruth, Improved, false),
            (Action, Detected, Upstream, true),
            (Action, Detected, Improved, true),
        ];
        for (writer, layer, compat, allowed) in cases {
            for channel in LightChannel::ALL {
                let store = StoreId { channel, layer };
                let checked = |text| check_state(store, &StateText::new(text), writer, compat);
                assert_eq!(checked("red, green unknown").is_ok(), allowed, "{writer:?} {store} {compat:?}");
                assert_eq!(checked("red"), Ok(()));
                assert_eq!(checked("blue").is_ok(), compat == Upstream);
            }
        }
    }

    #[test]
    fn a_refusal_names_the_store_that_allows_unknown() {
        let state = StateText::new("unknown");
        let error = check_state(StoreId::V2I, &state, StateWriter::Action, Compat::Improved).unwrap_err();
        assert!(error.to_string().contains("written to `v2i_detected` but not to `v2i`"), "{error}");
    }
}
