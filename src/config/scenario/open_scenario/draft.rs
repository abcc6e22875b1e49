//! The storyboard as it was read: references between its elements are still names.

use std::time::Duration;

use crate::config::reading::checker::LocatedText;
use crate::config::reading::element::Element;
use crate::config::reading::location::Location;
use crate::core::traffic_light::scenario::{Action, Edge, ElementState, Test};

/// An act as it was read.
pub(super) struct ActDraft<'e> {
    pub(super) element: &'e Element,
    /// Names from the story to itself.
    pub(super) path: Vec<String>,
    pub(super) start: Option<TriggerDraft>,
    pub(super) stop: Option<TriggerDraft>,
    pub(super) events: Vec<EventDraft<'e>>,
}

/// An event as it was read.
pub(super) struct EventDraft<'e> {
    pub(super) element: &'e Element,
    /// Names from the story to itself.
    pub(super) path: Vec<String>,
    pub(super) start: Option<TriggerDraft>,
    pub(super) most_executions: u32,
    pub(super) actions: Vec<ActionDraft>,
}

/// An `Action` element as it was read.
pub(super) struct ActionDraft {
    /// Names from the story to itself.
    pub(super) path: Vec<String>,
    pub(super) actions: Vec<Action>,
    /// It does nothing but what `actions` do.
    pub(super) is_whole: bool,
}

/// Groups of conditions as they were read.
pub(super) type TriggerDraft = Vec<Vec<ConditionDraft>>;

/// A condition as it was read.
#[derive(Debug)]
pub(super) struct ConditionDraft {
    pub(super) name: String,
    pub(super) edge: Edge,
    pub(super) delay: Duration,
    pub(super) test: TestDraft,
}

/// What a condition looks at.
#[derive(Debug)]
pub(super) enum TestDraft {
    Ready(Test),
    /// An element of the storyboard, to be found when all are known.
    Element {
        /// Of the reference, within the document.
        number: usize,
        /// `act`, `event` or `action`.
        kind: &'static str,
        reference: LocatedText,
        state: ElementState,
    },
    /// Nothing that is known here; what, and where.
    Undecidable {
        what: String,
        location: Location,
    },
}
