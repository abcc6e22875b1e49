//! The command machine: commands, control mode, reports and sent frames in; frames to send and statuses out.
//!
//! It runs in real time. Hand it every input with [`CommandFlow::handle_input`], [`CommandFlow::handle_report`]
//! and the methods for frames, then call [`CommandFlow::settle`], and again at
//! [`CommandFlow::next_deadline`]; drain [`CommandFlow::poll_output`] after each settling.

use std::collections::VecDeque;

use super::arbitration::{Decision, Situation, arbitrate};
use super::control_mode::{Grants, Mode};
use super::feedback_monitor::{Compliance, FeedbackMonitor};
use super::input::CommandInput;
use super::intake::{CommandState, Intake, merged_hazard};
use super::message::{CommandMessage, Contents};
use super::origin::{CommandOrigin, SampleId};
use super::output::CommandOutput;
use super::push_button::PushButton;
use super::sender::{FrameOrigin, SendCounts, SendProblem, Sender};
use super::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit};
use super::stale_message_filter::StaleMessageFilter;
use super::{Reported, Turn};
use crate::core::can::bus::Bus;
use crate::core::can::error_frame::ControllerState;
use crate::core::can::frame::{CanId, Frame};
use crate::core::can::link::{BusIndex, LinkState};
use crate::core::time::timer_table::TimerTable;
use crate::core::time::{MonoTime, Now, WallStamp, deadline_after};
use crate::core::validation::meaning::Meaning;
use crate::core::validation::observation::{Observations, Reading};
use crate::core::validation::table::MessageIndex;

/// The command machine.
#[derive(Debug, Clone)]
pub struct CommandFlow {
    pub(super) settings: CommandSettings,
    pub(super) binding: CommandBinding,
    observations: Observations,
    pub(super) turn: Intake<Turn>,
    pub(super) hazard: Intake<bool>,
    /// Hazard commands of this gateway's own decider, where it is the source.
    decider_hazard: Intake<bool>,
    /// The last mode of the topic, and when it was received.
    reported_mode: Option<(Mode, MonoTime)>,
    stale_mode_filter: StaleMessageFilter,
    pub(super) undefined_modes: u64,
    pub(super) reported: Reported,
    pub(super) turn_feedback: FeedbackMonitor<Turn>,
    pub(super) hazard_feedback: FeedbackMonitor<bool>,
    /// The last value of each signal for a driver override.
    driver_signals: Vec<bool>,
    /// The sender of each message of the profile.
    outputs: Vec<MessageOutput>,
    stopping: bool,
    finding: Finding,
    timers: TimerTable<Timer>,
    ready: VecDeque<CommandOutput>,
}

/// The deadlines of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Timer {
    TurnCommand,
    HazardCommand,
    DeciderHazard,
    ControlMode,
    TurnFeedback,
    HazardFeedback,
    /// The signals that are received for commands become too old.
    Signals,
    Button,
    /// A frame is due, or a foreign one is no longer shown.
    Frame,
}

/// One message of the profile on its way out.
#[derive(Debug, Clone)]
struct MessageOutput {
    sender: Sender,
    button: Option<PushButton>,
    /// Frames sent before the gateway began to end.
    sent_before_stop: u64,
    /// The contents of its last frame.
    last_contents: Option<Contents>,
}

/// The present state as the statuses show it; a change of it is news.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Finding {
    pub(super) decision: Decision,
    pub(super) mode: Mode,
    pub(super) turn: FunctionFinding<Turn>,
    pub(super) hazard: FunctionFinding<bool>,
    /// True if all attempts with a button were without response.
    pub(super) button_given_up: bool,
    /// The first bus that commands cannot be sent on.
    pub(super) cut_off: Option<BusIndex>,
    /// The worst of all messages.
    pub(super) problem: Option<SendProblem>,
    /// The first message that somebody else sends as well.
    pub(super) conflicting_sender: Option<usize>,
}

/// What has become of a function's request on the bus, at its worst of all messages that carry the function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) enum Delivery {
    /// It was sent, as far as the sockets know.
    #[default]
    Sent,
    /// It is not sent: a dry run.
    DryRun,
    /// The last frame could not be sent.
    Failing,
    /// Nothing can be sent on the bus.
    CutOff,
}

