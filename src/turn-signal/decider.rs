//! The decider: turns the inputs of one cycle into one decision, and keeps state between cycles
//! (docs/spec/turn-signal-decider.md, "Candidates", "Commands" and "Memory between cycles").

use std::sync::Arc;
use std::time::Duration;

use super::compat::{DeciderCompat, DeciderQuirks};
use super::country::Country;
use super::decision::{Basis, Decision};
use super::decision_context::DecisionContext;
use super::distance_path::DistancePath;
use super::finished::FinishedMemory;
use super::inputs::{AgeLimits, InputFinding, Inputs};
use super::intersection::{IntersectionMemory, STANDING_LIMIT, TurnAhead, turns};
use super::junction::{JunctionRemark, JunctionRule, JunctionVerdict};
use super::manoeuvre::{Manoeuvre, ManoeuvreMemory, ManoeuvreOutcome};
use super::min_duration::{MinDurationFilter, MinDurations};
use super::parameters::{DeciderParameters, VehicleInfo};
use super::path_generator::planned_lanes::PlaceOnRoute;
use super::path_generator::{self, TaggedLanelet};
use super::planner_input::Odometry;
use super::resolve::{CandidateSource, Candidates, Contender, PairwiseRules, Resolution, foremost, resolve};
use super::roundabout::RoundaboutMemory;
use super::roundabout::backward::backward_length_m;
use super::roundabout::legs::{RoundaboutLegs, legs};
use super::route::Route;
use super::section::Section;
use super::side::Side;
use super::turn_lane::TurnLane;
use crate::light_command::{HazardCommand, TurnCommand};
use gateway_base::time::MonoTime;
use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::{NearestLimits, Path, PathFrame};
use lanelet2_map::lane_network::{LaneId, LaneNetwork};

/// Settings of the decider.
#[derive(Debug, Clone, PartialEq)]
pub struct DeciderSettings {
    /// The decider of Autoware that is followed.
    pub compat: DeciderCompat,
    /// Parameters, under Autoware's names.
    pub parameters: DeciderParameters,
    /// Dimensions of the vehicle.
    pub vehicle: VehicleInfo,
    /// Age limits of the inputs.
    pub age_limits: AgeLimits,
    /// Minimum durations of signals; only in improved mode.
    pub min_durations: MinDurations,
    /// A vehicle that stands longer than this, out of range of a turn that it announced, no longer announces
    /// it; only in improved mode.
    pub standing_limit: Duration,
    /// The signal of a turn waits until the vehicle has passed any junction that offers the same side and is
    /// not taken; only in improved mode.
    pub waits_for_junctions: bool,
    /// The country whose law demands the signal of a turn; its other rules are in the parameters. `None`
    /// without a country.
    pub country: Option<Arc<Country>>,
}

/// Decides cycle by cycle: [`Self::decide`] is called in a fixed period with the latest inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Decider {
    settings: DeciderSettings,
    quirks: DeciderQuirks,
    route: Option<u128>,
    last: Option<MonoTime>,
    lane: Option<LaneId>,
    /// The vehicle's place in the path generator's last cycle.
    place: Option<PlaceOnRoute>,
    intersection: IntersectionMemory,
    roundabout: RoundaboutMemory,
    manoeuvres: ManoeuvreMemory,
    finished: FinishedMemory,
    min_duration: MinDurationFilter,
}

/// Turns and roundabouts on the distance path.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observed {
    /// Turns at intersections, in order.
    pub turns: Vec<TurnLane>,
    /// Entries and exits of roundabouts, in order.
    pub legs: RoundaboutLegs,
}

impl DeciderSettings {
    /// Settings as deployed with Autoware, with the sample vehicle.
    pub fn deployed(compat: DeciderCompat) -> Self {
        Self {
            compat,
            parameters: DeciderParameters::DEPLOYED,
            vehicle: VehicleInfo::SAMPLE,
            age_limits: AgeLimits::DEFAULT,
            min_durations: MinDurations::READABLE,
            standing_limit: STANDING_LIMIT,
            waits_for_junctions: true,
            country: None,
        }
    }

