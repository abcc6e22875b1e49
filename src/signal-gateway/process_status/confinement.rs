//! Confinement of the network process as reported in diagnostics.

use std::collections::BTreeMap;

use ros_transport::link::{Layer, Layers};

/// The confinement of a network process.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Confinement {
    /// Layers that this system does not support or has refused.
    pub missing: Layers,
    /// Refused system calls, with their counts.
    pub refused: BTreeMap<&'static str, u64>,
}

impl Confinement {
    /// Returns the missing layers as text.
    pub fn layers(&self) -> String {
        let missing = Layer::ALL.into_iter().filter(|layer| self.missing.contains(*layer));
        let missing: Vec<_> = missing.map(|layer| layer.to_string()).collect();
        if missing.is_empty() { "complete".to_owned() } else { format!("without {}", missing.join(", ")) }
    }

    /// Returns the refused calls as text.
    pub fn refused_calls(&self) -> String {
        let refused: Vec<_> = self.refused.iter().map(|(name, count)| format!("{name} {count}")).collect();
        if refused.is_empty() { "none".to_owned() } else { refused.join(", ") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_complete_and_what_was_refused_is_said() {
        let mut confinement = Confinement::default();
        assert_eq!((confinement.layers(), confinement.refused_calls()), ("complete".into(), "none".into()));
        confinement.missing = [Layer::CallNames, Layer::Landlock].into_iter().collect();
        confinement.refused = BTreeMap::from([("socket", 1), ("openat", 3)]);
        assert_eq!(confinement.layers(), "without all of Landlock, names of refused calls");
        assert_eq!(confinement.refused_calls(), "openat 3, socket 1");
        for layer in Layer::ALL {
            confinement.missing = [layer].into_iter().collect();
            assert_eq!(confinement.layers(), format!("without {layer}"));
        }
    }
}