/// The finding about one function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FunctionFinding<T> {
    pub(super) delivery: Delivery,
    pub(super) command_state: CommandState<T>,
    /// The undefined number of a command within the last second.
    pub(super) undefined_number: Option<u8>,
    pub(super) is_oscillating: bool,
    pub(super) compliance: Compliance,
    pub(super) reported: Option<T>,
}

impl CommandFlow {
    /// A machine that has received and sent nothing. The first frames come out of the first [`Self::settle`].
    pub fn new(settings: CommandSettings, binding: CommandBinding, now: Now) -> Self {
        let output = |message: &CommandMessage| MessageOutput {
            sender: Sender::new(message),
            button: message.hazard.as_ref().and_then(|part| part.button).map(PushButton::new),
            sent_before_stop: 0,
            last_contents: None,
        };
        Self {
            observations: Observations::new(&binding.table),
            turn: Intake::new(settings.turn_timeout, now.wall),
            hazard: Intake::new(settings.hazard_timeout, now.wall),
            decider_hazard: Intake::new(settings.hazard_timeout, now.wall),
            reported_mode: None,
            stale_mode_filter: StaleMessageFilter::new(now.wall, settings.mode_timeout().unwrap_or_default()),
            undefined_modes: 0,
            reported: Reported::default(),
            turn_feedback: FeedbackMonitor::new(settings.limits),
            hazard_feedback: FeedbackMonitor::new(settings.limits),
            driver_signals: vec![false; binding.driver.len()],
            outputs: binding.messages.iter().map(output).collect(),
            stopping: false,
            finding: Finding::default(),
            timers: TimerTable::default(),
            ready: VecDeque::new(),
            settings,
            binding,
        }
    }

    /// Takes an input. Turn commands count only from the configured source; hazard commands of the decider,
    /// where it is the source, count beside those of the topic.
    pub fn handle_input(&mut self, input: CommandInput, now: Now) {
        match input {
            CommandInput::Turn { origin, command, stamp } => {
                if CommandSource::from(origin) == self.settings.source {
                    self.turn.handle_command(command, origin, stamp, now);
                }
            }
            CommandInput::Hazard { origin: origin @ CommandOrigin::Topic(_), command, stamp } => {
                self.hazard.handle_command(command, origin, stamp, now);
            }
            CommandInput::Hazard { origin: origin @ CommandOrigin::Decider, command, stamp } => {
                if self.settings.source == CommandSource::Decider {
                    self.decider_hazard.handle_command(command, origin, stamp, now);
                }
            }
            CommandInput::ControlMode { sample, mode, stamp } => {
                self.handle_control_mode(mode.into(), sample, stamp, now);
            }
            CommandInput::Sent(frame) => {
                if let Some((output, _)) = self.output_of(frame.bus(), frame.frame().id()) {
                    output.sender.handle_sent(now.mono);
                }
            }
            CommandInput::SendFailed { frame, failure } => {
                if let Some((output, message)) = self.output_of(frame.bus(), frame.frame().id()) {
                    output.sender.handle_failure(message, frame.frame(), failure, now.mono);
                }
                self.timers.set(Timer::Frame, self.next_frame(now.mono));
            }
            CommandInput::Stop => {
                if !std::mem::replace(&mut self.stopping, true) {
                    for output in &mut self.outputs {
                        output.sent_before_stop = output.sender.counts().sent;
                    }
                }
            }
        }
    }

    /// Takes the present reports of the vehicle's lights.
    pub fn handle_report(&mut self, reported: Reported) {
        self.reported = reported;
    }

    /// Takes a frame of the vehicle after its bus has; false for a message that is not of [`CommandBinding::table`],
    /// which is ignored.
    pub fn handle_frame(&mut self, bus: BusIndex, frame: &Frame, stamp: WallStamp, now: Now) -> bool {
        let mut messages = self.binding.table.messages.iter();
        let at = messages.position(|message| message.bus == bus && message.id == frame.id());
        if let Some(at) = at {
            // A frame that is not used is counted, and its signals have no value for that reason.
            let _unused =
                self.observations.frame_arrived(&self.binding.table, MessageIndex(at), frame, stamp, now);
        }
        at.is_some()
    }