    fn junction_rule(&self) -> Option<JunctionRule> {
        self.waits_for_junctions.then(|| JunctionRule {
            turn_distance_m: self.country.as_ref().and_then(|country| country.turn_distance_m),
            least_time: self.min_durations.minimum_on,
        })
    }
}

/// Returns the settings without those that the quirks rule out.
fn effective(settings: DeciderSettings, quirks: DeciderQuirks) -> DeciderSettings {
    let min_durations =
        if quirks.has_no_minimum_durations { MinDurations::NONE } else { settings.min_durations };
    let waits_for_junctions = settings.waits_for_junctions && !quirks.misleads_before_junctions;
    DeciderSettings { min_durations, waits_for_junctions, ..settings }
}

impl Decider {
    /// Creates a decider before its first cycle.
    pub fn new(settings: DeciderSettings) -> Self {
        let quirks = DeciderQuirks::of(settings.compat);
        Self {
            settings: effective(settings, quirks),
            quirks,
            route: None,
            last: None,
            lane: None,
            place: None,
            intersection: IntersectionMemory::default(),
            roundabout: RoundaboutMemory::default(),
            manoeuvres: ManoeuvreMemory::default(),
            finished: FinishedMemory::default(),
            min_duration: MinDurationFilter::default(),
        }
    }

    /// Changes the settings and keeps the remembered state. `compat` must be the same as before.
    pub fn reconfigure(&mut self, settings: DeciderSettings) {
        self.settings = effective(settings, self.quirks);
    }

    /// Decides one cycle: returns the commands at `now`, with their reasons.
    pub fn decide(&mut self, inputs: &Inputs<'_>, now: MonoTime) -> Decision {
        let mut findings = Vec::new();
        self.note_time(now, &mut findings);
        let limits = self.settings.age_limits;
        let (odometry, road, route) = match inputs.usable_surroundings(limits, now) {
            Ok(observed) => observed,
            Err(finding) => {
                findings.push(finding);
                // NO_COMMAND switches nothing off: the signal continues without a gap when the inputs return.
                return Decision { findings, ..Decision::default() };
            }
        };
        self.note_route(route, &mut findings);
        let follows_path_generator = self.settings.compat == DeciderCompat::PathGenerator;
        let manoeuvres = if follows_path_generator {
            Vec::new()
        } else {
            inputs.usable_manoeuvres(limits, now, &mut findings)
        };
        if let Some(path) = inputs.planned_path.filter(|path| now.since(path.at) > limits.planned_path) {
            findings.push(InputFinding::OldPlannedPath(now.since(path.at)));
        }
        let is_planned = inputs.planned_path.is_none_or(|path| path.value > 0);
        if !is_planned {
            findings.push(InputFinding::EmptyPlannedPath);
        }
        let surroundings = (road, route, odometry);
        let mut decision = if follows_path_generator {
            let tagged = is_planned.then(|| self.decide_as_path_generator(surroundings)).flatten();
            let (turn, tagged) = tagged.unwrap_or((TurnCommand::NoCommand, TaggedLanelet::None));
            Decision { turn, basis: Basis::PathGenerator(tagged), ..Decision::default() }
        } else {
            let measured = is_planned.then(|| self.distance_path(road, route, odometry.pose));
            let measured = measured.and_then(|path| path.map_err(|finding| findings.push(finding)).ok());
            self.decide_by_candidates(surroundings, measured.as_ref(), manoeuvres, now)
        };
        decision.findings = findings;
        let due = decision.next_deadline.into_iter().chain(inputs.too_old_from(limits));
        decision.next_deadline = due.filter(|at| *at > now).min();
        decision
    }

    /// Returns the command of the path generator and the lanelet that decided; `None` without a lanelet of
    /// the route.
    fn decide_as_path_generator(
        &mut self,
        (road, route, odometry): (&LaneNetwork, &Route, Odometry),
    ) -> Option<(TurnCommand, TaggedLanelet)> {
        let (parameters, front_m) = (&self.settings.parameters, self.settings.vehicle.front_m());
        let place = PlaceOnRoute::new((road, route), self.place, odometry.pose, parameters.nearest);
        self.place = place;
        let lanes = place?.planned((road, route), front_m);
        Some(path_generator::decide((road, route), &lanes, odometry, front_m, parameters))
    }

