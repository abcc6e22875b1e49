//! An invented car, random from a seed: where its indicators are on the bus, and what else is there.

use std::collections::BTreeSet;

use super::lights::{Lights, Shows};
use super::message::Message;
use super::random::Random;
use can_signal::can::frame::{CanId, Frame};

/// How a press of the stalk ends an indication.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ending {
    HalfOpposite,
    SameAgain,
    FullOpposite,
}

pub(crate) struct Car {
    messages: Vec<Message>,
    ids: BTreeSet<CanId>,
    /// Half a flash cycle, ms.
    pub(crate) half_ms: u64,
    pub(crate) ending: Ending,
    pub(crate) has_half: bool,
    /// Share of full presses that show the half one on their way, in percent.
    pub(crate) half_percent: u64,
    pub(crate) shows_hazard: bool,
    /// Until this time signals that can say so are not available, ms.
    unavailable_until_ms: u64,
    random: Random,
}

/// Numbers of bits and values of an enumerated signal: off, left, right, hazard.
const CODES: [(u16, [u64; 4]); 11] = [
    (2, [0, 1, 2, 3]),
    (2, [0, 2, 1, 3]),
    (3, [0, 1, 2, 4]),
    (3, [0, 2, 1, 4]),
    (3, [0, 1, 3, 2]),
    (4, [0, 4, 8, 12]),
    (3, [7, 1, 2, 3]),
    (4, [1, 2, 3, 4]),
    (2, [0, 1, 3, 2]),
    (4, [0, 5, 6, 7]),
    (8, [0, 0x10, 0x20, 0x30]),
];
/// Likewise of a stalk: rest, half left, full left, half right, full right.
const STALKS: [(u16, [u64; 5]); 4] =
    [(3, [0, 1, 2, 3, 4]), (3, [0, 5, 1, 6, 2]), (4, [0, 1, 9, 2, 10]), (4, [15, 4, 6, 8, 12])];
/// Likewise, some with bits that are always set.
const DETENTS: [(u16, [u64; 5]); 8] = [
    (3, [0, 1, 2, 3, 4]),
    (3, [0, 2, 1, 4, 3]),
    (3, [0, 1, 3, 2, 6]),
    (4, [0, 1, 9, 2, 10]),
    (4, [4, 5, 6, 12, 13]),
    (4, [2, 3, 6, 10, 14]),
    (5, [8, 9, 10, 25, 26]),
    (4, [15, 4, 6, 8, 12]),
];
/// Numbers of bits and values of an enumerated signal with a bit that is always set.
const CONSTANT: [(u16, [u64; 4]); 3] = [(3, [2, 3, 6, 7]), (4, [4, 5, 12, 13]), (5, [4, 5, 20, 21])];
/// Ways in which cars show their indicators.
const FORMS: u64 = 8;

impl Car {
    /// A car with its indicators in ordinary messages.
    pub(crate) fn new(seed: u64) -> Self {
        Self::with(seed, |_, _| {})
    }

    /// A car of which each message of the indicators is multiplexed.
    pub(crate) fn multiplexed(seed: u64) -> Self {
        Self::with(seed, Message::multiplex)
    }

    /// A car whose indicators are easily mistaken: a stalk that springs back, whose half press shows in some
    /// of the presses; values with a bit that is always set; messages that are sent at changes alone.
    pub(crate) fn mistakable(seed: u64) -> Self {
        let mut car = Self::bare(seed, [4, 12]);
        car.ending = car.random.choose(&[Ending::HalfOpposite, Ending::SameAgain]);
        car.has_half = car.random.percent(80);
        car.half_percent = car.random.between(10, 100);
        let mut message = car.indicator_message(true);
        (message.period_ms, message.silent) = (message.period_ms.min(50), None);
        if car.random.percent(25) {
            (message.period_ms, message.on_change) = (0, true);
        }
        if car.random.percent(70) {
            let (length, mut values) = car.random.choose(&DETENTS);
            if !car.has_half {
                (values[1], values[3]) = (values[0], values[0]);
            }
            car.show(&mut message, length, Shows::Stalk(values));
        } else {
            let (length, mut values) = car.random.choose(&CONSTANT);
            car.shows_hazard = car.random.percent(50);
            if !car.shows_hazard {
                values[3] = values[0];
            }
            car.show(&mut message, length, Shows::State(values));
        }
        if !car.shows_hazard && car.random.percent(60) {
            car.show(&mut message, 2, Shows::Hazard([0, 1]));
            car.shows_hazard = true;
        }
        car.messages.push(message);
        for message in &mut car.messages {
            message.fill(&mut car.random);
        }
        car
    }

