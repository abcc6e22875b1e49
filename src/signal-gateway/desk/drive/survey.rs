//! Many drives over a map, compared with its geometry: finds turns whose signal is missing, too short, to the
//! wrong side, or flickering.

use std::collections::BTreeMap;
use std::fmt;

use self::judged_turn::{ExpectedSide, turns};
use super::run::DriveRun;
use super::simulation::DriveSimulation;
use crate::config::Refused;
use crate::config::drive::DriveFile;
use lanelet2_map::lane_network::{LaneId, LaneNetwork, Lanelet, TurnDirection};
use lanelet2_map::tag_check::{MapFlaw, check_tags};
use turn_signal::compat::DeciderCompat;
use turn_signal::decider::DeciderSettings;
use turn_signal::route::Segment;
use turn_signal::side::Side;

mod judged_turn;
mod route_choice;
mod sweep;

pub(crate) use judged_turn::SignalFault;
pub(crate) use route_choice::RouteChoice;
pub(crate) use sweep::Sweep;

/// A turn whose signal is wrong.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WrongTurn {
    /// The first lanelet of the turn.
    pub lane: LaneId,
    pub side: Side,
    /// Position of its start on its route, metres.
    pub at_m: f64,
    /// The first and the last lanelet of the route.
    pub way: [LaneId; 2],
    pub fault: SignalFault,
    /// Flaw of the map with which no decider can be right; `None` if the fault is the decider's.
    pub flaw: Option<MapFlaw>,
}

/// `lanelet 111, at 59.0 m from 101 to 402: the turn to the left is not signalled`
impl fmt::Display for WrongTurn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { lane, side, at_m, way: [from, to], fault, flaw } = self;
        let what = match fault {
            SignalFault::Missed => "is not signalled",
            SignalFault::Short => "is signalled in a part of its required section only",
            SignalFault::Opposite => "has the signal to the other side",
            SignalFault::Flickering => "has a signal that goes off and on again",
        };
        let side = side.name();
        write!(f, "lanelet {lane}, at {at_m:.1} m from {from} to {to}: the turn to the {side} {what}")?;
        flaw.as_ref().map_or(Ok(()), |flaw| write!(f, "; by the map: {flaw}"))
    }
}

/// Results of a survey of a map.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct TurnSurvey {
    pub routes: usize,
    pub turns: usize,
    /// Turns with a wrong signal, in the order of the routes.
    pub wrong: Vec<WrongTurn>,
}

impl TurnSurvey {
    /// Returns the number of turns with each fault, in the order of [`SignalFault::ALL`]: turns at flaws of
    /// the map if `of_map`, otherwise turns with faults of the decider.
    pub(crate) fn counts(&self, of_map: bool) -> [usize; 4] {
        let of = |wrong: &&WrongTurn| wrong.flaw.is_some() == of_map;
        SignalFault::ALL
            .map(|fault| self.wrong.iter().filter(of).filter(|wrong| wrong.fault == fault).count())
    }
}

/// Routes over the map of a drive, each driven with the drive's speed and settings.
#[derive(Debug, Clone)]
pub(crate) struct Surveyor {
    file: DriveFile,
    routes: Vec<Vec<LaneId>>,
    expected: BTreeMap<LaneId, ExpectedSide>,
}

impl Surveyor {
    /// Chooses the routes over the map of a drive, deterministically.
    pub(crate) fn new(file: DriveFile, choice: RouteChoice) -> Self {
        let (routes, expected) = (choice.routes(&file.road), expected_sides(&file.road));
        Self { file, routes, expected }
    }

    pub(crate) fn compat(&self) -> DeciderCompat {
        self.file.compats.first().copied().unwrap_or_default()
    }

    pub(crate) fn settings(&self) -> &DeciderSettings {
        &self.file.decider
    }

    /// Drives all routes with these settings. Fails if the lanelets of a route do not form a path.
    pub(crate) fn survey(
        &self,
        compat: DeciderCompat,
        settings: &DeciderSettings,
    ) -> Result<TurnSurvey, Refused> {
        let mut survey = TurnSurvey::default();
        for lanes in &self.routes {
            let [Some(from), Some(to)] = [lanes.first(), lanes.last()] else { continue };
            let mut file = self.file.clone();
            file.decider = settings.clone();
            file.route.segments =
                lanes.iter().map(|lane| Segment { preferred: *lane, lanes: vec![*lane] }).collect();
            let turns = turns(&file, lanes, &self.expected);
            let shown = shown(&DriveSimulation::new(file)?, compat);
            survey.routes += 1;
            survey.turns += turns.len();
            survey.wrong.extend(turns.iter().filter_map(|turn| {
                let fault = turn.fault(&turns, &shown)?;
                let (lane, side, at_m, flaw) = (turn.lane, turn.side, turn.start_m, turn.flaw.clone());
                Some(WrongTurn { lane, side, at_m, way: [*from, *to], fault, flaw })
            }));
        }
        Ok(survey)
    }
}

/// Returns the side to which each lanelet turns: by its tag, unless its geometry contradicts it, as in
/// `check`.
fn expected_sides(road: &LaneNetwork) -> BTreeMap<LaneId, ExpectedSide> {
    let by_tag = |lane: &Lanelet| match lane.turn_direction {
        TurnDirection::Left => Some((lane.id, ExpectedSide { side: Side::Left, flaw: None })),
        TurnDirection::Right => Some((lane.id, ExpectedSide { side: Side::Right, flaw: None })),
        TurnDirection::None | TurnDirection::Straight => None,
    };
    let plain = road.lanes().filter(|lane| lane.roundabouts.is_empty());
    let mut sides: BTreeMap<LaneId, ExpectedSide> = plain.filter_map(by_tag).collect();
    for finding in check_tags(road) {
        if let MapFlaw::OtherDirection { bend_deg, .. } | MapFlaw::UntaggedFork { bend_deg, .. } =
            finding.flaw
        {
            let side = if bend_deg > 0.0 { Side::Left } else { Side::Right };
            sides.insert(finding.lane, ExpectedSide { side, flaw: Some(finding.flaw) });
        }
    }
    sides
}

/// Returns the side shown at each position of the rear axle, metres.
fn shown(simulation: &DriveSimulation, compat: DeciderCompat) -> Vec<(f64, Option<Side>)> {
    let mut run = DriveRun::new(simulation, compat);
    simulation.cycles().map(|cycle| (cycle.at_m, run.step(&cycle).turn.side())).collect()
}
