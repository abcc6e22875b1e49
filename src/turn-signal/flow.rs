//! The decider as a flow of the gateway: receives the latest messages of Autoware and returns a decision
//! every cycle, as commands or as a comparison with Autoware's own commands.
//!
//! If an input is missing or too old, no decision is invented: the command is `NO_COMMAND`, and a finding
//! gives the reason.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use super::catalogue::SECTION;
use super::compat::{DeciderCompat, DeciderQuirks};
use super::decider::{Decider, DeciderSettings};
use super::decision::{Basis, Decision};
use super::factors::{FactorContext, manoeuvres, trajectory_manoeuvres};
use super::headline::Headline;
use super::inputs::{InputFinding, Inputs, Timed};
use super::output::TurnSignalOutput;
use super::planner_input::{Odometry, PlannerInput, PlannerRoute};
use super::route::{Route, RouteError};
use super::signal_judge::{JudgeSettings, JudgedCycle, SignalJudge, SignalVerdict};
use super::vehicle_state::{VehicleState, VehicleUse};
use crate::light_command::{HazardCommand, TurnCommand};
use gateway_base::diagnostics::{MessagePart, Status};
use gateway_base::time::{MonoTime, Now};
use lanelet2_map::lane_network::LaneNetwork;
use latest_inputs::LatestInputs;
use shadow_comparison::ShadowComparison;
use snapshot::WrongSignal;

mod latest_inputs;
mod shadow_comparison;
pub mod snapshot;
mod status;

/// Settings of the flow.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnSignalSettings {
    /// Settings of the decider.
    pub decider: DeciderSettings,
    /// The lanelets of the map, shared because a city has many.
    pub road: Arc<LaneNetwork>,
    /// Use of the decisions.
    pub role: DeciderRole,
    /// Time between cycles, above zero.
    pub period: Duration,
    /// The sections of each cycle are published.
    pub publishes_sections: bool,
    /// Use of the vehicle's own signals.
    pub vehicle: VehicleUse,
}

/// Use of the decisions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeciderRole {
    /// The commands are published.
    Command,
    /// The commands are only compared with Autoware's own; nothing is commanded.
    Shadow {
        /// Time for which the two may differ before it counts.
        tolerance: Duration,
    },
}

/// The decider with its inputs, outputs and diagnostics.
#[derive(Debug, Clone)]
pub struct TurnSignalFlow {
    settings: TurnSignalSettings,
    decider: Decider,
    latest: LatestInputs,
    /// The last route as sent, and its counterpart on the map.
    sent_route: Option<Arc<PlannerRoute>>,
    route: Option<Result<Route, RouteError>>,
    due: MonoTime,
    cycles: u64,
    /// Number of decisions that differ from the previous one, in command or reason.
    changes: u64,
    decision: Option<Arc<Decision>>,
    headline: Option<Headline>,
    turn_comparison: ShadowComparison<TurnCommand>,
    hazard_comparison: ShadowComparison<HazardCommand>,
    judge: SignalJudge,
    last_wrong: Option<WrongSignal>,
    last_summary: Option<MessagePart>,
    ready: VecDeque<TurnSignalOutput>,
}

impl TurnSignalFlow {
    /// Creates the flow; its first cycle is due at `now`.
    pub fn new(settings: TurnSignalSettings, now: Now) -> Self {
        Self {
            decider: Decider::new(settings.decider.clone()),
            settings,
            latest: LatestInputs::default(),
            sent_route: None,
            route: None,
            due: now.mono,
            cycles: 0,
            changes: 0,
            decision: None,
            headline: None,
            turn_comparison: ShadowComparison::default(),
            hazard_comparison: ShadowComparison::default(),
            judge: SignalJudge::new(JudgeSettings::DEFAULT),
            last_wrong: None,
            last_summary: None,
            ready: VecDeque::new(),
        }
    }

    /// Changes the settings from the next cycle on and keeps all received messages. The decider's state is
    /// cleared when the map or `compat` changes.
    pub fn reconfigure(&mut self, settings: TurnSignalSettings) {
        let is_same_road = self.settings.road == settings.road;
        if is_same_road && self.settings.decider.compat == settings.decider.compat {
            self.decider.reconfigure(settings.decider.clone());
        } else {
            self.decider = Decider::new(settings.decider.clone());
        }
        self.settings = settings;
        if !is_same_road {
            self.take_route();
        }
    }

    /// Accepts a message of Autoware. It takes effect in the next cycle.
    pub fn handle_input(&mut self, input: PlannerInput, now: Now) {
        if let PlannerInput::Route(route) = &input {
            self.sent_route = Some(Arc::clone(route));
            self.take_route();
        }
        self.latest.update(input, now.mono);
    }

