//! Signals of the two sides in different messages.

use super::candidate::{Drawback, ResponseTime, SignalCandidate, Switch, TurnForm};
use super::response::{Followed, ResponseShape, Responses, SignalResponse, Typical};
use super::search::{Responding, switch, typical};
use super::timeline::ActionTimeline;

/// Returns the candidates with the two sides in separate messages.
pub(super) fn candidates(
    messages: &[Responding<'_>],
    timeline: &ActionTimeline,
) -> Vec<SignalCandidate<TurnForm>> {
    let mut candidates = Vec::new();
    let sides: Vec<_> = messages.iter().flat_map(|message| sides(message, timeline)).collect();
    for left in sides.iter().filter(|side| side.is_left) {
        for right in sides.iter().filter(|side| !side.is_left) {
            candidates.extend(apart(left, right));
        }
    }
    candidates
}

struct SideBit<'a> {
    message: &'a Responding<'a>,
    is_left: bool,
    switch: Switch,
    /// True if it is on during the hazard lights as well.
    with_hazard: bool,
    typical: [Typical; 3],
    times: Vec<[Option<ResponseTime>; 2]>,
}

/// Returns the bits that are on for one side and keep their value.
fn sides<'a>(message: &'a Responding<'a>, timeline: &ActionTimeline) -> Vec<SideBit<'a>> {
    let side = |(bit, responses): &(u16, Responses)| {
        let typical = typical(responses, timeline)?;
        let (is_left, response) = match (typical[0].response, typical[1].response) {
            (Some(response), None) => (true, response),
            (None, Some(response)) => (false, response),
            (Some(_), Some(_)) | (None, None) => return None,
        };
        let is_steady = |response: SignalResponse| response.shape == ResponseShape::Steady;
        let is_side = is_steady(response) && typical[2].response.is_none_or(is_steady);
        let (switch, with_hazard) =
            (switch(message, *bit, responses, response), typical[2].response.is_some());
        let times = message.times(responses);
        is_side.then_some(SideBit { message, is_left, switch, with_hazard, typical, times })
    };
    message.bits.iter().filter_map(side).collect()
}

/// Builds a candidate from two sides in different messages.
fn apart(left: &SideBit<'_>, right: &SideBit<'_>) -> Option<SignalCandidate<TurnForm>> {
    if left.message.key == right.message.key || left.with_hazard != right.with_hazard {
        return None;
    }
    let of = |side: &SideBit<'_>| {
        side.message.drawbacks(&[side.switch.signal.layout.start], side.switch.off, ResponseShape::Steady)
    };
    let mut drawbacks = of(left);
    for drawback in of(right) {
        if !drawbacks.contains(&drawback) {
            drawbacks.push(drawback);
        }
    }
    drawbacks.push(Drawback::TwoMessages);
    drawbacks.extend((!left.with_hazard).then_some(Drawback::HidesHazard));
    let worse = |at: usize| {
        let (a, b) = (left.typical[at].followed, right.typical[at].followed);
        Followed { count: a.count.min(b.count), of: a.of }
    };
    let followed = [worse(0), worse(1), worse(2)];
    let shows_hazard = left.with_hazard;
    let form = TurnForm::Pair { left: left.switch, right: right.switch, lamps: false, shows_hazard };
    let times = left.times.iter().zip(&right.times);
    let times = times.map(|(left, right)| if left[0].is_some() { *left } else { *right }).collect();
    Some(SignalCandidate::new(form, ResponseShape::Steady, followed, drawbacks, times))
}
