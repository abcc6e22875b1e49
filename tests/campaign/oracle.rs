//! What may be published, by docs/spec/vehicle-interface.md and the profile alone.
//!
//! The oracle is given every line of a recording, and gives each report that is due at any instant. It shares
//! no code with the gateway.

use super::recording::{BUS, Content, Line};
use super::vehicle::{Hazard, MS, Meaning, Message, Role, Turn, Vehicle};

/// A jump of the recorder's clock ahead, beyond which it is no silence.
const LONGEST_SILENCE_NS: u64 = 3_600_000 * MS;

/// A stamp earlier by less than this is a line that comes late; by more, a clock that was set back.
const LATE_NS: u64 = 1000 * MS;

/// How long both lamps are lit before that is hazard, and one alone before hazard has ended.
const CONFIRM_NS: u64 = 100 * MS;

/// A state and the stamps it may have (several when frames came at the same instant), or `None`: withheld.
pub(crate) type Belief = Option<(&'static str, Vec<i64>)>;

/// A judged value, when its frame was received, and the stamps of that frame or of others as new.
type Judged<T> = Option<(T, u64, Vec<i64>)>;

pub(crate) struct Oracle<'a> {
    vehicle: &'a Vehicle,
    clock: Clock,
    link_is_up: bool,
    receptions: Vec<Reception>,
    last_life: Option<u64>,
    lamps: Lamps,
}

/// Virtual time of a recording.
#[derive(Default)]
struct Clock {
    now: u64,
    stamp: Option<i64>,
}

/// What was received of one message.
#[derive(Clone, Default)]
struct Reception {
    believed: Option<Frame>,
    /// The counter of the last intact frame, and when that came.
    counter: Option<(i64, u64)>,
    /// Whether any intact frame has come since the start.
    was_intact: bool,
    /// Whether the counter broke, or was silent, so that one frame in sequence is still missing.
    is_broken: bool,
}

#[derive(Clone)]
struct Frame {
    data: Vec<u8>,
    at: u64,
    stamp: i64,
}

impl Clock {
    fn advance(&mut self, stamp: i64) -> u64 {
        let before = *self.stamp.get_or_insert(stamp);
        let step = stamp.abs_diff(before);
        if stamp >= before {
            self.now += step.min(LONGEST_SILENCE_NS);
        }
        if stamp >= before || step >= LATE_NS {
            self.stamp = Some(stamp);
        }
        self.now
    }
}

impl<'a> Oracle<'a> {
    pub(crate) fn new(vehicle: &'a Vehicle) -> Self {
        let receptions = vec![Reception::default(); vehicle.messages.len()];
        let (clock, lamps) = (Clock::default(), Lamps::default());
        Self { vehicle, clock, link_is_up: true, receptions, last_life: None, lamps }
    }

    /// The virtual time of the next line, in nanoseconds.
    pub(crate) fn time_of(&mut self, line: &Line) -> u64 {
        // Damaged lines have no time.
        if line.content == Content::Garbage {
            self.clock.now
        } else {
            self.clock.advance(line.stamp_us * 1000)
        }
    }

    /// A line that comes at that virtual time.
    pub(crate) fn on_line(&mut self, line: &Line, at: u64) {
        match &line.content {
            _ if line.interface != BUS => {}
            Content::Note("link up") => self.link_is_up = true,
            Content::Note(note) if note.starts_with("link") => self.lose_link(),
            Content::Data { id, extended, fd, data } if self.link_is_up => {
                let is_its = |message: &&Message| message.id == *id && message.extended == *extended;
                let Some(message) = self.vehicle.messages.iter().position(|message| is_its(&message)) else {
                    return;
                };
                self.sign_of_life(at);
                if self.vehicle.messages[message].accepts_format(*fd) && self.is_believed(message, data, at) {
                    let frame = Frame { data: data.clone(), at, stamp: line.stamp_us * 1000 };
                    self.receptions[message].believed = Some(frame);
                    self.watch_lamps(message, at);
                }
            }
            Content::Data { .. }
            | Content::Remote { .. }
            | Content::Error { .. }
            | Content::Note(_)
            | Content::Garbage => {}
        }
    }

