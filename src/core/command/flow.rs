//! The whole command flow: commands, control mode and reports in, frames and what there is to say of
//! them out.

use std::collections::VecDeque;

use super::allow_list::CommandFrame;
use super::arbitration::{Decision, Situation, arbitrate};
use super::control_mode::{ControlMode, Grants, Mode};
use super::feedback_monitor::{Compliance, FeedbackMonitor};
use super::input::CommandInput;
use super::intake::{CommandState, Intake, Refusal, hazard_command_value, merged_hazard, turn_command_value};
use super::message::Contents;
use super::output::CommandOutput;
use super::push_button::PushButton;
use super::sender::{FrameOrigin, SendCounts, SendFailure, SendProblem, Sender};
use super::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit};
use super::stale_message_filter::StaleMessageFilter;
use super::{Reported, Turn};
use crate::core::can::bus::Bus;
use crate::core::can::error_frame::ControllerState;
use crate::core::can::frame::Frame;
use crate::core::can::link::{BusIndex, LinkState};
use crate::core::time::{MonoTime, Now, WallStamp, deadline_after};
use crate::core::validation::meaning::Meaning;
use crate::core::validation::observation::{Observations, Reading};
use crate::core::validation::table::{MessageIndex, Role};

/// Commands with everything around them.
#[derive(Debug, Clone)]
pub struct CommandFlow {
    pub(super) settings: CommandSettings,
    pub(super) binding: CommandBinding,
    observations: Observations,
    pub(super) turn: Intake<Turn>,
    pub(super) hazard: Intake<bool>,
    /// What this gateway's own decider says of the hazard lights, where it is the source.
    decider_hazard: Intake<bool>,
    /// The last value of the topic, and when it came.
    reported_mode: Option<(u8, MonoTime)>,
    stale_mode_filter: StaleMessageFilter,
    pub(super) undefined_modes: u64,
    pub(super) reported: Reported,
    pub(super) turn_feedback: FeedbackMonitor<Turn>,
    pub(super) hazard_feedback: FeedbackMonitor<bool>,
    /// What each sign of the driver said last.
    signs: Vec<bool>,
    /// One for each message.
    pub(super) outputs: Vec<MessageOutput>,
    stopping: bool,
    state: Finding,
    ready: VecDeque<CommandOutput>,
}

/// What there is for one message of the profile.
#[derive(Debug, Clone)]
pub(super) struct MessageOutput {
    pub(super) sender: Sender,
    button: Option<PushButton>,
    /// Frames sent before the gateway began to end.
    sent_before_stop: u64,
    /// What its last frame said, counter and checksum aside.
    said: Option<Contents>,
}

/// What diagnostics speak of; when it changes they have something new to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Finding {
    pub(super) decision: Decision,
    pub(super) mode: Mode,
    pub(super) turn: FunctionFinding<Turn>,
    pub(super) hazard: FunctionFinding<bool>,
    /// Whether all attempts with a button were without response.
    pub(super) button_given_up: bool,
    /// The first bus that commands cannot be sent on.
    pub(super) cut_off: Option<BusIndex>,
    /// The worst of all messages.
    pub(super) problem: Option<SendProblem>,
    /// The first message that somebody else sends as well.
    pub(super) conflicting_sender: Option<usize>,
}

/// The part about one function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FunctionFinding<T> {
    pub(super) command_state: CommandState<T>,
    pub(super) refusal: Option<Refusal>,
    pub(super) is_oscillating: bool,
    pub(super) compliance: Compliance,
    /// The report, as long as it is what the compliance is about.
    pub(super) reported: Option<T>,
}

impl CommandFlow {
    /// Nothing received, nothing sent. The first frames come out of the first [`Self::settle`].
    pub fn new(settings: CommandSettings, binding: CommandBinding, now: Now) -> Self {
        let output = |message| MessageOutput {
            sender: Sender::new(message),
            button: None,
            sent_before_stop: 0,
            said: None,
        };
        let mut outputs: Vec<_> = binding.messages.iter().map(output).collect();
        for (output, message) in outputs.iter_mut().zip(&binding.messages) {
            let rules = message.hazard.as_ref().and_then(|part| part.button);
            output.button = rules.map(PushButton::new);
        }
        let turn = Intake::new(turn_command_value, settings.turn_timeout, now.wall);
        let hazard = Intake::new(hazard_command_value, settings.hazard_timeout, now.wall);
        let decider_hazard = hazard.clone();
        let situation = Situation {
            turn: turn.command_state(now.mono),
            hazard: hazard.command_state(now.mono),
            mode: Mode::Unknown,
            driver: Grants::default(),
            hazard_without_feedback: false,
            stopping: false,
        };
        let state = Finding {
            decision: arbitrate(settings.rules, &situation),
            mode: Mode::Unknown,
            turn: FunctionFinding::none(situation.turn),
            hazard: FunctionFinding::none(situation.hazard),
            button_given_up: false,
            cut_off: None,
            problem: None,
            conflicting_sender: None,
        };
        Self {
            observations: Observations::new(&binding.table),
            turn,
            hazard,
            decider_hazard,
            reported_mode: None,
            stale_mode_filter: StaleMessageFilter::before(now.wall),
            undefined_modes: 0,
            reported: Reported::default(),
            turn_feedback: FeedbackMonitor::new(settings.limits),
            hazard_feedback: FeedbackMonitor::new(settings.limits),
            signs: vec![false; binding.driver.len()],
            outputs,
            stopping: false,
            state,
            ready: VecDeque::new(),
            settings,
            binding,
        }
    }

