//! Bits next to a signal that are set only while the whole signal is set, as for "not available" in SAE
//! J1939.

use super::bits::is_set;
use super::candidate::{FoundSignal, HazardForm, Switch, TurnForm, bits_of, sawtooth};
use super::search::Responding;
use can_signal::can::MAX_DATA;
use can_signal::dbc::codec::{ByteOrder, Layout};

/// A widened signal, with the number of bits added at its low end.
struct Widened {
    layout: Layout,
    below: u16,
}

/// Widens the signals of a form, so that "not available" is not mistaken for a state.
pub(super) fn widen_turn(messages: &[Responding<'_>], form: &mut TurnForm) {
    match form {
        TurnForm::Enumerated { signal, off, left, right, both } => {
            let values = [off, left, right].into_iter().chain(both);
            widen(messages, signal, &[], values);
        }
        TurnForm::Stalk { signal, idle, left, right, half, .. } => {
            let values = [idle, left, right].into_iter().chain(half.iter_mut().flatten());
            widen(messages, signal, &[], values);
        }
        TurnForm::Pair { left, right, .. } => {
            // A bit between both may belong to either: it is added to the side that has no other.
            let (mut first, mut second) = (*left, *right);
            widen_switch(messages, &mut first, Some(second.signal));
            widen_switch(messages, &mut second, Some(first.signal));
            if second.signal == right.signal {
                widen_switch(messages, right, Some(left.signal));
                widen_switch(messages, left, Some(right.signal));
            } else {
                (*left, *right) = (first, second);
            }
        }
    }
}

/// Widens the separate signal of the hazard lights.
pub(super) fn widen_hazard(messages: &[Responding<'_>], form: &mut HazardForm) {
    if let HazardForm::Signal(switch) | HazardForm::Button(switch) = form {
        widen_switch(messages, switch, None);
    }
}

fn widen_switch(messages: &[Responding<'_>], switch: &mut Switch, other: Option<FoundSignal>) {
    let is_beside = |other: &FoundSignal| other.message == switch.signal.message;
    let taken = other.filter(is_beside).map(|other| other.bits()).unwrap_or_default();
    widen(messages, &mut switch.signal, &taken, [&mut switch.off, &mut switch.on]);
}

fn widen<'v>(
    messages: &[Responding<'_>],
    signal: &mut FoundSignal,
    taken: &[u16],
    values: impl IntoIterator<Item = &'v mut u64>,
) {
    let message = messages.iter().find(|message| message.key == signal.message);
    // If a signal rests with all bits set, the neighbouring bits are inconclusive.
    let message =
        message.filter(|message| !signal.bits().iter().all(|bit| is_set(&message.quiet.idle, *bit)));
    if let Some(Widened { layout, below }) =
        message.and_then(|message| widened(message, signal.layout, taken))
    {
        signal.layout = layout;
        values.into_iter().for_each(|value| *value <<= below);
    }
}

/// Returns the signal with its neighbours, in its byte order or, within a byte, in the order that adds more
/// bits; `None` if no neighbour belongs to it.
fn widened(message: &Responding<'_>, layout: Layout, taken: &[u16]) -> Option<Widened> {
    let is_in_a_byte = layout.start % 8 + layout.length <= 8;
    let intel = |position: u16| position;
    let found = match layout.order {
        ByteOrder::Motorola => widened_in_order(message, layout, taken, sawtooth),
        ByteOrder::Intel if is_in_a_byte => {
            let start = layout.start + layout.length - 1;
            let motorola = Layout { order: ByteOrder::Motorola, start, ..layout };
            let both = [
                widened_in_order(message, layout, taken, intel),
                widened_in_order(message, motorola, taken, sawtooth),
            ];
            both.into_iter().rev().max_by_key(|widened| widened.layout.length)?
        }
        ByteOrder::Intel => widened_in_order(message, layout, taken, intel),
    };
    (found.layout.length > layout.length).then_some(found)
}

/// Widens a signal in one byte order. `bit_at` converts between the number of a bit and its position, in both
/// directions.
fn widened_in_order(
    message: &Responding<'_>,
    layout: Layout,
    taken: &[u16],
    bit_at: impl Fn(u16) -> u16,
) -> Widened {
    let own = bits_of(layout);
    let timeline = message.quiet.timeline;
    let belongs = |bit: &u16| {
        let set: Vec<_> = message.quiet.contents.iter().filter(|(_, data)| is_set(data, *bit)).collect();
        !taken.contains(bit)
            && !set.is_empty()
            && !is_set(&message.quiet.idle, *bit)
            && set
                .iter()
                .all(|(at, data)| own.iter().all(|own| is_set(data, *own)) && !timeline.is_requested(*at))
    };
    let first = bit_at(layout.start);
    let before = (0..first).rev().map(&bit_at).take_while(belongs).count();
    let end = u16::try_from(MAX_DATA * 8).unwrap_or(u16::MAX);
    let behind = (first + layout.length..end).map(&bit_at).take_while(belongs).count();
    let [before, behind] = [before, behind].map(|count| u16::try_from(count).unwrap_or(0));
    let below = if layout.order == ByteOrder::Motorola { behind } else { before };
    let layout = Layout { start: bit_at(first - before), length: layout.length + before + behind, ..layout };
    Widened { layout, below }
}
