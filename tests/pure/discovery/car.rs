//! An invented car, random from a seed: where its indicators are on the bus, what else is there, and what it sends.

use super::random::Random;
use signal_gateway::core::can::frame::{CanId, Frame, MAX_DATA};
use signal_gateway::core::dbc::codec::{ByteOrder, Layout, SignalCodec};
use signal_gateway::core::validation::integrity::checksum::{
    Checksum, CrcRule, Extra, Parameters, Rule, Sum,
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum State {
    Off,
    Left,
    Right,
    Hazard,
}

/// Positions of a stalk that springs back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stalk {
    Rest,
    HalfLeft,
    FullLeft,
    HalfRight,
    FullRight,
}

/// What the car's indicators do at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Lights {
    pub(crate) state: State,
    pub(crate) lit: bool,
    pub(crate) stalk: Stalk,
    pub(crate) button: bool,
}

/// What a signal of the indicators shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shows {
    /// Values of off, left, right, and hazard.
    State([u64; 4]),
    Side {
        is_left: bool,
        with_hazard: bool,
    },
    Lamp {
        is_left: bool,
    },
    /// Values of rest, half left, full left, half right, full right.
    Stalk([u64; 5]),
    Hazard([u64; 2]),
    Button([u64; 2]),
    /// On, or flashing, while anything is on.
    Any {
        flashes: bool,
    },
}

impl Shows {
    pub(crate) fn value(self, lights: Lights) -> u64 {
        use State::{Hazard, Left, Off, Right};
        let is = |state, with_hazard| lights.state == state || (with_hazard && lights.state == Hazard);
        let side = |is_left| if is_left { Left } else { Right };
        match self {
            Self::State(values) => values[lights.state as usize],
            Self::Side { is_left, with_hazard } => u64::from(is(side(is_left), with_hazard)),
            Self::Lamp { is_left } => u64::from(is(side(is_left), true) && lights.lit),
            Self::Stalk(values) => values[lights.stalk as usize],
            Self::Hazard(values) => values[usize::from(lights.state == Hazard)],
            Self::Button(values) => values[usize::from(lights.button)],
            Self::Any { flashes } => u64::from(lights.state != Off && (lights.lit || !flashes)),
        }
    }
}

#[derive(Debug, Clone)]
enum Part {
    /// Never changes in a session.
    Constant(Layout, u64),
    /// A sensor: another value each time.
    Noise(Layout),
    /// Toggles at random, every so many ms on average.
    Toggle {
        layout: Layout,
        mean_ms: u64,
        on: bool,
    },
    /// Toggles by itself, every so many ms.
    Periodic {
        layout: Layout,
        half_ms: u64,
    },
    Counter {
        layout: Layout,
        last: u64,
    },
    Indicator(Layout, Shows),
    /// A checksum that no profile knows: an 8-bit product of all other bytes.
    Secret(Layout),
}

#[derive(Debug, Clone)]
pub(crate) struct Message {
    pub(crate) id: CanId,
    length: usize,
    pub(crate) period_ms: u64,
    jitter_ms: u64,
    /// Sent at a change as well; with a period of 0 only then.
    pub(crate) on_change: bool,
    parts: Vec<Part>,
    checksum: Option<Checksum>,
    used: [bool; 64],
    count: u64,
    pub(crate) due_ms: u64,
    sent: Option<[u8; MAX_DATA]>,
}

impl Message {
    fn new(id: CanId, random: &mut Random) -> Self {
        let period_ms = random.choose(&[10, 20, 20, 50, 100, 100, 200, 500, 1000]);
        Self {
            id,
            length: 8,
            period_ms,
            jitter_ms: random.below(period_ms / 10 + 1),
            on_change: false,
            parts: Vec::new(),
            checksum: None,
            used: [false; 64],
            count: random.below(200),
            due_ms: random.below(period_ms),
            sent: None,
        }
    }

    /// A free place of this length, in either byte order.
    fn place(&mut self, length: u16, random: &mut Random) -> Option<Layout> {
        for _ in 0..200 {
            let order = if random.percent(50) { ByteOrder::Intel } else { ByteOrder::Motorola };
            let start = u16::try_from(random.below(64)).unwrap();
            if let Some(layout) = self.claim(Layout { start, length, order, signed: false }) {
                return Some(layout);
            }
        }
        None
    }

