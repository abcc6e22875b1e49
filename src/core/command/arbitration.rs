//! What is asked of the vehicle now: hazard before turn, within what the control mode grants, without
//! fighting the driver, and with a defined state when a sender falls silent.

use super::Turn;
use super::control_mode::{Grants, Mode};
use super::intake::Opinion;

/// What is asked of the vehicle with authority; `None` = this function is left to the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Demand {
    /// Turn indicators.
    pub turn: Option<Turn>,
    /// Hazard lights, `true` = on.
    pub hazard: Option<bool>,
}

/// What is wanted instead, when a sender that wanted something has fallen silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum WhenSilent {
    /// Its lights off.
    #[default]
    Off,
    /// What it wanted last.
    Hold,
    /// Hazard lights on.
    Hazard,
}

/// What the vehicle is asked for in the last frames before the gateway ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum AtStop {
    /// Nothing: authority is given back.
    #[default]
    Release,
    /// Lights off.
    Off,
    /// Hazard lights on.
    Hazard,
}

/// What does not change while the gateway runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Rules {
    /// When the turn command falls silent.
    pub turn_silent: WhenSilent,
    /// When the hazard command falls silent.
    pub hazard_silent: WhenSilent,
    /// At the end.
    pub at_stop: AtStop,
}

/// Everything that decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Situation {
    /// Of the turn command.
    pub turn: Opinion<Turn>,
    /// Of the hazard command.
    pub hazard: Opinion<bool>,
    /// The control mode.
    pub mode: Mode,
    /// Functions the driver has taken.
    pub driver: Grants,
    /// Whether the hazard lights may be the driver's for all that is known.
    pub hazard_unproven: bool,
    /// Whether the gateway is about to end.
    pub stopping: bool,
}

/// Why a function is asked for what it is, or for nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Why {
    /// The command says so.
    Commanded,
    /// The hazard lights are on, which come before turn indicators.
    HazardFirst,
    /// The command has fallen silent, and this is the state for that.
    Silent,
    /// Nothing is wanted.
    NoOpinion,
    /// No command has come since start.
    NeverCommanded,
    /// The control mode does not allow it.
    NotGranted,
    /// The driver does something else.
    Driver,
    /// No report says whether the hazard lights are on, and so perhaps the driver's.
    Unproven,
    /// The gateway is about to end.
    Stopping,
}

/// What is asked for, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Decision {
    /// What goes into the frames.
    pub demand: Demand,
    /// The same before the driver had a say: what the report is held against.
    pub wanted: Demand,
    /// About the turn indicators.
    pub turn: Why,
    /// About the hazard lights.
    pub hazard: Why,
}

impl Why {
    /// For people.
    pub fn text(self) -> &'static str {
        match self {
            Self::Commanded => "as commanded",
            Self::HazardFirst => "hazard lights come first",
            Self::Silent => "the command has fallen silent",
            Self::NoOpinion => "no opinion",
            Self::NeverCommanded => "no command yet",
            Self::NotGranted => "not allowed in this control mode",
            Self::Driver => "left to the driver",
            Self::Unproven => "no report says whether they are on",
            Self::Stopping => "the gateway ends",
        }
    }
}

/// Decides.
pub fn arbitrate(rules: Rules, situation: &Situation) -> Decision {
    let (mut turn, mut turn_why) = wish(situation.turn, |last| match rules.turn_silent {
        WhenSilent::Hold => last,
        WhenSilent::Off | WhenSilent::Hazard => Turn::Off,
    });
    let (mut hazard, mut hazard_why) = wish(situation.hazard, |last| match rules.hazard_silent {
        WhenSilent::Hold => last,
        WhenSilent::Off => false,
        WhenSilent::Hazard => true,
    });
    if rules.turn_silent == WhenSilent::Hazard && turn_why == Why::Silent {
        (hazard, hazard_why) = (Some(true), Why::Silent);
    }
    if situation.stopping {
        (turn, hazard) = match rules.at_stop {
            AtStop::Release => (None, None),
            AtStop::Off => (Some(Turn::Off), Some(false)),
            AtStop::Hazard => (Some(Turn::Off), Some(true)),
        };
        (turn_why, hazard_why) = (Why::Stopping, Why::Stopping);
    }
    let grants = situation.mode.grants();
    if !grants.turn {
        (turn, turn_why) = (None, Why::NotGranted);
    }
    if !grants.hazard {
        (hazard, hazard_why) = (None, Why::NotGranted);
    }
    if hazard == Some(true) && turn.is_some() {
        (turn, turn_why) = (Some(Turn::Off), Why::HazardFirst);
    }
    let wanted = Demand { turn, hazard };
    let mut demand = wanted;
    if situation.driver.turn && demand.turn.is_some() {
        (demand.turn, turn_why) = (None, Why::Driver);
    }
    // On is safe whoever wants it: only an off gives way.
    if demand.hazard == Some(false) {
        if situation.driver.hazard {
            (demand.hazard, hazard_why) = (None, Why::Driver);
        } else if situation.hazard_unproven {
            (demand.hazard, hazard_why) = (None, Why::Unproven);
        }
    }
    Decision { demand, wanted, turn: turn_why, hazard: hazard_why }
}

/// What an opinion comes to; `silent` = what to make of the last wish of a sender that fell silent.
fn wish<T>(opinion: Opinion<T>, silent: impl FnOnce(T) -> T) -> (Option<T>, Why) {
    match opinion {
        Opinion::Never => (None, Why::NeverCommanded),
        Opinion::None | Opinion::Silent(None) => (None, Why::NoOpinion),
        Opinion::Wanted(wish) => (Some(wish), Why::Commanded),
        Opinion::Silent(Some(last)) => (Some(silent(last)), Why::Silent),
    }
}