    /// Decides by turns, roundabouts and manoeuvres, on the distance path if there is one.
    fn decide_by_candidates(
        &mut self,
        (road, route, odometry): (&LaneNetwork, &Route, Odometry),
        measured: Option<&DistancePath>,
        manoeuvres: Vec<&Manoeuvre>,
        now: MonoTime,
    ) -> Decision {
        let (settings, quirks) = (self.settings.clone(), self.quirks);
        let (front_m, nearest) = (settings.vehicle.front_m(), settings.parameters.nearest);
        let on = |path_frame, way| DecisionContext {
            road,
            route,
            path_frame,
            way,
            speed_mps: odometry.speed_mps,
            parameters: &settings.parameters,
            vehicle: &settings.vehicle,
            quirks,
            standing_limit: settings.standing_limit,
            junction_rule: settings.junction_rule(),
            now,
        };
        let ego = odometry.pose;
        let Some(measured) = measured else {
            // Without a path of lanelets, the chain measures on the vehicle's own straight line.
            let Some(line) = own_line(ego) else { return Decision::default() };
            let path_frame = PathFrame::new(&line, ego, front_m, nearest);
            return self.decide_by_manoeuvre(&on(path_frame, None), manoeuvres);
        };
        let path = &measured.path;
        let path_frame = if quirks.ignores_height_and_continuity {
            PathFrame::new(path, ego, front_m, nearest)
        } else {
            PathFrame::of_every_visit(path, (ego, measured.ego_m), front_m, nearest)
        };
        let context = on(path_frame, Some(measured));
        self.decide_on(&context, manoeuvres, |manoeuvre| Observed {
            turns: turns(&context, measured, manoeuvre),
            legs: legs(&context, &measured.lanes),
        })
    }

