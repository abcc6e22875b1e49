//! The command machine: receives commands, control mode, reports and sent frames; returns frames to send and
//! statuses.
//!
//! It runs in real time. Pass every input to [`CommandFlow::handle_input`], [`CommandFlow::handle_report`] or
//! a method for frames, then call [`CommandFlow::settle`]; call it again at [`CommandFlow::next_deadline`].
//! Drain [`CommandFlow::poll_output`] after each call of `settle`.

use std::collections::VecDeque;

use super::arbitration::{CommandDecision, Situation, arbitrate};
use super::control_mode::{Grants, ModeState};
use super::feedback_monitor::{Compliance, FeedbackMonitor};
use super::input::CommandInput;
use super::intake::{CommandState, Intake, hazard_request, merged_hazard, turn_request};
use super::message::{CommandMessage, FrameContents};
use super::origin::{CommandOrigin, SampleId};
use super::output::CommandOutput;
use super::push_button::PushButton;
use super::sender::{FrameOrigin, SendCounts, SendProblem, Sender};
use super::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit};
use super::stale_message_filter::StaleMessageFilter;
use super::{Reported, Turn};
use can_signal::can::{Bus, BusIndex, CanId, ControllerState, Frame, LinkState};
use can_signal::validation::observation::{Interruption, Observations};
use gateway_base::time::timer_table::TimerTable;
use gateway_base::time::{MonoTime, Now, WallStamp, deadline_after};

/// State machine of the commands to the vehicle.
#[derive(Debug, Clone)]
pub struct CommandFlow {
    pub(super) settings: CommandSettings,
    pub(super) binding: CommandBinding,
    pub(super) observations: Observations,
    pub(super) turn: Intake<Turn>,
    pub(super) hazard: Intake<bool>,
    /// Hazard commands of the gateway's decider, if it is the source.
    decider_hazard: Intake<bool>,
    mode: ReceivedMode,
    stale_mode_filter: StaleMessageFilter,
    pub(super) undefined_modes: u64,
    pub(super) reported: Reported,
    pub(super) turn_feedback: FeedbackMonitor<Turn>,
    pub(super) hazard_feedback: FeedbackMonitor<bool>,
    /// Last value of each driver override signal.
    driver_signals: Vec<bool>,
    outputs: Vec<MessageOutput>,
    stopping: bool,
    pub(super) finding: CommandFinding,
    timers: TimerTable<CommandTimer>,
    ready: VecDeque<CommandOutput>,
}

/// The control mode as last received.
#[derive(Debug, Clone, Copy, Default)]
struct ReceivedMode {
    state: ModeState,
    /// Time from which the mode is unknown unless it is received again.
    expires: Option<MonoTime>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CommandTimer {
    TurnCommand,
    HazardCommand,
    DeciderHazard,
    ControlMode,
    TurnFeedback,
    HazardFeedback,
    /// A signal received for commands becomes stale.
    Signals,
    Button,
    /// A frame is due, or a foreign frame is no longer shown.
    Frame,
}

/// Transmission state of one message of the profile.
#[derive(Debug, Clone)]
struct MessageOutput {
    sender: Sender,
    button: Option<PushButton>,
    /// Frames sent before [`CommandInput::Stop`].
    sent_before_stop: u64,
    last_contents: Option<FrameContents>,
}

/// State shown by the statuses, which are published when it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct CommandFinding {
    pub(super) decision: CommandDecision,
    pub(super) mode: ModeState,
    pub(super) turn: FunctionFinding<Turn>,
    pub(super) hazard: FunctionFinding<bool>,
    /// True if no attempt with a button had a response.
    pub(super) button_given_up: bool,
    /// First bus on which no command can be sent.
    pub(super) cut_off: Option<BusIndex>,
    /// Worst send problem of all messages.
    pub(super) problem: Option<SendProblem>,
    /// Position of the first message that is also sent by another sender.
    pub(super) conflicting_sender: Option<usize>,
}

