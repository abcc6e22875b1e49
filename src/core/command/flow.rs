//! The whole command flow: commands, control mode and reports in, frames and what there is to say of
//! them out.

use std::collections::VecDeque;

use super::accord::{Accord, Watch};
use super::allow_list::CommandFrame;
use super::arbitration::{Decision, Situation, arbitrate};
use super::button::Button;
use super::control_mode::{ControlMode, Grants, Mode};
use super::intake::{Intake, Opinion, Refusal, hazard_word, joined_hazard, turn_word};
use super::message::Contents;
use super::past::Past;
use super::sender::{Heard, SendCounts, SendFailure, SendTrouble, Sender};
use super::settings::{CommandBinding, CommandSettings, CommandSource, ModeFrom, Transmit};
use super::{Reported, Turn};
use crate::core::bus::{Bus, past};
use crate::core::error_frame::ControllerState;
use crate::core::event::{BusIndex, LinkState};
use crate::core::frame::Frame;
use crate::core::time::{MonoTime, Now, WallStamp};
use crate::core::trust::meaning::Meaning;
use crate::core::trust::observation::{Observations, Reading};
use crate::core::trust::table::{MessageIndex, Role};

/// One frame to act on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outgoing {
    /// Send it.
    Send {
        /// The frame and its bus.
        frame: CommandFrame,
        /// Whether it asks for something else than the one before.
        is_news: bool,
    },
    /// Dry run: only tell that it would be sent.
    WouldSend {
        /// Where it would go.
        bus: BusIndex,
        /// What would go there.
        frame: Frame,
        /// Whether it asks for something else than the one before.
        is_news: bool,
    },
}

/// Commands with everything around them.
#[derive(Debug, Clone)]
pub struct CommandFlow {
    pub(super) settings: CommandSettings,
    pub(super) binding: CommandBinding,
    seen: Observations,
    pub(super) turn: Intake<Turn>,
    pub(super) hazard: Intake<bool>,
    /// What this gateway's own decider says of the hazard lights, where it is the source.
    decided_hazard: Intake<bool>,
    /// The last value of the topic, and when it came.
    told_mode: Option<(u8, MonoTime)>,
    modes_of_the_past: Past,
    pub(super) undefined_modes: u64,
    pub(super) reported: Reported,
    pub(super) turn_watch: Watch<Turn>,
    pub(super) hazard_watch: Watch<bool>,
    /// What each sign of the driver said last.
    signs: Vec<bool>,
    /// One for each message.
    pub(super) lines: Vec<Line>,
    stopping: bool,
    state: Finding,
    ready: VecDeque<Outgoing>,
}

/// What there is for one message of the profile.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) sender: Sender,
    button: Option<Button>,
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
    /// Whether all attempts with a button were in vain.
    pub(super) button_given_up: bool,
    /// The first bus that commands cannot be sent on.
    pub(super) cut_off: Option<BusIndex>,
    /// The worst of all messages.
    pub(super) trouble: Option<SendTrouble>,
    /// The first message that somebody else sends as well.
    pub(super) rival: Option<usize>,
}

/// The part about one function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FunctionFinding<T> {
    pub(super) opinion: Opinion<T>,
    pub(super) refusal: Option<Refusal>,
    pub(super) is_unsteady: bool,
    pub(super) accord: Accord,
    /// The report, as long as it is what the accord is about.
    pub(super) reported: Option<T>,
}

impl CommandFlow {
    /// Nothing heard, nothing sent. The first frames come out of the first [`Self::settle`].
    pub fn new(settings: CommandSettings, binding: CommandBinding, now: Now) -> Self {
        let line =
            |message| Line { sender: Sender::new(message), button: None, sent_before_stop: 0, said: None };
        let mut lines: Vec<_> = binding.messages.iter().map(line).collect();
        for (line, message) in lines.iter_mut().zip(&binding.messages) {
            let rules = message.hazard.as_ref().and_then(|part| part.button);
            line.button = rules.map(Button::new);
        }
        let turn = Intake::new(turn_word, settings.turn_timeout, now.wall);
        let hazard = Intake::new(hazard_word, settings.hazard_timeout, now.wall);
        let decided_hazard = hazard.clone();
        let situation = Situation {
            turn: turn.opinion(now.mono),
            hazard: hazard.opinion(now.mono),
            mode: Mode::Unknown,
            driver: Grants::default(),
            hazard_unproven: false,
            stopping: false,
        };
        let state = Finding {
            decision: arbitrate(settings.rules, &situation),
            mode: Mode::Unknown,
            turn: FunctionFinding::none(situation.turn),
            hazard: FunctionFinding::none(situation.hazard),
            button_given_up: false,
            cut_off: None,
            trouble: None,
            rival: None,
        };
        Self {
            seen: Observations::new(&binding.table),
            turn,
            hazard,
            decided_hazard,
            told_mode: None,
            modes_of_the_past: Past::before(now.wall),
            undefined_modes: 0,
            reported: Reported::default(),
            turn_watch: Watch::new(settings.limits),
            hazard_watch: Watch::new(settings.limits),
            signs: vec![false; binding.driver.len()],
            lines,
            stopping: false,
            state,
            ready: VecDeque::new(),
            settings,
            binding,
        }
    }

