//! Tells a story: which caption is due, and whether what it claims holds.

use std::collections::BTreeMap;
use std::time::Duration;

use super::{Caption, Claim, Observed, Story, claim};
use crate::process_status::snapshot::Snapshot;
use gateway_base::time::MonoTime;

/// Least time between two looks at the state.
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
    /// Time at which the story began, the last time if it was told several times.
    start: MonoTime,
    /// The captions that were shown since then.
    shown: usize,
    next_check: MonoTime,
    /// Traffic lights at the last look, by their names.
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

    /// The time in the story.
    fn story_time(&self, at: MonoTime) -> MonoTime {
        MonoTime::ZERO.after(at.since(self.start))
    }

    /// The next caption that is due; `None` when there is none.
    pub fn next_caption(&mut self, at: MonoTime) -> Option<&'static Caption> {
        let now = self.story_time(at);
        let next = self.story.get(self.shown).filter(|caption| caption.from <= now)?;
        self.shown += 1;
        Some(next)
    }

    /// The time at which a caption is shown.
    pub fn time_of(&self, caption: &Caption) -> MonoTime {
        self.start.after(caption.from.since(MonoTime::ZERO))
    }

    /// True if the state is to be looked at.
    pub fn is_check_due(&self, at: MonoTime) -> bool {
        self.shown > 0 && at >= self.next_check
    }

    /// Holds the present caption against the state. Returns the traffic lights that have changed since the
    /// last look, each with its bulbs.
    ///
    /// # Errors
    /// A claim that does not hold.
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

    /// The present caption, if it had time to settle.
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
