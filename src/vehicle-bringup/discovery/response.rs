//! The response of a signal to each request: its value, and its duration and rhythm.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use super::bits::{FrameBits, QuietBits, is_set};
use super::timeline::{ActionTimeline, DriverAction, EARLY, LATE, RequestWindow};
use can_signal::dbc::codec::SignalCodec;
use gateway_base::time::MonoTime;

/// Way in which a signal shows an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ResponseShape {
    /// It keeps one value as long as the action lasts.
    Steady,
    /// It turns on and off in the rhythm of the lamps.
    Flashing,
    /// It shows a value for a moment at the beginning.
    Momentary,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SignalResponse {
    pub(super) value: u64,
    pub(super) shape: ResponseShape,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Responses {
    pub(super) idle: u64,
    /// Response to each request: `Ok(None)` when the signal stayed at rest, `Err` when it changed in an
    /// unknown way.
    of: Vec<Result<Option<SignalResponse>, Irregular>>,
    /// Values other than at rest for each request, with the time of the first.
    begun: Vec<(Option<MonoTime>, BTreeSet<u64>)>,
    /// Time at which the lasting value of each request ended.
    ended: Vec<Option<MonoTime>>,
    /// Values at the end of an action, with that action.
    pub(super) endings: Vec<(DriverAction, u64)>,
    /// Values that lead to another value, like a detent.
    pub(super) detents: BTreeMap<u64, u64>,
}

/// The signal changed in an unknown way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Irregular;

/// The response to most requests of one action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Typical {
    pub(super) response: Option<SignalResponse>,
    pub(super) followed: Followed,
}

/// Requests of one action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Followed {
    /// Number of requests that a signal followed.
    pub count: usize,
    /// Number of all requests.
    pub of: usize,
}

impl Followed {
    /// Returns the number of requests that the signal did not follow.
    pub fn missed(self) -> usize {
        self.of - self.count
    }
}

/// A time with one value other than at rest.
#[derive(Debug, Clone, Copy)]
struct ValueRun {
    value: u64,
    from: MonoTime,
    until: MonoTime,
}

impl ValueRun {
    fn length(&self) -> Duration {
        self.until.since(self.from)
    }
}

const MAX_PRESS: Duration = Duration::from_millis(1600);
/// Maximum number of presses at one request: a wrong press, a press that ends it, and the right press.
const MAX_PRESSES: usize = 3;
const MIN_STEADY: Duration = Duration::from_millis(600);
const PHASE: (Duration, Duration) = (Duration::from_millis(100), Duration::from_millis(1250));
/// Time by which a driver may end an action before the request.
const EARLY_END: Duration = Duration::from_millis(1200);
/// Maximum time after the request to end an action until everything is at rest again, unless the next request
/// is earlier.
const LATE_END: Duration = Duration::from_secs(3);

impl Responses {
    pub(super) fn new(bits: &QuietBits<'_>, codec: &SignalCodec) -> Self {
        Self::of_value(bits, |data| u64::try_from(codec.value(data)).unwrap_or(0))
    }

    /// Returns the responses of two bits, of which the second one is the upper.
    pub(super) fn of_bits(bits: &QuietBits<'_>, two: [u16; 2]) -> Self {
        Self::of_value(bits, |data| {
            let [lower, upper] = two.map(|bit| u64::from(is_set(data, bit)));
            upper << 1 | lower
        })
    }

    fn of_value(bits: &QuietBits<'_>, value: impl Fn(&FrameBits) -> u64) -> Self {
        let timeline = bits.timeline;
        let idle = value(&bits.idle);
        let mut runs: Vec<ValueRun> = Vec::new();
        let mut last = None;
        for (at, data) in &bits.contents {
            let value = value(data);
            if last == Some(value) {
                continue;
            }
            if let Some(run) = runs.last_mut().filter(|_| last.is_some_and(|last| last != idle)) {
                run.until = *at;
            }
            if value != idle {
                runs.push(ValueRun { value, from: *at, until: bits.end });
            }
            last = Some(value);
        }
        let mut responses = Self { idle, ..Self::default() };
        for window in &timeline.windows {
            responses.add(window, &runs);
        }
        responses
    }