    /// Decides, if a cycle is due, with the vehicle in this state. Returns whether level or message of the
    /// diagnostics changed.
    pub fn settle(&mut self, vehicle: VehicleState, now: Now) -> bool {
        if now.mono < self.due {
            return false;
        }
        let next = self.due.after(self.settings.period);
        // After a gap, cycles continue from now; missed cycles are not made up.
        self.due = if next > now.mono { next } else { now.mono.after(self.settings.period) };
        self.cycles += 1;
        let decision = Arc::new(self.decide(vehicle, now.mono));
        match self.settings.role {
            DeciderRole::Command => {
                let (command, stamp) = (decision.turn, now.wall);
                self.ready.push_back(TurnSignalOutput::TurnCommand { command, stamp });
                let command = decision.hazard;
                self.ready.push_back(TurnSignalOutput::HazardCommand { command, stamp });
            }
            DeciderRole::Shadow { tolerance } => self.compare(&decision, tolerance, now.mono),
        }
        if self.settings.publishes_sections {
            let (decision, stamp) = (Arc::clone(&decision), now.wall);
            self.ready.push_back(TurnSignalOutput::Sections { decision, stamp });
        }
        let headline = Some(Headline::of(&decision));
        if self.headline != headline {
            self.headline = headline;
            self.changes += 1;
            self.ready.push_back(TurnSignalOutput::Decision(Arc::clone(&decision)));
        }
        self.decision = Some(decision);
        let summary = Some(self.summary());
        std::mem::replace(&mut self.last_summary, summary.clone()) != summary
    }

    /// Returns the next output, oldest first; `None` when none is left.
    pub fn poll_output(&mut self) -> Option<TurnSignalOutput> {
        self.ready.pop_front()
    }

    /// Returns the time of the next cycle, at which [`Self::settle`] must be called.
    pub fn next_deadline(&self) -> MonoTime {
        self.due
    }

    /// Returns the last decision; `None` before the first cycle.
    pub fn decision(&self) -> Option<&Decision> {
        self.decision.as_deref()
    }

    /// Returns the diagnostic status of the decider.
    pub fn status(&self, now: MonoTime) -> Status {
        Status::new(&SECTION, "turn_signal_decider", &[self.summary()], self.values(now))
    }

    /// Adopts the route that was sent last. An unusable route ends the previous route, which the vehicle has
    /// left.
    fn take_route(&mut self) {
        self.route = self.sent_route.as_ref().map(|sent| {
            let route = Route::new(sent.id, sent.start, sent.segments.clone());
            route.and_then(|route| route.with_goal(sent.goal).checked(&self.settings.road))
        });
    }

    fn decide(&mut self, mut vehicle: VehicleState, now: MonoTime) -> Decision {
        let limits = self.settings.decider.age_limits;
        let mut findings = Vec::new();
        let route = match &self.route {
            Some(Ok(route)) => Some(route),
            Some(Err(error)) => {
                findings.push(InputFinding::RouteRefused(*error));
                None
            }
            None => None,
        };
        let lane_driving = self.latest.lane_driving(limits.scenario, now, &mut findings);
        let odometry = self.odometry(vehicle.speed_mps, &mut findings);
        let fresh = odometry.filter(|odometry| now.since(odometry.at) <= limits.odometry);
        vehicle.speed_mps = vehicle.speed_mps.or(fresh.map(|odometry| odometry.value.speed_mps));
        let known = route.zip(odometry.map(|odometry| odometry.value));
        let manoeuvres = known.map(|(route, odometry)| self.manoeuvres(route, odometry, now, &mut findings));
        let manoeuvres = manoeuvres.unwrap_or_default();
        let inputs = Inputs {
            odometry,
            road: Some(&self.settings.road),
            route,
            planned_path: self.latest.planned_path_length(),
            manoeuvres: &manoeuvres,
            lane_driving,
        };
        let mut decision = self.decider.decide(&inputs, now);
        decision.hazard = self.joined_hazard(decision.hazard, now, &mut findings);
        decision.hazard = self.vehicle_hazard(decision.hazard, &vehicle, &mut findings);
        decision.findings.append(&mut findings);
        decision
    }

    /// Returns the odometry, with the speed from the vehicle's signals if configured.
    fn odometry(
        &self,
        vehicle_mps: Option<f64>,
        findings: &mut Vec<InputFinding>,
    ) -> Option<Timed<Odometry>> {
        let takes_speed = self.settings.vehicle.takes_speed;
        if takes_speed && vehicle_mps.is_none() {
            findings.push(InputFinding::NoVehicleSpeed);
        }
        let mut odometry = self.latest.odometry?;
        if let Some(speed_mps) = vehicle_mps.filter(|_| takes_speed) {
            odometry.value.speed_mps = speed_mps;
        }
        Some(odometry)
    }

