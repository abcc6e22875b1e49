//! Commands to the vehicle: what Autoware or the decider wants, what may be asked of the vehicle now,
//! the frames that ask for it, and whether the vehicle obeys
//! (docs/spec/vehicle-interface.md, "Arbitration of commands").
//!
//! Vocabulary: a *word* is what a sender says; an *opinion* is what is left of its words now; a
//! *grant* is what the control mode lets through; a *request* is what is asked of the vehicle with
//! authority; the *compliance* is how the vehicle's report stands to it.

pub mod allow_list;
pub mod arbitration;
pub mod control_mode;
pub mod feedback_monitor;
pub mod flow;
pub mod input;
pub mod intake;
pub mod message;
pub mod output;
pub mod patch;
pub mod push_button;
pub mod sender;
pub mod settings;
mod stale_message_filter;
mod status;

/// What can be asked of the turn indicators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Turn {
    /// Neither side.
    #[default]
    Off,
    /// Left.
    Left,
    /// Right.
    Right,
}

impl Turn {
    /// For people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// Hazard lights for people: `true` = on.
pub(crate) fn hazard_name(on: bool) -> &'static str {
    if on { "on" } else { "off" }
}

/// What the vehicle's lights do, as the gateway's own reports say; `None` = unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Reported {
    /// Turn indicators.
    pub turn: Option<Turn>,
    /// Hazard lights, `true` = on.
    pub hazard: Option<bool>,
}
