//! Follows a story: which caption is due, and whether its claims hold.

use std::collections::BTreeMap;
use std::time::Duration;

use super::caption::{Caption, Story};
use super::claim::{self, Claim, Observed};
use crate::process_status::snapshot::Snapshot;
use gateway_base::time::MonoTime;

/// Minimum time between two checks of the state.
const CHECK_INTERVAL: Duration = Duration::from_millis(10);

/// A caption whose claim does not hold: a fault of the demo or of the gateway.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the caption “{text}” is wrong {} ms after the start: {observed} should be {expected}, and is {found}",
    at.as_nanos() / 1_000_000
)]
pub struct WrongCaption {
    text: &'static str,
    at: MonoTime,
    observed: Observed,
    expected: &'static str,
    found: String,
}

/// Follows a story in time. First [`Self::next_caption`] until it is `None`, then [`Self::check`].
#[derive(Debug, Clone)]
pub struct Teller {
    story: Story,
    /// Time at which the current repetition of the story began.
    start: MonoTime,
    /// Number of captions shown since then.
    shown: usize,
    next_check: MonoTime,
    lights: BTreeMap<String, String>,
}

impl Teller {
    /// Begins a story.
    pub fn new(story: Story) -> Self {
        Self { story, start: MonoTime::ZERO, shown: 0, next_check: MonoTime::ZERO, lights: BTreeMap::new() }
    }

    /// Begins the story again.
    pub fn restart(&mut self, at: MonoTime) {
        (self.start, self.shown) = (at, 0);
    }

    fn story_time(&self, at: MonoTime) -> MonoTime {
        MonoTime::ZERO.after(at.since(self.start))
    }

    /// Returns the next due caption; `None` if there is none.
    pub fn next_caption(&mut self, at: MonoTime) -> Option<&'static Caption> {
        let now = self.story_time(at);
        let next = self.story.get(self.shown).filter(|caption| caption.from <= now)?;
        self.shown += 1;
        Some(next)
    }

    /// Returns the time at which a caption is shown.
    pub fn time_of(&self, caption: &Caption) -> MonoTime {
        self.start.after(caption.from.since(MonoTime::ZERO))
    }

    /// Returns true if the state is to be checked.
    pub fn is_check_due(&self, at: MonoTime) -> bool {
        self.shown > 0 && at >= self.next_check
    }

    /// Checks the current caption. Returns the traffic lights that have changed since, each with its bulbs.
    pub fn check(
        &mut self,
        snapshot: &Snapshot,
        at: MonoTime,
    ) -> Result<Vec<(String, String)>, WrongCaption> {
        self.next_check = at.after(CHECK_INTERVAL);
        if let Some(Caption { text, holds, .. }) = self.settled(at) {
            for Claim(observed, expected) in *holds {
                let found = observed.value(snapshot);
                if found != *expected {
                    return Err(WrongCaption { text, at, observed: *observed, expected, found });
                }
            }
        }
        Ok(self.changed_lights(snapshot))
    }

    /// Returns the current caption, if its settling time is over.
    fn settled(&self, at: MonoTime) -> Option<&'static Caption> {
        let present = self.story.get(self.shown.checked_sub(1)?)?;
        (self.story_time(at) >= present.must_hold_from()).then_some(present)
    }

    fn changed_lights(&mut self, snapshot: &Snapshot) -> Vec<(String, String)> {
        let lights: BTreeMap<_, _> = claim::lights(snapshot).collect();
        let before = std::mem::replace(&mut self.lights, lights);
        let gone = before.keys().filter(|name| !self.lights.contains_key(*name));
        let gone = gone.map(|name| (name.clone(), "no longer listed".to_owned()));
        let changed = self.lights.iter().filter(|(name, bulbs)| before.get(*name) != Some(bulbs));
        changed.map(|(name, bulbs)| (name.clone(), bulbs.clone())).chain(gone.collect::<Vec<_>>()).collect()
    }
}