/// Delivery of a request on the bus: the worst delivery of all messages that carry the function.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(super) enum RequestDelivery {
    /// The sockets have accepted the frames.
    #[default]
    Sent,
    DryRun,
    Failing,
    CutOff,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct FunctionFinding<T> {
    pub(super) delivery: RequestDelivery,
    pub(super) command_state: CommandState<T>,
    /// Undefined number of a command within the last second.
    pub(super) undefined_number: Option<u8>,
    pub(super) is_oscillating: bool,
    pub(super) compliance: Compliance,
    pub(super) reported: Option<T>,
}

impl CommandFlow {
    /// Creates a machine that has received and sent nothing. The first [`Self::settle`] queues the first
    /// frames.
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
            mode: ReceivedMode::default(),
            stale_mode_filter: StaleMessageFilter::new(now.wall, settings.mode_timeout().unwrap_or_default()),
            undefined_modes: 0,
            reported: Reported::default(),
            turn_feedback: FeedbackMonitor::new(settings.limits),
            hazard_feedback: FeedbackMonitor::new(settings.limits),
            driver_signals: vec![false; binding.driver.len()],
            outputs: binding.messages.iter().map(output).collect(),
            stopping: false,
            finding: CommandFinding::default(),
            timers: TimerTable::default(),
            ready: VecDeque::new(),
            settings,
            binding,
        }
    }

    /// Handles an input. Turn commands are accepted only from the configured source; if the source is the
    /// decider, hazard commands are accepted from both decider and topic.
    pub fn handle_input(&mut self, input: CommandInput, now: Now) {
        match input {
            CommandInput::Turn { origin, command, stamp } => {
                let is_from_decider = origin == CommandOrigin::Decider;
                if is_from_decider == (self.settings.source == CommandSource::Decider) {
                    self.turn.handle_command(turn_request(command), origin, stamp, now);
                }
            }
            CommandInput::Hazard { origin, command, stamp } => {
                let intake = match (origin, self.settings.source) {
                    (CommandOrigin::Topic(_), _) => &mut self.hazard,
                    (CommandOrigin::Decider, CommandSource::Decider) => &mut self.decider_hazard,
                    (CommandOrigin::Decider, CommandSource::Topic) => return,
                };
                intake.handle_command(hazard_request(command), origin, stamp, now);
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
                self.timers.set(CommandTimer::Frame, self.next_frame(now.mono));
            }
            CommandInput::Stop => {
                if !std::mem::replace(&mut self.stopping, true) {
                    for output in &mut self.outputs {
                        output.sent_before_stop = output.sender.counts.sent;
                    }
                }
            }
        }
    }

    /// Sets the current reports of the vehicle's lights.
    pub fn handle_report(&mut self, reported: Reported) {
        self.reported = reported;
    }

    /// Returns true if the control mode comes from the vehicle's signals: in that case, call
    /// [`Self::handle_signalled_mode`] before each [`Self::settle`].
    pub fn uses_mode_signals(&self) -> bool {
        self.settings.mode_from == ModeFrom::Signal
    }

    /// Sets the control mode given by the vehicle's signals, and the time at which it expires.
    pub fn handle_signalled_mode(&mut self, state: ModeState, expires: Option<MonoTime>) {
        let is_new = state.undefined().is_some() && self.mode.state != state;
        self.undefined_modes += u64::from(is_new);
        self.mode = ReceivedMode { state, expires };
    }

    /// Handles a frame of the vehicle after its bus has handled it. Returns false for a message that is not
    /// in [`CommandBinding::table`]; it is ignored.
    pub fn handle_frame(&mut self, bus: BusIndex, frame: &Frame, stamp: WallStamp, now: Now) -> bool {
        let at = self.binding.table.message_of(bus, frame.id());
        if let Some(at) = at {
            // A frame that is not used is counted, and its signals have no value as a result.
            let _unused = self.observations.frame_arrived(&self.binding.table, at, frame, stamp, now);
        }
        at.is_some()
    }

    /// Returns the origin of a received frame. Call it before any other flow handles the frame: only a frame
    /// of [`FrameOrigin::Vehicle`] may be treated as the vehicle's.
    pub fn classify_frame(&mut self, bus: BusIndex, frame: &Frame, now: Now) -> FrameOrigin {
        self.output_of(bus, frame.id())
            .map_or(FrameOrigin::Vehicle, |(output, _)| output.sender.classify_frame(frame, now.mono))
    }

    /// Forgets the state that does not survive an interruption of a bus.
    pub fn forget(&mut self, bus: BusIndex, by: Interruption) {
        self.observations.forget(&self.binding.table, bus, by);
    }

    /// Returns true if all frames after [`CommandInput::Stop`] have been sent.
    pub fn is_finished(&self) -> bool {
        self.stopping && self.outputs.iter().all(|output| !output.sender.is_waiting())
    }

    /// Updates the state to `now` and queues due frames. Returns true if the statuses have changed.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> bool {
        let mono = now.mono;
        let turn = self.turn.command_state(mono);
        let hazard = merged_hazard(self.hazard.command_state(mono), self.decider_hazard.command_state(mono));
        let mode = self.mode(mono);
        let overrides = self.driver_overrides(buses, mono);
        let rules = self.settings.rules;
        let (driver, stopping) = (Grants::default(), self.stopping);
        let situation = Situation { turn, hazard, mode, driver, hazard_without_feedback: false, stopping };
        let driver = self.supervise(arbitrate(rules, &situation), overrides, mono);
        let hazard_without_feedback =
            self.is_live() && self.reported.hazard.is_none() && !self.hazard_feedback.is_own_light();
        let decision = arbitrate(rules, &Situation { driver, hazard_without_feedback, ..situation });
        let cut_off = self.send(decision, buses, mono);
        let finding = CommandFinding {
            decision,
            mode,
            turn: FunctionFinding {
                delivery: self.delivery(buses, mono, |message| message.turn.is_some()),
                command_state: turn,
                undefined_number: self.turn.undefined_number(mono),
                is_oscillating: self.turn.is_oscillating(mono),
                compliance: self.turn_feedback.compliance,
                reported: self.reported.turn,
            },
            hazard: FunctionFinding {
                delivery: self.delivery(buses, mono, carries_hazard),
                command_state: hazard,
                undefined_number: self.hazard.undefined_number(mono),
                is_oscillating: self.hazard.is_oscillating(mono),
                compliance: self.hazard_feedback.compliance,
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

    /// Returns the next queued frame, oldest first; `None` when the queue is empty.
    pub fn poll_output(&mut self) -> Option<CommandOutput> {
        self.ready.pop_front()
    }

    /// Returns the time at which [`Self::settle`] is due without an input; `None` while nothing is due.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        self.timers.next_deadline()
    }

    /// Returns the request to the vehicle with its reasons, as of the last [`Self::settle`].
    pub fn decision(&self) -> CommandDecision {
        self.finding.decision
    }

    /// Returns the frame counts of each message since start, in the order of the profile.
    pub fn send_counts(&self) -> impl Iterator<Item = (&str, SendCounts)> {
        let names = self.binding.messages.iter().map(|message| message.name.as_str());
        names.zip(self.outputs.iter().map(|output| output.sender.counts))
    }

    pub(super) fn is_live(&self) -> bool {
        self.settings.transmit == Transmit::On
    }

    /// Handles a control mode of the topic, which is ignored if it is stale or if the mode comes from a
    /// signal.
    fn handle_control_mode(&mut self, mode: ModeState, sample: SampleId, stamp: WallStamp, now: Now) {
        let Some(timeout) = self.settings.mode_timeout() else { return };
        if self.stale_mode_filter.check(sample, stamp, false, now).is_ok() {
            self.mode = ReceivedMode { state: mode, expires: Some(deadline_after(now.mono, timeout)) };
            self.undefined_modes += u64::from(mode.undefined().is_some());
        }
    }

    /// Returns the transmission state of a message that the gateway sends, with its description.
    fn output_of(&mut self, bus: BusIndex, id: CanId) -> Option<(&mut MessageOutput, &CommandMessage)> {
        let is_it =
            |message: &CommandMessage| message.permission.bus() == bus && message.permission.id() == id;
        self.outputs.iter_mut().zip(&self.binding.messages).find(|(_, message)| is_it(message))
    }

    fn next_frame(&self, now: MonoTime) -> Option<MonoTime> {
        self.outputs.iter().filter_map(|output| output.sender.next_deadline(now)).min()
    }

    fn set_timers(&mut self, now: MonoTime) {
        let button = self.buttons().filter_map(PushButton::next_deadline).min();
        let deadlines = [
            (CommandTimer::TurnCommand, self.turn.next_deadline(now)),
            (CommandTimer::HazardCommand, self.hazard.next_deadline(now)),
            (CommandTimer::DeciderHazard, self.decider_hazard.next_deadline(now)),
            (CommandTimer::ControlMode, self.mode.expires.filter(|at| *at > now)),
            (CommandTimer::TurnFeedback, self.turn_feedback.next_deadline(now)),
            (CommandTimer::HazardFeedback, self.hazard_feedback.next_deadline(now)),
            (CommandTimer::Signals, self.observations.next_deadline(&self.binding.table, now)),
            (CommandTimer::Button, button.filter(|at| *at > now)),
            (CommandTimer::Frame, self.next_frame(now)),
        ];
        for (timer, at) in deadlines {
            self.timers.set(timer, at);
        }
    }

    /// Returns the worst delivery among the messages that carry a function.
    fn delivery(
        &self,
        buses: &[Bus],
        now: MonoTime,
        carries: impl Fn(&CommandMessage) -> bool,
    ) -> RequestDelivery {
        let of_message = |(output, message): (&MessageOutput, &CommandMessage)| {
            let bus = buses.get(usize::from(message.permission.bus().0));
            if !bus.is_some_and(|bus| can_send(bus, now)) {
                RequestDelivery::CutOff
            } else if output.sender.problem().is_some() {
                RequestDelivery::Failing
            } else if self.is_live() {
                RequestDelivery::Sent
            } else {
                RequestDelivery::DryRun
            }
        };
        let messages = self.outputs.iter().zip(&self.binding.messages);
        messages.filter(|(_, message)| carries(message)).map(of_message).max().unwrap_or_default()
    }

    fn buttons(&self) -> impl Iterator<Item = &PushButton> {
        self.outputs.iter().filter_map(|output| output.button.as_ref())
    }

    fn mode(&self, now: MonoTime) -> ModeState {
        let ReceivedMode { state, expires } = self.mode;
        if expires.is_some_and(|expires| expires <= now) { ModeState::Unknown } else { state }
    }

    /// Returns the functions that the driver has taken over, as signalled by the vehicle. A lost signal keeps
    /// its last value.
    fn driver_overrides(&mut self, buses: &[Bus], now: MonoTime) -> Grants {
        let mut overrides = Grants::default();
        for (signal, last) in self.binding.driver.iter().zip(&mut self.driver_signals) {
            let table = &self.binding.table;
            if let Ok((is_override, _)) = self.observations.defined(table, &signal.role, buses, now) {
                *last = is_override;
            }
            overrides.turn |= *last && signal.overrides.turn;
            overrides.hazard |= *last && signal.overrides.hazard;
        }
        overrides
    }

    /// Compares the report with the request and returns the functions of the driver. A dry run requests
    /// nothing. While the hazard lights are on, reports of turn indicators are not compared.
    fn supervise(&mut self, decision: CommandDecision, overrides: Grants, now: MonoTime) -> Grants {
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
        // If one signal requests both functions, a side would end hazard lights that are left to the vehicle.
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

    /// Queues the due frames and returns the first bus on which no frame can be sent.
    fn send(&mut self, decision: CommandDecision, buses: &[Bus], now: MonoTime) -> Option<BusIndex> {
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
            let has_ended = self.stopping && output.sender.counts.sent > output.sent_before_stop;
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

/// Returns true if a message requests hazard lights, by a separate part or together with the turn indicators.
fn carries_hazard(message: &CommandMessage) -> bool {
    message.hazard.is_some() || message.turn.as_ref().is_some_and(|turn| turn.hazard.is_some())
}

fn can_send(bus: &Bus, now: MonoTime) -> bool {
    bus.link() == LinkState::Up && bus.controller().shown(now) != Some(ControllerState::BusOff)
}
