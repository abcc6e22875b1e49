//! The two reports, derived from everything that happened.
//!
//! | knowledge of a signal | published | diagnostics |
//! |---|---|---|
//! | a defined value | it is | OK |
//! | not available, stale, never received, link lost | nothing | ERROR, unknown |
//! | never received, and the start not long ago | nothing | WARN, starting |
//! | no signal shows the state | nothing | WARN |
//! | a value without a meaning | nothing | ERROR, invalid |
//! | a value that means fault | nothing | ERROR, hardware fault |
//! | a fault signal beside a defined value | it is, unless withheld | ERROR, hardware fault |

use crate::pure::report_model::car::{
    ALIVE_TIMEOUT_NS, Car, FAULT_TIMEOUT_NS, HAZARD_TIMEOUT_NS, Hazard, TURN_TIMEOUT_NS, Turn,
};
use crate::pure::report_model::history::{
    ALIVE, FRONT, HAZARD, History, LAMP, LEFT, REAR, RIGHT, Received, TURN,
};

/// Gravest last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FaultKind {
    NotVisible,
    Unknown,
    Invalid,
    HardwareFault,
}

/// The outcome that is expected of one report.
#[derive(Debug)]
pub(crate) struct Expected {
    /// State and stamp, if it may be published.
    pub(crate) publish: Option<(&'static str, i64)>,
    unavailable: Option<FaultKind>,
    fault: bool,
    /// Texts that diagnostics must name.
    pub(crate) names: Vec<String>,
}

impl Expected {
    pub(crate) fn problem(&self) -> Option<FaultKind> {
        if self.fault { Some(FaultKind::HardwareFault) } else { self.unavailable }
    }

    /// The parts that only an event or a deadline may change; stamps of what is not fitted are always now.
    pub(crate) fn essence(&self) -> (Option<&'static str>, Option<FaultKind>, Vec<String>) {
        (self.publish.map(|(state, _)| state), self.problem(), self.names.clone())
    }
}

/// A state with the time and stamp of its newest frame, or what is wrong and what it is called.
type Judged<T> = Result<(T, u64, i64), (FaultKind, Vec<String>)>;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Sides {
    None,
    Left,
    Right,
    Both,
}

/// Turn and hazard at a moment; `wall` stamps what is known without any frame.
pub(crate) fn judge(car: &Car, history: &History, now: u64, wall: i64) -> [Expected; 2] {
    let knowledge = Knowledge { car, history, now };
    let sides = knowledge.sides(wall);
    let hazard = knowledge.hazard(&sides, wall);
    let turn = sides.map(|(sides, at, stamp)| match (&hazard, car.keep) {
        (Ok((true, since, hazard_stamp)), false) => {
            ("DISABLE", at.max(*since), if *since > at { *hazard_stamp } else { stamp })
        }
        _ => (turn_name(sides), at, stamp),
    });
    let hazard = hazard.map(|(on, at, stamp)| (if on { "ENABLE" } else { "DISABLE" }, at, stamp));
    [knowledge.expected(turn, car.turn_fault), knowledge.expected(hazard, car.hazard_fault)]
}

/// True if a bus of the car may sleep and was lately silent for as long as a permitted sleep begins with.
pub(crate) fn may_be_asleep(car: &Car, history: &History, now: u64) -> bool {
    let knowledge = Knowledge { car, history, now };
    let lately = (now.saturating_sub(4 * ALIVE_TIMEOUT_NS), now);
    let was_busy = |bus| history.was_busy(bus, &knowledge.relevant(bus), lately, TURN_TIMEOUT_NS / 2);
    car.may_sleep && !(was_busy(FRONT) && was_busy(REAR))
}

/// Longest time from the start in which a first frame is awaited, nanoseconds.
const START_NS: u64 = 2_000_000_000;

/// Whether each report awaits a first frame: for all that is known, and for certain.
pub(crate) fn awaits(car: &Car, history: &History, now: u64) -> [(bool, bool); 2] {
    let of_turn = match car.turn {
        Turn::Enumerated => vec![(FRONT, TURN)],
        Turn::Pair { .. } => vec![(FRONT, LEFT), (FRONT, RIGHT)],
        Turn::NotFitted => vec![],
    };
    let of_hazard = match car.hazard {
        Hazard::Signal | Hazard::Reason => vec![(REAR, HAZARD)],
        Hazard::BothSides => of_turn.clone(),
        Hazard::NotFitted | Hazard::NotVisible => vec![],
    };
    [of_turn, of_hazard].map(|messages| {
        let mut never = messages.iter().map(|(bus, id)| history.was_never_received(*bus, *id, now));
        let may = now <= START_NS && never.clone().any(|never| never);
        let is_calm = messages.iter().all(|(bus, _)| history.is_calm(*bus, now));
        (may, may && is_calm && never.all(|never| never))
    })
}

fn turn_name(sides: Sides) -> &'static str {
    match sides {
        Sides::Left => "ENABLE_LEFT",
        Sides::Right => "ENABLE_RIGHT",
        Sides::None | Sides::Both => "DISABLE",
    }
}

struct Knowledge<'a> {
    car: &'a Car,
    history: &'a History,
    now: u64,
}

