//! A driver who does what is requested, mostly: late, wrong and corrected, or not at all.

use can_signal::can::mark::DriverMark;

use super::car::{Car, Ending};
use super::lights::{Lights, Stalk, State};
use super::random::Random;

/// What a driver does at a time, ms.
#[derive(Debug, Clone, Copy)]
enum Act {
    Switch(State),
    Stalk(Stalk),
    Button(bool),
    Brake(bool),
    Door(bool),
    Wheel(i64),
}

pub(crate) struct Driver {
    acts: Vec<(u64, Act)>,
    random: Random,
    clumsy: bool,
    /// True if the lever is moved while nothing is to be operated.
    restless: bool,
    lights: Lights,
    on_since_ms: u64,
    wanted: State,
    /// States with the times of their beginnings, ms.
    pub(crate) states: Vec<(u64, State)>,
}

impl Driver {
    pub(crate) fn new(seed: u64, clumsy: bool) -> Self {
        Self {
            acts: Vec::new(),
            random: Random::new(seed ^ 0xD21F),
            clumsy,
            restless: false,
            lights: Lights::REST,
            on_since_ms: 0,
            wanted: State::Off,
            states: vec![(0, State::Off)],
        }
    }

    /// A driver who follows the requests, but moves the lever during HANDS OFF.
    pub(crate) fn restless(seed: u64) -> Self {
        Self { restless: true, ..Self::new(seed, false) }
    }

    pub(crate) fn request(&mut self, mark: DriverMark, now_ms: u64, car: &Car) {
        let state = match mark {
            DriverMark::Left => State::Left,
            DriverMark::Right => State::Right,
            DriverMark::Hazard => State::Hazard,
            DriverMark::Off | DriverMark::Quiet => State::Off,
        };
        let mut at = now_ms + self.random.between(300, 1300);
        if mark == DriverMark::Quiet {
            if self.clumsy && self.random.percent(5) {
                self.change(State::Left, now_ms + 3000, car);
                self.change(State::Off, now_ms + 4200, car);
            }
            let moves = if self.restless { 1000..9000 } else { 0..0 };
            for begin in moves.step_by(2000) {
                let side = if begin % 4000 == 1000 { State::Left } else { State::Right };
                self.change(side, now_ms + begin, car);
                self.change(State::Off, now_ms + begin + 1000, car);
            }
            return;
        }
        if self.clumsy {
            self.operate_others(state, at);
        }
        let mistake = if self.clumsy { self.random.below(100) } else { 100 };
        let wrong = match state {
            State::Left => State::Right,
            State::Right | State::Hazard | State::Off => State::Left,
        };
        match mistake {
            0..10 => at = now_ms + self.random.between(1500, 2800),
            10..15 if state != State::Off => {
                self.change(wrong, at, car);
                at += self.random.between(700, 1500);
            }
            15..18 if state != State::Off => {
                return self.change(wrong, at, car);
            }
            18..20 if state != State::Off => {
                return;
            }
            _ => {}
        }
        self.change(state, at, car);
    }

    /// Brakes, steers to the side, or opens a door about the time of an action.
    fn operate_others(&mut self, state: State, at: u64) {
        if self.random.percent(25) {
            let pressed = at.saturating_sub(self.random.between(0, 700)) + self.random.between(0, 500);
            self.acts.push((pressed, Act::Brake(true)));
            self.acts.push((pressed + self.random.between(300, 5000), Act::Brake(false)));
        }
        if self.random.percent(5) {
            self.acts.push((at, Act::Door(true)));
            self.acts.push((at + self.random.between(1000, 6000), Act::Door(false)));
        }
        let side = match state {
            State::Left => 1,
            State::Right => -1,
            State::Off | State::Hazard => return,
        };
        if self.random.percent(60) {
            let angle = side * i64::try_from(self.random.between(5, 400)).unwrap();
            let begins = at + self.random.between(0, 1000);
            let turns = self.random.between(1000, 5000);
            for step in 0..10 {
                let to = i64::try_from(step + 1).unwrap();
                self.acts.push((begins + 40 * step, Act::Wheel(angle * to / 10)));
                self.acts.push((begins + turns + 40 * step, Act::Wheel(angle * (10 - to) / 10)));
            }
        }
    }

    /// Operates the controls so that the state becomes another one.
    fn change(&mut self, to: State, at: u64, car: &Car) {
        let from = std::mem::replace(&mut self.wanted, to);
        if from == to {
            return;
        }
        if to == State::Hazard || from == State::Hazard {
            self.acts.push((at, Act::Button(true)));
            let released = at + self.random.between(200, 500);
            self.acts.push((released, Act::Button(false)));
        }
        if to != State::Hazard && from != State::Hazard {
            let opposite = if from == State::Left { State::Right } else { State::Left };
            let (is_left, is_half) = match (to, car.ending) {
                (State::Off, Ending::HalfOpposite) => (opposite == State::Left, car.has_half),
                (State::Off, Ending::SameAgain) => (from == State::Left, false),
                (State::Off, Ending::FullOpposite) => (opposite == State::Left, false),
                (to, _) => (to == State::Left, false),
            };
            let [half, full] = if is_left {
                [Stalk::HalfLeft, Stalk::FullLeft]
            } else {
                [Stalk::HalfRight, Stalk::FullRight]
            };
            let shows_half =
                car.has_half && (car.half_percent == 100 || self.random.percent(car.half_percent));
            let pressed = at + if shows_half { self.random.between(30, 80) } else { 0 };
            let released = pressed + self.random.between(200, 600);
            self.acts.push((at, Act::Stalk(if shows_half || is_half { half } else { full })));
            self.acts.push((pressed, Act::Stalk(if is_half { half } else { full })));
            self.acts.push((released, Act::Stalk(Stalk::Rest)));
        }
        self.acts.push((at, Act::Switch(to)));
    }

    /// What the indicators do at a time.
    pub(crate) fn lights(&mut self, now_ms: u64, car: &Car) -> Lights {
        self.acts.sort_by_key(|(at, _)| *at);
        while let Some((at, act)) = self.acts.first().copied().filter(|(at, _)| *at <= now_ms) {
            self.acts.remove(0);
            match act {
                Act::Stalk(stalk) => self.lights.stalk = stalk,
                Act::Button(button) => self.lights.button = button,
                Act::Brake(brake) => self.lights.others.brake = brake,
                Act::Door(door) => self.lights.others.door = door,
                Act::Wheel(wheel) => self.lights.others.wheel = wheel,
                Act::Switch(state) => {
                    self.lights.state = state;
                    self.on_since_ms = at;
                    self.states.push((at, state));
                }
            }
        }
        let phase = (now_ms - self.on_since_ms) / car.half_ms;
        self.lights.lit = self.lights.state != State::Off && phase.is_multiple_of(2);
        self.lights
    }
}