    /// Takes a place, if it is free.
    fn claim(&mut self, layout: Layout) -> Option<Layout> {
        let codec = SignalCodec::new(layout, self.length).ok()?;
        let mut data = [0; MAX_DATA];
        codec.write(codec.range().1, &mut data).unwrap();
        let bits: Vec<_> = (0..64).filter(|bit| data[bit / 8] >> (bit % 8) & 1 == 1).collect();
        if bits.iter().any(|bit| self.used[*bit]) {
            return None;
        }
        for bit in bits {
            self.used[bit] = true;
        }
        Some(layout)
    }

    /// Counter, checksum, sensors and switches in the places that are left.
    fn fill(&mut self, random: &mut Random) {
        if random.percent(60) {
            let kind = random.below(9);
            let byte = |at: u16| Layout { start: at * 8, length: 8, order: ByteOrder::Intel, signed: false };
            let nibble = Layout { start: 56, length: 4, order: ByteOrder::Intel, signed: false };
            let any = u8::try_from(random.below(256)).unwrap();
            let layout = self.claim(if kind == 5 { nibble } else { byte(random.choose(&[7, 7, 7, 0, 6])) });
            let general = Parameters::crc8(any | 1, 0xFF, any).with_reflection(random.percent(50));
            let rule = match kind {
                0 => Some(Rule::Sum(Sum::PLAIN)),
                1 => Some(Rule::Sum(Sum::TOYOTA)),
                2 => Some(Rule::Xor { start: any }),
                3 => Some(Rule::Crc(CrcRule::j1850())),
                4 => Some(Rule::Crc(CrcRule::giorgio(any))),
                5 => Some(Rule::Honda),
                6 => Some(Rule::Crc(CrcRule::new(general, Extra::Nothing, None))),
                7 => Some(Rule::Sum(Sum { start: any, ..Sum::PLAIN })),
                _ => None,
            };
            if let Some(layout) = layout {
                let codec = SignalCodec::new(layout, self.length).unwrap();
                match rule {
                    Some(rule) => self.checksum = Some(Checksum::new(rule, codec).unwrap()),
                    None => self.parts.push(Part::Secret(layout)),
                }
            }
        }
        if random.percent(60) {
            let (length, last) = random.choose(&[(4, 15), (4, 14), (2, 3), (8, 255), (3, 7)]);
            let counter = self.place(length, random).map(|layout| Part::Counter { layout, last });
            self.parts.extend(counter);
        }
        for _ in 0..random.below(4) {
            let length = u16::try_from(random.between(1, 12)).unwrap();
            let Some(layout) = self.place(length, random) else { break };
            let part = match random.below(if length == 1 { 6 } else { 3 }) {
                0 => Part::Noise(layout),
                1 | 2 => Part::Constant(layout, random.below(1 << length)),
                3 => Part::Periodic { layout, half_ms: random.between(200, 3000) },
                _ => Part::Toggle { layout, mean_ms: random.between(2_000, 40_000), on: false },
            };
            self.parts.push(part);
        }
    }

