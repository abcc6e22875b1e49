//! Searches for signals that follow the driver's actions.

use std::time::Duration;

use super::bits::{QuietBits, quiet_bits};
use super::candidate::{
    Drawback, FoundSignal, HazardForm, ResponseTime, SignalCandidate, Switch, TurnForm, bits_of, sawtooth,
};
use super::capture::{Capture, FrameTrack, MessageKey};
use super::pages::is_on_a_page;
use super::protection::FoundProtection;
use super::response::{Followed, ResponseShape, Responses, SignalResponse, Typical};
use super::suspects::{MIN_CHECKSUM_BITS, companions, like_checksum, restless};
use super::timeline::{ActionTimeline, DriverAction, EARLY};
use can_signal::dbc::codec::{ByteOrder, Layout, SignalCodec};
use gateway_base::time::MonoTime;

/// Maximum length of an enumerated signal, bits.
const MAX_WIDTH: u16 = 8;
/// Maximum number of responding bits of a message that are combined; more are not an indicator signal.
const MAX_RESPONDING: usize = 40;
/// Silence from which a message counts as not sent regularly, seconds.
const REGULAR_S: u64 = 3;
/// Maximum delay of a change.
const MAX_PERIOD: Duration = Duration::from_secs(1);
/// Number of followed requests that may be more than chance.
const MIN_HINTS: usize = 2;

/// A message with bits that follow the actions.
#[derive(Debug)]
pub(super) struct Responding<'a> {
    pub(super) key: MessageKey,
    pub(super) protection: FoundProtection,
    pub(super) quiet: QuietBits<'a>,
    pub(super) bits: Vec<(u16, Responses)>,
    /// Bits that change at some presses of a momentary switch, like its half press.
    companions: Vec<u16>,
    /// Bytes that change whenever anything in the message changes.
    like_checksum: Vec<u16>,
    /// Bits that change with most uses of the indicators, in an unknown way.
    restless: Vec<u16>,
    is_regular: bool,
    /// Usual time between two frames, by which a change may be late.
    period: Duration,
    length: usize,
}

pub(super) fn responding<'a>(capture: &Capture, timeline: &'a ActionTimeline) -> Vec<Responding<'a>> {
    let Some((_, end)) = capture.span() else { return Vec::new() };
    capture.tracks().filter_map(|(key, track)| Responding::new(key, track, timeline, end)).collect()
}

impl<'a> Responding<'a> {
    fn new(key: MessageKey, track: &FrameTrack, timeline: &'a ActionTimeline, end: MonoTime) -> Option<Self> {
        // Most messages end here. The slow search for checksums is only made for the remaining messages.
        responding_bits(&quiet_bits(track, timeline, end, &[])?, track)?;
        let protection = FoundProtection::find(track);
        let quiet = quiet_bits(track, timeline, end, &protection.bits())?;
        let mut bits = responding_bits(&quiet, track)?;
        bits.retain(|(bit, _)| !is_on_a_page(track, &quiet, *bit));
        let gaps = track.gaps();
        let is_regular = gaps.is_some_and(|gaps| gaps.longest.as_secs() < REGULAR_S);
        let period = gaps.map_or(Duration::ZERO, |gaps| gaps.median).min(MAX_PERIOD);
        let like_checksum = like_checksum(&quiet, &bits);
        let restless = restless(&quiet, &bits);
        let length = track.shortest();
        let companions = companions(&quiet, &bits);
        Some(Self {
            key,
            protection,
            quiet,
            bits,
            companions,
            like_checksum,
            restless,
            is_regular,
            period,
            length,
        })
    }

    /// Returns the bits that a signal may have.
    fn known_bits(&self) -> impl Iterator<Item = u16> {
        self.bits.iter().map(|(bit, _)| *bit).chain(self.companions.iter().copied())
    }

    fn is_known(&self, bit: u16) -> bool {
        self.known_bits().any(|known| known == bit)
    }

