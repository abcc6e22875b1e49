//! A message of an invented car: its signals, what else changes in it, and when it is sent.

use super::lights::{Lights, Shows};
use super::random::Random;
use can_signal::can::frame::{CanId, Frame, MAX_DATA};
use can_signal::dbc::codec::{ByteOrder, Layout, SignalCodec};
use can_signal::validation::integrity::checksum::{
    Checksum, ChecksumRule, CrcParameters, CrcRule, Extra, Sum,
};

/// A place in a message, on one of its pages or on all.
#[derive(Debug, Clone)]
struct Field {
    layout: Layout,
    codec: SignalCodec,
    page: Option<u64>,
}

#[derive(Debug, Clone)]
enum Content {
    /// Never changes in a session.
    Constant(u64),
    /// A sensor: another value each time.
    Noise,
    /// A sensor that goes up and down by one.
    Drift(u64),
    /// Toggles at random, every so many ms on average.
    Toggle {
        mean_ms: u64,
        on: bool,
    },
    /// Toggles by itself, every so many ms.
    Periodic {
        half_ms: u64,
    },
    Counter {
        last: u64,
    },
    Shown(Shows),
    /// A checksum that no profile knows: an 8-bit product of all other bytes.
    Secret,
}

impl Content {
    fn is_of_indicators(&self) -> bool {
        matches!(self, Self::Shown(shows) if shows.is_of_indicators())
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Message {
    pub(crate) id: CanId,
    length: usize,
    pub(crate) period_ms: u64,
    pub(crate) jitter_ms: u64,
    /// Sent at a change as well; with a period of 0 only then.
    pub(crate) on_change: bool,
    /// Not sent from the first of these times to the second, ms.
    pub(crate) silent: Option<(u64, u64)>,
    /// The multiplexor, with the number of pages.
    pages: Option<(Field, u64)>,
    parts: Vec<(Field, Content)>,
    checksum: Option<Checksum>,
    used: Vec<bool>,
    count: u64,
    due_ms: u64,
    sent: Option<[u8; MAX_DATA]>,
}

impl Message {
    pub(crate) fn new(id: CanId, length: usize, random: &mut Random) -> Self {
        let period_ms = random.choose(&[20, 100, 100, 200, 200, 500, 500, 1000, 1000]);
        Self {
            id,
            length,
            period_ms,
            jitter_ms: random.below(period_ms / 10 + 1),
            on_change: false,
            silent: None,
            pages: None,
            parts: Vec::new(),
            checksum: None,
            used: vec![false; length * 8],
            count: random.below(200),
            due_ms: random.below(period_ms),
            sent: None,
        }
    }

    /// A free place of this length, in either byte order.
    fn place(&mut self, length: u16, random: &mut Random) -> Option<Field> {
        for _ in 0..200 {
            let order = if random.percent(50) { ByteOrder::Intel } else { ByteOrder::Motorola };
            let start = u16::try_from(random.below(self.length as u64 * 8)).unwrap();
            if let Some(field) = self.claim(Layout { start, length, order, signed: false }) {
                return Some(field);
            }
        }
        None
    }

    /// Takes a place, if it is free.
    fn claim(&mut self, layout: Layout) -> Option<Field> {
        let codec = SignalCodec::new(layout, self.length).ok()?;
        let mut data = [0; MAX_DATA];
        codec.write(codec.range().1, &mut data).unwrap();
        let bits: Vec<_> = (0..self.length * 8).filter(|bit| data[bit / 8] >> (bit % 8) & 1 == 1).collect();
        if bits.iter().any(|bit| self.used[*bit]) {
            return None;
        }
        for bit in bits {
            self.used[bit] = true;
        }
        Some(Field { layout, codec, page: None })
    }

    /// Adds a signal at any place; false if there is none.
    pub(crate) fn show(&mut self, length: u16, shows: Shows, random: &mut Random) -> bool {
        let Some(field) = self.place(length, random) else { return false };
        self.parts.push((field, Content::Shown(shows)));
        true
    }

    /// Adds a signal of a whole number of fields like this one, as J1939 places them.
    pub(crate) fn show_aligned(&mut self, length: u16, shows: Shows, random: &mut Random) {
        let slots = self.length as u64 * 8 / u64::from(length);
        let slot = |random: &mut Random| u16::try_from(random.below(slots)).unwrap() * length;
        let layout = |start| Layout::unsigned(start, length);
        let field = (0..200).find_map(|_| self.claim(layout(slot(random)))).unwrap();
        self.parts.push((field, Content::Shown(shows)));
    }

    /// Counter, checksum, sensors and switches in the places that are left.
    pub(crate) fn fill(&mut self, random: &mut Random) {
        if random.percent(50) {
            self.add_checksum(random);
        }
        if random.percent(50) {
            let (length, last) = random.choose(&[(4, 15), (4, 14), (2, 3), (8, 255), (3, 7)]);
            let counter = self.place(length, random).map(|field| (field, Content::Counter { last }));
            self.parts.extend(counter);
        }
        if !self.is_of_indicators() && random.percent(10) {
            self.add_pages(random);
        }
        for _ in 0..random.below(3 + self.length as u64 / 4) {
            let length = u16::try_from(random.between(1, 12)).unwrap();
            let Some(mut field) = self.place(length, random) else { break };
            field.page = self.pages.as_ref().and_then(|(_, pages)| {
                let page = random.below(pages + 1);
                (page < *pages).then_some(page)
            });
            let content = match random.below(if length == 1 { 7 } else { 4 }) {
                0 => Content::Noise,
                1 => Content::Drift(random.below(1 << length)),
                2 | 3 => Content::Constant(random.below(1 << length)),
                4 => Content::Periodic { half_ms: random.between(200, 3000) },
                _ => Content::Toggle { mean_ms: random.between(2_000, 40_000), on: false },
            };
            self.parts.push((field, content));
        }
    }

    fn add_pages(&mut self, random: &mut Random) {
        let pages = random.between(2, 5);
        self.pages = self.place(random.choose(&[3, 4, 8]), random).map(|field| (field, pages));
    }

    /// Moves all of its signals to pages, which are sent in turn; on the others, the same places may have
    /// other contents.
    pub(crate) fn multiplex(&mut self, random: &mut Random) {
        self.add_pages(random);
        (self.period_ms, self.on_change) = (self.period_ms.max(20), false);
        let Some((_, pages)) = self.pages else { return };
        let page = random.below(pages);
        let mut others = Vec::new();
        for (field, _) in &mut self.parts {
            field.page = Some(if random.percent(80) { page } else { random.below(pages) });
            for other in (0..pages).filter(|other| Some(*other) != field.page) {
                let size = 1 << field.layout.length;
                let content = match random.below(8) {
                    0 => Content::Noise,
                    1 => Content::Toggle { mean_ms: random.between(2_000, 40_000), on: false },
                    2 => Content::Constant(random.below(size)),
                    _ => continue,
                };
                others.push((Field { page: Some(other), ..field.clone() }, content));
            }
        }
        self.parts.extend(others);
    }

    fn add_checksum(&mut self, random: &mut Random) {
        let kind = random.below(9);
        let at = |start, length| Layout::unsigned(start, length);
        let last = u16::try_from(self.length).unwrap() - 1;
        let any = u8::try_from(random.below(256)).unwrap();
        let byte = random.choose(&[last, last, last, 0, last - 1]);
        // Rules with a place of their own are for eight bytes.
        let kind = if self.length == 8 { kind } else { kind % 5 };
        let field = self.claim(if kind == 5 { at(56, 4) } else { at(byte * 8, 8) });
        let general = CrcParameters::crc8(any | 1, 0xFF, any).with_reflection(random.percent(50));
        let rule = match kind {
            0 => Some(ChecksumRule::Sum(Sum::PLAIN)),
            1 => Some(ChecksumRule::Sum(Sum { start: any, ..Sum::PLAIN })),
            2 => Some(ChecksumRule::Xor { start: any }),
            3 => Some(ChecksumRule::Crc(CrcRule::new(general, Extra::Nothing, None))),
            5 => Some(ChecksumRule::Honda),
            6 => Some(ChecksumRule::Crc(CrcRule::j1850())),
            7 => Some(ChecksumRule::Crc(CrcRule::giorgio(any))),
            8 => Some(ChecksumRule::Sum(Sum::TOYOTA)),
            _ => None,
        };
        if let Some(field) = field {
            match rule {
                Some(rule) => self.checksum = Some(Checksum::new(rule, field.codec).unwrap()),
                None => self.parts.push((field, Content::Secret)),
            }
        }
    }

    /// The data at a moment. With `varied`, what does not belong to the indicators is arbitrary.
    fn data(&mut self, lights: Lights, now_ms: u64, varied: bool, random: &mut Random) -> [u8; MAX_DATA] {
        let mut data = [0; MAX_DATA];
        let write = |field: &Field, value: u64, data: &mut [u8; MAX_DATA]| {
            field.codec.write(value.into(), data).unwrap();
        };
        let page = self.pages.as_ref().map(|(field, pages)| (field, self.count % pages));
        if let Some((field, page)) = page {
            write(field, page, &mut data);
        }
        let page = page.map(|(_, page)| page);
        let mut secret = None;
        for (field, content) in &mut self.parts {
            if field.page.is_some() && field.page != page {
                continue;
            }
            let length = field.layout.length;
            let value = match content {
                Content::Shown(shows) if shows.is_of_indicators() => shows.value(lights, length),
                Content::Secret => {
                    secret = Some(&*field);
                    continue;
                }
                _ if varied => random.below(1 << length),
                Content::Shown(shows) => shows.value(lights, length),
                Content::Noise => random.below(1 << length),
                Content::Drift(value) => {
                    *value = (*value + random.below(3)).saturating_sub(1).min((1 << length) - 1);
                    *value
                }
                Content::Constant(value) => *value,
                Content::Periodic { half_ms } => now_ms / *half_ms % 2,
                Content::Counter { last } => self.count % (*last + 1),
                Content::Toggle { mean_ms, on } => {
                    *on ^= self.period_ms > 0 && random.below(*mean_ms) < self.period_ms;
                    u64::from(*on)
                }
            };
            write(field, value, &mut data);
        }
        if let Some(field) = secret {
            let product = data.iter().take(self.length).fold(0x9D_u8, |product, byte| {
                product.wrapping_mul(31).wrapping_add(*byte).rotate_left(3) ^ (byte >> 2)
            });
            write(field, product.into(), &mut data);
        }
        if let Some(checksum) = &self.checksum {
            assert!(checksum.protect(self.id, &mut data[..self.length]));
        }
        data
    }

    fn frame(&self, data: &[u8; MAX_DATA]) -> Frame {
        let data = &data[..self.length];
        if self.length > 8 { Frame::fd(self.id, data) } else { Frame::classic(self.id, data) }.unwrap()
    }

    pub(crate) fn is_of_indicators(&self) -> bool {
        self.parts.iter().any(|(_, content)| content.is_of_indicators())
    }

    /// The frame that is sent at a moment, if one is.
    pub(crate) fn step(&mut self, lights: Lights, now_ms: u64, random: &mut Random) -> Option<Frame> {
        let is_due = self.period_ms > 0 && now_ms >= self.due_ms;
        if is_due {
            let jitter = random.below(2 * self.jitter_ms + 1);
            self.due_ms = (self.due_ms + self.period_ms + jitter).saturating_sub(self.jitter_ms);
        }
        let is_silent = self.silent.is_some_and(|(from, until)| (from..until).contains(&now_ms));
        let is_new = self.on_change && self.sent.is_none_or(|sent| sent != self.shown(lights));
        if is_silent || !(is_due || is_new) {
            return None;
        }
        self.count += 1;
        if self.on_change {
            self.sent = Some(self.shown(lights));
        }
        let data = self.data(lights, now_ms, false, random);
        Some(self.frame(&data))
    }

    /// What the driver does shows in it, without anything else.
    fn shown(&self, lights: Lights) -> [u8; MAX_DATA] {
        let mut data = [0; MAX_DATA];
        for (field, content) in &self.parts {
            if let Content::Shown(shows) = content {
                field.codec.write(shows.value(lights, field.layout.length).into(), &mut data).unwrap();
            }
        }
        data
    }

    /// Arbitrary frames with this state of the indicators.
    pub(crate) fn arbitrary_frames(&mut self, lights: Lights, random: &mut Random) -> Vec<Frame> {
        let mut frame = || {
            let data = self.data(lights, 0, true, random);
            self.frame(&data)
        };
        (0..20).map(|_| frame()).collect()
    }

    /// Its signals of the indicators, for messages of failed tests.
    pub(crate) fn indicators(&self) -> Vec<String> {
        let fields = self.parts.iter().filter(|(_, content)| content.is_of_indicators());
        let text = |(field, content): &(Field, Content)| {
            format!("{} {:?} {content:?} every {} ms", self.id, field.layout, self.period_ms)
        };
        fields.map(text).collect()
    }

    /// What its signals show, with their lengths.
    pub(crate) fn shown_signals(&self) -> Vec<(u16, Shows)> {
        let shown = |(field, content): &(Field, Content)| {
            if let Content::Shown(shows) = content { Some((field.layout.length, *shows)) } else { None }
        };
        self.parts.iter().filter_map(shown).collect()
    }
}