impl Knowledge<'_> {
    fn expected(&self, state: Judged<&'static str>, fault_signal: Option<bool>) -> Expected {
        let fault = fault_signal.is_some() && self.lamp_broken();
        let withheld = fault && fault_signal == Some(true);
        let (publish, unavailable, mut names) = match state {
            Ok((state, _, stamp)) => (Some((state, stamp)).filter(|_| !withheld), None, vec![]),
            Err((problem, names)) => (None, Some(problem), names),
        };
        if fault {
            names.push("LAMP.BROKEN = 1".to_owned());
        }
        Expected { publish, unavailable, fault, names }
    }

    fn lamp_broken(&self) -> bool {
        let received = self.history.newest(REAR, LAMP, self.now);
        received.is_some_and(|received| self.now - received.at_ns <= FAULT_TIMEOUT_NS && received.raw == 1)
    }

    /// The newest value, unless it is too old or was sent before the bus fell silent.
    fn trusted(&self, bus: u8, id: u16, event: bool, timeout: u64) -> Option<Received> {
        let received = self.history.newest(bus, id, self.now)?;
        let holds = if event {
            let times = (received.at_ns, self.now);
            self.history.was_busy(bus, &self.relevant(bus), times, ALIVE_TIMEOUT_NS)
        } else {
            self.now - received.at_ns <= timeout
        };
        holds.then_some(received)
    }

    /// Messages that are received on a bus.
    fn relevant(&self, bus: u8) -> Vec<u16> {
        let car = self.car;
        let of_turn: &[u16] = match car.turn {
            Turn::Enumerated => &[TURN],
            Turn::Pair { .. } => &[LEFT, RIGHT],
            Turn::NotFitted => &[],
        };
        let has_hazard = matches!(car.hazard, Hazard::Signal | Hazard::Reason);
        let has_lamp = car.turn_fault.is_some() || car.hazard_fault.is_some();
        let mut ids = vec![ALIVE];
        if bus == FRONT {
            ids.extend(of_turn);
        } else {
            ids.extend(has_hazard.then_some(HAZARD));
            ids.extend(has_lamp.then_some(LAMP));
        }
        ids
    }

    fn sides(&self, wall: i64) -> Judged<Sides> {
        let newest = |id| self.trusted(FRONT, id, self.car.turn_event, TURN_TIMEOUT_NS);
        let switch = |raw| match raw {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        };
        let both_is_hazard = match self.car.turn {
            Turn::NotFitted => return Ok((Sides::None, self.now, wall)),
            Turn::Enumerated => {
                return read(newest(TURN), "TURN.CODE", |raw| match raw {
                    0 => Some(Sides::None),
                    1 => Some(Sides::Left),
                    4 => Some(Sides::Right),
                    5 => Some(Sides::Both),
                    _ => None,
                });
            }
            Turn::Pair { both_is_hazard } => both_is_hazard,
        };
        let left = read(newest(LEFT), "LEFT.ON", switch);
        let right = read(newest(RIGHT), "RIGHT.ON", switch);
        match (left, right) {
            (Ok((left, left_at, left_stamp)), Ok((right, right_at, right_stamp))) => {
                let sides = match (left, right) {
                    (false, false) => Sides::None,
                    (true, false) => Sides::Left,
                    (false, true) => Sides::Right,
                    (true, true) if both_is_hazard => Sides::Both,
                    (true, true) => {
                        let names = vec!["LEFT.ON = 1".to_owned(), "RIGHT.ON = 1".to_owned()];
                        return Err((FaultKind::Invalid, names));
                    }
                };
                let stamp = if right_at > left_at { right_stamp } else { left_stamp };
                Ok((sides, left_at.max(right_at), stamp))
            }
            (Err(wrong), Ok(_)) | (Ok(_), Err(wrong)) => Err(wrong),
            // The graver one; when both are alike, either may be named.
            (Err(left), Err(right)) if left.0 == right.0 => Err((left.0, vec![])),
            (Err(left), Err(right)) => Err(if left.0 > right.0 { left } else { right }),
        }
    }

    fn hazard(&self, sides: &Judged<Sides>, wall: i64) -> Judged<bool> {
        match self.car.hazard {
            Hazard::NotFitted => Ok((false, self.now, wall)),
            Hazard::NotVisible => Err((FaultKind::NotVisible, vec!["no signal".to_owned()])),
            Hazard::BothSides => sides.clone().map(|(sides, at, stamp)| (sides == Sides::Both, at, stamp)),
            Hazard::Signal | Hazard::Reason => {
                let received = self.trusted(REAR, HAZARD, self.car.hazard_event, HAZARD_TIMEOUT_NS);
                read(received, "HAZARD.CODE", |raw| match raw {
                    0 => Some(false),
                    1 | 5 | 6 => Some(true),
                    _ => None,
                })
            }
        }
    }
}

/// Raw values 2 and 3 mean fault and not available everywhere; `meaning` knows the rest.
fn read<T>(received: Option<Received>, name: &str, meaning: impl Fn(u8) -> Option<T>) -> Judged<T> {
    let Some(Received { raw, at_ns, stamp }) = received else {
        return Err((FaultKind::Unknown, vec![]));
    };
    let named = |problem| Err((problem, vec![format!("{name} = {raw}")]));
    match raw {
        2 => named(FaultKind::HardwareFault),
        3 => named(FaultKind::Unknown),
        _ => match meaning(raw) {
            Some(value) => Ok((value, at_ns, stamp)),
            None => named(FaultKind::Invalid),
        },
    }
}