    /// Returns fields of two bits or more that could be an enumerated signal.
    fn fields(&self) -> Vec<(Layout, Responses)> {
        let mut layouts: Vec<Layout> = Vec::new();
        for (order, position) in
            [(ByteOrder::Intel, (|bit| bit) as fn(u16) -> u16), (ByteOrder::Motorola, sawtooth)]
        {
            let mut positions: Vec<_> = self.known_bits().map(position).collect();
            positions.sort_unstable();
            for (index, low) in positions.iter().enumerate() {
                for high in positions[index + 1..].iter().take_while(|high| **high - low < MAX_WIDTH) {
                    let start = position(*low);
                    let layout = Layout { start, length: high - low + 1, order, signed: false };
                    // Within a byte both orders are equivalent, so the field is listed once.
                    let is_in_a_byte = low / 8 == high / 8;
                    if !(is_in_a_byte && order == ByteOrder::Motorola) {
                        layouts.push(layout);
                    }
                }
            }
        }
        // A bit in between that changes for other reasons ends the field.
        layouts.retain(|layout| {
            let bits = bits_of(*layout);
            bits.iter().all(|bit| self.is_known(*bit) || !self.quiet.varies(*bit))
        });
        let responses = |layout: Layout| {
            let codec = SignalCodec::new(layout, self.length).ok()?;
            Some((layout, Responses::new(&self.quiet, &codec)))
        };
        layouts.into_iter().filter_map(responses).collect()
    }

    /// Returns the drawbacks of a signal that result from its position.
    pub(super) fn drawbacks(&self, bits: &[u16], rest: u64, shape: ResponseShape) -> Vec<Drawback> {
        let is_next = |bit: &u16, other: &u16| {
            is_beside(*bit, *other) && (bit / 8 == other / 8 || !self.like_checksum.contains(&(other / 8)))
        };
        let is_cut = |other: &u16| !bits.contains(other) && bits.iter().any(|bit| is_next(bit, other));
        let is_same =
            |responses: &Responses| responses.has_shape(self.quiet.timeline, &DriverAction::ALL, shape);
        let cut = if shape == ResponseShape::Momentary {
            self.cut_of_stalk(bits)
        } else {
            self.bits.iter().filter(|(other, of)| is_cut(other) && is_same(of)).count()
        };
        let gaps = bits.iter().filter(|bit| !self.is_known(**bit)).count();
        let is_near = |other: &u16| bits.iter().any(|bit| bit / 8 == other / 8 || is_next(bit, other));
        let counted = |count: usize, drawback: fn(u16) -> Drawback| {
            (count > 0).then(|| drawback(u16::try_from(count).unwrap_or(u16::MAX)))
        };
        let is_like_checksum = bits.iter().any(|bit| self.like_checksum.contains(&(bit / 8)));
        let drawbacks = [
            is_like_checksum.then_some(Drawback::LikeChecksum),
            self.restless.iter().any(is_near).then_some(Drawback::PartOfNumber),
            counted(cut, Drawback::Cut),
            counted(gaps, Drawback::Gaps),
            counted(bits.len().saturating_sub(2), Drawback::Wide),
            (rest != 0).then_some(Drawback::RestsOn),
            (!self.is_regular).then_some(Drawback::Irregular),
            self.protection.checksum.is_none().then_some(Drawback::NoChecksum),
            self.protection.counter.is_none().then_some(Drawback::NoCounter),
        ];
        drawbacks.into_iter().flatten().collect()
    }

    /// Returns the number of further bits that belong to these `bits` of a momentary switch: they also show
    /// presses to the sides, and are separated from `bits` by constant bits at most.
    fn cut_of_stalk(&self, bits: &[u16]) -> usize {
        let timeline = self.quiet.timeline;
        let shows_a_press = |responses: &Responses| {
            responses.has_shape(timeline, &DriverAction::ALL[..2], ResponseShape::Momentary)
        };
        let responding = self.bits.iter().filter(|(_, of)| shows_a_press(of)).map(|(bit, _)| *bit);
        let others = responding.chain(self.companions.iter().copied()).filter(|bit| !bits.contains(bit));
        let is_joined = |bit: u16, other: u16| {
            [|bit| bit, sawtooth].into_iter().any(|position: fn(u16) -> u16| {
                let (low, high) = (position(bit).min(position(other)), position(bit).max(position(other)));
                high - low < MAX_WIDTH && (low + 1..high).all(|at| !self.quiet.varies(position(at)))
            })
        };
        others.filter(|other| bits.iter().any(|bit| is_joined(*bit, *other))).count()
    }

    /// Returns the times of the response and of its end for each request, with their largest delays.
    pub(super) fn times(&self, responses: &Responses) -> Vec<[Option<ResponseTime>; 2]> {
        let late = self.period;
        responses.times().map(|times| times.map(|at| Some(ResponseTime { at: at?, late }))).collect()
    }