    fn add(&mut self, window: &RequestWindow, runs: &[ValueRun]) {
        let (begin, end) = (window.on.before(EARLY), window.end.before(EARLY));
        let latest = window.off.after(LATE).min(end);
        let begun: Vec<_> =
            runs.iter().filter(|run| begin <= run.from && run.from <= latest).copied().collect();
        let all: Vec<_> = runs.iter().filter(|run| begin <= run.from && run.from < end).collect();
        let ended = all.iter().filter(|run| latest < run.from);
        self.endings.extend(ended.map(|run| (window.action, run.value)));
        let back = window.end.max(window.off.after(LATE_END));
        let rests = !all.iter().any(|run| back < run.until);
        for pair in all.windows(2).filter(|pair| pair[0].until == pair[1].from) {
            self.detents.insert(pair[0].value, pair[1].value);
        }
        let response = if rests { response(&begun, window) } else { Err(Irregular) };
        let is_steady = matches!(response, Ok(Some(SignalResponse { shape: ResponseShape::Steady, .. })));
        self.ended.push(begun.last().filter(|_| is_steady).map(|run| run.until));
        self.of.push(response);
        self.begun.push((begun.first().map(|run| run.from), begun.iter().map(|run| run.value).collect()));
    }

    /// Returns for each request the time at which the signal left its value at rest, and the time at which it
    /// returned from a lasting value.
    pub(super) fn times(&self) -> impl Iterator<Item = [Option<MonoTime>; 2]> {
        self.begun.iter().zip(&self.ended).map(|((begun, _), ended)| [*begun, *ended])
    }

    /// Returns the number of requests for a side at which values other than these states were observed.
    pub(super) fn strange(&self, timeline: &ActionTimeline, states: &[u64]) -> usize {
        let windows = timeline.windows.iter().zip(&self.begun);
        let sides = windows.filter(|(window, _)| window.action != DriverAction::Hazard);
        sides.filter(|(_, (_, values))| values.iter().any(|value| !states.contains(value))).count()
    }

    /// Returns the values with which the signal responded to requests of an action in a known way.
    pub(super) fn values(&self, timeline: &ActionTimeline, action: DriverAction) -> Vec<u64> {
        self.to(timeline, action).filter_map(|response| Some(response.ok()??.value)).collect()
    }

    /// Returns true if the signal responded to the last request in a known way.
    pub(super) fn to_last(&self) -> bool {
        matches!(self.of.last(), Some(Ok(Some(_))))
    }

    /// Returns the responses to the requests of an action.
    fn to<'a>(
        &'a self,
        timeline: &'a ActionTimeline,
        action: DriverAction,
    ) -> impl Iterator<Item = Result<Option<SignalResponse>, Irregular>> + 'a {
        let windows = timeline.windows.iter().zip(&self.of);
        windows.filter(move |(window, _)| window.action == action).map(|(_, response)| *response)
    }

    /// Returns true if the signal responded to half of the requests of an action in a known way.
    pub(super) fn responds(&self, timeline: &ActionTimeline, action: DriverAction) -> bool {
        let count = self.values(timeline, action).len();
        count > 0 && count * 2 >= timeline.count(action)
    }

    /// Returns true if the signal shows one of these actions in this way.
    pub(super) fn has_shape(
        &self,
        timeline: &ActionTimeline,
        actions: &[DriverAction],
        shape: ResponseShape,
    ) -> bool {
        let response = |action: &DriverAction| self.typical(timeline, *action)?.response;
        actions.iter().filter_map(response).any(|response| response.shape == shape)
    }

    /// Returns the response to more than half of the requests of an action; `None` when there is none.
    pub(super) fn typical(&self, timeline: &ActionTimeline, action: DriverAction) -> Option<Typical> {
        let all: Vec<_> = self.to(timeline, action).collect();
        let known = || all.iter().filter_map(|response| response.ok());
        let count = |response| known().filter(|other| *other == response).count();
        let response = known().max_by_key(|response| count(*response))?;
        let count = count(response);
        (count * 2 > all.len()).then_some(Typical { response, followed: Followed { count, of: all.len() } })
    }
}

/// Returns the response according to the values begun in a window. The last one counts, since a driver
/// corrects a wrong side.
fn response(begun: &[ValueRun], window: &RequestWindow) -> Result<Option<SignalResponse>, Irregular> {
    if begun.is_empty() {
        return Ok(None);
    }
    let reaches_end = |run: &ValueRun| run.until.after(EARLY_END) >= window.off;
    if begun.iter().all(|run| run.length() <= MAX_PRESS && !reaches_end(run)) {
        return pressed(begun).map(Some);
    }
    // Of two values that last equally long, the later one counts.
    let total = |value| -> Duration {
        let runs = begun.iter().filter(|run| run.value == value);
        runs.map(|run| run.until.min(window.end).since(run.from)).sum()
    };
    let value = begun.iter().map(|run| run.value).max_by_key(|value| total(*value)).ok_or(Irregular)?;
    let runs: Vec<_> = begun.iter().filter(|run| run.value == value).collect();
    let (Some(first), Some(last)) = (runs.first(), runs.last()) else { return Err(Irregular) };
    let time_left = window.off.since(first.from);
    let shape = match runs.len() {
        1 if reaches_end(last) && first.length() >= MIN_STEADY && first.length() > time_left / 2 => {
            ResponseShape::Steady
        }
        2.. if reaches_end(last) && is_rhythmic(&runs) => ResponseShape::Flashing,
        _ => return Err(Irregular),
    };
    Ok(Some(SignalResponse { value, shape }))
}

