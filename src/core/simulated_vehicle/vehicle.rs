//! The whole vehicle: requests and command frames in, frames and what there is to see out.

use std::collections::VecDeque;
use std::time::Duration;

use rand_pcg::Pcg32;

use super::commanded::{CommandReceiver, LightsRequest};
use super::driver::Driver;
use super::encoder::VehicleState;
use super::faults::Faults;
use super::flasher::Flasher;
use super::plan::{PlannedMessage, VehiclePlan};
use super::possible::missing;
use super::request::{Fault, Request};
use super::transmission::Transmission;
use super::{Output, SimulationSettings, VehicleEvent, Who};
use crate::core::can::error_frame::{ErrorFrame, class};
use crate::core::can::frame::Frame;
use crate::core::can::link::BusIndex;
use crate::core::time::MonoTime;
use crate::core::vehicle_lights::lamp::Sides;
use crate::core::vehicle_lights::state::TurnCode;

/// Which of the generator's sequences the faults are drawn from.
const RANDOM_STREAM: u64 = 0x5EED;

/// A vehicle on the bus.
#[derive(Debug, Clone)]
pub struct SimulatedVehicle {
    messages: Vec<PlannedMessage>,
    transmissions: Vec<Transmission>,
    receivers: Vec<CommandReceiver>,
    simulation: SimulationSettings,
    driver: Driver,
    flasher: Flasher,
    faults: Faults,
    random: Pcg32,
    /// Whose wish the lights follow.
    who: Who,
    /// A wish on its way to the lights, and when it is there.
    coming: Option<((TurnCode, Who), MonoTime)>,
    bus_off_until: Option<MonoTime>,
    buses: Vec<BusIndex>,
    request: LightsRequest,
    lit: Sides,
    /// By time.
    scheduled: VecDeque<(MonoTime, Request)>,
    outputs: VecDeque<Output>,
}

impl SimulatedVehicle {
    /// Awake, driven by Autoware, all lights off. The first frames are due now, a millisecond apart.
    pub fn new(plan: VehiclePlan, simulation: SimulationSettings, now: MonoTime) -> Self {
        let starts = (0_u64..).map(|index| now.after(Duration::from_millis(index)));
        let transmissions = plan.messages.iter().zip(starts);
        let transmissions = transmissions.map(|(message, start)| Transmission::new(message, start)).collect();
        let receive = |message| CommandReceiver::new(message, simulation.command_timeout);
        let heard = plan.command.messages.iter().map(|message| message.permission.bus());
        let mut buses: Vec<_> = plan.messages.iter().map(|message| message.bus).chain(heard).collect();
        buses.sort_unstable();
        buses.dedup();
        let mut vehicle = Self {
            transmissions,
            receivers: plan.command.messages.iter().map(receive).collect(),
            driver: Driver::new(plan.ending, &simulation),
            messages: plan.messages,
            flasher: Flasher::new(simulation.flash_period),
            faults: Faults::default(),
            random: Pcg32::new(simulation.seed, RANDOM_STREAM),
            who: Who::Nobody,
            coming: None,
            bus_off_until: None,
            buses,
            request: LightsRequest::default(),
            lit: Sides::default(),
            scheduled: VecDeque::new(),
            outputs: VecDeque::new(),
            simulation,
        };
        vehicle.settle(now);
        vehicle
    }

    /// Does what is asked for. `now` never lies before that of an earlier call.
    pub fn request(&mut self, request: Request, now: MonoTime) {
        self.perform(request, now);
        self.settle(now);
    }

    /// Does at its time what is asked for; of requests for the same time the first one first.
    pub fn schedule(&mut self, at: MonoTime, request: Request) {
        let place = self.scheduled.iter().position(|(other, _)| *other > at);
        self.scheduled.insert(place.unwrap_or(self.scheduled.len()), (at, request));
    }

    /// Takes a frame of somebody else.
    pub fn frame_arrived(&mut self, bus: BusIndex, frame: &Frame, now: MonoTime) {
        if self.faults.ignores_commands || self.is_off_the_bus() {
            return;
        }
        for listener in &mut self.receivers {
            let heard = listener.on_frame(bus, frame, now);
            self.outputs.extend(heard.told.map(Output::Happened));
            if heard.presses && self.driver.mode.grants().hazard {
                self.driver.press_hazard(None, Who::Command, now);
            }
        }
        self.settle(now);
    }

    /// Does what is due.
    pub fn settle(&mut self, now: MonoTime) {
        while self.scheduled.front().is_some_and(|(at, _)| now >= *at) {
            self.scheduled.pop_front().into_iter().for_each(|(_, request)| self.perform(request, now));
        }
        self.driver.settle(now);
        if self.bus_off_until.is_some_and(|until| now >= until) {
            self.bus_off_until = None;
            self.tell_controllers(class::RESTARTED);
            self.outputs.push_back(Output::Happened(VehicleEvent::BusOff(false)));
        }
        let lost = self.receivers.iter_mut().filter_map(|listener| listener.settle(now));
        self.outputs.extend(lost.map(Output::Happened));
        self.follow_commands();
        self.follow_wish(now);
        let lit = self.flasher.lit(self.faults.broken, now);
        if std::mem::replace(&mut self.lit, lit) != lit {
            let happening = VehicleEvent::Lamps { left: lit.left, right: lit.right };
            self.outputs.push_back(Output::Happened(happening));
        }
        self.send(now);
    }

