//! What makes a decision another one: command, winner, reasons; not how far things are.

use std::mem::{Discriminant, discriminant};

use crate::core::turn_signal::decision::{Decision, Ground};
use crate::core::turn_signal::inputs::Finding;
use crate::core::turn_signal::manoeuvre::Remark;
use crate::core::turn_signal::resolve::{Case, Fate};
use crate::core::turn_signal::signal::{Hazard, Signal};
use crate::core::turn_signal::steady::Held;

/// A decision without its distances and ages.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Headline {
    turn: Signal,
    hazard: Hazard,
    ground: Discriminant<Ground>,
    case: Option<Case>,
    /// What each candidate asks for, and what became of it.
    candidates: Vec<(Signal, Fate)>,
    held: Option<Held>,
    remarks: Vec<Remark>,
    findings: Vec<Discriminant<Finding>>,
}

impl Headline {
    pub(super) fn of(decision: &Decision) -> Self {
        let (case, candidates) = match &decision.ground {
            Ground::Weighed(resolution) => {
                let candidates = resolution.weighed.iter().map(|weighed| (weighed.turn, weighed.fate));
                (resolution.case, candidates.collect())
            }
            Ground::Blind | Ground::Hazard | Ground::BehaviourAlone(_) => (None, Vec::new()),
        };
        Self {
            turn: decision.turn,
            hazard: decision.hazard,
            ground: discriminant(&decision.ground),
            case,
            candidates,
            held: decision.held,
            remarks: decision.remarks.clone(),
            findings: decision.findings.iter().map(discriminant).collect(),
        }
    }
}