    /// Takes `TurnIndicatorsCommand.command`, of the topic or of the decider, as the settings say. Call
    /// [`Self::settle`] afterwards, as after all that follow.
    pub fn turn_command(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        self.turn.take(raw, stamp, now);
    }

    /// Takes `HazardLightsCommand.command`.
    pub fn hazard_command(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        self.hazard.take(raw, stamp, now);
    }

    /// Takes what the decider says of the hazard lights, by the values of `HazardLightsCommand.command`: on
    /// counts beside the topic, anything else only while the topic has no opinion.
    pub fn decided_hazard(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        self.decided_hazard.take(raw, stamp, now);
    }

    /// Takes `ControlModeReport.mode`. Ignored when the mode comes from a signal. A report of the past is not
    /// used, like a command.
    pub fn control_mode(&mut self, raw: u8, stamp: WallStamp, now: Now) {
        let ModeFrom::Topic { timeout } = self.settings.mode_from else { return };
        let speaks = self.told_mode.is_some_and(|(_, at)| now.mono.since(at) <= timeout);
        if self.modes_of_the_past.holds_back(speaks, stamp, timeout, now) {
            return;
        }
        self.told_mode = Some((raw, now.mono));
        self.undefined_modes += u64::from(ControlMode::from_raw(raw).is_none());
    }

    /// Takes what the gateway reports of the vehicle's lights now.
    pub fn report(&mut self, reported: Reported) {
        self.reported = reported;
    }

    /// Takes a frame of a message of [`CommandBinding::table`], after its bus has.
    pub fn frame_arrived(&mut self, message: MessageIndex, frame: &Frame, stamp: WallStamp, now: Now) {
        self.seen.frame_arrived(&self.binding.table, message, frame, stamp, now);
    }

    /// Says whose frame came in, before anybody else looks at it: only [`Heard::NotOurs`] may count as
    /// the vehicle's.
    pub fn heard(&mut self, bus: BusIndex, frame: &Frame, now: Now) -> Heard {
        let is_it = |permit: &super::allow_list::Permit| permit.bus() == bus && permit.id() == frame.id();
        let at = self.binding.messages.iter().position(|message| is_it(&message.permit));
        at.and_then(|at| self.lines.get_mut(at))
            .map_or(Heard::NotOurs, |line| line.sender.heard(frame, now.mono))
    }

    /// A frame was sent only at this time, which is later than that of [`Self::settle`]: the next one
    /// keeps its distance from then on.
    pub fn sent(&mut self, frame: &CommandFrame, at: MonoTime) {
        for (line, message) in self.lines.iter_mut().zip(&self.binding.messages) {
            if message.permit.bus() == frame.bus() && message.permit.id() == frame.frame().id() {
                line.sender.sent_at(at);
            }
        }
    }

    /// A frame that was to be sent could not be; to be told before the next [`Self::settle`].
    pub fn not_sent(&mut self, frame: &CommandFrame, why: SendFailure, now: Now) {
        for (line, message) in self.lines.iter_mut().zip(&self.binding.messages) {
            if message.permit.bus() == frame.bus() && message.permit.id() == frame.frame().id() {
                line.sender.not_sent(message, frame.frame(), why, now.mono);
            }
        }
    }

    /// Forgets what came over a bus.
    pub fn forget_bus(&mut self, bus: BusIndex) {
        self.seen.forget_bus(&self.binding.table, bus);
    }

    /// Forgets the event messages of a bus that was silent.
    pub fn forget_events(&mut self, bus: BusIndex) {
        self.seen.forget_events(&self.binding.table, bus);
    }

    /// The gateway is about to end: one last frame of each message, then no more. Go on with
    /// [`Self::settle`] until [`Self::is_finished`], but not for ever.
    pub fn stop(&mut self) {
        if !std::mem::replace(&mut self.stopping, true) {
            for line in &mut self.lines {
                line.sent_before_stop = line.sender.counts().sent;
            }
        }
    }

