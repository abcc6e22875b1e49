//! From readings to one verdict a report: publish this state, or withhold it for that reason.
//!
//! This is the one place where the four fates of a value collapse into a report
//! (vehicle-interface sections 1.3 and 4.2).

use super::binding::{
    BothOn, FaultBinding, HazardBinding, HazardCode, LightsBinding, OnFault, Role, SignalIndex, TurnBinding,
    TurnCode, TurnWhileHazard,
};
use super::meaning::Meaning;
use super::observation::{Absence, Observations, Reading};
use crate::core::bus::{Bus, Received};
use crate::core::time::Now;

/// `TurnIndicatorsReport.report`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TurnIndicators {
    /// DISABLE, 1.
    Disable,
    /// `ENABLE_LEFT`, 2.
    EnableLeft,
    /// `ENABLE_RIGHT`, 3.
    EnableRight,
}

/// `HazardLightsReport.report`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HazardLights {
    /// DISABLE, 1.
    Disable,
    /// ENABLE, 2.
    Enable,
}

impl TurnIndicators {
    /// The constant's name in the `.msg` file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disable => "DISABLE",
            Self::EnableLeft => "ENABLE_LEFT",
            Self::EnableRight => "ENABLE_RIGHT",
        }
    }
}

impl HazardLights {
    /// The constant's name in the `.msg` file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disable => "DISABLE",
            Self::Enable => "ENABLE",
        }
    }
}

/// Why a state is not published.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doubt {
    /// The profile binds no signal that could tell.
    Unbound,
    /// Unknown: no believable value of this signal.
    Absent(SignalIndex, Absence),
    /// Unknown: the vehicle says "not available", with this raw value.
    NotAvailable(SignalIndex, i128),
    /// Invalid: the profile gives this raw value no meaning.
    Undefined(SignalIndex, i128),
    /// Invalid: left and right are on at once, which the profile calls undefined.
    BothOn([(SignalIndex, i128); 2]),
    /// The value itself says "fault".
    Fault(SignalIndex, i128),
}

/// A fault signal that is on: the signal and its position in the [`FaultBinding`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ActiveFault {
    /// The signal.
    pub signal: SignalIndex,
    /// Its raw value.
    pub raw: i128,
    /// Position of its text.
    pub index: usize,
}

/// What is known of one report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdict<T> {
    /// The state and when it was received, or why there is none.
    pub state: Result<(T, Received), Doubt>,
    /// A fault the vehicle reports beside the state; the first one in the profile's order.
    pub fault: Option<ActiveFault>,
    /// What to publish: the state unless in doubt, or withheld for the fault.
    pub publish: Option<(T, Received)>,
    /// Reason code of a hazard signal, for diagnostics.
    pub reason: Option<u8>,
}

/// Both verdicts at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdicts {
    /// Turn indicators.
    pub turn: Verdict<TurnIndicators>,
    /// Hazard lights.
    pub hazard: Verdict<HazardLights>,
}

/// Judges both reports now.
pub fn judge(binding: &LightsBinding, seen: &Observations, buses: &[Bus], now: Now) -> Verdicts {
    let bench = Bench { binding, seen, buses, now };
    let sides = bench.sides();
    let (hazard_state, reason) = bench.hazard(&sides);
    let turn_state = sides.map(|(code, received)| {
        let hazard_on = match hazard_state {
            Ok((HazardLights::Enable, since)) => Some(since),
            Ok((HazardLights::Disable, _)) | Err(_) => None,
        };
        match (binding.turn_while_hazard, hazard_on) {
            (TurnWhileHazard::Disable, Some(since)) => (TurnIndicators::Disable, received.newest(since)),
            (TurnWhileHazard::Keep, _) | (TurnWhileHazard::Disable, None) => (turn_of(code), received),
        }
    });
    Verdicts {
        turn: bench.with_faults(turn_state, &binding.turn_faults, None),
        hazard: bench.with_faults(hazard_state, &binding.hazard_faults, reason),
    }
}

/// Both sides on is hazard; the turn indicators then show no direction.
fn turn_of(code: TurnCode) -> TurnIndicators {
    match code {
        TurnCode::Left => TurnIndicators::EnableLeft,
        TurnCode::Right => TurnIndicators::EnableRight,
        TurnCode::Off | TurnCode::Both => TurnIndicators::Disable,
    }
}

type Judged<T> = Result<(T, Received), Doubt>;