    /// Decides one cycle in a context that is already measured. `observed` finds the turns and roundabouts on
    /// the distance path, given the command of the manoeuvres.
    pub fn decide_on<'a>(
        &mut self,
        context: &DecisionContext<'_>,
        manoeuvres: impl IntoIterator<Item = &'a Manoeuvre>,
        observed: impl FnOnce(TurnCommand) -> Observed,
    ) -> Decision {
        let (records, remarks) = self.manoeuvres.chain(context, manoeuvres);
        if let Some(decision) = self.hazard(&records, &remarks, context.now) {
            return decision;
        }
        let manoeuvre = self.foremost(context, &records);
        let observed = observed(manoeuvre.map_or(TurnCommand::NoCommand, |record| record.turn));
        let candidates = Candidates {
            intersection: self.intersection.section(context, &observed.turns),
            roundabout: self.roundabout.section(context, &observed.legs),
            manoeuvre,
        };
        let resolution = self.resolved(context, &candidates);
        let sections = sections(&candidates, &records);
        let is_required = |(_, section): &&(CandidateSource, Section)| {
            section.distances(&context.path_frame).are_required()
        };
        let required: Vec<Side> =
            sections.iter().filter(is_required).filter_map(|(_, section)| section.turn.side()).collect();
        let min_durations = self.settings.min_durations;
        let shown = self.min_duration.show(resolution.signal(), &required, min_durations, context.now);
        self.note_finished(context, &sections, &candidates, &resolution, shown.signal);
        Decision {
            turn: shown.signal,
            hazard: HazardCommand::Disable,
            held: shown.held,
            intersection: turn_ahead(&candidates, &resolution),
            junction: self.junction(&candidates),
            sections: candidates,
            basis: Basis::Candidates(Box::new(resolution)),
            remarks,
            findings: Vec::new(),
            next_deadline: shown.deadline,
        }
    }

    /// Returns the number of signals so far that waited for a junction offering their side.
    pub const fn shortened(&self) -> u64 {
        self.intersection.shortened()
    }

    /// Returns the junction before the next turn that offers its side, and the law if the law decides.
    fn junction(&self, candidates: &Candidates) -> Option<JunctionRemark> {
        let ahead = candidates.intersection?.junction?;
        let is_by_law = matches!(ahead.verdict, JunctionVerdict::LawDemands(_));
        Some(JunctionRemark { ahead, country: self.settings.country.clone().filter(|_| is_by_law) })
    }

    /// Decides without a path to measure on, by the command of the manoeuvres alone.
    fn decide_by_manoeuvre(
        &mut self,
        context: &DecisionContext<'_>,
        manoeuvres: Vec<&Manoeuvre>,
    ) -> Decision {
        let (records, remarks) = self.manoeuvres.chain(context, manoeuvres);
        if let Some(decision) = self.hazard(&records, &remarks, context.now) {
            return decision;
        }
        let manoeuvre = self.foremost(context, &records);
        let requested =
            manoeuvre.filter(Section::is_finite).map_or(TurnCommand::NoCommand, |record| record.turn);
        let shown = self.min_duration.show(requested, &[], self.settings.min_durations, context.now);
        Decision {
            turn: shown.signal,
            hazard: HazardCommand::Disable,
            basis: Basis::ManoeuvreAlone(requested),
            held: shown.held,
            remarks,
            next_deadline: shown.deadline,
            ..Decision::default()
        }
    }

    /// Decides for the hazard lights if a record requests them; the remembered state does not change. `None`
    /// otherwise.
    fn hazard(
        &mut self,
        records: &[Section],
        remarks: &[ManoeuvreOutcome],
        now: MonoTime,
    ) -> Option<Decision> {
        records.iter().find(|record| record.hazard == HazardCommand::Enable)?;
        self.min_duration.force_off(now);
        let (turn, hazard) = (TurnCommand::Disable, HazardCommand::Enable);
        Some(Decision {
            turn,
            hazard,
            basis: Basis::Hazard,
            remarks: remarks.to_vec(),
            ..Decision::default()
        })
    }

    /// Returns the record of the planner's manoeuvres that takes part: among several (W19), the record that
    /// would win alone.
    fn foremost(&self, context: &DecisionContext<'_>, records: &[Section]) -> Option<Section> {
        let frame = &context.path_frame;
        let is_open =
            |record: &&Section| !self.finished.is_finished(frame, CandidateSource::Manoeuvre, record);
        let open: Vec<Section> = records.iter().filter(is_open).copied().collect();
        let records = if open.is_empty() { records } else { &open };
        let won_before =
            |record: &Section| self.finished.won_before(frame, CandidateSource::Manoeuvre, record);
        foremost(frame, records, &rules(context), won_before)
    }

    fn resolved(&self, context: &DecisionContext<'_>, candidates: &Candidates) -> Resolution {
        let is_finished = |source: &CandidateSource| {
            let is_finished = |section| self.finished.is_finished(&context.path_frame, *source, section);
            candidates.of(*source).as_ref().is_some_and(is_finished)
        };
        let finished = CandidateSource::ALL.into_iter().filter(is_finished).collect();
        let won_before = CandidateSource::ALL.into_iter().find(|source| {
            let won_before = |section| self.finished.won_before(&context.path_frame, *source, &section);
            candidates.of(*source).is_some_and(won_before)
        });
        resolve(&context.path_frame, candidates, &PairwiseRules { finished, won_before, ..rules(context) })
    }

    /// Improved: remembers signalled manoeuvres that are over (W4).
    fn note_finished(
        &mut self,
        context: &DecisionContext<'_>,
        sections: &[(CandidateSource, Section)],
        candidates: &Candidates,
        resolution: &Resolution,
        shown: TurnCommand,
    ) {
        if context.quirks.finished_manoeuvres_return {
            return;
        }
        let winner = resolution
            .winner
            .and_then(|Contender { source, .. }| candidates.of(source).map(|section| (source, section)));
        self.finished.note(&context.path_frame, sections, winner.as_ref(), shown);
    }

    fn note_time(&mut self, now: MonoTime, findings: &mut Vec<InputFinding>) {
        if let Some(last) = self.last.replace(now).filter(|last| now < *last) {
            findings.push(InputFinding::TimeWentBack(last.since(now)));
            self.min_duration = MinDurationFilter::default();
        }
    }

    /// Clears the state remembered for another route (W8); upstream restarts its modules, but not its
    /// decider.
    fn note_route(&mut self, route: &Route, findings: &mut Vec<InputFinding>) {
        if self.route.replace(route.id()).is_some_and(|before| before != route.id()) {
            findings.push(InputFinding::NewRoute);
            self.manoeuvres = ManoeuvreMemory::default();
            (self.lane, self.place) = (None, None);
            if !self.quirks.memory_survives_route {
                self.intersection.clear();
                self.roundabout = RoundaboutMemory::default();
                self.finished = FinishedMemory::default();
            }
        }
    }

    fn distance_path(
        &mut self,
        road: &LaneNetwork,
        route: &Route,
        ego: Pose,
    ) -> Result<DistancePath, InputFinding> {
        let parameters = &self.settings.parameters;
        let current = if self.quirks.ignores_height_and_continuity {
            road.closest(route.lanes(), ego)
        } else {
            // A route is planned from the position of the vehicle.
            let before = self.lane.or_else(|| route.first_preferred());
            let around = before.map(|before| route.around(road, before, MAX_STEP_M)).unwrap_or_default();
            let is_continuous = |lane| around.binary_search(&lane).is_ok();
            // On a long route most of the lanelets are far away.
            let surely = road.surely_current(around.iter().copied(), ego, parameters.nearest);
            surely.or_else(|| road.current(route.lanes(), ego, parameters.nearest, is_continuous))
        };
        let current = current.ok_or(InputFinding::NoLaneAround)?;
        self.lane = Some(current.id);
        let limits = parameters.nearest;
        let on = if self.quirks.searches_back_by_entries {
            // Upstream compares the square of the distance with the limit.
            let limits = NearestLimits { distance_m: limits.distance_m.sqrt(), ..limits };
            road.closest_within(route.lanes(), ego, limits)
        } else {
            let is_near = current.distance_m(ego.position) <= limits.distance_m;
            Some(current).filter(|_| is_near && current.misalignment_rad(ego) <= limits.yaw_rad)
        };
        let backward_m =
            on.map_or(parameters.path_backward_length_m, |on| self.backward_m(road, route, on.id));
        DistancePath::new((road, route, self.quirks), parameters, ego, current.id, backward_m)
            .map_err(InputFinding::NoDistancePath)
    }

    fn backward_m(&self, road: &LaneNetwork, route: &Route, current: LaneId) -> f64 {
        let parameters = &self.settings.parameters;
        backward_length_m((road, route), parameters, &self.roundabout, current, self.quirks)
    }
}