    /// Returns the manoeuvres of the planner; none without the pose of the vehicle, or for the path
    /// generator.
    fn manoeuvres(
        &self,
        route: &Route,
        odometry: Odometry,
        now: MonoTime,
        findings: &mut Vec<InputFinding>,
    ) -> Vec<Timed<super::manoeuvre::Manoeuvre>> {
        if self.settings.decider.compat == DeciderCompat::PathGenerator || !odometry.pose.is_finite() {
            return Vec::new();
        }
        let path_limit = self.settings.decider.age_limits.planned_path;
        let context = FactorContext {
            road: &self.settings.road,
            route,
            parameters: &self.settings.decider.parameters,
            looks_at_height: !DeciderQuirks::of(self.settings.decider.compat).ignores_height_and_continuity,
            odometry,
            path: self.latest.planned_path(path_limit, now, findings),
            modified_goal: self.latest.modified_goal(route.id()),
            operation_mode: self.latest.operation_mode,
        };
        if let Some(trajectory) = self.latest.trajectory(path_limit, now, findings) {
            return trajectory_manoeuvres(&context, &self.latest.driven, trajectory);
        }
        let (manoeuvres, mut found) = manoeuvres(&context, &self.latest.factors);
        findings.append(&mut found);
        manoeuvres
    }

    /// Joins the hazard requests: on when the planner or the system requests them
    /// (docs/spec/turn-signal-decider.md, "Hazard lights"). A request that is too old
    /// does not count as off.
    fn joined_hazard(
        &self,
        planner: HazardCommand,
        now: MonoTime,
        findings: &mut Vec<InputFinding>,
    ) -> HazardCommand {
        let Some(request) = self.latest.hazard_request else { return planner };
        let age = now.since(request.at);
        if age > self.settings.decider.age_limits.hazard_request {
            findings.push(InputFinding::OldHazardRequest(age));
            return if planner == HazardCommand::Enable { planner } else { HazardCommand::NoCommand };
        }
        if request.value == HazardCommand::Enable { HazardCommand::Enable } else { planner }
    }

    /// Adds the hazard lights requested by the state of the vehicle. While it is unknown whether the state
    /// requests them, they are not commanded off.
    fn vehicle_hazard(
        &self,
        requested: HazardCommand,
        vehicle: &VehicleState,
        findings: &mut Vec<InputFinding>,
    ) -> HazardCommand {
        let mut hazard = requested;
        for state in &self.settings.vehicle.hazards {
            match state.asks(vehicle) {
                Some(true) => {
                    findings.push(InputFinding::VehicleHazard(*state));
                    hazard = HazardCommand::Enable;
                }
                Some(false) => {}
                None => {
                    findings.push(InputFinding::UnknownVehicleHazard(*state));
                    if hazard == HazardCommand::Disable {
                        hazard = HazardCommand::NoCommand;
                    }
                }
            }
        }
        hazard
    }

    fn compare(&mut self, decision: &Decision, tolerance: Duration, now: MonoTime) {
        let limit = self.settings.decider.age_limits.own_command;
        // Upstream publishes nothing when it lacks inputs; NO_COMMAND of the path generator is a decision.
        let decides = decision.turn != TurnCommand::NoCommand
            || decision.hazard != HazardCommand::NoCommand
            || matches!(decision.basis, Basis::PathGenerator(_));
        let counts = |at: MonoTime| decides && now.since(at) <= limit;
        let turn = self.latest.own_turn.filter(|own| counts(own.at)).map(|own| own.value);
        let hazard = self.latest.own_hazard.filter(|own| counts(own.at)).map(|own| own.value);
        self.turn_comparison.compare(decision.turn, turn, tolerance, now);
        self.hazard_comparison.compare(decision.hazard, hazard, tolerance, now);
        self.judge(decision, now);
    }

    /// Judges the turn signal commanded by Autoware, manoeuvre by manoeuvre.
    fn judge(&mut self, decision: &Decision, now: MonoTime) {
        let limit = self.settings.decider.age_limits.own_command;
        let odometry = self.latest.odometry.map(|odometry| odometry.value).unwrap_or_default();
        let cycle = JudgedCycle::of(decision, odometry, self.latest.own_turn, limit, now);
        let judged = self.judge.on_cycle(cycle);
        let wrong = judged.iter().rfind(|judged| judged.verdict != SignalVerdict::Agree);
        self.last_wrong = wrong.map(WrongSignal::of).or(self.last_wrong.take());
    }
}