    /// Takes a message. Turn commands of the topic are ignored where the decider is the source: then nobody
    /// else is. Call [`Self::settle`] afterwards, as after all that follow.
    pub fn handle_input(&mut self, input: CommandInput, now: Now) {
        match input {
            CommandInput::Turn { .. } if self.follows_decider() => {}
            CommandInput::Turn { raw, stamp } => self.turn_command(raw, stamp, now),
            CommandInput::Hazard { raw, stamp } => self.hazard_command(raw, stamp, now),
            CommandInput::ControlMode { raw, stamp } => self.control_mode(raw, stamp, now),
        }
    }

    /// Takes `TurnIndicatorsCommand.command`, of the topic or of the decider, as the settings say.
    pub fn turn_command(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        self.turn.take(raw, stamp, now);
    }

    /// Takes `HazardLightsCommand.command`.
    pub fn hazard_command(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        self.hazard.take(raw, stamp, now);
    }

    /// Takes what the decider says of the hazard lights, by the values of `HazardLightsCommand.command`: on
    /// counts beside the topic, anything else only while the topic requests nothing.
    pub fn decider_hazard(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        self.decider_hazard.take(raw, stamp, now);
    }

    /// Takes `ControlModeReport.mode`. Ignored when the mode comes from a signal. A report that are stale is not
    /// used, like a command.
    pub fn control_mode(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        let ModeFrom::Topic { timeout } = self.settings.mode_from else { return };
        let is_active = self.reported_mode.is_some_and(|(_, at)| now.mono.since(at) <= timeout);
        if self.stale_mode_filter.rejects_as_stale(is_active, stamp, timeout, now) {
            return;
        }
        self.reported_mode = Some((raw, now.mono));
        self.undefined_modes += u64::from(ControlMode::from_raw(raw).is_none());
    }

    /// Takes what the gateway reports of the vehicle's lights now.
    pub fn report(&mut self, reported: Reported) {
        self.reported = reported;
    }

    /// Takes a frame of a message of [`CommandBinding::table`], after its bus has.
    pub fn frame_arrived(&mut self, message: MessageIndex, frame: &Frame, stamp: WallStamp, now: Now) {
        self.observations.frame_arrived(&self.binding.table, message, frame, stamp, now);
    }

    /// Says whose frame came in, before anybody else looks at it: only [`FrameOrigin::Vehicle`] may count as
    /// the vehicle's.
    pub fn classify_frame(&mut self, bus: BusIndex, frame: &Frame, now: Now) -> FrameOrigin {
        let is_it = |permission: &super::allow_list::SendPermission| {
            permission.bus() == bus && permission.id() == frame.id()
        };
        let at = self.binding.messages.iter().position(|message| is_it(&message.permission));
        at.and_then(|at| self.outputs.get_mut(at))
            .map_or(FrameOrigin::Vehicle, |output| output.sender.classify_frame(frame, now.mono))
    }

    /// A frame was sent only at this time, which is later than that of [`Self::settle`]: the next one
    /// keeps its distance from then on.
    pub fn sent(&mut self, frame: &CommandFrame, at: MonoTime) {
        for (output, message) in self.outputs.iter_mut().zip(&self.binding.messages) {
            if message.permission.bus() == frame.bus() && message.permission.id() == frame.frame().id() {
                output.sender.sent_at(at);
            }
        }
    }

    /// A frame that was to be sent could not be; to be told before the next [`Self::settle`].
    pub fn not_sent(&mut self, frame: &CommandFrame, why: SendFailure, now: Now) {
        for (output, message) in self.outputs.iter_mut().zip(&self.binding.messages) {
            if message.permission.bus() == frame.bus() && message.permission.id() == frame.frame().id() {
                output.sender.not_sent(message, frame.frame(), why, now.mono);
            }
        }
    }

    /// Forgets what came over a bus.
    pub fn forget_bus(&mut self, bus: BusIndex) {
        self.observations.forget_bus(&self.binding.table, bus);
    }