/// Maximum distance that a vehicle advances on its route between two decisions, metres.
const MAX_STEP_M: f64 = 20.0;

/// Returns the rules of the mode, with no finished source.
fn rules(context: &DecisionContext<'_>) -> PairwiseRules {
    PairwiseRules {
        start_belongs_to_before: !context.quirks.required_start_belongs_to_nothing,
        nested_waits: !context.quirks.nested_section_comes_early,
        ..PairwiseRules::default()
    }
}

/// Returns the records of turns and roundabouts that take part, and all records of the planner's manoeuvres.
fn sections(candidates: &Candidates, records: &[Section]) -> Vec<(CandidateSource, Section)> {
    let of = |source| candidates.of(source).map(|section| (source, section));
    let on_road = [CandidateSource::Intersection, CandidateSource::Roundabout].into_iter().filter_map(of);
    on_road.chain(records.iter().map(|section| (CandidateSource::Manoeuvre, *section))).collect()
}

fn own_line(ego: Pose) -> Option<Path> {
    let ahead = Pose { position: ego.point_at(1.0, 0.0), yaw_rad: ego.yaw_rad };
    Path::new([ego, ahead]).ok()
}

/// docs/spec/turn-signal-decider.md, "Next-turn output": only while the intersection is signalled.
fn turn_ahead(candidates: &Candidates, resolution: &Resolution) -> Option<TurnAhead> {
    let winner = resolution.winner.filter(|winner| winner.source == CandidateSource::Intersection)?;
    let pose = candidates.intersection?.required_start;
    let distances = winner.distances;
    let within = distances.desired_start_m < 0.0 && distances.desired_end_m > 0.0;
    let distance_m = distances.required_start_m;
    within.then_some(TurnAhead { side: winner.side, active: distance_m <= 0.0, pose, distance_m })
}