    /// Turn and hazard report at that time.
    pub(crate) fn beliefs(&mut self, now: u64) -> [Belief; 2] {
        let sides = self.sides(now);
        let hazard = match &self.vehicle.hazard {
            Hazard::NotVisible => None,
            Hazard::BothSides => {
                sides.clone().map(|(sides, at, stamps)| (sides == Meaning::Both, at, stamps))
            }
            Hazard::Signal(role) => {
                self.judge(role, now).map(|(meaning, at, stamps)| (meaning == Meaning::On, at, stamps))
            }
        };
        let turn = sides.map(|(sides, at, stamps)| match (&hazard, sides) {
            (Some((true, since, of_hazard)), _) => {
                ("DISABLE", newest((at, stamps), (*since, of_hazard.clone())).1)
            }
            (_, Meaning::Left) => ("ENABLE_LEFT", stamps),
            (_, Meaning::Right) => ("ENABLE_RIGHT", stamps),
            (_, Meaning::Off | Meaning::Both | Meaning::On | Meaning::NotAvailable | Meaning::Fault) => {
                ("DISABLE", stamps)
            }
        });
        let hazard = hazard.map(|(on, _, stamps)| (if on { "ENABLE" } else { "DISABLE" }, stamps));
        let [turn_withheld, hazard_withheld] =
            [&self.vehicle.turn_faults, &self.vehicle.hazard_faults].map(|faults| {
                let is_broken = |role: &Role| {
                    let meaning = self.believed(role, now).and_then(|frame| role.meaning(&frame.data));
                    matches!(meaning, Some(Meaning::On | Meaning::Fault))
                };
                faults.iter().any(is_broken)
            });
        let [turn_by_fault, hazard_by_fault] = self.vehicle.fault_withholds;
        [
            turn.filter(|_| !(turn_withheld && turn_by_fault)),
            hazard.filter(|_| !(hazard_withheld && hazard_by_fault)),
        ]
    }

    fn lose_link(&mut self) {
        self.link_is_up = false;
        for reception in &mut self.receptions {
            *reception = Reception { was_intact: reception.was_intact, ..Reception::default() };
        }
        self.last_life = None;
        self.lamps = Lamps::default();
    }

    /// A frame of the profile came. After a silence of the bus, event messages must be received again.
    fn sign_of_life(&mut self, at: u64) {
        if self.last_life.is_some_and(|last| at - last > self.vehicle.alive_ns) {
            for (reception, message) in self.receptions.iter_mut().zip(&self.vehicle.messages) {
                reception.believed = reception.believed.take().filter(|_| message.timeout_ns.is_some());
            }
        }
        self.last_life = Some(at);
    }

    /// Whether the frame proves itself.
    fn is_believed(&mut self, index: usize, data: &[u8], at: u64) -> bool {
        let (message, reception) = (&self.vehicle.messages[index], &mut self.receptions[index]);
        let roles = self.vehicle.roles().into_iter().filter(|role| role.message == index);
        let fields = roles.map(|role| &role.field).chain(message.checksum.as_ref().map(|(_, field)| field));
        let mut fields = fields.chain(message.counter.as_ref().map(|(field, _)| field));
        if fields.any(|field| field.needed_bytes() > data.len())
            || message.right_length.is_some_and(|right| right != data.len())
        {
            return false;
        }
        let mut sealed = data.to_vec();
        message.seal(&mut sealed);
        if sealed != data {
            return false;
        }
        let Some((field, max_step)) = &message.counter else { return true };
        // A counter is forgotten with the value that it vouches for.
        let in_time = |(_, last): &(i64, u64)| message.timeout_ns.is_none_or(|limit| at - last <= limit);
        let before = reception.counter.filter(in_time);
        reception.counter = Some((field.get(data), at));
        let Some((before, _)) = before else {
            reception.is_broken = std::mem::replace(&mut reception.was_intact, true);
            return false;
        };
        let step = (field.get(data) - before).rem_euclid(1 << field.width());
        let in_sequence = (1..=*max_step).contains(&step);
        let was_broken = std::mem::replace(&mut reception.is_broken, !in_sequence);
        in_sequence && !was_broken
    }

    /// The frame that counts for a role, while it does.
    fn believed(&self, role: &Role, now: u64) -> Option<&Frame> {
        let frame = self.receptions[role.message].believed.as_ref()?;
        let holds = match self.vehicle.messages[role.message].timeout_ns {
            Some(limit) => now - frame.at <= limit,
            None => self.last_life.is_some_and(|last| now - last <= self.vehicle.alive_ns),
        };
        (self.link_is_up && holds).then_some(frame)
    }

    fn judge(&self, role: &Role, now: u64) -> Judged<Meaning> {
        let frame = self.believed(role, now)?;
        let meaning = role.meaning(&frame.data)?;
        let is_defined = !matches!(meaning, Meaning::NotAvailable | Meaning::Fault);
        is_defined.then(|| (meaning, frame.at, vec![frame.stamp]))
    }