    /// Returns another bit of the message that always changed together with one of `bits`. It may be part of
    /// a checksum or counter, and the frames do not show which of the two is the signal.
    fn twin(&self, bits: &[u16], shows_all: bool) -> Option<u16> {
        let is_apart = |other: u16| !bits.iter().any(|bit| is_beside(*bit, other));
        let others = self.bits.iter().map(|(bit, _)| *bit).filter(|bit| is_apart(*bit));
        let mut others = others.filter(|bit| !bits.contains(bit) && !self.like_checksum.contains(&(bit / 8)));
        let in_byte = |byte: u16| self.bits.iter().filter(|(bit, _)| bit / 8 == byte).count();
        // Sums preserve the position within a byte or nibble, other checksums change many bits, and counters
        // change with rare frames. A bit that is neither is a second copy of the signal.
        let may_be_derived = |bit: u16, other: u16| {
            bit % 4 == other % 4
                || ((!shows_all || bit / 8 != other / 8) && in_byte(other / 8) >= MIN_CHECKSUM_BITS)
                || !self.is_regular
        };
        others.find(|other| {
            let is_twin =
                |bit: &u16| may_be_derived(*bit, *other) && self.quiet.change_together(*bit, *other);
            bits.iter().any(is_twin)
        })
    }

    fn signal(&self, layout: Layout) -> FoundSignal {
        FoundSignal { message: self.key, layout }
    }
}

/// Returns true for neighbouring bits, within a byte or where Motorola or Intel order continues in the next
/// byte.
fn is_beside(bit: u16, other: u16) -> bool {
    let follows = |bit: u16, other: u16| other == bit + 1 || (bit.is_multiple_of(8) && other == bit + 15);
    follows(bit, other) || follows(other, bit)
}