    /// Tells whose frame was received, before any other flow takes it: only a frame of
    /// [`FrameOrigin::Vehicle`] may count as the vehicle's.
    pub fn classify_frame(&mut self, bus: BusIndex, frame: &Frame, now: Now) -> FrameOrigin {
        self.output_of(bus, frame.id())
            .map_or(FrameOrigin::Vehicle, |(output, _)| output.sender.classify_frame(frame, now.mono))
    }

    /// Forgets what was received on a bus.
    pub fn forget_bus(&mut self, bus: BusIndex) {
        self.observations.forget_bus(&self.binding.table, bus);
    }

    /// Forgets the event messages of a bus that was silent.
    pub fn forget_events(&mut self, bus: BusIndex) {
        self.observations.forget_events(&self.binding.table, bus);
    }

    /// True if nothing is left to be sent after [`CommandInput::Stop`].
    pub fn is_finished(&self) -> bool {
        self.stopping && self.outputs.iter().all(|output| !output.sender.is_waiting())
    }

    /// Brings everything up to now, and queues the frames that are due. True when the statuses have changed.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> bool {
        let mono = now.mono;
        let turn = self.turn.command_state(mono);
        let hazard = merged_hazard(self.hazard.command_state(mono), self.decider_hazard.command_state(mono));
        let mode = self.mode(buses, mono);
        let overrides = self.driver_overrides(buses, mono);
        let rules = self.settings.rules;
        let (driver, stopping) = (Grants::default(), self.stopping);
        let situation = Situation { turn, hazard, mode, driver, hazard_without_feedback: false, stopping };
        let driver = self.supervise(arbitrate(rules, &situation), overrides, mono);
        let hazard_without_feedback =
            self.is_live() && self.reported.hazard.is_none() && !self.hazard_feedback.is_own_light();
        let decision = arbitrate(rules, &Situation { driver, hazard_without_feedback, ..situation });
        let cut_off = self.send(decision, buses, mono);
        let finding = Finding {
            decision,
            mode,
            turn: FunctionFinding {
                delivery: self.delivery(buses, mono, |message| message.turn.is_some()),
                command_state: turn,
                undefined_number: self.turn.undefined_number(mono),
                is_oscillating: self.turn.is_oscillating(mono),
                compliance: self.turn_feedback.compliance(),
                reported: self.reported.turn,
            },
            hazard: FunctionFinding {
                delivery: self.delivery(buses, mono, carries_hazard),
                command_state: hazard,
                undefined_number: self.hazard.undefined_number(mono),
                is_oscillating: self.hazard.is_oscillating(mono),
                compliance: self.hazard_feedback.compliance(),
                reported: self.reported.hazard,
            },
            button_given_up: self.is_live() && self.buttons().any(PushButton::has_given_up),
            cut_off,
            problem: self.outputs.iter().filter_map(|output| output.sender.problem()).max(),
            conflicting_sender: self
                .outputs
                .iter()
                .position(|output| output.sender.has_conflicting_sender(mono)),
        };
        self.set_timers(mono);
        std::mem::replace(&mut self.finding, finding) != finding
    }

    /// The next frame, oldest first; `None` when all were taken.
    pub fn poll_output(&mut self) -> Option<CommandOutput> {
        self.ready.pop_front()
    }

    /// When to call [`Self::settle`] without an input; `None` while nothing is due.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.timers.next_deadline()
    }

    /// The request to the vehicle and its reasons, as settled last.
    pub fn decision(&self) -> Decision {
        self.finding.decision
    }

    /// Frames of each message since start, in the order of the profile.
    pub fn send_counts(&self) -> impl Iterator<Item = (&str, SendCounts)> {
        let names = self.binding.messages.iter().map(|message| message.name.as_str());
        names.zip(self.outputs.iter().map(|output| output.sender.counts()))
    }

    /// Last values of the signals that are received for commands.
    pub(super) fn observations(&self) -> &Observations {
        &self.observations
    }

    pub(super) fn finding(&self) -> &Finding {
        &self.finding
    }

    pub(super) fn is_live(&self) -> bool {
        self.settings.transmit == Transmit::On
    }

    /// A control mode of the topic. Ignored when the mode comes from a signal, and when it is stale.
    fn handle_control_mode(&mut self, mode: Mode, sample: SampleId, stamp: WallStamp, now: Now) {
        let is_from_topic = self.settings.mode_timeout().is_some();
        if !is_from_topic || self.stale_mode_filter.check(sample, stamp, false, now).is_err() {
            return;
        }
        self.reported_mode = Some((mode, now.mono));
        self.undefined_modes += u64::from(matches!(mode, Mode::Undefined(_)));
    }

    /// The way out of a message that the gateway sends, with its description.
    fn output_of(&mut self, bus: BusIndex, id: CanId) -> Option<(&mut MessageOutput, &CommandMessage)> {
        let is_it =
            |message: &CommandMessage| message.permission.bus() == bus && message.permission.id() == id;
        self.outputs.iter_mut().zip(&self.binding.messages).find(|(_, message)| is_it(message))
    }

    fn next_frame(&self, now: MonoTime) -> Option<MonoTime> {
        self.outputs.iter().filter_map(|output| output.sender.next_deadline(now)).min()
    }

    /// Sets all timers by what was settled at `now`.
    fn set_timers(&mut self, now: MonoTime) {
        let reported_mode = self.reported_mode.zip(self.settings.mode_timeout());
        let mode = reported_mode.map(|((_, at), timeout)| deadline_after(at, timeout));
        let button = self.buttons().filter_map(PushButton::next_deadline).min();
        let deadlines = [
            (Timer::TurnCommand, self.turn.next_deadline(now)),
            (Timer::HazardCommand, self.hazard.next_deadline(now)),
            (Timer::DeciderHazard, self.decider_hazard.next_deadline(now)),
            (Timer::ControlMode, mode.filter(|at| *at > now)),
            (Timer::TurnFeedback, self.turn_feedback.next_deadline(now)),
            (Timer::HazardFeedback, self.hazard_feedback.next_deadline(now)),
            (Timer::Signals, self.observations.next_deadline(&self.binding.table, now)),
            (Timer::Button, button.filter(|at| *at > now)),
            (Timer::Frame, self.next_frame(now)),
        ];
        for (timer, at) in deadlines {
            self.timers.set(timer, at);
        }
    }

    /// What has become of the request of the function that these messages carry.
    fn delivery(&self, buses: &[Bus], now: MonoTime, carries: impl Fn(&CommandMessage) -> bool) -> Delivery {
        let of_message = |(output, message): (&MessageOutput, &CommandMessage)| {
            let bus = buses.get(usize::from(message.permission.bus().0));
            if !bus.is_some_and(|bus| can_send(bus, now)) {
                Delivery::CutOff
            } else if output.sender.problem().is_some() {
                Delivery::Failing
            } else if self.is_live() {
                Delivery::Sent
            } else {
                Delivery::DryRun
            }
        };
        let messages = self.outputs.iter().zip(&self.binding.messages);
        messages.filter(|(_, message)| carries(message)).map(of_message).max().unwrap_or_default()
    }

    fn buttons(&self) -> impl Iterator<Item = &PushButton> {
        self.outputs.iter().filter_map(|output| output.button.as_ref())
    }

    fn mode(&self, buses: &[Bus], now: MonoTime) -> Mode {
        let signal = self.binding.control_mode.as_ref();
        match (self.settings.mode_from, signal) {
            (ModeFrom::Topic { timeout }, _) => match self.reported_mode {
                Some((mode, at)) if now.since(at) <= timeout => mode,
                Some(_) | None => Mode::Unknown,
            },
            (ModeFrom::Signal, Some(role)) => {
                match self.observations.read(&self.binding.table, role, buses, now) {
                    Reading::Observed { meaning: Meaning::Defined(mode), .. } => Mode::Known(mode),
                    Reading::Observed { meaning: Meaning::Undefined, raw, .. } => Mode::Undefined(raw),
                    Reading::Observed { meaning: Meaning::NotAvailable | Meaning::Fault, .. }
                    | Reading::Missing(_) => Mode::Unknown,
                }
            }
            (ModeFrom::Signal, None) => Mode::Unknown,
        }
    }

    /// The functions that the vehicle signals the driver has taken over. A signal that is lost keeps its last
    /// value.
    fn driver_overrides(&mut self, buses: &[Bus], now: MonoTime) -> Grants {
        let mut overrides = Grants::default();
        for (signal, last) in self.binding.driver.iter().zip(&mut self.driver_signals) {
            let reading = self.observations.read(&self.binding.table, &signal.role, buses, now);
            if let Reading::Observed { meaning: Meaning::Defined(is_override), .. } = reading {
                *last = is_override;
            }
            overrides.turn |= *last && signal.overrides.turn;
            overrides.hazard |= *last && signal.overrides.hazard;
        }
        overrides
    }

    /// Compares the report with the request; gives the functions that are the driver's. A dry run requests
    /// nothing of the vehicle. While the hazard lights are on, reports of turn indicators show nothing.
    fn supervise(&mut self, decision: Decision, overrides: Grants, now: MonoTime) -> Grants {
        let Reported { turn, hazard } = self.reported;
        let commanded = Some(decision.commanded).filter(|_| self.is_live()).unwrap_or_default();
        let is_hazard = commanded.hazard == Some(true) || hazard == Some(true);
        if is_hazard {
            self.turn_feedback.suspend(commanded.turn, overrides.turn);
        } else {
            self.turn_feedback.update(commanded.turn, turn, overrides.turn, now);
        }
        self.hazard_feedback.update(commanded.hazard, hazard, overrides.hazard, now);
        let drivers = self.hazard_feedback.is_driver_override();
        // Where one signal requests both, a side would end hazard lights that are left to the vehicle.
        let would_end = match hazard {
            Some(true) => commanded.hazard.is_none() || (commanded.hazard == Some(false) && drivers),
            None => {
                let own_lights = self.hazard_feedback.is_own_light() || self.turn_feedback.is_own_light();
                commanded.turn == Some(Turn::Off) && !is_hazard && !own_lights
            }
            Some(false) => false,
        };
        let would_end = would_end && self.is_live() && self.binding.shares_signal();
        Grants { turn: self.turn_feedback.is_driver_override() || would_end, hazard: drivers }
    }

    /// Queues the frames that are due; gives the first bus on which none can be sent.
    fn send(&mut self, decision: Decision, buses: &[Bus], now: MonoTime) -> Option<BusIndex> {
        let mut cut_off = None;
        for (output, message) in self.outputs.iter_mut().zip(&self.binding.messages) {
            let bus = message.permission.bus();
            if !buses.get(usize::from(bus.0)).is_some_and(|bus| can_send(bus, now)) {
                output.sender.cut_off();
                if let Some(button) = &mut output.button {
                    button.forget();
                }
                cut_off = cut_off.or(Some(bus));
                continue;
            }
            let requested = decision.request.hazard.filter(|_| !self.stopping);
            let press = |button: &mut PushButton| button.update(requested, self.reported.hazard, now);
            let pressed = output.button.as_mut().is_some_and(press);
            let has_ended = self.stopping && output.sender.counts().sent > output.sent_before_stop;
            let contents = message.contents(decision.request, pressed).filter(|_| !has_ended);
            if let Some(frame) = output.sender.settle(message, contents, now) {
                let is_news = std::mem::replace(&mut output.last_contents, contents) != contents;
                self.ready.push_back(match self.settings.transmit {
                    Transmit::On => CommandOutput::Transmit { frame, is_news },
                    Transmit::Off => {
                        output.sender.forget_echoes();
                        CommandOutput::WouldTransmit { bus, frame: *frame.frame(), is_news }
                    }
                });
            }
        }
        cut_off
    }
}

/// True if a message requests hazard lights, by a part of its own or together with the turn indicators.
fn carries_hazard(message: &CommandMessage) -> bool {
    message.hazard.is_some() || message.turn.as_ref().is_some_and(|turn| turn.hazard.is_some())
}

/// True if frames can be sent on a bus.
fn can_send(bus: &Bus, now: MonoTime) -> bool {
    bus.link() == LinkState::Up && bus.controller().shown(now) != Some(ControllerState::BusOff)
}
