//! Fusion of several sources of one state.
//!
//! Sources are ordered by trust, as in the profile. The first source decides: its value is the state. If it
//! is unavailable, the first fallback below it that has a value decides; if there is none, there is no state.
//! All other values are compared with the chosen value. A function decides which values contradict each
//! other, since a stalk cannot show the hazard lights. A source whose condition is off neither decides nor
//! contradicts.

use std::time::Duration;

use super::state::TurnCode;
use gateway_base::time::{MonoTime, deadline_after};

#[cfg(test)]
mod properties;

/// Two sources that have contradicted each other for longer than the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // a field without a comment is what its name says
pub struct Disagreement<T> {
    /// Position of the deciding source in the profile.
    pub chosen: usize,
    pub chosen_value: T,
    /// Position of the contradicting source in the profile.
    pub other: usize,
    pub other_value: T,
}

/// Sources of one state with their contradictions.
#[derive(Debug, Clone)]
pub struct Fusion<T> {
    limit: Duration,
    agree: fn(T, T) -> bool,
    sources: Vec<Source<T>>,
    chosen: Option<(usize, T)>,
    now: MonoTime,
}

#[derive(Debug, Clone)]
struct Source<T> {
    /// True if the source may replace an unavailable source above it.
    is_fallback: bool,
    /// Value that contradicts the chosen source, with the start of the contradiction.
    contradicts: Option<(T, MonoTime)>,
}

/// Returns true if two turn states can apply at once: equal states, and hazard with any other state, since
/// hazard overlays the request of the stalk.
pub fn turn_codes_agree(one: TurnCode, other: TurnCode) -> bool {
    one == other || one == TurnCode::Both || other == TurnCode::Both
}

impl<T: Copy + PartialEq> Fusion<T> {
    /// Creates a fusion without any state; `sources` are true for fallbacks. A contradiction with the chosen
    /// source becomes a disagreement after `limit`; `agree` returns true for values that do not contradict
    /// (usually `|a, b| a == b`).
    pub fn new(sources: impl IntoIterator<Item = bool>, limit: Duration, agree: fn(T, T) -> bool) -> Self {
        let sources =
            sources.into_iter().map(|is_fallback| Source { is_fallback, contradicts: None }).collect();
        Self { limit, agree, sources, chosen: None, now: MonoTime::ZERO }
    }

    /// Fuses the current states of all sources in the order of the profile, and returns the position of the
    /// deciding source. The state is `None` for a source that does not apply; surplus states are ignored.
    /// Returns `None` if no source applies. A `now` before the previous one counts as the previous one.
    pub fn update<D>(
        &mut self,
        states: impl IntoIterator<Item = Option<Result<T, D>>, IntoIter: Clone>,
        now: MonoTime,
    ) -> Option<usize> {
        self.now = self.now.max(now);
        let mut states = states.into_iter().take(self.sources.len());
        let applicable = states.clone().enumerate();
        let deciding = self.choose(applicable.filter_map(|(source, state)| Some((source, state?.is_ok()))));
        let chosen = deciding.and_then(|source| Some((source, states.clone().nth(source)??.ok()?)));
        let same_source = chosen.map(|(source, _)| source) == self.chosen.map(|(source, _)| source);
        self.chosen = chosen;
        for source in &mut self.sources {
            let before = source.contradicts.filter(|_| same_source);
            source.contradicts = match (chosen, states.next()) {
                (Some((_, state)), Some(Some(Ok(value)))) if !(self.agree)(state, value) => {
                    Some((value, before.map_or(self.now, |(_, since)| since)))
                }
                _ => None,
            };
        }
        deciding
    }

    /// Returns the sources that have contradicted the chosen source for longer than the limit, most trusted
    /// first. An unavailable source contradicts nothing.
    pub fn disagreements(&self) -> impl Iterator<Item = Disagreement<T>> + '_ {
        let disagreement = |(other, source): (usize, &Source<T>)| {
            let ((chosen, chosen_value), (other_value, since)) = (self.chosen?, source.contradicts?);
            let lasting = self.now.since(since) > self.limit;
            lasting.then_some(Disagreement { chosen, chosen_value, other, other_value })
        };
        self.sources.iter().enumerate().filter_map(disagreement)
    }

    /// Returns the next instant at which [`Self::disagreements`] grows without a new state and
    /// [`Self::update`] is due.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        let due = |source: &Source<T>| source.contradicts.map(|(_, since)| deadline_after(since, self.limit));
        self.sources.iter().filter_map(due).filter(|at| *at > self.now).min()
    }

    /// Returns which of some sources decides; they are given in the order of the profile, each by its
    /// position and whether it has a state. Returns `None` without any source.
    pub fn choose(&self, sources: impl IntoIterator<Item = (usize, bool)>) -> Option<usize> {
        let mut sources = sources.into_iter();
        let (first, is_known) = sources.next()?;
        let mut fallbacks = sources.filter(|(other, is_known)| *is_known && self.sources[*other].is_fallback);
        let fallback = if is_known { None } else { fallbacks.next() };
        Some(fallback.map_or(first, |(other, _)| other))
    }
}