    /// The same car in another session.
    pub(crate) fn again(mut self, session: u64) -> Self {
        self.random = Random::new(session ^ 0xA6A1);
        self
    }

    fn with(seed: u64, change: impl Fn(&mut Message, &mut Random)) -> Self {
        let mut car = Self::bare(seed, [24, 120]);
        car.add_indicators(seed % FORMS);
        for message in &mut car.messages {
            if message.is_of_indicators() {
                change(message, &mut car.random);
            }
            message.fill(&mut car.random);
        }
        car
    }

    /// A car without indicators.
    fn bare(seed: u64, [fewest, most]: [u64; 2]) -> Self {
        let mut random = Random::new(seed);
        let mut car = Self {
            messages: Vec::new(),
            ids: BTreeSet::new(),
            half_ms: random.between(250, 450),
            ending: random.choose(&[Ending::HalfOpposite, Ending::SameAgain, Ending::FullOpposite]),
            has_half: random.percent(50),
            half_percent: 100,
            shows_hazard: false,
            unavailable_until_ms: if random.percent(30) { random.between(200, 6000) } else { 0 },
            random,
        };
        // A full press of a stalk with two detents passes the half press, which ends an indication by itself.
        if car.has_half && car.ending == Ending::FullOpposite {
            car.ending = Ending::HalfOpposite;
        }
        let number = car.random.between(fewest, most);
        for _ in 0..number {
            let mut message = car.message();
            if car.random.percent(5) {
                let from = car.random.between(1_000, 60_000);
                message.silent = Some((from, from + car.random.choose(&[2_000, 10_000, 1_000_000])));
            }
            car.messages.push(message);
        }
        car.add_controls();
        car
    }

    fn id(&mut self, is_extended: bool) -> CanId {
        loop {
            let id = if is_extended {
                CanId::Extended(u32::try_from(self.random.below(0x1FFF_FFFF)).unwrap())
            } else {
                CanId::Standard(u16::try_from(self.random.between(1, 0x7F0)).unwrap())
            };
            if self.ids.insert(id) {
                return id;
            }
        }
    }

    fn message(&mut self) -> Message {
        let is_extended = self.random.percent(20);
        let id = self.id(is_extended);
        let length = match self.random.below(10) {
            0..7 => 8,
            7 => usize::try_from(self.random.between(3, 7)).unwrap(),
            _ => self.random.choose(&[12, 16, 24, 32, 64]),
        };
        Message::new(id, length, &mut self.random)
    }

    /// A message of the indicators: cyclic, cyclic and at changes, or at changes alone.
    fn indicator_message(&mut self, fast: bool) -> Message {
        let is_extended = self.random.percent(20);
        let id = self.id(is_extended);
        let length = self.random.choose(&[8, 8, 8, 8, 4, 6, 16, 32, 64]);
        let mut message = Message::new(id, length, &mut self.random);
        message.period_ms = self.random.choose(if fast { &[10, 20, 50, 100] } else { &[20, 50, 100, 200] });
        message.jitter_ms = message.period_ms / 10;
        match self.random.below(8) {
            0 => (message.period_ms, message.on_change) = (1000, true),
            1 => (message.period_ms, message.on_change) = (0, true),
            _ => message.on_change = self.random.percent(20),
        }
        if self.random.percent(5) {
            let from = self.random.between(1_000, 60_000);
            message.silent = Some((from, from + self.random.between(500, 2_500)));
        }
        message
    }

    /// Pedals, doors and the steering wheel.
    fn add_controls(&mut self) {
        let from_middle = self.random.percent(50);
        for (length, shows) in
            [(1, Shows::Brake), (1, Shows::Brake), (2, Shows::Door), (12, Shows::Wheel { from_middle })]
        {
            let at = usize::try_from(self.random.below(self.messages.len() as u64)).unwrap();
            self.messages[at].show(length, shows, &mut self.random);
        }
    }