    /// Whether nothing is left to be sent after [`Self::stop`].
    pub fn is_finished(&self) -> bool {
        self.stopping && self.lines.iter().all(|line| !line.sender.is_waiting())
    }

    /// Brings everything up to now. True when the diagnostics have something new to say.
    pub fn settle(&mut self, buses: &[Bus], now: Now) -> bool {
        let mono = now.mono;
        let turn = self.turn.opinion(mono);
        let hazard = joined_hazard(self.hazard.opinion(mono), self.decided_hazard.opinion(mono));
        let mode = self.mode(buses, mono);
        let signs = self.driver_signs(buses, mono);
        let rules = self.settings.rules;
        let (driver, stopping) = (Grants::default(), self.stopping);
        let situation = Situation { turn, hazard, mode, driver, hazard_unproven: false, stopping };
        let driver = self.supervise(arbitrate(rules, &situation), signs, mono);
        let hazard_unproven =
            self.is_live() && self.reported.hazard.is_none() && !self.hazard_watch.is_ours();
        let decision = arbitrate(rules, &Situation { driver, hazard_unproven, ..situation });
        let cut_off = self.send(decision, buses, mono);
        let finding = Finding {
            decision,
            mode,
            turn: FunctionFinding {
                opinion: turn,
                refusal: self.turn.refusal(mono),
                is_unsteady: self.turn.is_unsteady(mono),
                accord: self.turn_watch.accord(),
                reported: self.reported.turn,
            },
            hazard: FunctionFinding {
                opinion: hazard,
                refusal: self.hazard.refusal(mono),
                is_unsteady: self.hazard.is_unsteady(mono),
                accord: self.hazard_watch.accord(),
                reported: self.reported.hazard,
            },
            button_given_up: self.is_live() && self.buttons().any(Button::has_given_up),
            cut_off,
            trouble: self.lines.iter().filter_map(|line| line.sender.trouble()).max(),
            rival: self.lines.iter().position(|line| line.sender.has_rival(mono)),
        };
        std::mem::replace(&mut self.state, finding) != finding
    }

    /// The next frame, oldest first.
    pub fn poll_output(&mut self) -> Option<Outgoing> {
        self.ready.pop_front()
    }