    /// The data at a moment. With `varied`, what does not belong to the indicators is arbitrary.
    fn data(&mut self, lights: Lights, now_ms: u64, varied: bool, random: &mut Random) -> [u8; MAX_DATA] {
        let mut data = [0; MAX_DATA];
        let length = self.length;
        let mut write = |layout: Layout, value: u64| {
            SignalCodec::new(layout, length).unwrap().write(value.into(), &mut data).unwrap();
        };
        let mut secret = None;
        for part in &mut self.parts {
            match part {
                Part::Indicator(layout, shows) => write(*layout, shows.value(lights)),
                Part::Noise(layout) => write(*layout, random.below(1 << layout.length)),
                Part::Constant(layout, _)
                | Part::Periodic { layout, .. }
                | Part::Counter { layout, .. }
                | Part::Toggle { layout, .. }
                    if varied =>
                {
                    write(*layout, random.below(1 << layout.length));
                }
                Part::Constant(layout, value) => write(*layout, *value),
                Part::Periodic { layout, half_ms } => write(*layout, now_ms / *half_ms % 2),
                Part::Counter { layout, last } => write(*layout, self.count % (*last + 1)),
                Part::Toggle { layout, mean_ms, on } => {
                    *on ^= self.period_ms > 0 && random.below(*mean_ms) < self.period_ms;
                    write(*layout, u64::from(*on));
                }
                Part::Secret(layout) => secret = Some(*layout),
            }
        }
        if let Some(layout) = secret {
            let product = data.iter().fold(0x9D_u8, |product, byte| {
                product.wrapping_mul(31).wrapping_add(*byte).rotate_left(3) ^ (byte >> 2)
            });
            SignalCodec::new(layout, length).unwrap().write(product.into(), &mut data).unwrap();
        }
        if let Some(checksum) = &self.checksum {
            assert!(checksum.protect(self.id, &mut data[..length]));
        }
        data
    }

    fn frame(&self, data: &[u8; MAX_DATA]) -> Frame {
        Frame::classic(self.id, &data[..self.length]).unwrap()
    }

    fn is_indicator(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Indicator(..)))
    }
}

/// How a press of the stalk ends an indication.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ending {
    HalfOpposite,
    SameAgain,
    FullOpposite,
}

pub(crate) struct Car {
    pub(crate) messages: Vec<Message>,
    /// Half a flash cycle, ms.
    pub(crate) half_ms: u64,
    pub(crate) ending: Ending,
    pub(crate) has_half: bool,
    pub(crate) shows_hazard: bool,
    random: Random,
}

/// Numbers of bits and values of an enumerated signal: off, left, right, hazard.
const CODES: [(u16, [u64; 4]); 9] = [
    (2, [0, 1, 2, 3]),
    (2, [0, 2, 1, 3]),
    (3, [0, 1, 2, 4]),
    (3, [0, 1, 3, 2]),
    (4, [0, 4, 8, 12]),
    (3, [7, 1, 2, 3]),
    (4, [1, 2, 3, 4]),
    (2, [0, 1, 3, 2]),
    (4, [0, 5, 6, 7]),
];
/// Likewise of a stalk: rest, half left, full left, half right, full right.
const STALKS: [(u16, [u64; 5]); 4] =
    [(3, [0, 1, 2, 3, 4]), (3, [0, 5, 1, 6, 2]), (4, [0, 1, 9, 2, 10]), (4, [15, 4, 6, 8, 12])];