    fn add_indicators(&mut self, form: u64) {
        let mut message = self.indicator_message(matches!(form, 2 | 6));
        let mut with_hazard = self.random.percent(60);
        let sides = |with_hazard| [true, false].map(|is_left| Shows::Side { is_left, with_hazard });
        let lamps = [true, false].map(|is_left| Shows::Lamp { is_left });
        match form {
            0 => self.show_state(&mut message, with_hazard),
            1 => self.show_all(&mut message, &sides(with_hazard)),
            2 => {
                with_hazard = true;
                self.show_all(&mut message, &lamps);
            }
            3 => {
                with_hazard = false;
                self.show_stalk(&mut message);
            }
            4 | 6 => {
                with_hazard = true;
                self.show_stalk(&mut message);
                if form == 6 {
                    self.show_all(&mut message, &lamps);
                } else {
                    let mut other = self.indicator_message(true);
                    self.show_all(&mut other, &lamps);
                    self.messages.push(other);
                }
            }
            5 => self.show_j1939(&mut message, with_hazard),
            _ => {
                with_hazard = true;
                self.show_state(&mut message, false);
                let mut other = self.indicator_message(true);
                self.show_all(&mut other, &lamps);
                self.messages.push(other);
            }
        }
        self.shows_hazard = with_hazard;
        if !self.shows_hazard || self.random.percent(40) {
            let kind = self.random.below(5);
            let values = self.random.choose(&[[0, 1], [1, 2], [0, 2], [3, 1]]);
            match kind {
                0 => {}
                1 | 2 => self.show(&mut message, 2, Shows::Hazard(values)),
                3 => {
                    let mut other = self.indicator_message(false);
                    self.show(&mut other, 2, Shows::Hazard(values));
                    self.messages.push(other);
                }
                _ => self.show(&mut message, 2, Shows::Button(values)),
            }
            self.shows_hazard |= kind != 0;
        }
        if self.random.percent(40) {
            let flashes = self.random.percent(60);
            self.show(&mut message, 1, Shows::Any { flashes });
        }
        if self.random.percent(15) {
            let mut copy = self.indicator_message(true);
            for (length, shows) in message.shown_signals() {
                self.show(&mut copy, length, shows);
            }
            self.messages.push(copy);
        }
        self.messages.push(message);
    }

    fn show(&mut self, message: &mut Message, length: u16, shows: Shows) {
        assert!(message.show(length, shows, &mut self.random));
    }

    fn show_all(&mut self, message: &mut Message, signals: &[Shows]) {
        for shows in signals {
            self.show(message, 1, *shows);
        }
    }

    fn show_state(&mut self, message: &mut Message, with_hazard: bool) {
        let (length, mut values) = self.random.choose(&CODES);
        if !with_hazard {
            values[3] = values[0];
        }
        self.show(message, length, Shows::State(values));
    }

    fn show_stalk(&mut self, message: &mut Message) {
        let (length, mut values) = self.random.choose(&STALKS);
        if !self.has_half {
            (values[1], values[3]) = (values[0], values[0]);
        }
        self.show(message, length, Shows::Stalk(values));
    }

    /// Fields of two bits for each side, or of four for the switch, under an identifier of 29 bits.
    fn show_j1939(&mut self, message: &mut Message, with_hazard: bool) {
        message.id = self.id(true);
        if self.random.percent(50) {
            for is_left in [true, false] {
                message.show_aligned(2, Shows::Side { is_left, with_hazard }, &mut self.random);
            }
        } else {
            let hazard = if with_hazard { 3 } else { 0 };
            message.show_aligned(4, Shows::State([0, 1, 2, hazard]), &mut self.random);
        }
    }

    /// Where the indicators are, for messages of failed tests.
    pub(crate) fn indicators(&self) -> String {
        self.messages.iter().flat_map(Message::indicators).collect::<Vec<_>>().join("; ")
    }

    /// True if signals say for a time that they are not available.
    pub(crate) fn is_unavailable_at_first(&self) -> bool {
        self.unavailable_until_ms > 1000
    }

    /// The frames that are sent at a moment.
    pub(crate) fn step(&mut self, mut lights: Lights, now_ms: u64, mut send: impl FnMut(Frame)) {
        lights.unavailable = now_ms < self.unavailable_until_ms;
        for message in &mut self.messages {
            message.step(lights, now_ms, &mut self.random).into_iter().for_each(&mut send);
        }
    }

    /// Arbitrary frames of a message while the indicators are in this state; `None` for a message that does
    /// not belong to the indicators.
    pub(crate) fn arbitrary_frames(&mut self, id: CanId, lights: Lights) -> Option<Vec<Frame>> {
        let message = self.messages.iter_mut().find(|message| message.id == id)?;
        message.is_of_indicators().then(|| message.arbitrary_frames(lights, &mut self.random))
    }
}