    /// When [`Self::settle`] has something to do.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let mode = match self.settings.mode_from {
            ModeFrom::Topic { timeout } => self.told_mode.map(|(_, at)| past(at, timeout)),
            ModeFrom::Signal => None,
        };
        let watches =
            self.turn_watch.next_deadline(now).into_iter().chain(self.hazard_watch.next_deadline(now));
        let intakes = self.turn.next_deadline(now).into_iter().chain(self.hazard.next_deadline(now));
        let intakes = intakes.chain(self.decided_hazard.next_deadline(now));
        let signals = self.seen.next_deadline(&self.binding.table, now);
        let buttons = self.buttons().filter_map(Button::next_deadline);
        let later = mode.into_iter().chain(watches).chain(intakes).chain(signals).chain(buttons);
        let frames = self.lines.iter().filter_map(|line| line.sender.next_deadline(now));
        later.filter(|at| *at > now).chain(frames).min()
    }

    /// What is asked of the vehicle, and why, as settled last.
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
        names.zip(self.lines.iter().map(|line| line.sender.counts()))
    }

    pub(super) fn state(&self) -> &Finding {
        &self.state
    }

    pub(super) fn is_live(&self) -> bool {
        self.settings.transmit == Transmit::On
    }

    fn buttons(&self) -> impl Iterator<Item = &Button> {
        self.lines.iter().filter_map(|line| line.button.as_ref())
    }

    fn mode(&self, buses: &[Bus], now: MonoTime) -> Mode {
        let signal = self.binding.control_mode.as_ref();
        match (self.settings.mode_from, signal) {
            (ModeFrom::Topic { timeout }, _) => match self.told_mode {
                Some((raw, at)) if now.since(at) <= timeout => {
                    ControlMode::from_raw(raw).map_or(Mode::Undefined(raw.into()), Mode::Known)
                }
                Some(_) | None => Mode::Unknown,
            },
            (ModeFrom::Signal, Some(role)) => match self.read(role, buses, now) {
                Reading::Seen { meaning: Meaning::Defined(mode), .. } => Mode::Known(mode),
                Reading::Seen { meaning: Meaning::Undefined, raw, .. } => Mode::Undefined(raw),
                Reading::Seen { meaning: Meaning::NotAvailable | Meaning::Fault, .. }
                | Reading::Absent(_) => Mode::Unknown,
            },
            (ModeFrom::Signal, None) => Mode::Unknown,
        }
    }

    fn read<T: Copy>(&self, role: &Role<T>, buses: &[Bus], now: MonoTime) -> Reading<T> {
        self.seen.read(&self.binding.table, role, buses, now)
    }

    /// What the vehicle itself says the driver has taken, or said last: he has it until it says otherwise.
    fn driver_signs(&mut self, buses: &[Bus], now: MonoTime) -> Grants {
        for (at, sign) in self.binding.driver.iter().enumerate() {
            let Reading::Seen { meaning: Meaning::Defined(says), .. } = self.read(&sign.role, buses, now)
            else {
                continue;
            };
            self.signs.get_mut(at).into_iter().for_each(|known| *known = says);
        }
        let taken = self.binding.driver.iter().zip(&self.signs).filter(|(_, has)| **has);
        taken.fold(Grants::default(), |all, (sign, _)| Grants {
            turn: all.turn || sign.takes.turn,
            hazard: all.hazard || sign.takes.hazard,
        })
    }

    /// Holds the report against what is wanted; gives what the driver has. A dry run can want nothing
    /// of the vehicle. While the hazard lights are on, reports of turn indicators say nothing.
    fn supervise(&mut self, decision: Decision, signs: Grants, now: MonoTime) -> Grants {
        let Reported { turn, hazard } = self.reported;
        let wanted = Some(decision.wanted).filter(|_| self.is_live()).unwrap_or_default();
        let is_hazard = wanted.hazard == Some(true) || hazard == Some(true);
        if is_hazard {
            self.turn_watch.suspend(wanted.turn, signs.turn);
        } else {
            self.turn_watch.update(wanted.turn, turn, signs.turn, now);
        }
        self.hazard_watch.update(wanted.hazard, hazard, signs.hazard, now);
        let drivers = self.hazard_watch.is_drivers();
        // Where one signal asks for both, a side would end hazard lights that are left to the vehicle.
        let would_end = match hazard {
            Some(true) => wanted.hazard.is_none() || (wanted.hazard == Some(false) && drivers),
            None => {
                let ours = self.hazard_watch.is_ours() || self.turn_watch.is_ours();
                wanted.turn == Some(Turn::Off) && !is_hazard && !ours
            }
            Some(false) => false,
        };
        let would_end = would_end && self.is_live() && self.binding.shares_signal();
        Grants { turn: self.turn_watch.is_drivers() || would_end, hazard: drivers }
    }

    /// Gives out the frames that are due; says on which bus none can be sent.
    fn send(&mut self, decision: Decision, buses: &[Bus], now: MonoTime) -> Option<BusIndex> {
        let mut cut_off = None;
        for (line, message) in self.lines.iter_mut().zip(&self.binding.messages) {
            let bus = message.permit.bus();
            if !buses.get(usize::from(bus.0)).is_some_and(|bus| can_send(bus, now)) {
                line.sender.cut_off();
                line.button.iter_mut().for_each(Button::forget);
                cut_off = cut_off.or(Some(bus));
                continue;
            }
            let wish = decision.demand.hazard.filter(|_| !self.stopping);
            let press = |button: &mut Button| button.update(wish, self.reported.hazard, now);
            let pressed = line.button.as_mut().is_some_and(press);
            let has_ended = self.stopping && line.sender.counts().sent > line.sent_before_stop;
            let contents = message.contents(decision.demand, pressed).filter(|_| !has_ended);
            if let Some(frame) = line.sender.settle(message, contents, now) {
                let is_news = std::mem::replace(&mut line.said, contents) != contents;
                self.ready.push_back(match self.settings.transmit {
                    Transmit::On => Outgoing::Send { frame, is_news },
                    Transmit::Off => {
                        line.sender.forget_echoes();
                        Outgoing::WouldSend { bus, frame: *frame.frame(), is_news }
                    }
                });
            }
        }
        cut_off
    }
}

impl<T> FunctionFinding<T> {
    fn none(opinion: Opinion<T>) -> Self {
        Self { opinion, refusal: None, is_unsteady: false, accord: Accord::Free, reported: None }
    }
}

/// Whether frames go anywhere.
fn can_send(bus: &Bus, now: MonoTime) -> bool {
    bus.link() == LinkState::Up && bus.controller().shown(now) != Some(ControllerState::BusOff)
}