struct Bench<'a> {
    binding: &'a LightsBinding,
    seen: &'a Observations,
    buses: &'a [Bus],
    now: Now,
}

impl Bench<'_> {
    fn judge<T: Copy>(&self, role: &Role<T>) -> Judged<T> {
        let signal = role.signal;
        match self.seen.read(self.binding, role, self.buses, self.now.mono) {
            Reading::Absent(why) => Err(Doubt::Absent(signal, why)),
            Reading::Seen { meaning, raw, received } => match meaning {
                Meaning::Defined(value) => Ok((value, received)),
                Meaning::NotAvailable => Err(Doubt::NotAvailable(signal, raw)),
                Meaning::Undefined => Err(Doubt::Undefined(signal, raw)),
                Meaning::Fault => Err(Doubt::Fault(signal, raw)),
            },
        }
    }

    /// What is not fitted is off for ever, as of now.
    fn not_fitted<T>(&self, off: T) -> (T, Received) {
        (off, Received { at: self.now.mono, stamp: self.now.wall })
    }

    fn sides(&self) -> Judged<TurnCode> {
        match &self.binding.turn {
            TurnBinding::NotFitted => Ok(self.not_fitted(TurnCode::Off)),
            TurnBinding::Enumerated(role) => self.judge(role),
            TurnBinding::Pair { left, right, both } => {
                let (left_on, right_on) = match (self.judge(left), self.judge(right)) {
                    (Ok(left), Ok(right)) => (left, right),
                    (Err(doubt), Ok(_)) | (Ok(_), Err(doubt)) => return Err(doubt),
                    (Err(first), Err(second)) => return Err(graver(first, second)),
                };
                let code = match (left_on.0, right_on.0, both) {
                    (false, false, _) => TurnCode::Off,
                    (true, false, _) => TurnCode::Left,
                    (false, true, _) => TurnCode::Right,
                    (true, true, BothOn::Hazard) => TurnCode::Both,
                    (true, true, BothOn::Undefined) => {
                        let raw = |signal| self.seen.last(signal).map_or(0, |last| last.raw);
                        let sides = [left.signal, right.signal].map(|signal| (signal, raw(signal)));
                        return Err(Doubt::BothOn(sides));
                    }
                };
                Ok((code, left_on.1.newest(right_on.1)))
            }
        }
    }

    fn hazard(&self, sides: &Judged<TurnCode>) -> (Judged<HazardLights>, Option<u8>) {
        let lights = |on| if on { HazardLights::Enable } else { HazardLights::Disable };
        match &self.binding.hazard {
            HazardBinding::NotFitted => (Ok(self.not_fitted(HazardLights::Disable)), None),
            HazardBinding::Unbound => (Err(Doubt::Unbound), None),
            HazardBinding::BothLamps => {
                (sides.map(|(code, received)| (lights(code == TurnCode::Both), received)), None)
            }
            HazardBinding::Signal { role, .. } => match self.judge(role) {
                Ok((HazardCode { active, reason }, received)) => (Ok((lights(active), received)), reason),
                Err(doubt) => (Err(doubt), None),
            },
        }
    }

    fn with_faults<T: Copy>(
        &self,
        state: Judged<T>,
        faults: &FaultBinding,
        reason: Option<u8>,
    ) -> Verdict<T> {
        let is_on = |(index, fault): (usize, &super::binding::FaultSignal)| match self.seen.read(
            self.binding,
            &fault.role,
            self.buses,
            self.now.mono,
        ) {
            Reading::Seen { meaning: Meaning::Defined(true) | Meaning::Fault, raw, .. } => {
                Some(ActiveFault { signal: fault.role.signal, raw, index })
            }
            Reading::Seen { .. } | Reading::Absent(_) => None,
        };
        let fault = faults.signals.iter().enumerate().find_map(is_on);
        let withheld = fault.is_some() && faults.on_fault == OnFault::Withhold;
        Verdict { state, fault, publish: state.ok().filter(|_| !withheld), reason }
    }
}

/// Of two doubts the one an operator should hear first: fault, invalid, then unknown.
fn graver(first: Doubt, second: Doubt) -> Doubt {
    let gravity = |doubt| match doubt {
        Doubt::Fault(..) => 3,
        Doubt::Undefined(..) | Doubt::BothOn(..) => 2,
        Doubt::NotAvailable(..) => 1,
        Doubt::Absent(..) | Doubt::Unbound => 0,
    };
    if gravity(second) > gravity(first) { second } else { first }
}