impl Car {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut car = Self {
            messages: Vec::new(),
            half_ms: random.between(250, 450),
            ending: random.choose(&[Ending::HalfOpposite, Ending::SameAgain, Ending::FullOpposite]),
            has_half: random.percent(50),
            shows_hazard: true,
            random,
        };
        // A full press of a stalk with two detents passes the half press, which ends an indication by itself.
        if car.has_half && car.ending == Ending::FullOpposite {
            car.ending = Ending::HalfOpposite;
        }
        for _ in 0..car.random.between(8, 25) {
            let message = car.message();
            car.messages.push(message);
        }
        car.add_indicators(seed % 5);
        for message in &mut car.messages {
            message.fill(&mut car.random);
        }
        car
    }

    fn message(&mut self) -> Message {
        loop {
            let id = if self.random.percent(15) {
                CanId::Extended(u32::try_from(self.random.below(0x1FFF_FFFF)).unwrap())
            } else {
                CanId::Standard(u16::try_from(self.random.between(1, 0x7F0)).unwrap())
            };
            if self.messages.iter().all(|message| message.id != id) {
                return Message::new(id, &mut self.random);
            }
        }
    }

    /// A message of the indicators: cyclic, cyclic and at changes, or at changes alone.
    fn indicator_message(&mut self, fast: bool) -> Message {
        let mut message = self.message();
        message.period_ms = self.random.choose(if fast { &[10, 20, 50, 100] } else { &[20, 50, 100, 200] });
        message.jitter_ms = message.period_ms / 10;
        match self.random.below(8) {
            0 => (message.period_ms, message.on_change) = (1000, true),
            1 => (message.period_ms, message.on_change) = (0, true),
            _ => message.on_change = self.random.percent(20),
        }
        message
    }

    fn show(&mut self, message: &mut Message, length: u16, shows: Shows) {
        let layout = message.place(length, &mut self.random).unwrap();
        message.parts.push(Part::Indicator(layout, shows));
    }

    fn add_indicators(&mut self, form: u64) {
        let mut message = self.indicator_message(form == 2);
        let is_stalk = form == 3;
        let with_hazard = self.random.percent(60);
        match form {
            0 => {
                let (length, mut values) = self.random.choose(&CODES);
                if !with_hazard {
                    values[3] = values[0];
                }
                self.show(&mut message, length, Shows::State(values));
            }
            1 => {
                for is_left in [true, false] {
                    self.show(&mut message, 1, Shows::Side { is_left, with_hazard });
                }
            }
            2 => {
                for is_left in [true, false] {
                    self.show(&mut message, 1, Shows::Lamp { is_left });
                }
            }
            3 => self.show_stalk(&mut message),
            _ => {
                self.show_stalk(&mut message);
                let mut lamps = self.indicator_message(true);
                for is_left in [true, false] {
                    self.show(&mut lamps, 1, Shows::Lamp { is_left });
                }
                self.messages.push(lamps);
            }
        }
        self.shows_hazard = form == 2 || form == 4 || (!is_stalk && with_hazard);
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
        self.messages.push(message);
    }

    fn show_stalk(&mut self, message: &mut Message) {
        let (length, mut values) = self.random.choose(&STALKS);
        if !self.has_half {
            (values[1], values[3]) = (values[0], values[0]);
        }
        self.show(message, length, Shows::Stalk(values));
    }

    /// Where the indicators are, for messages of failed tests.
    pub(crate) fn indicators(&self) -> String {
        let parts = self.messages.iter().flat_map(|message| {
            let shown = message.parts.iter().filter(|part| matches!(part, Part::Indicator(..)));
            shown.map(|part| format!("{} {part:?}", message.id))
        });
        parts.collect::<Vec<_>>().join("; ")
    }

    /// The frames that are sent at a moment.
    pub(crate) fn step(&mut self, lights: Lights, now_ms: u64, mut send: impl FnMut(Frame)) {
        for message in &mut self.messages {
            let is_due = message.period_ms > 0 && now_ms >= message.due_ms;
            if !is_due && !message.on_change {
                continue;
            }
            // Before a change a message is composed with the values that it was sent with.
            let data = message.data(lights, now_ms, false, &mut self.random);
            let is_new = message.on_change && message.is_indicator() && message.has_news(lights);
            if is_due || is_new {
                message.count += 1;
                message.sent = Some(message.shown(lights));
                if is_due {
                    let jitter = self.random.below(2 * message.jitter_ms + 1);
                    message.due_ms =
                        (message.due_ms + message.period_ms + jitter).saturating_sub(message.jitter_ms);
                }
                send(message.frame(&data));
            }
        }
    }

    /// Arbitrary frames of a message while the indicators are in this state; `None` for a message that does not
    /// belong to the indicators.
    pub(crate) fn arbitrary_frames(&mut self, id: CanId, lights: Lights) -> Option<Vec<Frame>> {
        let message = self.messages.iter_mut().find(|message| message.id == id)?;
        if !message.is_indicator() {
            return None;
        }
        let mut frame = || {
            let data = message.data(lights, 0, true, &mut self.random);
            message.frame(&data)
        };
        Some((0..20).map(|_| frame()).collect())
    }
}

impl Message {
    /// What the indicators show in it, without anything else.
    fn shown(&self, lights: Lights) -> [u8; MAX_DATA] {
        let mut data = [0; MAX_DATA];
        for part in &self.parts {
            if let Part::Indicator(layout, shows) = part {
                let codec = SignalCodec::new(*layout, self.length).unwrap();
                codec.write(shows.value(lights).into(), &mut data).unwrap();
            }
        }
        data
    }

    fn has_news(&self, lights: Lights) -> bool {
        self.sent.is_none_or(|sent| sent != self.shown(lights))
    }
}