/// Returns the response of a momentary switch, which is decided by its last press.
fn pressed(begun: &[ValueRun]) -> Result<SignalResponse, Irregular> {
    let mut presses = begun.chunk_by(|before, after| before.until == after.from);
    // Of two values that last equally long, the later one counts: a stalk passes the half press on the way to
    // the full press.
    let value = |press: &[ValueRun]| press.iter().max_by_key(|run| run.length()).map(|run| run.value);
    let value_of_last = presses.next_back().and_then(value).ok_or(Irregular)?;
    let is_repeated = presses.clone().any(|press| value(press) == Some(value_of_last));
    if is_repeated || presses.count() >= MAX_PRESSES {
        return Err(Irregular);
    }
    Ok(SignalResponse { value: value_of_last, shape: ResponseShape::Momentary })
}

/// Returns true if lit and dark times are like a lamp's; the first and last time may be truncated.
fn is_rhythmic(runs: &[&ValueRun]) -> bool {
    let (shortest, longest) = PHASE;
    let dark = runs.windows(2).map(|pair| pair[1].from.since(pair[0].until));
    let lit = runs.iter().take(runs.len() - 1).map(|run| run.length());
    let fits = |time: Duration| shortest <= time && time <= longest;
    let mut begins: Vec<_> = runs.windows(2).map(|pair| pair[1].from.since(pair[0].from)).collect();
    begins.sort_unstable();
    let is_regular = match begins.as_slice() {
        [first, .., last] => *last <= *first * 2,
        _ => true,
    };
    is_regular && dark.chain(lit).all(fits)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: RequestWindow = RequestWindow {
        action: DriverAction::Left,
        on: MonoTime::from_millis(10_000),
        off: MonoTime::from_millis(15_000),
        end: MonoTime::from_millis(19_000),
    };

    /// Returns the responses to one request of a signal that rests at 0 and has these values from these times
    /// on, ms.
    fn responses(values: &[(u64, u64)]) -> Responses {
        let mut runs: Vec<ValueRun> = Vec::new();
        for pair in values.windows(2).filter(|pair| pair[0].1 != 0) {
            let [from, until] = [pair[0].0, pair[1].0].map(MonoTime::from_millis);
            runs.push(ValueRun { value: pair[0].1, from, until });
        }
        let mut responses = Responses::default();
        responses.add(&WINDOW, &runs);
        responses
    }

    fn response_to(values: &[(u64, u64)]) -> Result<Option<SignalResponse>, Irregular> {
        responses(values).of[0]
    }

    #[test]
    fn of_a_wrong_press_and_a_right_one_the_last_counts() {
        let pressed = |value| Ok(Some(SignalResponse { value, shape: ResponseShape::Momentary }));
        let long_wrong_one = [(10_500, 2), (11_100, 0), (12_000, 1), (12_300, 0), (20_000, 0)];
        assert_eq!(response_to(&long_wrong_one), pressed(1));
        let through_a_detent = [(10_500, 3), (10_560, 1), (10_900, 0), (20_000, 0)];
        assert_eq!(response_to(&through_a_detent), pressed(1));
        let twice = [(10_500, 1), (10_900, 0), (12_000, 1), (12_300, 0), (20_000, 0)];
        assert_eq!(response_to(&twice), Err(Irregular), "a second press may have ended it");
    }

    #[test]
    fn what_is_not_back_at_rest_before_the_next_request_did_not_follow() {
        let steady = Ok(Some(SignalResponse { value: 1, shape: ResponseShape::Steady }));
        assert_eq!(response_to(&[(10_700, 1), (17_800, 0), (30_000, 0)]), steady);
        assert_eq!(response_to(&[(10_700, 1), (19_500, 0), (30_000, 0)]), Err(Irregular));
        let by_itself = [(10_700, 1), (14_900, 0), (16_000, 2), (20_000, 0), (30_000, 0)];
        assert_eq!(response_to(&by_itself), Err(Irregular), "another value over the next request");
    }
}
