//! Recordings of a vehicle that drives for some seconds: what its control units send, encoded by the
//! campaign.

use std::fmt;

use super::dice::Dice;
use super::vehicle::{MS, Meaning, Message, Role, Turn, Vehicle};

/// The interface of the vehicle's bus, and one that nothing is configured for.
pub(crate) const BUS: &str = "can0";
pub(crate) const OTHER_BUS: &str = "can9";

/// An identifier that no shipped vehicle has.
pub(crate) const UNKNOWN_ID: u32 = 0x7FE;

/// The stamp of the first line, microseconds.
const START_US: i64 = 1_700_000_000_000_000;

/// One line of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Line {
    pub(crate) stamp_us: i64,
    pub(crate) interface: &'static str,
    pub(crate) content: Content,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Content {
    Data {
        id: u32,
        extended: bool,
        fd: bool,
        data: Vec<u8>,
    },
    Remote {
        id: u32,
        extended: bool,
    },
    /// An error frame: its class, and the second byte of its data.
    Error {
        class: u32,
        controller: u8,
    },
    /// A note of the black box: `link down`, `controller bus-off`, `drops 7`.
    Note(&'static str),
    /// Not a line of a recording.
    Garbage,
}

/// As candump writes it.
impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { stamp_us, interface, content } = self;
        let time = format!("({}.{:06})", stamp_us / 1_000_000, stamp_us % 1_000_000);
        let id =
            |id: &u32, extended: &bool| if *extended { format!("{id:08X}") } else { format!("{id:03X}") };
        match content {
            Content::Data { id: number, extended, fd, data } => {
                let mark = if *fd { "##0" } else { "#" };
                let data: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
                write!(f, "{time} {interface} {}{mark}{data}", id(number, extended))
            }
            Content::Remote { id: number, extended } => {
                write!(f, "{time} {interface} {}#R", id(number, extended))
            }
            Content::Error { class, controller } => {
                write!(f, "{time} {interface} {:08X}#00{controller:02X}000000000000", class | 0x2000_0000)
            }
            Content::Note(note) => write!(f, "# {time} {interface} {note}"),
            Content::Garbage => write!(f, "{time} {interface} 2A5#0G \u{1F4A5}"),
        }
    }
}

impl Line {
    /// A frame of the message with these bytes.
    pub(crate) fn frame(stamp_us: i64, message: &Message, data: Vec<u8>) -> Self {
        let content = Content::Data { id: message.id, extended: message.extended, fd: message.is_fd(), data };
        Self { stamp_us, interface: BUS, content }
    }

    /// A frame that belongs to nothing.
    pub(crate) fn unknown(stamp_us: i64) -> Self {
        let content = Content::Data { id: UNKNOWN_ID, extended: false, fd: false, data: vec![0xFF; 8] };
        Self { stamp_us, interface: BUS, content }
    }
}

/// The distance between frames of a message that lie `timeouts / 5` apart.
pub(crate) fn period_us(vehicle: &Vehicle, message: &Message) -> u64 {
    message.timeout_ns.unwrap_or(vehicle.alive_ns) / 5 / 1000
}

/// A control unit's view of the lights, which changes now and then.
struct Lights<'a> {
    roles: Vec<&'a Role>,
    raw: Vec<i64>,
    until_us: Vec<u64>,
    /// Which sides flash, for how long a cycle, and how much of it is lit, of lamps.
    flashing: Option<(bool, bool)>,
    cycle_us: u64,
    lit_us: u64,
}

impl Lights<'_> {
    /// The raw value of a role at that time.
    fn raw(&mut self, role: usize, at_us: u64, dice: &mut Dice) -> i64 {
        if let Some(sides) = &mut self.flashing
            && role < 2
        {
            if at_us >= self.until_us[0] {
                *sides =
                    *dice.pick(&[(false, false), (false, false), (true, false), (false, true), (true, true)]);
                self.until_us[0] = at_us + dice.within(800_000..6_000_000);
            }
            let lit = at_us % self.cycle_us < self.lit_us;
            return i64::from(lit && if role == 0 { sides.0 } else { sides.1 });
        }
        if at_us >= self.until_us[role] {
            self.until_us[role] = at_us + dice.within(100_000..2_500_000);
            self.raw[role] = any_raw(self.roles[role], dice);
        }
        self.raw[role]
    }
}

/// Mostly a defined state; now and then not available, a fault, or any value at all.
fn any_raw(role: &Role, dice: &mut Dice) -> i64 {
    let entries: Vec<_> = role
        .values
        .iter()
        .filter(|(_, meaning)| dice.percent(15) || !matches!(meaning, Meaning::NotAvailable | Meaning::Fault))
        .collect();
    if dice.percent(10) || entries.is_empty() {
        return dice.within(0..1 << role.field.width()).cast_signed();
    }
    let (values, _) = dice.pick(&entries);
    let span = (values.end() - values.start()).cast_unsigned();
    values.start() + dice.within(0..span + 1).cast_signed()
}

/// What a sound vehicle sends, in order of time. After the last frame there is a silence longer than any
/// limit.
pub(crate) fn drive(vehicle: &Vehicle, dice: &mut Dice) -> Vec<Line> {
    let limits = vehicle.messages.iter().filter_map(|message| message.timeout_ns);
    let longest_us = limits.max().unwrap_or(0).max(vehicle.alive_ns) / 1000;
    let is_lamp = matches!(vehicle.turn, Turn::Sides { hold_ns: Some(_), .. });
    let length_us = if is_lamp { 20_000_000 } else { (12 * longest_us).clamp(5_000_000, 25_000_000) };
    let roles = vehicle.roles();
    let cycle_us = dice.within(500_000..1_000_000);
    let mut lights = Lights {
        raw: vec![0; roles.len()],
        until_us: vec![0; roles.len()],
        flashing: is_lamp.then_some((false, false)),
        lit_us: cycle_us * dice.within(30..76) / 100,
        cycle_us,
        roles,
    };
    let mut lines = Vec::new();
    for (index, message) in vehicle.messages.iter().enumerate() {
        let period = period_us(vehicle, message);
        let mut counter = dice.within(0..16).cast_signed();
        let mut at_us = dice.within(0..period);
        while at_us < length_us {
            let mut data: Vec<_> = (0..message.length).map(|_| dice.next().to_le_bytes()[0]).collect();
            for role in 0..lights.roles.len() {
                if lights.roles[role].message == index {
                    let raw = lights.raw(role, at_us, dice);
                    lights.roles[role].field.set(&mut data, raw);
                }
            }
            if let Some((field, _)) = &message.counter {
                counter += 1;
                field.set(&mut data, counter);
            }
            message.seal(&mut data);
            lines.push(Line::frame(START_US + at_us.cast_signed(), message, data));
            at_us += period * dice.within(90..111) / 100;
        }
    }
    lines.sort_by_key(|line| line.stamp_us);
    let hold_us = 4000 * MS / 1000;
    lines.push(Line::unknown(START_US + (length_us + 3 * longest_us + hold_us).cast_signed()));
    lines
}
