//! Vehicle status: reports on velocity, steering, gear, control mode and doors from bound frames.
//!
//! As with the lights, an unknown, invalid or faulty value is not published, and diagnostics show the reason
//! (docs/spec/vehicle-interface.md, "Vehicle status").

pub mod binding;
pub mod catalogue;
pub mod control_mode;
pub mod doors;
mod finding;
pub mod gear;
pub mod kinematics;
pub mod measure;
pub mod missing_dimensions;
pub mod output;
pub mod plausibility;
pub mod quantity;
pub mod role_texts;
pub mod settings;
mod snapshot;
pub mod state;
mod status;
pub mod steering;
pub mod velocity;

use crate::control_mode::ControlMode;
use crate::vehicle_report::{Publish, ReportFlow, ReportTask, StreamFlow};
use binding::StatusBinding;
use can_signal::can::{Bus, BusIndex, Frame, ReceiveTime};
use can_signal::validation::observation::{Arrival, Interruption, Observations};
use can_signal::validation::requirement::Unmet;
use can_signal::validation::table::MessageIndex;
use doors::DoorStates;
use finding::{StatusFinding, message};
use gateway_base::diagnostics::texts;
use gateway_base::time::{MonoTime, Now, WallStamp};
use gear::{Gear, GearBinding, Shifting};
use output::VehicleStatusOutput;
use plausibility::alarm::{Alarm, AlarmSet, Effect};
use plausibility::{Motion, Plausibility};
use settings::StatusSettings;
use state::{Chosen, Judged, StatusContext, StatusReason};
use steering::{SteeringSource, TireAngle};
use velocity::binding::VelocityBinding;
use velocity::speed::{self, SpeedReading};
use velocity::{Velocity, VelocityInputs, VelocityMemory};

pub use measure::StatusReport;
pub use snapshot::{DoorSnapshot, VehicleStatusSnapshot};

/// State machine of all reports.
#[derive(Debug, Clone)]
pub struct VehicleStatus {
    binding: StatusBinding,
    settings: StatusSettings,
    /// Messages whose every frame is published.
    streamed: Vec<MessageIndex>,
    observations: Observations,
    shifting: Shifting,
    memory: VelocityMemory,
    plausibility: Plausibility,
    pub(crate) velocity: StreamFlow<Velocity>,
    steering: StreamFlow<TireAngle>,
    pub(crate) gear: ReportFlow<Gear>,
    pub(crate) control_mode: ReportFlow<ControlMode>,
    pub(crate) doors: ReportFlow<DoorStates>,
    /// Reports that the profile describes, in their order.
    tasks: Vec<(StatusReport, ReportTask<StatusFinding>)>,
}

/// A value and its finding.
struct Verdict<T> {
    state: Judged<T>,
    finding: StatusFinding,
}

impl<T> Verdict<T> {
    /// Withholds the value while a requirement of the profile is not met, and adds the reason to the finding.
    /// A contradicted requirement replaces any other reason; an open requirement replaces no reason.
    fn new(state: Judged<T>, finding: StatusFinding, context: StatusContext<'_>) -> Self {
        Self::with_reason(
            match context.unmet {
                Some(unmet) if state.is_ok() || unmet.is_contradicted => Err(unmet.into()),
                Some(_) | None => state,
            },
            finding,
        )
    }

    fn with_reason(state: Judged<T>, finding: StatusFinding) -> Self {
        Self { finding: StatusFinding { reason: state.as_ref().err().copied(), ..finding }, state }
    }
}

impl VehicleStatus {
    /// Creates reports before any frame or publication.
    pub fn new(binding: StatusBinding, settings: StatusSettings, publish: Publish) -> Self {
        Self {
            streamed: streamed(&binding),
            observations: Observations::new(&binding.table),
            shifting: Shifting::default(),
            memory: VelocityMemory::default(),
            plausibility: Plausibility::default(),
            velocity: StreamFlow::new(settings.min_period),
            steering: StreamFlow::new(settings.min_period),
            gear: ReportFlow::new(publish),
            control_mode: ReportFlow::new(publish),
            doors: ReportFlow::new(publish),
            tasks: binding
                .reports()
                .map(|report| (report, ReportTask::new(binding.signals(report))))
                .collect(),
            binding,
            settings,
        }
    }