    fn sides(&mut self, now: u64) -> Judged<Meaning> {
        let (left, right, both_is_hazard, hold_ns) = match &self.vehicle.turn {
            Turn::One(role) => return self.judge(role, now),
            Turn::Sides { left, right, both_is_hazard, hold_ns } => (left, right, both_is_hazard, hold_ns),
        };
        let (left, right) = (self.judge(left, now), self.judge(right, now));
        if let Some(hold) = hold_ns {
            let Some((_, at, stamps)) = left else {
                self.lamps.be_blind();
                return None;
            };
            return self.lamps.state(now, *hold).map(|state| (state, at, stamps));
        }
        let ((left, left_at, left_stamps), (right, right_at, right_stamps)) = (left?, right?);
        let (at, stamps) = newest((left_at, left_stamps), (right_at, right_stamps));
        match (left == Meaning::On, right == Meaning::On) {
            (false, false) => Some((Meaning::Off, at, stamps)),
            (true, false) => Some((Meaning::Left, at, stamps)),
            (false, true) => Some((Meaning::Right, at, stamps)),
            (true, true) => both_is_hazard.then_some((Meaning::Both, at, stamps)),
        }
    }

    /// Lamps are watched frame by frame.
    fn watch_lamps(&mut self, message: usize, at: u64) {
        let Turn::Sides { left, right, hold_ns: Some(hold), .. } = &self.vehicle.turn else { return };
        if left.message == message {
            let lit = |role| self.judge(role, at).is_some_and(|(meaning, ..)| meaning == Meaning::On);
            let (left, right) = (lit(left), lit(right));
            self.lamps.frame(left, right, at, *hold);
        }
    }
}

/// The later of two receptions; of equally late ones, either stamp.
fn newest(one: (u64, Vec<i64>), other: (u64, Vec<i64>)) -> (u64, Vec<i64>) {
    match one.0.cmp(&other.0) {
        std::cmp::Ordering::Less => other,
        std::cmp::Ordering::Greater => one,
        std::cmp::Ordering::Equal => (one.0, [one.1, other.1].concat()),
    }
}

/// Lamps that flash, by the specification's section of that name.
#[derive(Default)]
struct Lamps {
    /// The first frame since the lamps were seen without a break.
    watched_since: Option<u64>,
    state: Option<(Meaning, u64)>,
    /// What is lit, since when and until when no frame showed anything else but darkness.
    run: Option<(Meaning, u64, u64)>,
}

impl Lamps {
    fn be_blind(&mut self) {
        self.watched_since = None;
        self.run = None;
    }

    fn frame(&mut self, left: bool, right: bool, at: u64, hold: u64) {
        self.expire(at, hold);
        self.watched_since.get_or_insert(at);
        let lit = match (left, right) {
            (false, false) => return,
            (true, false) => Meaning::Left,
            (false, true) => Meaning::Right,
            (true, true) => Meaning::Both,
        };
        let since = match self.run {
            Some((same, since, last)) if same == lit && at - last <= hold => since,
            _ => at,
        };
        self.run = Some((lit, since, at));
        let is_confirmed = at - since >= CONFIRM_NS;
        let was = self.state.map(|(state, _)| state);
        match (was, lit) {
            // Both lamps keep either side on until they are hazard, and one lamp keeps hazard on likewise.
            (_, Meaning::Both) if is_confirmed => self.state = Some((lit, at)),
            (Some(state), Meaning::Both) => self.state = Some((state, at)),
            (None, Meaning::Both) => {}
            (Some(Meaning::Both), _) if !is_confirmed => {}
            _ => self.state = Some((lit, at)),
        }
    }

    /// A state ends when the hold has passed since its last light.
    fn expire(&mut self, now: u64, hold: u64) {
        if let Some((state, last)) = self.state
            && now - last > hold
        {
            // What is lit meanwhile takes its place.
            let next = self
                .run
                .filter(|(lit, _, last)| *lit != state && *lit != Meaning::Both && now - last <= hold);
            self.state = next.map(|(lit, _, last)| (lit, last));
        }
    }

    fn state(&mut self, now: u64, hold: u64) -> Option<Meaning> {
        self.expire(now, hold);
        let since = self.watched_since?;
        match self.state {
            Some((state, _)) => Some(state),
            None => (now - since > hold).then_some(Meaning::Off),
        }
    }
}