    /// The next output.
    pub fn poll_output(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// When [`Self::settle`] is to be called next, if nothing happens before.
    pub fn next_deadline(&self, now: MonoTime) -> Option<MonoTime> {
        let sends = self.transmissions.iter().filter_map(Transmission::next_deadline);
        let commands = self.receivers.iter().filter_map(CommandReceiver::next_deadline);
        let coming = self.coming.map(|(_, at)| at);
        let edge = self.flasher.next_edge(self.faults.broken, now);
        let false_report = self.false_report().and_then(|told| told.next_edge(Sides::default(), now));
        let scheduled = self.scheduled.front().map(|(at, _)| *at);
        let others = [scheduled, self.driver.next_deadline(), coming, edge, false_report, self.bus_off_until];
        sends.chain(commands).chain(others.into_iter().flatten()).min()
    }

    /// Which lights flash.
    pub fn lights(&self) -> (TurnCode, Who) {
        (self.flasher.code(), self.who)
    }

    fn perform(&mut self, request: Request, now: MonoTime) {
        let missing = missing(&request, &self.messages);
        self.outputs.extend(missing.map(VehicleEvent::NotPossible).map(Output::Happened));
        match request {
            Request::Stalk(turn) => self.driver.stalk(turn, now),
            Request::Tap(turn) => self.driver.tap(turn, now),
            Request::Hazard(wanted) => self.driver.press_hazard(wanted, Who::Driver, now),
            Request::Mode(mode) => self.driver.mode = mode,
            Request::Fault(Fault::BusOff(duration)) => {
                if self.bus_off_until.replace(now.after(duration)).is_none() {
                    self.tell_controllers(class::BUS_OFF);
                    self.outputs.push_back(Output::Happened(VehicleEvent::BusOff(true)));
                }
            }
            Request::Fault(fault) => self.faults.add(fault),
            Request::Clear => self.faults = Faults::default(),
        }
    }

    fn is_off_the_bus(&self) -> bool {
        self.faults.is_silent || self.bus_off_until.is_some()
    }

    /// What all messages together ask for, as far as the mode lets them.
    fn follow_commands(&mut self) {
        let grants = self.driver.mode.grants();
        let mut request = LightsRequest::default();
        for listener in &self.receivers {
            request.turn = request.turn.or(listener.request().turn.filter(|_| grants.turn));
            request.hazard = request.hazard.or(listener.request().hazard.filter(|_| grants.hazard));
        }
        if std::mem::replace(&mut self.request, request) != request {
            let happening = VehicleEvent::Commanded { turn: request.turn, hazard: request.hazard };
            self.outputs.push_back(Output::Happened(happening));
        }
    }

    /// A hand acts at once, a command after the reaction time.
    fn follow_wish(&mut self, now: MonoTime) {
        let shown = (self.flasher.code(), self.who);
        let wish = self.driver.wish(self.request);
        if wish == shown {
            self.coming = None;
            return;
        }
        let (_, at) = self.coming.filter(|(coming, _)| *coming == wish).unwrap_or_else(|| {
            let by_hand = wish.1 == Who::Driver || shown.1 == Who::Driver;
            (wish, if by_hand { now } else { now.after(self.simulation.reaction) })
        });
        if now < at {
            self.coming = Some((wish, at));
            return;
        }
        self.coming = None;
        let (code, who) = wish;
        self.flasher.set(code, now);
        self.who = who;
        self.outputs.push_back(Output::Happened(VehicleEvent::Lights { code, who }));
    }

    fn send(&mut self, now: MonoTime) {
        let state = self.state(now);
        let off_the_bus = self.is_off_the_bus();
        for (message, transmission) in self.messages.iter().zip(&mut self.transmissions) {
            let quality = self.faults.of(&message.name);
            for frame in transmission.settle(message, &state, quality, &mut self.random, now) {
                if !off_the_bus {
                    self.outputs.push_back(Output::Frame { bus: message.bus, frame });
                }
            }
        }
    }

    /// What the signals say.
    fn state(&self, now: MonoTime) -> VehicleState {
        let false_report = self.false_report();
        VehicleState {
            code: false_report.map_or(self.flasher.code(), |told| told.code()),
            lit: false_report.map_or(self.lit, |told| told.lit(Sides::default(), now)),
            stalk: self.driver.stalk_position(),
            button: self.driver.is_button_pressed(),
            quality: self.faults.quality,
            broken: self.faults.broken,
            mode: self.driver.mode,
            driver: self.driver.driver(),
        }
    }

    /// What is told in the place of the lights: lamps are believed only if they flash.
    fn false_report(&self) -> Option<Flasher> {
        let mut told = Flasher::new(self.simulation.flash_period);
        told.set(self.faults.false_report?, MonoTime::ZERO);
        Some(told)
    }

    fn tell_controllers(&mut self, class: u32) {
        let errors =
            self.buses.iter().map(|bus| Output::Error { bus: *bus, error: ErrorFrame::new(class, &[]) });
        self.outputs.extend(errors);
    }
}