    /// Continues with another binding and other settings of the same reports. Received values, published
    /// reports and findings are kept as far as both bindings include them. Call [`Self::settle`] afterwards.
    pub fn reconfigure(
        &mut self,
        binding: StatusBinding,
        settings: StatusSettings,
        publish: Publish,
        now: MonoTime,
    ) {
        self.observations = self.observations.carried_over(&self.binding.table, &binding.table);
        self.streamed = streamed(&binding);
        (self.memory, self.plausibility) = (VelocityMemory::default(), Plausibility::default());
        self.velocity.reconfigure(settings.min_period);
        self.steering.reconfigure(settings.min_period);
        self.gear.reconfigure(publish, now);
        self.control_mode.reconfigure(publish, now);
        self.doors.reconfigure(publish, now);
        let mut known = std::mem::take(&mut self.tasks);
        let task_of = |report: StatusReport| {
            let signals = binding.signals(report);
            let Some(position) = known.iter().position(|(known, _)| *known == report) else {
                return (report, ReportTask::new(signals));
            };
            let mut task = known.swap_remove(position);
            task.1.reconfigure(signals);
            task
        };
        self.tasks = binding.reports().map(task_of).collect();
        (self.binding, self.settings) = (binding, settings);
    }

    /// Returns the binding of the status.
    pub fn binding(&self) -> &StatusBinding {
        &self.binding
    }

    /// Returns the control mode at `now`, whether or not its topic is published.
    pub fn control_mode(&self, buses: &[Bus], now: Now) -> Judged<ControlMode> {
        let binding = self.binding.control_mode.as_ref().ok_or(StatusReason::NoSource)?;
        binding.judge(self.context(buses, now))
    }

    /// Returns the context for judging values at `now`, without the requirements of the profile: commands
    /// need a profile without requirements.
    fn context<'a>(&'a self, buses: &'a [Bus], now: Now) -> StatusContext<'a> {
        StatusContext {
            table: &self.binding.table,
            settings: &self.settings,
            observations: &self.observations,
            unmet: None,
            buses,
            now,
        }
    }

    /// Handles a frame of a bound message. If it returns [`Arrival::News`], call [`Self::settle`] afterwards.
    /// A frame of a report that is published with each frame always does.
    pub fn frame_arrived(
        &mut self,
        message: MessageIndex,
        frame: &Frame,
        stamp: WallStamp,
        now: Now,
    ) -> Arrival {
        match self.observations.frame_arrived(&self.binding.table, message, frame, stamp, now) {
            Ok(Arrival::Repetition) if !self.streamed.contains(&message) => Arrival::Repetition,
            Ok(_) | Err(_) => Arrival::News,
        }
    }

    /// Forgets the values that do not survive an interruption of a bus.
    pub fn forget(&mut self, bus: BusIndex, by: Interruption) {
        self.observations.forget(&self.binding.table, bus, by);
    }