    /// Forgets the event messages of a bus that was silent.
    pub fn forget_events(&mut self, bus: BusIndex) {
        self.observations.forget_events(&self.binding.table, bus);
    }

    /// The gateway is about to end: one last frame of each message, then no more. Go on with
    /// [`Self::settle`] until [`Self::is_finished`], but not for ever.
    pub fn stop(&mut self) {
        if !std::mem::replace(&mut self.stopping, true) {
            for output in &mut self.outputs {
                output.sent_before_stop = output.sender.counts().sent;
            }
        }
    }

    /// Whether nothing is left to be sent after [`Self::stop`].
    pub fn is_finished(&self) -> bool {
        self.stopping && self.outputs.iter().all(|output| !output.sender.is_waiting())
    }

    /// Brings everything up to now. True when the diagnostics have something new to say.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> bool {
        let mono = now.mono;
        let turn = self.turn.command_state(mono);
        let hazard = merged_hazard(self.hazard.command_state(mono), self.decider_hazard.command_state(mono));
        let mode = self.mode(buses, mono);
        let signs = self.driver_signs(buses, mono);
        let rules = self.settings.rules;
        let (driver, stopping) = (Grants::default(), self.stopping);
        let situation = Situation { turn, hazard, mode, driver, hazard_without_feedback: false, stopping };
        let driver = self.supervise(arbitrate(rules, &situation), signs, mono);
        let hazard_without_feedback =
            self.is_live() && self.reported.hazard.is_none() && !self.hazard_feedback.is_own_light();
        let decision = arbitrate(rules, &Situation { driver, hazard_without_feedback, ..situation });
        let cut_off = self.send(decision, buses, mono);
        let finding = Finding {
            decision,
            mode,
            turn: FunctionFinding {
                command_state: turn,
                refusal: self.turn.refusal(mono),
                is_oscillating: self.turn.is_oscillating(mono),
                compliance: self.turn_feedback.compliance(),
                reported: self.reported.turn,
            },
            hazard: FunctionFinding {
                command_state: hazard,
                refusal: self.hazard.refusal(mono),
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
        std::mem::replace(&mut self.state, finding) != finding
    }

    /// The next frame, oldest first.
    pub fn poll_output(&mut self) -> Option<CommandOutput> {
        self.ready.pop_front()
    }

    /// When [`Self::settle`] has something to do.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let mode = match self.settings.mode_from {
            ModeFrom::Topic { timeout } => self.reported_mode.map(|(_, at)| deadline_after(at, timeout)),
            ModeFrom::Signal => None,
        };
        let monitors =
            self.turn_feedback.next_deadline(now).into_iter().chain(self.hazard_feedback.next_deadline(now));
        let intakes = self.turn.next_deadline(now).into_iter().chain(self.hazard.next_deadline(now));
        let intakes = intakes.chain(self.decider_hazard.next_deadline(now));
        let signals = self.observations.next_deadline(&self.binding.table, now);
        let buttons = self.buttons().filter_map(PushButton::next_deadline);
        let later = mode.into_iter().chain(monitors).chain(intakes).chain(signals).chain(buttons);
        let frames = self.outputs.iter().filter_map(|output| output.sender.next_deadline(now));
        later.filter(|at| *at > now).chain(frames).min()
    }

    /// What is requested of the vehicle, and why, as settled last.
    pub fn decision(&self) -> Decision {
        self.state.decision
    }

    /// Whether the turn commands of this gateway's own decider are carried out, not those of the topic.
    pub fn follows_decider(&self) -> bool {
        self.settings.source == CommandSource::Decider
    }

    /// What the profile binds.
    pub fn binding(&self) -> &CommandBinding {
        &self.binding
    }

    /// Frames of each message since start, in the order of the profile.
    pub fn send_counts(&self) -> impl Iterator<Item = (&str, SendCounts)> {
        let names = self.binding.messages.iter().map(|message| message.name.as_str());
        names.zip(self.outputs.iter().map(|output| output.sender.counts()))
    }

    pub(super) fn state(&self) -> &Finding {
        &self.state
    }

    pub(super) fn is_live(&self) -> bool {
        self.settings.transmit == Transmit::On
    }

    fn buttons(&self) -> impl Iterator<Item = &PushButton> {
        self.outputs.iter().filter_map(|output| output.button.as_ref())
    }

    fn mode(&self, buses: &[Bus], now: MonoTime) -> Mode {
        let signal = self.binding.control_mode.as_ref();
        match (self.settings.mode_from, signal) {
            (ModeFrom::Topic { timeout }, _) => match self.reported_mode {
                Some((raw, at)) if now.since(at) <= timeout => {
                    ControlMode::from_raw(raw).map_or(Mode::Undefined(raw.into()), Mode::Known)
                }
                Some(_) | None => Mode::Unknown,
            },
            (ModeFrom::Signal, Some(role)) => match self.read(role, buses, now) {
                Reading::Observed { meaning: Meaning::Defined(mode), .. } => Mode::Known(mode),
                Reading::Observed { meaning: Meaning::Undefined, raw, .. } => Mode::Undefined(raw),
                Reading::Observed { meaning: Meaning::NotAvailable | Meaning::Fault, .. }
                | Reading::Missing(_) => Mode::Unknown,
            },
            (ModeFrom::Signal, None) => Mode::Unknown,
        }
    }

    fn read<T: Copy>(&self, role: &Role<T>, buses: &[Bus], now: MonoTime) -> Reading<T> {
        self.observations.read(&self.binding.table, role, buses, now)
    }

    /// What the vehicle itself says the driver has taken, or said last: he has it until it says otherwise.
    fn driver_signs(&mut self, buses: &[Bus], now: MonoTime) -> Grants {
        for (at, sign) in self.binding.driver.iter().enumerate() {
            let Reading::Observed { meaning: Meaning::Defined(says), .. } = self.read(&sign.role, buses, now)
            else {
                continue;
            };
            self.signs.get_mut(at).into_iter().for_each(|known| *known = says);
        }
        let taken = self.binding.driver.iter().zip(&self.signs).filter(|(_, has)| **has);
        taken.fold(Grants::default(), |all, (sign, _)| Grants {
            turn: all.turn || sign.overrides.turn,
            hazard: all.hazard || sign.overrides.hazard,
        })
    }

    /// Holds the report against what is wanted; gives what the driver has. A dry run can want nothing
    /// of the vehicle. While the hazard lights are on, reports of turn indicators say nothing.
    fn supervise(&mut self, decision: Decision, signs: Grants, now: MonoTime) -> Grants {
        let Reported { turn, hazard } = self.reported;
        let wanted = Some(decision.wanted).filter(|_| self.is_live()).unwrap_or_default();
        let is_hazard = wanted.hazard == Some(true) || hazard == Some(true);
        if is_hazard {
            self.turn_feedback.suspend(wanted.turn, signs.turn);
        } else {
            self.turn_feedback.update(wanted.turn, turn, signs.turn, now);
        }
        self.hazard_feedback.update(wanted.hazard, hazard, signs.hazard, now);
        let drivers = self.hazard_feedback.is_driver_override();
        // Where one signal asks for both, a side would end hazard lights that are left to the vehicle.
        let would_end = match hazard {
            Some(true) => wanted.hazard.is_none() || (wanted.hazard == Some(false) && drivers),
            None => {
                let own_lights = self.hazard_feedback.is_own_light() || self.turn_feedback.is_own_light();
                wanted.turn == Some(Turn::Off) && !is_hazard && !own_lights
            }
            Some(false) => false,
        };
        let would_end = would_end && self.is_live() && self.binding.shares_signal();
        Grants { turn: self.turn_feedback.is_driver_override() || would_end, hazard: drivers }
    }

    /// Gives out the frames that are due; says on which bus none can be sent.
    fn send(&mut self, decision: Decision, buses: &[Bus], now: MonoTime) -> Option<BusIndex> {
        let mut cut_off = None;
        for (output, message) in self.outputs.iter_mut().zip(&self.binding.messages) {
            let bus = message.permission.bus();
            if !buses.get(usize::from(bus.0)).is_some_and(|bus| can_send(bus, now)) {
                output.sender.cut_off();
                output.button.iter_mut().for_each(PushButton::forget);
                cut_off = cut_off.or(Some(bus));
                continue;
            }
            let requested = decision.request.hazard.filter(|_| !self.stopping);
            let press = |button: &mut PushButton| button.update(requested, self.reported.hazard, now);
            let pressed = output.button.as_mut().is_some_and(press);
            let has_ended = self.stopping && output.sender.counts().sent > output.sent_before_stop;
            let contents = message.contents(decision.request, pressed).filter(|_| !has_ended);
            if let Some(frame) = output.sender.settle(message, contents, now) {
                let is_news = std::mem::replace(&mut output.said, contents) != contents;
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

impl<T> FunctionFinding<T> {
    fn none(command_state: CommandState<T>) -> Self {
        Self {
            command_state,
            refusal: None,
            is_oscillating: false,
            compliance: Compliance::NotRequested,
            reported: None,
        }
    }
}

/// Whether frames go anywhere.
fn can_send(bus: &Bus, now: MonoTime) -> bool {
    bus.link() == LinkState::Up && bus.controller().shown(now) != Some(ControllerState::BusOff)
}