/// Returns a bit elsewhere in the message that always changed together with one of `bits`. The codes of a
/// signal that shows all states may fill a byte.
pub(super) fn twin(
    messages: &[Responding<'_>],
    bits: &[(MessageKey, Vec<u16>)],
    shows_all: bool,
) -> Option<FoundSignal> {
    messages.iter().find_map(|message| {
        let own = bits.iter().filter(|(key, _)| *key == message.key);
        let bits: Vec<_> = own.flat_map(|(_, bits)| bits).copied().collect();
        let start = message.twin(&bits, shows_all)?;
        Some(message.signal(Layout::unsigned(start, 1)))
    })
}

/// Returns true if a bit followed some requests of an action, but too few for a decision.
pub(super) fn is_open(messages: &[Responding<'_>], timeline: &ActionTimeline, action: DriverAction) -> bool {
    let of = timeline.count(action);
    let is_known = |count: usize| action == DriverAction::Hazard && count * 2 > of;
    let bits = messages.iter().flat_map(|message| &message.bits);
    let mut counts = bits.map(|(_, responses)| responses.values(timeline, action).len());
    counts.any(|count| count >= MIN_HINTS && !is_known(count))
}

/// Returns the messages that responded to the last request, and the number of responding bits.
pub(super) fn seen(capture: &Capture, timeline: &ActionTimeline) -> (Vec<MessageKey>, usize) {
    let end = capture.span().map_or(MonoTime::ZERO, |(_, end)| end);
    let (mut messages, mut bits) = (Vec::new(), 0);
    let Some(last) = timeline.windows.last() else { return (messages, bits) };
    for (key, track) in capture.tracks() {
        let begin = last.on.before(EARLY);
        if !track.changes_from(begin).any(|(at, _)| begin <= at) {
            continue;
        }
        let Some(quiet) = quiet_bits(track, timeline, end, &[]) else { continue };
        let responds =
            |bit: &&u16| responses_of(&quiet, **bit, track).is_some_and(|responses| responses.to_last());
        let count = quiet.bits.iter().filter(responds).count();
        if count > 0 {
            messages.push(key);
            bits += count;
        }
    }
    (messages, bits)
}

fn responses_of(quiet: &QuietBits<'_>, bit: u16, track: &FrameTrack) -> Option<Responses> {
    let codec = SignalCodec::new(Layout::unsigned(bit, 1), track.shortest()).ok()?;
    Some(Responses::new(quiet, &codec))
}

/// Returns the bits that respond to an action; `None` if there are none, or too many for a signal.
fn responding_bits(quiet: &QuietBits<'_>, track: &FrameTrack) -> Option<Vec<(u16, Responses)>> {
    let mut found = Vec::new();
    for bit in &quiet.bits {
        let Some(responses) = responses_of(quiet, *bit, track) else { continue };
        if DriverAction::ALL.into_iter().any(|action| responses.responds(quiet.timeline, action)) {
            found.push((*bit, responses));
        }
    }
    (!found.is_empty() && found.len() <= MAX_RESPONDING).then_some(found)
}

/// Returns the typical responses to all actions; `None` if a side has none.
pub(super) fn typical(responses: &Responses, timeline: &ActionTimeline) -> Option<[Typical; 3]> {
    let [left, right, hazard] = DriverAction::ALL.map(|action| responses.typical(timeline, action));
    let unknown =
        Typical { response: None, followed: Followed { count: 0, of: timeline.count(DriverAction::Hazard) } };
    Some([left?, right?, hazard.unwrap_or(unknown)])
}

/// Returns the candidates for the turn indicators within a message.
pub(super) fn turn(messages: &[Responding<'_>], timeline: &ActionTimeline) -> Vec<SignalCandidate<TurnForm>> {
    let mut candidates = Vec::new();
    for message in messages {
        for (layout, responses) in message.fields() {
            candidates.extend(enumerated(message, layout, &responses, timeline));
        }
        candidates.extend(pairs(message, timeline));
    }
    candidates
}

fn enumerated(
    message: &Responding<'_>,
    layout: Layout,
    responses: &Responses,
    timeline: &ActionTimeline,
) -> Option<SignalCandidate<TurnForm>> {
    let typical = typical(responses, timeline)?;
    let [Some(left), Some(right), hazard] = typical.map(|typical| typical.response) else { return None };
    if left.value == right.value || left.shape != right.shape {
        return None;
    }
    let signal = message.signal(layout);
    let bits = signal.bits();
    // A bit that shows an action in another manner, or shows none, belongs to another signal, such as a
    // button next to a stalk.
    let shown =
        if left.shape == ResponseShape::Momentary { &DriverAction::ALL[..2] } else { &DriverAction::ALL[..] };
    let mut others = message.bits.iter().filter(|(bit, _)| bits.contains(bit));
    if others.any(|(_, responses)| !responses.has_shape(timeline, shown, left.shape)) {
        return None;
    }
    let mut drawbacks = message.drawbacks(&bits, responses.idle, left.shape);
    let form = match left.shape {
        ResponseShape::Flashing => return None,
        ResponseShape::Steady => {
            if hazard.is_some_and(|hazard| [left.value, right.value].contains(&hazard.value)) {
                return None;
            }
            let both =
                hazard.filter(|hazard| hazard.shape == ResponseShape::Steady).map(|hazard| hazard.value);
            drawbacks.extend(both.is_none().then_some(Drawback::HidesHazard));
            let mut states = responses.values(timeline, DriverAction::Hazard);
            states.extend([left.value, right.value]);
            let strange = responses.strange(timeline, &states);
            drawbacks.extend((strange > 0).then_some(Drawback::OtherValues(strange)));
            TurnForm::Enumerated { signal, off: responses.idle, left: left.value, right: right.value, both }
        }
        // With part of a stalk's bits, a half press may look like a full press.
        ResponseShape::Momentary if drawbacks.iter().any(|drawback| matches!(drawback, Drawback::Cut(_))) => {
            return None;
        }
        ResponseShape::Momentary => {
            drawbacks.push(Drawback::Momentary);
            stalk(signal, responses, left, right)
        }
    };
    let followed = typical.map(|typical| typical.followed);
    Some(SignalCandidate::new(form, left.shape, followed, drawbacks, message.times(responses)))
}

/// Builds a stalk with the half presses that were observed before a full press, or that ended an indication.
fn stalk(
    signal: FoundSignal,
    responses: &Responses,
    left: SignalResponse,
    right: SignalResponse,
) -> TurnForm {
    let full = [left.value, right.value];
    let leads_to =
        |to: u64| responses.detents.iter().find(|(from, next)| **next == to && !full.contains(from));
    let on_the_way = full.map(|full| leads_to(full).map(|(half, _)| *half));
    let ending = |action| {
        let values = responses.endings.iter().filter(move |(ended, _)| *ended == action);
        let mut values = values.map(|(_, value)| *value);
        values.find(|value| !full.contains(value) && !on_the_way.contains(&Some(*value)))
    };
    // The left half press ends an indication to the right.
    let half = [
        on_the_way[0].or_else(|| ending(DriverAction::Right)),
        on_the_way[1].or_else(|| ending(DriverAction::Left)),
    ];
    let half = if half[0] == half[1] { [None, None] } else { half };
    let cancels = |action, value| responses.endings.contains(&(action, value));
    let opposite_full_cancels = half == [None, None]
        && (cancels(DriverAction::Left, right.value) || cancels(DriverAction::Right, left.value));
    TurnForm::Stalk {
        signal,
        idle: responses.idle,
        left: left.value,
        right: right.value,
        half,
        opposite_full_cancels,
    }
}

/// Returns the candidates of two bits in one message, one for each side. Both are evaluated together, so that
/// a driver's correction of a wrong side is recognised.
fn pairs(message: &Responding<'_>, timeline: &ActionTimeline) -> Vec<SignalCandidate<TurnForm>> {
    let follows = |action| {
        let bits = message.bits.iter().filter(move |(_, responses)| responses.responds(timeline, action));
        bits.map(|(bit, _)| *bit)
    };
    let pairs = follows(DriverAction::Left)
        .flat_map(|left| follows(DriverAction::Right).map(move |right| [left, right]));
    pairs.filter(|[left, right]| left != right).filter_map(|bits| pair(message, bits, timeline)).collect()
}

fn pair(
    message: &Responding<'_>,
    bits: [u16; 2],
    timeline: &ActionTimeline,
) -> Option<SignalCandidate<TurnForm>> {
    let responses = Responses::of_bits(&message.quiet, bits);
    let typical = typical(&responses, timeline)?;
    let [Some(left), Some(right), hazard] = typical.map(|typical| typical.response) else { return None };
    let [left_on, right_on, both_on] = [1, 2, 3].map(|changed| responses.idle ^ changed);
    let is_pair = left.value == left_on && right.value == right_on && left.shape == right.shape;
    if !is_pair || left.shape == ResponseShape::Momentary {
        return None;
    }
    let shows_hazard = match hazard {
        None => false,
        Some(hazard) if hazard.value == both_on && hazard.shape == left.shape => true,
        Some(_) => return None,
    };
    let switch = |at: usize| {
        let off = responses.idle >> at & 1;
        Switch { signal: message.signal(Layout::unsigned(bits[at], 1)), off, on: off ^ 1 }
    };
    let lamps = left.shape == ResponseShape::Flashing;
    let mut drawbacks = message.drawbacks(&bits, responses.idle, left.shape);
    // While one side is on, the other is at rest.
    let strange = responses.strange(timeline, &[left_on, right_on]);
    drawbacks.extend((strange > 0).then_some(Drawback::OtherValues(strange)));
    drawbacks.extend(lamps.then_some(Drawback::Flashes));
    drawbacks.extend((!shows_hazard).then_some(Drawback::HidesHazard));
    let form = TurnForm::Pair { left: switch(0), right: switch(1), lamps, shows_hazard };
    let followed = typical.map(|typical| typical.followed);
    Some(SignalCandidate::new(form, left.shape, followed, drawbacks, message.times(&responses)))
}

pub(super) fn switch(
    message: &Responding<'_>,
    bit: u16,
    responses: &Responses,
    response: SignalResponse,
) -> Switch {
    Switch { signal: message.signal(Layout::unsigned(bit, 1)), off: responses.idle, on: response.value }
}

/// Returns the candidates for hazard lights with their own signal, best first.
pub(super) fn hazard(
    messages: &[Responding<'_>],
    turn: &[MessageKey],
    timeline: &ActionTimeline,
) -> Vec<SignalCandidate<HazardForm>> {
    let mut candidates = Vec::new();
    for message in messages {
        for (bit, responses) in &message.bits {
            let Some(typical) = typical(responses, timeline) else { continue };
            let [None, None, Some(response)] = typical.map(|typical| typical.response) else { continue };
            let switch = switch(message, *bit, responses, response);
            let mut drawbacks = message.drawbacks(&[*bit], responses.idle, response.shape);
            drawbacks.extend((!turn.contains(&message.key)).then_some(Drawback::OtherMessage));
            let form = match response.shape {
                ResponseShape::Steady => HazardForm::Signal(switch),
                ResponseShape::Momentary => {
                    drawbacks.push(Drawback::Momentary);
                    HazardForm::Button(switch)
                }
                // The flashing lamp of the switch: hazard lights are not derived from one lamp.
                ResponseShape::Flashing => continue,
            };
            let (followed, times) = (typical.map(|typical| typical.followed), message.times(responses));
            candidates.push(SignalCandidate::new(form, response.shape, followed, drawbacks, times));
        }
    }
    candidates.sort_by_key(SignalCandidate::weight);
    candidates
}