    /// Evaluates all reports, passes the actions to `emit`, and calls `changed` with each report whose
    /// finding has changed.
    pub fn settle(
        &mut self,
        unmet: Option<Unmet>,
        buses: &[Bus],
        now: Now,
        mut emit: impl FnMut(VehicleStatusOutput),
        mut changed: impl FnMut(StatusReport),
    ) {
        let binding = &self.binding;
        let context = StatusContext {
            table: &binding.table,
            settings: &self.settings,
            observations: &self.observations,
            unmet,
            buses,
            now,
        };
        let gear = gear_verdict(binding.gear.as_ref(), &mut self.shifting, context);
        let (speed, tire) = speed_and_tire(binding, self.plausibility.alarms(), context);
        let velocity = velocity_verdict(
            binding.velocity.as_ref(),
            &mut self.memory,
            &mut self.plausibility,
            speed,
            VelocityInputs { gear: gear.state, tire: tire.state },
            context,
        );
        let tire = plausible_tire(binding, tire, self.plausibility.alarms(), context);
        for (report, task) in &mut self.tasks {
            let (output, finding) = match report {
                StatusReport::Velocity => {
                    let step = self.velocity.update(velocity.state.ok(), now.mono);
                    (step.map(VehicleStatusOutput::Velocity), velocity.finding)
                }
                StatusReport::Steering => {
                    let step = self.steering.update(tire.state.ok(), now.mono);
                    (step.map(VehicleStatusOutput::Steering), tire.finding)
                }
                StatusReport::Gear => {
                    let step = self.gear.update(gear.state.ok(), now.mono);
                    (step.map(VehicleStatusOutput::Gear), gear.finding)
                }
                StatusReport::ControlMode => {
                    let mode = control_mode_verdict(binding, context);
                    let step = self.control_mode.update(mode.state.ok(), now.mono);
                    (step.map(VehicleStatusOutput::ControlMode), mode.finding)
                }
                StatusReport::Doors => {
                    let (state, fallback) = doors::judge(&binding.doors, context);
                    let finding = StatusFinding { fallback, ..StatusFinding::default() };
                    let doors = Verdict::new(state, finding, context);
                    let step = self.doors.update(doors.state.ok(), now.mono);
                    (step.map(VehicleStatusOutput::Doors), doors.finding)
                }
            };
            output.into_iter().for_each(&mut emit);
            let geometry = &context.settings.geometry;
            let is_starting = finding.reason.is_some_and(|reason| reason.is_awaited(context.is_starting()));
            let finding = StatusFinding { is_starting, ..finding.as_configured(geometry) };
            let text = || texts(&message(binding, geometry, buses, *report, finding));
            if task.update(finding, text, now.mono) {
                changed(*report);
            }
        }
    }

    /// Returns the next instant at which a signal becomes stale.
    pub fn next_stale(&self, now: MonoTime) -> Option<MonoTime> {
        self.observations.next_deadline(&self.binding.table, now)
    }

    /// Returns the next instant at which [`Self::settle`] is due without an event.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let stale = self.next_stale(now);
        let shifting = self.binding.gear.as_ref().and_then(|gear| self.shifting.next_deadline(gear, now));
        let reports =
            [self.gear.next_deadline(), self.control_mode.next_deadline(), self.doors.next_deadline()];
        [stale, shifting].into_iter().chain(reports).flatten().min()
    }
}

/// Returns the messages whose every frame is published.
fn streamed(binding: &StatusBinding) -> Vec<MessageIndex> {
    let signals = binding.quantities().map(|quantity| quantity.role.signal);
    let mut messages: Vec<_> = signals.map(|signal| binding.table.signals[signal.0].message).collect();
    messages.sort_unstable();
    messages.dedup();
    messages
}

/// Returns the value of the first source that has one, with its position; if none has, the reason of the
/// first.
fn first_usable<S, T>(
    sources: &[S],
    context: StatusContext<'_>,
    read: impl FnMut(usize, &S) -> Judged<T>,
) -> Verdict<T> {
    let Chosen { state, source, fallback } = Chosen::first(sources, read);
    Verdict::new(state, StatusFinding { source, fallback, ..StatusFinding::default() }, context)
}

/// Returns the speed without its sign, and the angle of the front wheels. Either the steering ratio may
/// depend on the speed, or the speed of the front wheels on the steering, but not both.
fn speed_and_tire(
    binding: &StatusBinding,
    alarms: AlarmSet,
    context: StatusContext<'_>,
) -> (Option<Chosen<SpeedReading>>, Verdict<TireAngle>) {
    let velocity = binding.velocity.as_ref();
    let speed = |tire| velocity.map(|velocity| speed::judge(velocity, tire, alarms, context));
    let geometry = &context.settings.geometry;
    let needs_speed = binding.steering.iter().any(|source| source.depends_on_speed(geometry));
    let known = if needs_speed { speed(Err(StatusReason::NoSpeedForSteering)) } else { None };
    let speed_mps = known.and_then(|chosen| chosen.state.ok()).map(|(reading, _)| reading.speed_mps);
    let awaited = known.and_then(|chosen| chosen.state.err()).filter(|reason| reason.is_awaited(false));
    let read = |_, source: &SteeringSource| {
        let judged = steering::judge(source, speed_mps, context);
        judged.map_err(|reason| {
            awaited.filter(|_| reason == StatusReason::NoSpeedForSteering).unwrap_or(reason)
        })
    };
    let tire = first_usable(&binding.steering, context, read);
    (speed(tire.state), tire)
}

