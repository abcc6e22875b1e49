//! Several sources of one state: who is believed, and who disagrees.
//!
//! Sources stand in the order of the profile, the most trusted first. Each says a value, has a doubt,
//! or has nothing to say (a reason field without a reason). The first that says anything decides: its
//! value is the state; its doubt is the state too, unless a source below says a value and the profile
//! lets that source stand in. All other values are compared with the chosen one; which differences
//! count is up to a function, for a stalk cannot know of the hazard lights.

use std::time::Duration;

use super::state::TurnCode;
use crate::core::time::{MonoTime, deadline_after};

#[cfg(test)]
mod properties;

/// What the profile says of one source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SourceSettings {
    /// Whether it may stand in for a source above it that is in doubt.
    pub fallback: bool,
}

/// What a source says at present.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statement<T, D> {
    /// Nothing: as if it were not there.
    NotStated,
    /// This value, trusted.
    Value(T),
    /// It should, but cannot be believed.
    Unavailable(D),
}

/// What comes out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fused<T, D> {
    /// The state, or why there is none.
    pub state: Result<T, D>,
    /// The source that decided it, by position in the profile.
    pub source: usize,
}

/// Two sources that have contradicted each other for longer than the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Disagreement<T> {
    /// The source that is believed, by position in the profile.
    pub chosen: usize,
    /// What it says.
    pub chosen_value: T,
    /// The source that contradicts it.
    pub other: usize,
    /// What that one says.
    pub other_value: T,
    /// Since when.
    pub since: MonoTime,
}

/// Sources of one state.
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
    settings: SourceSettings,
    /// What it says against the chosen source, and since when.
    contradicts: Option<(T, MonoTime)>,
}

/// Whether two turn states can be true at once: equal ones, and hazard beside anything, since it
/// overlays what the stalk asked for.
pub fn turn_codes_agree(one: TurnCode, other: TurnCode) -> bool {
    one == other || one == TurnCode::Both || other == TurnCode::Both
}

impl<T: Copy + PartialEq> Fusion<T> {
    /// No source has said anything. `limit` is how long sources may contradict the chosen one before
    /// it is a finding; `agree` says which values do not contradict (for most, `|a, b| a == b`).
    pub fn new(
        sources: impl IntoIterator<Item = SourceSettings>,
        limit: Duration,
        agree: fn(T, T) -> bool,
    ) -> Self {
        let sources = sources.into_iter().map(|settings| Source { settings, contradicts: None }).collect();
        Self { limit, agree, sources, chosen: None, now: MonoTime::ZERO }
    }

    /// Takes what every source says now, in the profile's order; surplus statements are ignored.
    /// `None` when no source says anything. A `now` before the last one counts as the last one.
    pub fn update<D: Copy>(&mut self, statements: &[Statement<T, D>], now: MonoTime) -> Option<Fused<T, D>> {
        self.now = self.now.max(now);
        let statements = &statements[..statements.len().min(self.sources.len())];
        let fused = self.choose(statements.iter().copied().enumerate());
        let chosen = fused.and_then(|fused| Some((fused.source, fused.state.ok()?)));
        let same_source = chosen.map(|(source, _)| source) == self.chosen.map(|(source, _)| source);
        self.chosen = chosen;
        for (position, source) in self.sources.iter_mut().enumerate() {
            let before = source.contradicts.filter(|_| same_source);
            source.contradicts = match (chosen, statements.get(position)) {
                (Some((_, state)), Some(Statement::Value(value))) if !(self.agree)(state, *value) => {
                    Some((*value, before.map_or(self.now, |(_, since)| since)))
                }
                _ => None,
            };
        }
        fused
    }

    /// Who contradicts the chosen source for longer than the limit, most trusted first. A source that
    /// goes silent or into doubt contradicts nobody.
    pub fn disagreements(&self) -> impl Iterator<Item = Disagreement<T>> + '_ {
        let of = |(other, source): (usize, &Source<T>)| {
            let ((chosen, chosen_value), (other_value, since)) = (self.chosen?, source.contradicts?);
            let lasting = self.now.since(since) > self.limit;
            lasting.then_some(Disagreement { chosen, chosen_value, other, other_value, since })
        };
        self.sources.iter().enumerate().filter_map(of)
    }

    /// When [`Self::disagreements`] grows with nothing being said anew; call [`Self::update`] then.
    pub fn next_deadline(&self) -> Option<MonoTime> {
        let due = |source: &Source<T>| source.contradicts.map(|(_, since)| deadline_after(since, self.limit));
        self.sources.iter().filter_map(due).filter(|at| *at > self.now).min()
    }

    /// What comes out of these statements, each with its source, in the profile's order. Changes
    /// nothing: with some sources left out it tells what the others say.
    pub fn choose<D: Copy>(
        &self,
        statements: impl IntoIterator<Item = (usize, Statement<T, D>)>,
    ) -> Option<Fused<T, D>> {
        let opinion = |(source, statement)| match statement {
            Statement::NotStated => None,
            Statement::Value(value) => Some(Fused { state: Ok(value), source }),
            Statement::Unavailable(doubt) => Some(Fused { state: Err(doubt), source }),
        };
        let mut opinions = statements.into_iter().filter_map(opinion);
        let first = opinions.next()?;
        if first.state.is_ok() {
            return Some(first);
        }
        let stands_in =
            |other: &Fused<T, D>| other.state.is_ok() && self.sources[other.source].settings.fallback;
        Some(opinions.find(stands_in).unwrap_or(first))
    }
}
