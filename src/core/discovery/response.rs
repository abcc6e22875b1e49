//! The response of a signal to each request: its value, and how it comes and goes.

use std::collections::BTreeMap;
use std::time::Duration;

use super::bits::QuietBits;
use super::timeline::{Action, EARLY, Timeline, Window};
use crate::core::dbc::codec::SignalCodec;
use crate::core::time::MonoTime;

/// The manner in which a signal shows an action.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Shape {
    /// It keeps one value as long as the action lasts.
    Steady,
    /// It comes and goes in the rhythm of the lamps.
    Flashing,
    /// It shows a value for a moment at the beginning.
    Momentary,
}

/// The response to one request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Response {
    pub(super) value: u64,
    pub(super) shape: Shape,
}

/// The responses of a signal to all requests.
#[derive(Debug, Clone)]
pub(super) struct Responses {
    pub(super) idle: u64,
    /// For each request: `Ok(None)` when the signal stayed at rest, `Err` when it changed in no known manner.
    of: Vec<Result<Option<Response>, Irregular>>,
    /// Values at the end of an action, with the action that they end.
    pub(super) endings: Vec<(Action, u64)>,
    /// Values that lead to another one, as a detent does.
    pub(super) detents: BTreeMap<u64, u64>,
}

/// The signal changed in no known manner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Irregular;

/// The response to most requests of one action.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Typical {
    pub(super) response: Option<Response>,
    /// Requests with this response.
    pub(super) count: usize,
    /// All requests of the action.
    pub(super) of: usize,
}

/// A time with one value other than that at rest.
#[derive(Debug, Clone, Copy)]
struct Run {
    value: u64,
    from: MonoTime,
    until: MonoTime,
}

impl Run {
    fn length(&self) -> Duration {
        self.until.since(self.from)
    }
}

/// Time after the request to end an action in which an action may still begin.
const LATE: Duration = Duration::from_millis(200);
/// The longest press of a momentary switch.
const MAX_PRESS: Duration = Duration::from_millis(1600);
/// The shortest time that counts as a lasting state.
const MIN_STEADY: Duration = Duration::from_millis(600);
/// The shortest and the longest lit or dark time of a lamp.
const PHASE: (Duration, Duration) = (Duration::from_millis(100), Duration::from_millis(1250));
/// A driver may end an action this much before the request.
const EARLY_END: Duration = Duration::from_millis(1200);

impl Responses {
    /// The responses of a signal among the bits.
    pub(super) fn new(bits: &QuietBits<'_>, codec: &SignalCodec) -> Self {
        let timeline = bits.timeline;
        let value = |data| u64::try_from(codec.value(data)).unwrap_or(0);
        let idle = value(&bits.idle);
        let mut runs: Vec<Run> = Vec::new();
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
                runs.push(Run { value, from: *at, until: bits.end });
            }
            last = Some(value);
        }
        let mut responses = Self { idle, of: Vec::new(), endings: Vec::new(), detents: BTreeMap::new() };
        for window in &timeline.windows {
            responses.add(window, &runs);
        }
        responses
    }

    fn add(&mut self, window: &Window, runs: &[Run]) {
        let begin = window.on.before(EARLY);
        let latest = window.off.after(LATE).min(window.end);
        let begun: Vec<_> =
            runs.iter().filter(|run| begin <= run.from && run.from <= latest).copied().collect();
        let ended = runs.iter().filter(|run| latest < run.from && run.from < window.end);
        self.endings.extend(ended.map(|run| (window.action, run.value)));
        for pair in begun.windows(2).filter(|pair| pair[0].until == pair[1].from) {
            self.detents.insert(pair[0].value, pair[1].value);
        }
        self.of.push(response(&begun, window));
    }

    /// True if the signal responded to the last request in a known manner.
    pub(super) fn to_last(&self) -> bool {
        matches!(self.of.last(), Some(Ok(Some(_))))
    }

    /// Responses to the requests of an action.
    fn to<'a>(
        &'a self,
        timeline: &'a Timeline,
        action: Action,
    ) -> impl Iterator<Item = Result<Option<Response>, Irregular>> + 'a {
        let windows = timeline.windows.iter().zip(&self.of);
        windows.filter(move |(window, _)| window.action == action).map(|(_, response)| *response)
    }

    /// The response to more than half of the requests of an action; `None` when there is none.
    pub(super) fn typical(&self, timeline: &Timeline, action: Action) -> Option<Typical> {
        let all: Vec<_> = self.to(timeline, action).collect();
        let known = || all.iter().filter_map(|response| response.ok());
        let count = |response| known().filter(|other| *other == response).count();
        let response = known().max_by_key(|response| count(*response))?;
        let count = count(response);
        (count * 2 > all.len()).then_some(Typical { response, count, of: all.len() })
    }
}

/// The response that the values begun in a window amount to.
fn response(begun: &[Run], window: &Window) -> Result<Option<Response>, Irregular> {
    // Of two that last as long the later counts: a stalk passes the half press on the way to the full one.
    let total = |value| -> Duration {
        let runs = begun.iter().filter(|run| run.value == value);
        runs.map(|run| run.until.min(window.end).since(run.from)).sum()
    };
    let Some(value) = begun.iter().map(|run| run.value).max_by_key(|value| total(*value)) else {
        return Ok(None);
    };
    let runs: Vec<_> = begun.iter().filter(|run| run.value == value).collect();
    let (Some(first), Some(last)) = (runs.first(), runs.last()) else { return Ok(None) };
    let time_left = window.off.since(first.from);
    let reaches_end = last.until.after(EARLY_END) >= window.off;
    let shape = match runs.len() {
        1 if reaches_end && first.length() >= MIN_STEADY && first.length() > time_left / 2 => Shape::Steady,
        1 if first.length() <= MAX_PRESS && !reaches_end => Shape::Momentary,
        1 => return Err(Irregular),
        _ if reaches_end && is_rhythmic(&runs) => Shape::Flashing,
        _ => return Err(Irregular),
    };
    Ok(Some(Response { value, shape }))
}

/// True for lit and dark times as lamps have them; the first and the last time may be cut.
fn is_rhythmic(runs: &[&Run]) -> bool {
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