fn velocity_verdict(
    binding: Option<&VelocityBinding>,
    memory: &mut VelocityMemory,
    plausibility: &mut Plausibility,
    speed: Option<Chosen<SpeedReading>>,
    inputs: VelocityInputs,
    context: StatusContext<'_>,
) -> Verdict<Velocity> {
    let Some((binding, speed)) = binding.zip(speed) else {
        let tire_rad = inputs.tire.ok().map(|(TireAngle(angle), _)| angle);
        plausibility.update(Motion { tire_rad, ..Motion::default() }, context.now.mono);
        return Verdict { state: Err(StatusReason::NoSource), finding: StatusFinding::default() };
    };
    let assembled = memory.assemble(binding, speed, inputs, plausibility.alarms(), context);
    let alarms = plausibility.update(assembled.motion, context.now.mono).of_steering(false);
    let finding = StatusFinding { source: speed.source, fallback: speed.fallback, ..assembled.finding };
    let verdict = Verdict::new(assembled.state, finding, context);
    plausible(verdict, alarms, &[Effect::WithholdBoth, Effect::WithholdVelocity])
}

/// Adds alarms to a verdict; one of the `effects` withholds its value.
fn plausible<T>(verdict: Verdict<T>, alarms: AlarmSet, effects: &[Effect]) -> Verdict<T> {
    let Verdict { state, finding } = verdict;
    let state = match alarms.first_with(effects) {
        Some(alarm) if state.is_ok() => Err(StatusReason::Implausible(alarm)),
        Some(_) | None => state,
    };
    Verdict::with_reason(state, StatusFinding { alarms, ..finding })
}

/// Like [`plausible`], but for the steering, which is also withheld while its ratio depends on a speed that
/// is not trusted. The checks still compare its angle.
fn plausible_tire(
    binding: &StatusBinding,
    tire: Verdict<TireAngle>,
    alarms: AlarmSet,
    context: StatusContext<'_>,
) -> Verdict<TireAngle> {
    let source = binding.steering.get(tire.finding.source);
    let depends = source.is_some_and(|source| source.depends_on_speed(&context.settings.geometry));
    let effects = &[Effect::WithholdBoth, Effect::WithholdSteering];
    let tire = plausible(tire, alarms.of_steering(true), effects);
    if tire.state.is_ok() && depends && Alarm::OF_SPEED.into_iter().any(|alarm| alarms.has(alarm)) {
        return Verdict::with_reason(Err(StatusReason::NoSpeedForSteering), tire.finding);
    }
    tire
}

fn gear_verdict(
    binding: Option<&GearBinding>,
    shifting: &mut Shifting,
    context: StatusContext<'_>,
) -> Verdict<Gear> {
    let Some(binding) = binding else {
        return first_usable(&[(); 0], context, |_, ()| Err(StatusReason::NoSource));
    };
    let chosen = context.settings.gear_source.as_deref();
    first_usable(&binding.sources, context, |position, source| {
        if chosen.is_some_and(|chosen| chosen != source.name) {
            return Err(StatusReason::NotChosen);
        }
        shifting.judge(binding, position, context.defined(&source.role), context)
    })
}

fn control_mode_verdict(binding: &StatusBinding, context: StatusContext<'_>) -> Verdict<ControlMode> {
    let binding = binding.control_mode.as_ref();
    let state = binding.map_or(Err(StatusReason::NoSource), |binding| binding.judge(context));
    let Verdict { state, finding } = Verdict::new(state, StatusFinding::default(), context);
    let is_not_ready = binding.is_some_and(|binding| binding.is_not_ready_while_unknown);
    let unknown = ReceiveTime { at: context.now.mono, stamp: context.now.wall };
    let state = if is_not_ready { state.or(Ok((ControlMode::NotReady, unknown))) } else { state };
    Verdict { state, finding }
}
